"""diagnose (participant): what the simulation gets wrong in all trials of one person."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from zlib import crc32

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.diagnosis.findings import Finding, findings_of
from bsip_cli.diagnosis.loud_noise import with_loud_noise
from bsip_cli.diagnosis.pattern import UNEXPLAINED
from bsip_cli.diagnosis.patterns import PATTERNS
from bsip_cli.diagnosis.rounds import Round, Selection
from bsip_cli.diagnosis.scale_mass import (
    agreed_share,
    is_noticed,
    mass_sd_of,
    weight_round,
    weight_share,
)
from bsip_cli.diagnosis.selection import select
from bsip_cli.diagnosis.signatures import signatures_of
from bsip_cli.diagnosis.stated_mass import loaded_plate, stated_mass_findings
from bsip_cli.diagnosis.support import SHORTEST_S
from bsip_cli.diagnosis.together import Evidence, together
from bsip_cli.effects.catalogue import CATALOGUE
from bsip_cli.effects.scene import Scene
from bsip_cli.identification.prior import Prior
from bsip_cli.report.verdict import verdict_of
from bsip_cli.running.unit import Unit
from bsip_cli.stages.diagnosis_facts import detection_rows, facts_of
from bsip_cli.stages.diagnosis_rows import rows_of
from bsip_cli.stages.error_budget import error_budget
from bsip_cli.stages.frames import person_from
from bsip_cli.stages.moving_trials import (
    LookedAt,
    is_weighed,
    moving_trials,
    prior_of,
    stated_sd,
)
from bsip_cli.stages.trial_scene import scene_of
from bsip_cli.study.study import Trial

_ALIKE = 0.5  # part of the difference to the stated mass
_ATTRIBUTED = "segment_inertia"  # not a cause beside the parameters: they are projected out
ASKED = (*(effect for effect in CATALOGUE if effect.name != _ATTRIBUTED), *PATTERNS)


def run(unit: Unit) -> None:
    """Read motion, wrench, person and RM of all trials; write what is wrong, with its evidence."""
    skeleton = load_skeleton(unit.config.skeleton)
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    prior = prior_of(unit, person)
    standing = _standing(unit, person, prior)
    moving = moving_trials(unit, person, prior)
    asked = _asked(unit, moving, standing)
    if asked.selection and standing and _agrees(asked.selection, prior, standing):
        as_read = prior_of(unit, person, standing.share)
        again = _asked(unit, moving_trials(unit, person, as_read), standing, standing.share)
        asked = max(again, asked, key=_causes)
    told = (*(f for one in asked.looked_at for f in one.told), *_weighed(unit, standing))
    for sentence in filter(None, (one.left_out() for one in asked.looked_at)):
        unit.warn(sentence)
    findings: tuple[Finding, ...] = told
    facts: dict = {}
    limits = empty_table("detection")
    if asked.selection:
        findings, facts = _answer(asked, asked.selection, told)
        limits = detection_rows(asked.selection)
    scenes = [(standing.trial, standing.scene)] if standing else []
    scenes += [(one.trial, one.scene) for one in moving]
    held = [f.trials[0] for one in moving for f in one.told if one.evidence is None]
    budget, large = error_budget(unit, prior, scenes, facts.get("causes", []), held)
    findings = (*_beside(findings, large), *findings)
    if not asked.selection and not findings:
        unit.warn(
            f"{unit.name}: no trial has {SHORTEST_S:g} s of motion with every contact on a "
            "plate; no movement can be diagnosed"
        )
    names = list(dict.fromkeys([*facts.get("trials", []), *_trials_of(findings)]))
    facts |= {"trials": names, "too_short_s": _too_short(asked)}
    _write(unit, rows_of(findings, tuple(names)), limits, facts, budget)


def _beside(found: Sequence[Finding], large: Sequence[Finding]) -> Iterator[Finding]:
    """Large errors, less the trials of which it is told already that something has no name."""
    told = {t for f in found if f.effect == UNEXPLAINED and f.verdict == "named" for t in f.trials}
    for one in large:
        if trials := tuple(t for t in one.trials if t not in told):
            yield replace(one, trials=trials)


@dataclass(frozen=True)
class Standing:
    """A static trial in which the plates carry the person, and by what part of the stated mass they
    read more."""

    trial: Trial
    scene: Scene
    share: float


@dataclass(frozen=True)
class Asked:
    """Trials that move, what the selection made of their evidence, if there is any, and what they
    say of the stated mass; the generator goes on from there.

    heavier_by : part of the stated mass by which the body is taken to be heavier.
    """

    looked_at: tuple[LookedAt, ...]
    selection: Selection | None
    weighed: tuple[Finding, ...]
    rng: np.random.Generator
    heavier_by: float = 0.0


def _asked(
    unit: Unit,
    looked_at: tuple[LookedAt, ...],
    standing: Standing | None,
    heavier_by: float = 0.0,
) -> Asked:
    rng = np.random.default_rng(crc32(unit.name.encode()))
    trials = tuple(one.evidence for one in looked_at if one.evidence is not None)
    if not trials:
        return Asked(looked_at, None, (), rng, heavier_by)
    evidence = together(trials)
    only_motion_weighs = is_weighed(unit) and standing is None
    first, weighed = _weighed_moving(evidence) if only_motion_weighs else (None, ())
    selection = select(signatures_of(evidence, ASKED), rng, first)
    return Asked(looked_at, selection, weighed, rng, heavier_by)


def _too_short(asked: Asked) -> dict[str, float]:
    """Moving trials that are left out, and how many seconds of them can be used."""
    left_out = ((one.trial.stem, one.too_short_s) for one in asked.looked_at)
    return {stem: seconds for stem, seconds in left_out if seconds is not None}


def _causes(asked: Asked) -> int:
    return len(asked.selection.fit.explanations) if asked.selection else 0


def _agrees(selection: Selection, prior: Prior, standing: Standing) -> bool:
    """Whether beside all causes that are found the moving person is as much heavier or lighter than
    stated as the plates read in quiet standing.

    Then no trial is judged against the stated mass, which would make one of them seem the odd one.
    """
    share, evidence = standing.share, selection.signatures.evidence
    beyond = evidence.beyond_stated(selection.fit.residual)
    moving = beyond * prior.total_mass_sd_kg / standing.scene.mass_kg
    return is_noticed(share, mass_sd_of(evidence)) and abs(moving - share) < _ALIKE * abs(share)


def _answer(
    asked: Asked, selection: Selection, told: tuple[Finding, ...]
) -> tuple[tuple[Finding, ...], dict]:
    """Findings and facts, of the moving trials and of what is told already."""
    found = findings_of(selection, asked.rng)
    findings = (*with_loud_noise(selection, found), *asked.weighed)
    findings = tuple(sorted(findings, key=lambda one: one.verdict == "rejected"))
    facts = facts_of(selection, findings)
    proven = [cause for one in asked.looked_at for cause in one.causes()]
    facts["causes"] = [*proven, *facts["causes"]]
    facts["heavier_by"] = asked.heavier_by
    return (*told, *findings), facts


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


def _standing(unit: Unit, person: Person, prior: Prior) -> Standing | None:
    """The first static trial in which the plates carry the person."""
    for trial in unit.trials("kinematics", "wrench"):
        if trial.role == "static":
            scene = scene_of(unit, person, prior.phi, trial)
            if scene.valid.any():
                return Standing(trial, scene, weight_share(scene))
    return None


def _weighed(unit: Unit, standing: Standing | None) -> tuple[Finding, ...]:
    """What quiet standing says of the stated mass; nothing without the one or the other."""
    if standing is None or not is_weighed(unit):
        return ()
    plate, mass_kg = loaded_plate([standing.scene]), standing.scene.mass_kg
    return stated_mass_findings(
        standing.share, mass_kg, stated_sd(unit), plate, (standing.trial.stem,), "in quiet standing"
    )


def _weighed_moving(evidence: Evidence) -> tuple[Round | None, tuple[Finding, ...]]:
    """What moving trials say of the stated mass: a cause to begin with where one plate carries the
    person and its gain may be off as much, else a class of causes."""
    share = agreed_share(evidence)
    if share is None:
        return None, ()
    scenes = [one.scene for one in evidence.trials]
    plate = loaded_plate(scenes)
    if plate and (first := weight_round(evidence, share, plate)):
        return first, ()
    names = tuple(one.name for one in evidence.trials)
    mass_kg, mass_sd = scenes[0].mass_kg, mass_sd_of(evidence)
    return None, stated_mass_findings(share, mass_kg, mass_sd, plate, names, "in motion")


def _trials_of(findings: tuple[Finding, ...]) -> list[str]:
    return list(dict.fromkeys(trial for one in findings for trial in one.trials))
