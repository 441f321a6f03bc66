"""The identification's recordings and equations, for every stage that identifies."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from bsip_cli.body.inertia import from_readable
from bsip_cli.body.person import Person
from bsip_cli.dynamics.base_parameters import find_basis
from bsip_cli.dynamics.ground_wrench import pinocchio_model, predicted_wrench
from bsip_cli.dynamics.lowpass import valid_intervals
from bsip_cli.identification.prior import Prior, Spread, likeliest, prior_of
from bsip_cli.identification.problem import (
    Estimate,
    Instruments,
    Problem,
    Recording,
    accumulate,
    even_noise,
    noise_of,
    residual_series,
)
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import bsip_names, spread_names
from bsip_cli.stages.frames import load_phi, signals_of
from bsip_cli.study.study import Trial

# Where the iteration of the weights begins: force plates and skin make errors of this size.
_FIRST_NOISE = np.array([10.0, 10.0, 10.0, 5.0, 5.0, 5.0])
_WEIGHT_ROUNDS = 3
_MASS_AND_ALONG = [0, 2]  # of the spreads: where there are figures of another table


def prior_from(
    unit: Unit,
    regression: pd.DataFrame,
    person: Person,
    fixed: np.ndarray | None = None,
    **other: float,
) -> Prior:
    """What is known of a person before the data, from the rows of ``regression``.

    fixed : as of :func:`prior_of`. other : standard deviations that stand for the configured ones.
    """
    bodies = list(person.skeleton.body_names)
    table = regression.set_index("segment").loc[bodies]
    rows = table[list(bsip_names())].to_numpy()
    spread = spread_from(unit, table[list(spread_names())].to_numpy(), **other)
    return prior_of(tuple(from_readable(row) for row in rows), person, spread, fixed)


def spread_from(unit: Unit, spreads: np.ndarray, **other: float) -> Spread:
    """As configured, with the person's own ``spreads`` (n, 7): the columns of ``regression``, less
    the part of what tables differ by that all segments share."""
    options = {**unit.config.prior.model_dump(), **other}
    own, tables = spreads[:, :5].copy(), spreads[:, 5:]
    shared = options["other_table_sd"] * tables
    own[:, _MASS_AND_ALONG] = np.sqrt(np.maximum(own[:, _MASS_AND_ALONG] ** 2 - shared**2, 0.0))
    options |= {"com_sd_percent": own[:, 1:4], "other_table_percent": tables}
    return Spread(mass_sd_percent=own[:, 0], inertia_sd_percent=own[:, 4], **options)


def recordings_of(
    unit: Unit,
    person: Person,
    trials: Iterable[Trial],
    changes: Mapping[str, np.ndarray] | None = None,
) -> tuple[list[Recording], pd.DataFrame]:
    """Motion and the wrench of the person alone, and the intervals that may identify.

    changes : of a trial's stem, the part (N, 6) of its measured wrench that is not the person's.
    """
    recordings, blocks, options = [], [], unit.config.identify
    for trial in trials:
        signals = signals_of(unit, person, trial)
        times = signals.times_s
        # the blocks that are kept out are spread evenly over the trial
        share, block = options.hold_out_fraction, (times - times[0]) // options.block_s
        held_out = np.floor((block + 1) * share + 1e-9) > np.floor(block * share + 1e-9)
        use = signals.valid & ~held_out
        if not use.any():
            unit.say(f"{trial.stem} has no frame with all contacts on plates; left out")
            continue
        for start, stop in valid_intervals(use):
            blocks.append({"trial": trial.stem, "start_s": times[start], "end_s": times[stop - 1]})
        motion, measured = (signals.q, signals.v, signals.a), np.nan_to_num(signals.wrench)
        if unit.loads(trial):
            phi = load_phi(unit, person, trial)[:, None]
            carried = predicted_wrench(pinocchio_model(person), *motion, phi, np.zeros(3))
            measured = measured - carried[..., 0]
        if changes and trial.stem in changes:
            measured = measured - changes[trial.stem]
        level = signals.acceleration_noise
        recordings.append(Recording(*motion, measured, use, signals.rate_hz, level))
    return recordings, pd.DataFrame(blocks, columns=["trial", "start_s", "end_s"])


def duration_s(recordings: list[Recording]) -> float:
    """Time that may identify [s]."""
    return sum(float(r.use.sum()) / r.rate_hz for r in recordings)


def estimate_by(estimator: str, problem: Problem) -> Estimate:
    """What the estimator of this name makes of the problem."""
    return importlib.import_module(f"bsip_cli.identification.{estimator}").estimate(problem)


def problem_of(
    unit: Unit, person: Person, prior: Prior, recordings: list[Recording]
) -> tuple[Problem, np.ndarray]:
    """Equations about the middle of the motion, weighted by what the fit leaves.

    Segments that no markers show enter with the table's values.
    """
    model = pinocchio_model(person)
    known = prior.fixed_parameters()
    basis = find_basis(model, known)
    reference = np.mean(
        [np.append(r.q[r.use, :2].mean(axis=0), 0.0) for r in recordings if r.use.any()], axis=0
    )
    options = unit.config.identify
    cutoff = options.cutoff_hz
    judgement = (options.trust_ratio, options.sigma_percent_limit, options.spread_weight)
    instruments = Instruments(options.plate_place_sd_m, options.delay_sd_s, prior.phi)
    joint = accumulate(model, recordings, cutoff, reference)
    noise = even_noise(_FIRST_NOISE, joint.samples)
    for left in reversed(range(_WEIGHT_ROUNDS)):
        equations = joint.with_known(prior.phi, known)
        likely = likeliest(prior, *equations.weighted(noise.weights()))
        noise = noise_of(residual_series(model, recordings, cutoff, reference, likely))
        last = None if left else instruments  # the weights need the body alone
        joint = accumulate(model, recordings, cutoff, reference, noise.weights_at, last)
    jointly, whole = joint.with_known(prior.phi, known), joint.of_the_body(len(prior.phi))
    equations = jointly.of_the_body(len(prior.phi))
    return Problem(equations, noise, prior, basis, *judgement, whole, jointly), reference
