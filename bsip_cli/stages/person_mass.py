"""The person's mass: stated, measured by the plates of all trials, or not known."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bsip_cli.recordings.measured_mass import (
    Comparison,
    MeasuredMass,
    differing_trials,
    measured_mass,
)
from bsip_cli.recordings.momentum_mass import Interval
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import load_words
from bsip_cli.study.study import Trial

UNKNOWN, PLATES, TABLE = "unknown", "plates", "participants.tsv"
ENTRY = "the recording's own entry"
VAGUE_PERCENT = 50.0  # half of an interval that still shows pounds to be no kilograms


@dataclass(frozen=True)
class StatedMass:
    """What somebody wrote down, and where."""

    mass_kg: float
    source: str


@dataclass(frozen=True)
class PersonMass:
    """mass_kg (NaN if not known), its source, what the plates show without known loads (NaN if
    nothing for sure), and a gross disagreement or what is missing in words."""

    mass_kg: float
    source: str
    plate_kg: float
    note: str


def stated_mass(unit: Unit, *facts: dict[str, Any]) -> StatedMass | None:
    """From participants.tsv, else the first entry in the ``facts`` of a recording."""
    if unit.person.mass_kg is not None:
        return StatedMass(unit.person.mass_kg, TABLE)
    known = [one["stated_mass_kg"] for one in facts if one.get("stated_mass_kg") is not None]
    return StatedMass(known[0], ENTRY) if known else None


def compared(
    unit: Unit,
    stated: StatedMass | None,
    measured: MeasuredMass,
    load_kg: float,
    height_m: float | None = None,
) -> Comparison | None:
    """The stated mass with ``load_kg`` against the plates; None without either."""
    if stated is None or not measured.is_known:
        return None
    options, height_m = unit.config.ingest, height_m or unit.person.height_m
    limits = options.mass_tolerance_percent, options.mass_gross_percent
    return Comparison(stated.mass_kg, load_kg, measured, *limits, height_m)


def person_mass(unit: Unit, trials: list[Trial], height_m: float) -> PersonMass:
    """From what is stated and the intervals that ingest found in these trials; warns."""
    intervals = {}
    for trial in trials:
        records = map(Interval.of, unit.facts("wrench", trial)["mass_stretches"])
        intervals[trial.stem] = [one.without(unit.load_kg(trial)) for one in records]
    static = {trial.stem for trial in trials if trial.role == "static"}
    measured = measured_mass(
        intervals, unit.config.ingest.mass_half_width_percent, height_m, static
    )
    apart = {t.stem: unit.facts("wrench", t)["plates_apart"] for t in trials}
    if said := [f"in {name} {each[0]}" for name, each in apart.items() if each]:
        measured = replace(measured, mass_kg=float("nan"), reason=said[0])
    alone = {t.stem: intervals[t.stem] for t in trials if not load_words(unit, t)}
    if fault := differing_trials(alone, unit.config.ingest.mass_gross_percent):
        unit.say(fault)
    stated = stated_mass(unit, *(unit.facts("markers", trial) for trial in trials))
    loads = " and ".join(dict.fromkeys(filter(None, (load_words(unit, t) for t in trials))))
    without = f" without the known load ({loads})" if loads else ""
    if stated is None and measured.is_known:
        unit.say(f"mass taken from the plates{without}: {measured.words()}")
        return PersonMass(measured.mass_kg, PLATES, measured.mass_kg, "")
    if stated is None:
        note = f"mass is not known: put mass_kg into participants.tsv, because {measured.reason}"
        unit.say(note)
        return PersonMass(float("nan"), UNKNOWN, float("nan"), note)
    vague = measured
    if not measured.is_known:
        vague = measured_mass(intervals, VAGUE_PERCENT, static=static)
    comparison = compared(unit, stated, vague, 0.0, height_m)
    if stated.source != TABLE:
        unit.say(f"mass {stated.mass_kg:.2f} kg taken from {stated.source}")
    if comparison is None:
        return PersonMass(stated.mass_kg, stated.source, measured.mass_kg, "")
    if comparison.is_gross:
        return _gross(unit, stated, comparison, measured.is_known)
    if measured.is_known and not comparison.is_small:
        unit.say(
            f"the plates measure {measured.words()}{without}, stated are "
            f"{stated.mass_kg:.2f} kg ({comparison.difference_percent:+.1f} %, tolerance "
            f"{comparison.tolerance_percent:g} %)"
        )
    return PersonMass(stated.mass_kg, stated.source, measured.mass_kg, "")


def _gross(unit: Unit, stated: StatedMass, comparison: Comparison, is_sure: bool) -> PersonMass:
    """Where the mistake in the stated mass is plain, the plates' own counts, if it is sure, or
    none, as where it is in the forces, which fit no mass; else nothing is known to be wrong with
    either, and the stated one stays."""
    plates_kg = comparison.measured.mass_kg if is_sure else float("nan")
    used, source = plates_kg, PLATES if is_sure else UNKNOWN
    remedy = "correct mass_kg in participants.tsv"
    if comparison.is_of_the_forces:
        used, source, remedy = float("nan"), UNKNOWN, "correct the forces"
    elif not comparison.likely():
        used, source = stated.mass_kg, stated.source
    what = f"{used:.2f} kg is used" if np.isfinite(used) else "no mass is used"
    note = f"{comparison.sentence(stated.source)}; {what}: {remedy}"
    unit.say(note)
    return PersonMass(used, source, plates_kg, note)
