"""The error budget of a person's trials, and errors too large to be passed over, as tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.diagnosis.error_budget import Ground, Line, budget_of, ground_of
from bsip_cli.diagnosis.error_model import Term, TrialErrors, error_model
from bsip_cli.diagnosis.error_terms import (
    FAULT,
    Columns,
    error_terms,
    noise_of_instruments,
)
from bsip_cli.diagnosis.evidence import Filter, at_full_rate, filter_of, slow
from bsip_cli.diagnosis.findings import Finding
from bsip_cli.diagnosis.held_out import FOLDS
from bsip_cli.diagnosis.large_errors import Yardsticks, large_errors
from bsip_cli.diagnosis.support import HANDS, LIGHTER
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.scene import Scene
from bsip_cli.identification.prior import Prior
from bsip_cli.report.budget import term_words
from bsip_cli.running.unit import Unit
from bsip_cli.stages.reconstructed import scale_of
from bsip_cli.study.study import Trial

_KIND = "overall-error-budget"
_MORE_THAN_USUAL = 2.0  # times the usual size: what is usual is no cause of a large error
_MOST_PERCENT = 20.0  # of the squared error: less explains nothing
_LEAST_SAMPLES = 4  # of the filtered residual, for its course to be one
_WHOLE, _PARTS = "each trial from the others", f"each fifth of a trial from the other {FOLDS - 1}"


@dataclass(frozen=True, eq=False)
class Prepared:
    """A trial as the model of the error takes it: errors, ground, and how heavy the person is."""

    errors: TrialErrors
    ground: Ground
    moves: bool
    weight_N: float


def error_budget(
    unit: Unit,
    prior: Prior,
    scenes: Sequence[tuple[Trial, Scene]],
    causes: Sequence[Mapping],
    held: Sequence[str],
) -> tuple[pd.DataFrame, tuple[Finding, ...]]:
    """The ``overall-error-budget``, and what is too large for all that is named or usual.

    causes : as in the facts of ``overall-diagnosis``; they are part of the model. held : stems of
    trials in which hands hold on to something: what that bears is a term, and no large error.
    """
    trials = [
        one for t, s in scenes if (one := _prepared(unit, prior, t, s, causes, held)) is not None
    ]
    if not trials:
        return empty_table(_KIND), ()
    whole = sum(one.moves for one in trials) > 1
    errors, grounds = [one.errors for one in trials], [one.ground for one in trials]
    model = error_model(errors, 1 if whole else FOLDS)
    rng = np.random.default_rng(0)
    every = range(len(trials))
    data = _WHOLE if whole else _PARTS
    rows = [*_rows(budget_of(model, grounds, every, rng), "", data)]
    for k in every:
        rows += _rows(budget_of(model, grounds, (k,), rng), errors[k].name, data)
    budget = pd.DataFrame(rows)
    return budget, _large(unit, trials, held, partial(_along, budget))


def _along(budget: pd.DataFrame, trials: Sequence[str], component: str) -> str:
    """What most of an error goes along with that is more than usual: the budget sizes everything
    freely, which is no proof."""
    rows = budget[
        budget["trial"].isin(trials)
        & (budget["component"] == component)
        & (budget["target"] == "")
        & (budget["scale"] > _MORE_THAN_USUAL)
    ]
    shares = rows.groupby("term", sort=False)["share_percent"].mean()
    if shares.empty or not shares.max() > _MOST_PERCENT:
        return "it goes along with nothing that bsip knows"
    return (
        f"{shares.max():.0f} % of it would go along with {term_words(str(shares.idxmax()))}, which "
        "is not sure enough to be named"
    )


def _large(
    unit: Unit,
    trials: Sequence[Prepared],
    held: Sequence[str],
    along: Callable[[Sequence[str], str], str],
) -> tuple[Finding, ...]:
    usual = error_model([one.errors for one in trials], 1, adapt=False)
    options = unit.config.diagnosis
    yardsticks = Yardsticks(
        options.large_cop_error_m,
        0.01 * options.large_force_error_percent,
        options.least_correlation,
        trials[0].weight_N,
    )
    asked = [k for k, one in enumerate(trials) if one.errors.name not in held]
    return large_errors(usual, [one.ground for one in trials], asked, yardsticks, along)


def _prepared(
    unit: Unit,
    prior: Prior,
    trial: Trial,
    scene: Scene,
    causes: Sequence[Mapping],
    held: Sequence[str],
) -> Prepared | None:
    """None where the plates carry the person for hardly a sample."""
    if not scene.valid.any():
        return None
    options, facts = unit.config.diagnosis, unit.read("person").iloc[0]
    fewer = slow(scene)
    filter_ = _about_surface(filter_of(fewer, options.cutoff_hz), scene)
    if len(filter_.frames) < _LEAST_SAMPLES:
        return None
    full = at_full_rate(filter_, scene, options.cutoff_hz)
    measured = full.one(scene.measured)
    residual = full.one(scene.measured - scene.predicted)
    weight_N = scene.mass_kg * GRAVITY_M_S2
    terms = error_terms(fewer, prior.root, options.landmark_sd_m, options.skin_factor)
    ground = ground_of(
        measured,
        residual,
        facts[["anterior_x", "anterior_y"]].to_numpy(dtype=float),
        0.01 * unit.config.reconstruct.cop_min_force_percent_bw * weight_N,
        np.floor(fewer.times_s[filter_.frames]).astype(int),
    )
    noise_m = unit.facts("kinematics", trial)["marker_noise_m"]
    errors = TrialErrors(
        trial.stem,
        filter_,
        residual,
        (
            *(_term(x, filter_) for x in terms),
            *_named(fewer, filter_, [x for x in causes if trial.stem in x["trials"]]),
            *(_of_hands(fewer, filter_) if trial.stem in held else ()),
        ),
        noise_of_instruments(fewer, filter_.reference_m, noise_m, scene.rate_hz, options.cutoff_hz),
    )
    return Prepared(errors, ground, trial.role != "static", weight_N)


def _term(x: Columns, filter_: Filter) -> Term:
    """The columns once they have passed the filter."""
    wrench = filter_(x.wrench)
    return Term(x.term, x.target, x.scale, x.own, wrench, mixing=x.mixing, targets=x.targets)


def _about_surface(filter_: Filter, scene: Scene) -> Filter:
    """Moments about a point of the plates' surface."""
    heights = [plate.corners_m[:, 2] for plate in scene.plates]
    height = float(np.mean(heights)) if heights else 0.0
    return replace(filter_, reference_m=np.append(filter_.reference_m[:2], height))


def _named(scene: Scene, filter_: Filter, causes: Sequence[Mapping]) -> Iterator[Term]:
    """Faults with the sizes that the diagnosis has found, and how they might differ."""
    for one in causes:
        effect, target = EFFECTS.get(one["effect"]), one["target"]
        if effect is None:
            continue  # a pattern without a cause: it belongs to the unknown
        values = np.asarray(one["values"], dtype=float)
        typical = [p.typical for p in effect.parameters(scene, target) if not p.scan]
        columns = filter_(effect.tangent(scene, target, values) * np.array(typical))
        known = filter_.one(effect.change(scene, target, values))
        yield Term(
            FAULT + effect.name,
            target,
            f"{FAULT}{effect.name} {target} named",
            len(one["trials"]) == 1,
            columns,
            known,
        )


def _of_hands(scene: Scene, filter_: Filter) -> Iterator[Term]:
    """A constant force on each hand, of the size from which on it is told."""
    force = LIGHTER * scene.mass_kg * GRAVITY_M_S2 * np.eye(3)
    for hand in HANDS:
        place = scene.point(hand, scene.centre_of(hand)).position_m
        arm = np.cross(place[:, None], force).swapaxes(1, 2)
        columns = np.concatenate([np.broadcast_to(force, arm.shape), arm], axis=1)
        term = FAULT + EFFECTS["unmeasured_contact"].name
        yield Term(term, hand, f"{term} {hand}", True, filter_(columns))


def _rows(lines: Sequence[Line], trial: str, data: str) -> Iterator[dict]:
    for one in lines:
        factor, unit = scale_of(one.component)
        yield {
            "term": one.term,
            "target": one.target,
            "component": one.component,
            "rms": factor * one.rms,
            "unit": unit,
            "share_percent": 100 * one.share,
            "share_low": 100 * one.share_low,
            "share_high": 100 * one.share_high,
            "gain_percent": one.gain.percent,
            "gain_low": one.gain.ci_low,
            "gain_high": one.gain.ci_high,
            "data": data if np.isfinite(one.gain.percent) else "",
            "trial": trial,
            "scale": one.scale,
            "alike": ", ".join(one.alike),
        }
