"""Moving trials as the diagnosis asks them, and what each tells by itself beforehand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from zlib import crc32

import numpy as np
import pandas as pd

from bsip_cli.body.person import Person
from bsip_cli.diagnosis.evidence import TrialEvidence, slow, trial_evidence
from bsip_cli.diagnosis.findings import Finding
from bsip_cli.diagnosis.held_out import FOLDS, Gain
from bsip_cli.diagnosis.marker_proof import BEND, Proof, Slip, proofs_of
from bsip_cli.diagnosis.nuisances import own_nuisances, shared_nuisances
from bsip_cli.diagnosis.support import SHORTEST_S, Support
from bsip_cli.diagnosis.together import together
from bsip_cli.effects.marker_shift import BEFORE_S
from bsip_cli.effects.scene import Scene
from bsip_cli.identification.prior import Prior
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import bsip_names
from bsip_cli.stages.frames import acceleration_noise
from bsip_cli.stages.identification_problem import prior_from
from bsip_cli.stages.person_mass import PLATES
from bsip_cli.stages.trial_scene import scene_of
from bsip_cli.study.study import Trial

# Of the spreads an offset is judged against: 17 mm for a marker that is trusted to 5.
_FAR_OFF = 3.5
_READ_TO_PERCENT = 0.3  # standard deviation of what the same plates read in another trial


@dataclass(frozen=True)
class Proven:
    """What the markers of a trial prove, and what the forces gain by it."""

    proof: Proof
    scene: Scene
    gain: Gain


@dataclass(frozen=True)
class LookedAt:
    """A moving trial: its evidence, if there is enough to ask; what its markers prove; what is told
    of it beforehand; or for how long it can be used, where that is too short."""

    trial: Trial
    scene: Scene
    evidence: TrialEvidence | None = None
    proven: tuple[Proven, ...] = ()
    told: tuple[Finding, ...] = ()
    too_short_s: float | None = None

    def left_out(self) -> str:
        """Why it is left out; empty where it is not."""
        if self.too_short_s is None:
            return ""
        return (
            f"{self.trial.stem}: has no part in the diagnosis: every contact is on a plate and the "
            f"pose known for {self.too_short_s:.2f} s only, {SHORTEST_S:g} s are needed"
        )

    def causes(self) -> tuple[dict, ...]:
        """In full, what is proven and the forces show too."""
        shown = (one.proof for one in self.proven if one.gain.is_real())
        return tuple(_in_full(one, self.trial) for one in shown if not one.is_rival)


def moving_trials(unit: Unit, person: Person, prior: Prior) -> tuple[LookedAt, ...]:
    """The evidence of trials that move, and what hands or markers tell of them beforehand."""
    moving = (t for t in unit.trials("kinematics", "wrench") if t.role != "static")
    contacts = unit.facts("identification")["external_contacts"]
    looked_at = [_looked_at(unit, person, prior, t, contacts.get(t.stem)) for t in moving]
    bent = sum(any(_is_bend(proven) for proven in one.proven) for one in looked_at)
    return tuple(
        replace(one, told=(*one.told, *_told(one, f"M{k}", bent > 1)))
        for k, one in enumerate(looked_at, start=1)
    )


def _told(one: LookedAt, class_id: str, is_everywhere: bool) -> Iterator[Finding]:
    """What the markers prove. ``class_id``: of what they do not tell apart. ``is_everywhere``:
    several trials show a second bend, so that ``scale`` has put the waist between two joints."""
    for proven in one.proven:
        is_taken_up = is_everywhere and _is_bend(proven)
        scene, gain = proven.scene, proven.gain
        yield proven.proof.finding(scene, one.trial.stem, class_id, gain, is_taken_up)


def _is_bend(proven: Proven) -> bool:
    return proven.proof.effect.name == BEND


def prior_of(unit: Unit, person: Person, share: float | None = None) -> Prior:
    """Of the parameters, none of which is taken for known; the plates' gain shows against a mass
    that a scale has told.

    share : by what part of the stated mass the plates read more, where they are believed instead.
    """
    sd_percent = 100 * stated_sd(unit) if share is None else _READ_TO_PERCENT
    known = {"total_mass_sd_percent": sd_percent} if is_weighed(unit) else {}
    table = unit.read("regression").copy()
    table[[name for name in bsip_names() if not name.startswith("com")]] *= 1 + (share or 0.0)
    none = np.zeros(len(person.skeleton.bodies), dtype=bool)
    return prior_from(unit, table, person, none, **known)


def _looked_at(
    unit: Unit, person: Person, prior: Prior, trial: Trial, contact: dict | None
) -> LookedAt:
    """``contact``: what a hand holds on to there, as ``identify`` has written it."""
    scene = scene_of(unit, person, prior.phi, trial)
    measured_s = float(scene.valid.sum()) / scene.rate_hz
    if measured_s < SHORTEST_S:
        return LookedAt(trial, scene, too_short_s=measured_s)
    if contact is not None:
        return LookedAt(trial, scene, told=(Support(**contact).finding(trial.stem),))
    fewer = slow(scene)
    options = unit.config.diagnosis
    rng = np.random.default_rng(crc32(trial.stem.encode()))
    own = own_nuisances(fewer, options.skin_factor, options.skin_draws, rng)
    shared = shared_nuisances(fewer, prior.root, options.marker_sd_m)
    stated = (_heavier(prior, shared.shape[2]), stated_sd(unit)) if is_weighed(unit) else ()
    level = acceleration_noise(unit.read("kinematics", trial), person.skeleton)

    def evidence_with(nuisances: np.ndarray) -> TrialEvidence:
        return trial_evidence(
            trial.stem, scene, nuisances, shared, level, options.cutoff_hz, *stated
        )

    proofs = proofs_of(fewer, _slips(unit, trial), rng)
    if not proofs:
        return LookedAt(trial, scene, evidence_with(own))
    alone = together((evidence_with(own),))
    proven = tuple(Proven(one, fewer, one.gain(alone)) for one in proofs)
    beside = np.concatenate([own, *(one.columns(fewer) for one in proofs)], axis=2)
    return LookedAt(trial, scene, evidence_with(beside), proven)


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
    return [*_off(events[slips]), *_off(events[throughout], BEFORE_S, _FAR_OFF)]


def _off(events: pd.DataFrame, before_s: float = 0.0, least: float = 0.0) -> list[Slip]:
    """``least``: how far off a marker must be, in the spreads that its statistic is in."""
    columns = (events[name] for name in ("marker", "start_s", "statistic", "size_m"))
    return [
        Slip(str(m), float(t) - before_s, float(z), least * float(size) / float(z))
        for m, t, z, size in zip(*columns, strict=True)
    ]


def _in_full(one: Proof, trial: Trial) -> dict:
    """A cause with the same sizes for every fold: no plate helped to find them."""
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


def stated_sd(unit: Unit) -> float:
    """Standard deviation of a stated mass, part of it."""
    return 0.01 * unit.config.diagnosis.stated_mass_sd_percent


def is_weighed(unit: Unit) -> bool:
    """Whether the person's mass is a stated one, in a table or in a recording."""
    return unit.read("person").iloc[0]["mass_source"] != PLATES
