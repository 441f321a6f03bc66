"""diagnose (participant): what the simulation gets wrong in all trials of one person."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from zlib import crc32

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.diagnosis.fault_model import session_of
from bsip_cli.diagnosis.fault_scores import Library, library_of
from bsip_cli.diagnosis.fault_search import Found, search
from bsip_cli.diagnosis.findings import Finding, findings_of
from bsip_cli.diagnosis.held_out import HeldOut, held_out
from bsip_cli.diagnosis.marker_proof import BEND, bend_of, shaken_finding
from bsip_cli.diagnosis.patterns import PATTERNS, UNEXPLAINED
from bsip_cli.effects.catalogue import CATALOGUE
from bsip_cli.report.verdict import verdict_of
from bsip_cli.running.unit import Unit
from bsip_cli.stages.diagnosed_trials import Diagnosed, diagnosed, weighed
from bsip_cli.stages.diagnosis_rows import cause_record, detection_rows, facts_of, rows_of
from bsip_cli.stages.error_budget import error_budget
from bsip_cli.stages.frames import person_from
from bsip_cli.stages.known_laboratory import Known, known_laboratory

ASKED = (*CATALOGUE, *PATTERNS)


def run(unit: Unit) -> None:
    """Read motion, wrench, person and RM of all trials; write what is wrong, with its evidence."""
    skeleton = load_skeleton(unit.config.skeleton)
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    of_mass = weighed(unit, person)
    asked = [diagnosed(unit, of_mass.prior, t, s) for t, s in of_mass.scenes]
    trials = [one for one in asked if one is not None]
    findings: tuple[Finding, ...] = of_mass.findings
    facts: dict = {"heavier_by": of_mass.share, "trials": [], "causes": []}
    limits = empty_table("detection")
    free = [one for one in trials if one.held is None]
    rng = np.random.default_rng(crc32(unit.name.encode()))
    if any(one.moves for one in free):
        known = known_laboratory(unit)
        found, library, held = _searched(unit, free, known)
        named_from = unit.config.diagnosis.named_from
        more = findings_of(found, held, named_from, rng)
        findings = (*_still_open(findings, more), *more)
        findings = tuple(sorted(findings, key=lambda one: one.verdict == "rejected"))
        facts |= facts_of(found, held, findings)
        limits = detection_rows(found, library, named_from)
        findings = (*_of_markers(free, found, held, findings, rng), *findings)
        facts["causes"] = [*_proven(free, found, held), *facts["causes"]]
        if known is not None:
            mine = [one.for_faults for one in free]
            findings = (*known.findings(mine), *findings)
            facts["causes"] = [*known.causes(mine), *facts["causes"]]
            limits = known.limits(limits)
    findings = (*(one.held.finding(one.trial.stem) for one in trials if one.held), *findings)
    budget, large = error_budget(unit, trials, facts["causes"])
    findings = (*_beside(findings, large), *findings)
    if not trials:
        unit.warn(
            f"{unit.name}: no trial has motion with every contact on a plate; no movement can be "
            "diagnosed"
        )
    names = dict.fromkeys(
        [*(x.trial.stem for x in trials), *(t for f in findings for t in f.trials)]
    )
    facts["trials"] = list(names)
    _write(unit, rows_of(findings, tuple(names)), limits, facts, budget)


def _still_open(of_mass: Sequence[Finding], more: Sequence[Finding]) -> tuple[Finding, ...]:
    """The class of the stated mass, unless the movements tell which of its causes it is."""
    told = {(one.effect, one.target) for one in more if one.verdict == "named"}
    is_told = any((one.effect, one.target) in told for one in of_mass)
    return () if is_told else tuple(of_mass)


def _searched(
    unit: Unit, trials: Sequence[Diagnosed], known: Known | None
) -> tuple[Found, Library, HeldOut]:
    """Faults that the forces show, beside what the markers prove and other persons tell."""
    options = unit.config.diagnosis
    told = [
        x.for_faults if known is None else known.beside(x.for_faults, not x.moves) for x in trials
    ]
    session = session_of(told)
    alone = [t for t, one in enumerate(trials) if one.moves]
    library = library_of(session, ASKED, alone, options.fault_prior_odds)
    slips = [slip.hypothesis(t) for t, one in enumerate(trials) for slip in one.slips]
    found = search(session, library, options.named_from, slips)
    return found, library, held_out(found.fit)


def _of_markers(
    trials: Sequence[Diagnosed],
    found: Found,
    held: HeldOut,
    findings: Sequence[Finding],
    rng: np.random.Generator,
) -> Iterator[Finding]:
    """What markers prove; and a bend of the trunk, where the forces have not told it already."""
    bent = {t for f in findings if f.effect == BEND and f.verdict != "rejected" for t in f.trials}
    number = 0
    for k, one in enumerate(trials, start=1):
        stem, scene = one.trial.stem, one.for_faults.scene
        for slip in one.slips:
            yield slip.finding(scene, stem, held.gain(number))
            number += 1
        if one.shaken:
            yield shaken_finding(scene, one.shaken, stem)
        if one.moves and stem not in bent:
            yield from bend_of(scene, (*one.slips, *one.shaken), stem, f"M{k}", rng)


def _proven(trials: Sequence[Diagnosed], found: Found, held: HeldOut) -> Iterator[dict]:
    """Slips that the forces show too, in full and with the same sizes for every fold: no plate
    helped to find them."""
    slips = [(one.trial.stem, slip) for one in trials for slip in one.slips]
    for number, (stem, slip) in enumerate(slips):
        if held.gain(number).is_real():
            yield cause_record(slip.effect.name, slip.target, (stem,), slip.values)


def _beside(found: Sequence[Finding], large: Sequence[Finding]) -> Iterator[Finding]:
    """Large errors, less the trials of which it is told already that something has no name."""
    told = {t for f in found if f.effect == UNEXPLAINED and f.verdict == "named" for t in f.trials}
    for one in large:
        if trials := tuple(t for t in one.trials if t not in told):
            yield replace(one, trials=trials)


def _write(
    unit: Unit, diagnosis: pd.DataFrame, limits: pd.DataFrame, facts: dict, budget: pd.DataFrame
) -> None:
    """The artifacts, and in words what they say."""
    unit.write("overall-error-budget", budget)
    unit.write("overall-diagnosis", diagnosis, facts)
    unit.write("detection", limits)
    said = verdict_of(diagnosis, limits)
    for sentence in (said.headline, *said.causes, said.limits):
        if sentence:
            unit.warn(f"{unit.name}: {sentence}")
