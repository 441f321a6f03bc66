"""diagnose (participant): what the simulation gets wrong in all trials of one person."""

from __future__ import annotations

from dataclasses import dataclass
from zlib import crc32

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.diagnosis.detection import limits_of
from bsip_cli.diagnosis.evidence import TrialEvidence, slow, trial_evidence
from bsip_cli.diagnosis.findings import Finding, findings_of
from bsip_cli.diagnosis.held_out import FOLDS, values_without
from bsip_cli.diagnosis.intervals import bounds
from bsip_cli.diagnosis.loud_noise import with_loud_noise
from bsip_cli.diagnosis.marker_proof import Proof, Slip, proofs_of
from bsip_cli.diagnosis.nuisances import own_nuisances, shared_nuisances
from bsip_cli.diagnosis.patterns import PATTERNS
from bsip_cli.diagnosis.scale_mass import NOTICED, agreed_share, weight_round, weight_share
from bsip_cli.diagnosis.selection import Round, Selection, select
from bsip_cli.diagnosis.signatures import signatures_of
from bsip_cli.diagnosis.stated_mass import loaded_plate, stated_mass_findings
from bsip_cli.diagnosis.support import support_of
from bsip_cli.diagnosis.together import BLOCK_S, Evidence, together
from bsip_cli.effects.catalogue import CATALOGUE
from bsip_cli.effects.marker_shift import BEFORE_S
from bsip_cli.effects.scene import Scene
from bsip_cli.identification.prior import Prior
from bsip_cli.report.verdict import verdict_of
from bsip_cli.schemas import bsip_names
from bsip_cli.stages.diagnosis_rows import rows_of
from bsip_cli.stages.frames import acceleration_noise, person_from
from bsip_cli.stages.identification_problem import prior_from
from bsip_cli.stages.trial_scene import scene_of
from bsip_cli.study import Trial
from bsip_cli.unit import Unit

_SHORTEST_S = 2.0
# Of the spreads an offset is judged against: 17 mm for a marker that is trusted to 5.
_FAR_OFF = 3.5
_ALIKE = 0.5  # part of the difference to the stated mass
_READ_TO_PERCENT = 0.3  # standard deviation of what the same plates read in another trial
_ATTRIBUTED = "segment_inertia"  # not a cause beside the parameters: they are projected out
ASKED = (*(effect for effect in CATALOGUE if effect.name != _ATTRIBUTED), *PATTERNS)


def run(unit: Unit) -> None:
    """Read motion, wrench, person and RM of all trials; write what is wrong, with its evidence."""
    skeleton = load_skeleton(unit.config.skeleton)
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    prior = prior_of(unit, person)
    standing = _standing(unit, person, prior)
    asked = _asked(unit, moving_trials(unit, person, prior), standing)
    if asked.selection and standing and _agrees(asked.selection, prior, standing[1]):
        as_read = prior_of(unit, person, weight_share(standing[1]))
        again = _asked(unit, moving_trials(unit, person, as_read), standing)
        asked = max(again, asked, key=_causes)
    told = (*(f for one in asked.looked_at for f in one.told), *_weighed(unit, standing))
    for sentence in filter(None, (one.left_out for one in asked.looked_at)):
        unit.warn(sentence)
    if asked.selection:
        _write(unit, *_answer(asked, asked.selection, told))
        return
    if not told:
        unit.warn(
            f"{unit.name}: no trial has {_SHORTEST_S:g} s of motion with every contact on a "
            "plate; no movement can be diagnosed"
        )
    names = _trials_of(told)
    _write(unit, rows_of(told, tuple(names)), empty_table("detection"), {"trials": names})


@dataclass(frozen=True)
class Asked:
    """Trials that move, what the selection made of their evidence, if there is any, and what they
    say of the stated mass; the generator goes on from there."""

    looked_at: tuple[LookedAt, ...]
    selection: Selection | None
    weighed: tuple[Finding, ...]
    rng: np.random.Generator


def _asked(
    unit: Unit, looked_at: tuple[LookedAt, ...], standing: tuple[str, Scene] | None
) -> Asked:
    rng = np.random.default_rng(crc32(unit.name.encode()))
    trials = tuple(one.evidence for one in looked_at if one.evidence is not None)
    if not trials:
        return Asked(looked_at, None, (), rng)
    evidence = together(trials)
    only_motion_weighs = _is_weighed(unit) and standing is None
    first, weighed = _weighed_moving(evidence) if only_motion_weighs else (None, ())
    return Asked(looked_at, select(signatures_of(evidence, ASKED), rng, first), weighed, rng)


def _causes(asked: Asked) -> int:
    return len(asked.selection.fit.explanations) if asked.selection else 0


def _agrees(selection: Selection, prior: Prior, standing: Scene) -> bool:
    """Whether beside all causes that are found the moving person is as much heavier or lighter than
    stated as the plates read in quiet standing.

    Then no trial is judged against the stated mass, which would make one of them seem the odd one.
    """
    share = weight_share(standing)
    beyond = selection.signatures.evidence.beyond_stated(selection.fit.residual)
    moving = beyond * prior.total_mass_sd_kg / standing.mass_kg
    return abs(share) >= NOTICED and abs(moving - share) < _ALIKE * abs(share)


def _answer(
    asked: Asked, selection: Selection, told: tuple[Finding, ...]
) -> tuple[pd.DataFrame, pd.DataFrame, dict]:
    """Diagnosis, detection limits and facts, of the moving trials and of what is told already."""
    found = findings_of(selection, asked.rng)
    findings = (*with_loud_noise(selection, found), *asked.weighed)
    findings = tuple(sorted(findings, key=lambda one: one.verdict == "rejected"))
    facts = _facts(selection, findings)
    facts["trials"] = list(dict.fromkeys([*facts["trials"], *_trials_of(told)]))
    proven = [cause for one in asked.looked_at for cause in one.causes]
    facts["causes"] = [*proven, *facts["causes"]]
    names = tuple(one.name for one in selection.signatures.evidence.trials)
    return rows_of((*told, *findings), names), _detection(selection), facts


def _write(unit: Unit, diagnosis: pd.DataFrame, limits: pd.DataFrame, facts: dict) -> None:
    """Both artifacts, and in words what they say."""
    unit.write("overall-diagnosis", diagnosis, facts)
    unit.write("detection", limits)
    said = verdict_of(diagnosis, limits)
    for sentence in (said.headline, *said.causes, said.limits):
        if sentence:
            unit.warn(f"{unit.name}: {sentence}")


@dataclass(frozen=True)
class LookedAt:
    """A moving trial: its evidence, if there is enough to ask; what it tells by itself; of that the
    causes in full that the forces show too; or why it is left out."""

    evidence: TrialEvidence | None = None
    told: tuple[Finding, ...] = ()
    causes: tuple[dict, ...] = ()
    left_out: str = ""


def moving_trials(unit: Unit, person: Person, prior: Prior) -> tuple[LookedAt, ...]:
    """The evidence of trials that move, and what hands or markers tell of them beforehand."""
    moving = (t for t in unit.trials("kinematics", "wrench") if t.role != "static")
    return tuple(
        _looked_at(unit, person, prior, trial, f"M{k}") for k, trial in enumerate(moving, start=1)
    )


def prior_of(unit: Unit, person: Person, share: float | None = None) -> Prior:
    """Of the parameters, none of which is taken for known; the plates' gain shows against a mass
    that a scale has told.

    share : by what part of the stated mass the plates read more, where they are believed instead.
    """
    stated_sd = unit.config.diagnosis.stated_mass_sd_percent
    sd_percent = stated_sd if share is None else _READ_TO_PERCENT
    known = {"total_mass_sd_percent": sd_percent} if _is_weighed(unit) else {}
    table = unit.read("regression").copy()
    table[[name for name in bsip_names() if not name.startswith("com")]] *= 1 + (share or 0.0)
    none = np.zeros(len(person.skeleton.segments), dtype=bool)
    return prior_from(unit, table, person, none, **known)


def _looked_at(unit: Unit, person: Person, prior: Prior, trial: Trial, class_id: str) -> LookedAt:
    """class_id : of what its markers do not tell apart."""
    scene = scene_of(unit, person, prior.phi, trial)
    measured_s = float(scene.valid.sum()) / scene.rate_hz
    if measured_s < _SHORTEST_S:
        return LookedAt(
            left_out=f"{trial.stem}: has no part in the diagnosis: every contact is on a plate for "
            f"{measured_s:.2f} s only, {_SHORTEST_S:g} s are needed"
        )
    fewer = slow(scene)
    held = support_of(fewer)
    if held is not None:
        return LookedAt(told=(held.finding(trial.stem),))
    options = unit.config.diagnosis
    rng = np.random.default_rng(crc32(trial.stem.encode()))
    own = own_nuisances(fewer, options.skin_factor, options.skin_draws, rng)
    shared = shared_nuisances(fewer, prior.root, options.marker_sd_m)
    heavier = _heavier(prior, shared.shape[2]) if _is_weighed(unit) else None
    level = acceleration_noise(unit.read("kinematics", trial), person.skeleton)

    def evidence_with(nuisances: np.ndarray) -> TrialEvidence:
        return trial_evidence(
            trial.stem, scene, nuisances, shared, level, options.cutoff_hz, heavier
        )

    proofs = proofs_of(fewer, _slips(unit, trial), rng)
    if not proofs:
        return LookedAt(evidence_with(own))
    alone = together((evidence_with(own),))
    gains = [one.gain(alone) for one in proofs]
    told = tuple(
        one.finding(fewer, trial.stem, class_id, gain)
        for one, gain in zip(proofs, gains, strict=True)
    )
    beside = np.concatenate([own, *(one.columns(fewer) for one in proofs)], axis=2)
    causes = tuple(
        _proven(one, trial)
        for one, gain in zip(proofs, gains, strict=True)
        if gain.is_real() and not one.is_rival
    )
    return LookedAt(evidence_with(beside), told, causes)


def _heavier(prior: Prior, count: int) -> np.ndarray:
    """(count,) how many standard deviations of the stated mass shared nuisances of unit variance,
    the parameters first, make the body heavier."""
    masses = prior.root[::10].sum(axis=0) / prior.total_mass_sd_kg
    return np.pad(masses, (0, count - len(masses)))


def _slips(unit: Unit, trial: Trial) -> list[Slip]:
    """Markers off their places that the inverse kinematics has found, a slip's before those of
    the whole trial."""
    events = unit.read("marker-events", trial)
    slips = events["kind"] == "slip"
    throughout = (events["kind"] == "offset") & (events["statistic"] > _FAR_OFF)
    return [*_off(events[slips]), *_off(events[throughout], before_s=BEFORE_S)]


def _off(events: pd.DataFrame, before_s: float = 0.0) -> list[Slip]:
    columns = (events[name] for name in ("marker", "start_s", "statistic"))
    return [Slip(str(m), float(t) - before_s, float(z)) for m, t, z in zip(*columns, strict=True)]


def _proven(one: Proof, trial: Trial) -> dict:
    """A cause in full, with the same sizes for every fold: no plate helped to find them."""
    values = one.values.tolist()
    return {
        "effect": one.effect.name,
        "target": one.target,
        "trials": [trial.stem],
        "verdict": "named" if one.is_alone else "ambiguous",
        "values": values,
        "folds": [values] * FOLDS,
        "bounds": {},
    }


def _is_weighed(unit: Unit) -> bool:
    assert unit.participant is not None
    return unit.participant.mass_kg is not None


def _standing(unit: Unit, person: Person, prior: Prior) -> tuple[str, Scene] | None:
    """Name and scene of the first static trial in which the plates carry the person."""
    for trial in unit.trials("kinematics", "wrench"):
        if trial.role == "static":
            scene = scene_of(unit, person, prior.phi, trial)
            if scene.valid.any():
                return trial.stem, scene
    return None


def _weighed(unit: Unit, standing: tuple[str, Scene] | None) -> tuple[Finding, ...]:
    """What quiet standing says of the stated mass; nothing without the one or the other."""
    if standing is None or not _is_weighed(unit):
        return ()
    name, scene = standing
    share, plate = weight_share(scene), loaded_plate([scene])
    return stated_mass_findings(share, scene.mass_kg, plate, (name,), "in quiet standing")


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
    return None, stated_mass_findings(share, scenes[0].mass_kg, plate, names, "in motion")


def _trials_of(findings: tuple[Finding, ...]) -> list[str]:
    return list(dict.fromkeys(trial for one in findings for trial in one.trials))


def _facts(selection: Selection, findings: tuple[Finding, ...]) -> dict:
    """The best score of each round and whether it was a cause, and the causes in full: their
    values from all data and from each fold's training blocks, for ``extend``, and the bound of
    Cramér and Rao on what is reported."""
    evidence = selection.signatures.evidence
    rounds = [
        {"best": max((t.score for t in one.tried), default=0.0), "kept": one.kept is not None}
        for one in selection.rounds
    ]
    verdicts = {
        (one.effect, one.target, one.trials): one.verdict
        for one in findings
        if one.verdict != "rejected"
    }
    causes = []
    unseen = values_without(evidence, selection.fit)
    for number, (one, folds) in enumerate(zip(selection.fit.explanations, unseen, strict=True)):
        trials = tuple(evidence.trials[t].name for t in one.place.trials)
        if (one.effect.name, one.target, trials) not in verdicts:
            continue  # it became negligible or impossible beside later ones
        causes.append(
            {
                "effect": one.effect.name,
                "target": one.target,
                "trials": list(trials),
                "verdict": verdicts[one.effect.name, one.target, trials],
                "values": one.values.tolist(),
                "folds": folds,
                "bounds": bounds(evidence, selection.fit, number),
            }
        )
    blocks = {
        one.name: {
            "first": evidence.first_block(t),
            "start_s": float(one.rows_s()[0]),
        }
        for t, one in enumerate(evidence.trials)
    }
    return {
        "trials": [one.name for one in evidence.trials],
        "rounds": rounds,
        "causes": causes,
        "block_s": BLOCK_S,
        "folds": FOLDS,
        "blocks": blocks,
    }


def _detection(selection: Selection) -> pd.DataFrame:
    trials = selection.signatures.evidence.trials
    rows = [
        {
            "effect": limit.place.candidate.effect.name,
            "target": limit.place.candidate.target,
            "parameter": limit.parameter,
            "unit": limit.unit,
            "limit": limit.size,
            "trials": ", ".join(trials[t].name for t in limit.place.trials),
        }
        for limit in limits_of(selection)
    ]
    return pd.DataFrame(rows)
