"""identify: inertial parameters that explain the measured ground forces (OM), and RM+mass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from itertools import product

import numpy as np
import pandas as pd

from bsip_cli.body.inertia import PARAMETERS, UNITS
from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import Skeleton
from bsip_cli.diagnosis.filtering import slow
from bsip_cli.diagnosis.support import Support, support_of
from bsip_cli.dynamics.base_parameters import expressions
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.identification import uncertainty
from bsip_cli.identification.base import base_parameters
from bsip_cli.identification.movement_gain import advice
from bsip_cli.identification.problem import Estimate, Problem
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import column_names, spread_names
from bsip_cli.segments import in_words as segment_in_words
from bsip_cli.stages.frames import (
    WRENCH,
    bsip_table,
    load_phi,
    load_words,
    loads_record,
    person_of,
    signals_of,
)
from bsip_cli.stages.identification_problem import (
    duration_s,
    estimate_by,
    prior_from,
    problem_of,
    recordings_of,
)
from bsip_cli.stages.trial_scene import without_markers
from bsip_cli.statistics.methods import OM, RM, RM_MASS
from bsip_cli.study.study import Trial

_SHORTEST_S = 0.5


def run(unit: Unit) -> None:
    """Read motion, wrench, person and RM; write bsip and what belongs to it."""
    person = person_of(unit)
    skeleton = person.skeleton
    regression = unit.read("regression")
    prior = prior_from(unit, regression, person)
    contacts, frames = _external_contacts(unit, person, prior.phi)
    facts = {"external_contacts": {stem: asdict(one) for stem, one in contacts.items()}}
    trials = _identification_trials(unit, contacts, frames)
    recordings, blocks = recordings_of(unit, person, trials)
    for trial in trials:
        known = load_words(unit, trial) if trial.stem in set(blocks["trial"]) else ""
        if known:
            unit.say(f"taken off the forces of {trial.stem} as a known load: {known}")
    table, roots = regression.drop(columns=["note", *spread_names()]), {RM: prior.root}
    if (seconds := duration_s(recordings)) < _SHORTEST_S:
        unit.say(
            f"{seconds:.2f} s of motion with every contact on a plate, needed are {_SHORTEST_S:g} "
            "s: nothing is identified, the table (RM) stands alone"
        )
        unit.write("bsip", table)
        unit.write("covariance", _covariance_table(skeleton, roots))
        for kind in ("base-parameters", "excitation", "used-blocks"):
            unit.write(kind, ())
        unit.write("identification", (), facts)
        return
    lost = person.without_data()[list(skeleton.bodies)]
    fixed = [name for name, is_lost in zip(skeleton.body_names, lost, strict=True) if is_lost]
    if fixed:
        unit.say(
            f"no data for {', '.join(map(segment_in_words, fixed))}: no markers show "
            "how they move, OM keeps the table's values (RM) there"
        )
    problem, reference = problem_of(unit, person, prior, recordings)
    # by method: OM is the first that is configured, others go by their names
    first, *others = unit.config.identify.estimators
    estimators = {RM_MASS: "mass_factor", OM: first} | {name: name for name in others}
    estimates = {method: estimate_by(name, problem) for method, name in estimators.items()}
    shares: dict[str, np.ndarray] = {}
    tables = [table]
    for method, estimate in estimates.items():
        unit.say(f"{method}: {estimate.note}")
        roots[method] = uncertainty.root_of(estimate.covariance)
        found = uncertainty.readable(estimate, prior)
        shares[method] = found.share
        tables.append(bsip_table(method, skeleton.body_names, found.values, found.sd, found.share))
    rarity = {
        method: _rarity(unit, problem, method, one, skeleton.body_names)
        for method, one in estimates.items()
    }
    loads = {trial.stem: loads_record(unit, trial) for trial in trials}
    rms = problem.noise.rms.tolist()
    made = {"reference_m": reference.tolist(), "noise_rms": rms, "loads": loads}
    unit.write("bsip", pd.concat(tables, ignore_index=True), made)
    unit.write("covariance", _covariance_table(skeleton, roots))
    unit.write("base-parameters", _base_table(skeleton, problem))
    excited = uncertainty.excitation(problem)
    unit.write("excitation", _excitation_table(person, problem, excited, shares[OM]))
    of_all = {"trials": ", ".join(blocks["trial"].unique()), "rank": problem.basis.rank}
    of_all["condition_number"] = excited.condition_number
    summary = [
        {"method": method, "estimator": estimators[method]}
        | of_all
        | _summary(problem, one)
        | rarity[method]
        for method, one in estimates.items()
    ]
    unit.write("identification", summary, facts)
    unit.write("used-blocks", blocks)


# --- which data -------------------------------------------------------------------------------


def _external_contacts(
    unit: Unit, person: Person, phi: np.ndarray
) -> tuple[dict[str, Support], dict[Trial, int]]:
    """What bears part of the body off the plates, by trial; phi (10 n,) of the table. And how many
    frames of each trial are valid."""
    found, frames = {}, {}
    for trial in unit.trials("kinematics", "wrench"):
        known = phi + load_phi(unit, person, trial)
        scene = without_markers(signals_of(unit, person, trial), person, known)
        frames[trial] = int(scene.valid.sum())
        if (support := support_of(slow(scene))) is not None:
            found[trial.stem] = support
    return found, frames


def _identification_trials(
    unit: Unit, contacts: Mapping[str, Support], frames: Mapping[Trial, int]
) -> list[Trial]:
    """The trials with the role; without one, the trial with most valid ``frames``. Never one with
    an external contact: the body would be made to bear what the contact bears."""
    ready = list(frames)
    named = [trial for trial in ready if trial.role == "sequence"]
    chosen = [trial for trial in named if trial.stem not in contacts]
    if not chosen:
        measured = [trial for trial in ready if frames[trial] > 0]
        moving = [trial for trial in measured if trial.role != "static"] or measured
        free = [trial for trial in moving if trial.stem not in contacts]
        chosen = [max(free, key=lambda trial: frames[trial])] if free else []
    instead = ", ".join(trial.stem for trial in chosen)
    used = f"{instead} identifies instead" if chosen else "no trial is left to identify from"
    for trial in named or ready:
        if trial.stem in contacts:
            unit.say(f"{trial.stem} does not identify: {contacts[trial.stem].words()}; {used}")
    if chosen and not named:
        unit.say(f"{chosen[0].stem} identifies, since no trial is of an identification task")
        if len(ready) == 1 and unit.config.identify.hold_out_fraction == 0:
            unit.say(
                "no other trial validates, so the fit is judged on the data it was "
                "made from; identify.hold_out_fraction would keep blocks out"
            )
    return chosen


# --- the estimate -----------------------------------------------------------------------------


def _rarity(
    unit: Unit, problem: Problem, method: str, estimate: Estimate, names: tuple[str, ...]
) -> dict[str, object]:
    """Columns of ``identification``: whether its body is rarer than people allow; RM+mass is the
    table's body, for which its number stands."""
    if method == RM_MASS:
        return {"distance": np.nan, "probability": np.nan, "rare": False, "farthest": ""}
    found = uncertainty.rarity_of(problem.prior, estimate)
    kg, table_kg = estimate.phi[::10], problem.prior.phi[::10]
    words = ", ".join(  # of the segments that make half of the distance
        f"the {segment_in_words(names[i])} ({100 * found.shares[i]:.0f} % of the "
        f"distance from the table; {kg[i]:.2f} kg, table {table_kg[i]:.2f} kg)"
        for i in found.farthest()
    )
    if found.is_rare:
        unit.say(
            f"do not use {method}: a body like this is rarer than 1 in "
            f"{1 / uncertainty.RARE:.0f} people, most by {words}"
        )
    known = {"distance": found.distance, "probability": found.probability}
    return known | {"rare": found.is_rare, "farthest": words}


def _covariance_table(skeleton: Skeleton, roots: dict[str, np.ndarray]) -> pd.DataFrame:
    """Roots (P, P) of the covariance, by method."""
    rows = [
        (method, segment, name, unit)
        for method, segment in product(roots, skeleton.body_names)
        for name, unit in zip(PARAMETERS, UNITS, strict=True)
    ]
    table = pd.DataFrame(rows, columns=["method", "segment", "parameter", "unit"])
    named = pd.DataFrame(np.vstack([*roots.values()])).add_prefix("root_")
    return pd.concat([table, named], axis=1)


def _base_table(skeleton: Skeleton, problem: Problem) -> pd.DataFrame:
    fit = base_parameters(problem)
    named = expressions(problem.basis, skeleton.body_names)
    table = pd.DataFrame(named, columns=["name", "expression", "unit"])
    table["value"], table["sd"] = fit.values, np.sqrt(np.diag(fit.covariance))
    table["sigma_percent"], table["rm_value"] = fit.sigma_percent(), fit.rm_values
    table = table.sort_values("sigma_percent", kind="stable", ignore_index=True)
    return table[column_names("base-parameters")]


def _excitation_table(
    person: Person, problem: Problem, found: uncertainty.Excitation, share: np.ndarray
) -> pd.DataFrame:
    """``share`` (n, 10) are OM's data shares."""
    names = person.skeleton.body_names
    words = [
        "no markers, no data: the table's values" if fixed else uncertainty.in_words(own)
        for fixed, own in zip(problem.prior.fixed, share, strict=True)
    ]
    rows = [("condition_number", "", found.condition_number, "1", "", "")]
    for k, value in enumerate(found.singular_values, start=1):
        rows.append(("singular_value", str(k), value, "1", "", ""))
    for k, name in enumerate(names):
        rows += [
            ("segment", name, found.segment_share[k], "1", name, ""),
            ("combinations", name, float(found.combinations[k]), "1", name, ""),
            ("data_share", name, share[k].mean(), "1", name, words[k]),
        ]
    helpful = advice(problem, person, pinocchio_model(person))
    for quantity, gains in (("movement", helpful.alone), ("next", helpful.together)):
        for g in gains:
            most, text = names[g.best_segment], g.movement.text
            rows.append((quantity, g.movement.name, 100 * g.share, "%", most, text))
    for g in helpful.alone:
        name, text = g.movement.name, g.movement.text
        rows.append(("movement_forces", name, 100 * g.wrench, "%", "", text))
    return pd.DataFrame(rows, columns=["quantity", "name", "value", "unit", "segment", "text"])


def _summary(problem: Problem, estimate: Estimate) -> dict[str, object]:
    """Columns of ``identification``: what it rests on, its mass, and what it leaves."""
    table_kg = float(problem.prior.phi[::10].sum())
    equations = problem.equations
    row: dict[str, object] = {"samples": equations.samples, "duration_s": equations.duration_s}
    row |= {"effective_samples": float(problem.noise.effective.sum()), "note": estimate.note}
    row["decided"] = estimate.decided
    row["mass_factor"] = float(estimate.phi[::10].sum()) / table_kg
    row["mass_factor_sd"] = float(np.sqrt(estimate.covariance[::10, ::10].sum())) / table_kg
    names = [f"rms_{name}" for name in WRENCH]
    return row | dict(zip(names, estimate.residual_rms(problem), strict=True))
