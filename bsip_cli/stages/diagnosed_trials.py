"""A person's trials as the diagnosis takes them: mass by the plates, errors, markers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any
from zlib import crc32

import numpy as np

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.person import Person
from bsip_cli.diagnosis import support
from bsip_cli.diagnosis.error_budget import Ground, ground_of
from bsip_cli.diagnosis.error_model import TrialErrors
from bsip_cli.diagnosis.error_terms import FAULT, Term, error_terms, noise_of_instruments
from bsip_cli.diagnosis.filtering import Filter, at_full_rate, filter_of, slow
from bsip_cli.diagnosis.findings import Finding
from bsip_cli.diagnosis.marker_proof import Proof, Slip, alone_and_shaken, slips_of
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.markers import BEFORE_S
from bsip_cli.effects.scene import Scene
from bsip_cli.identification.prior import Prior
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import bsip_names
from bsip_cli.stages.identification_problem import prior_from
from bsip_cli.stages.person_mass import PLATES
from bsip_cli.stages.trial_scene import scene_of
from bsip_cli.study.study import Trial

STATIC = "static"
_ORIGINS = {"origin_sd_m": 0.0}  # joint centres are a term of their own, jointly with the body
# Of the spreads an offset is judged against: 17 mm for a marker that is trusted to 5.
_FAR_OFF = 3.5
_READ_TO_PERCENT = 0.3  # standard deviation of what the same plates read in another trial
_LEAST_SAMPLES = 4  # of the filtered residual, for it to be a signal


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """A trial as the model of the error takes it.

    ground : how forces become components. held : what hands hold on to, if they do. slips : what
    its markers prove; ``shaken``: that several do at once.
    """

    trial: Trial
    scene: Scene
    errors: TrialErrors
    ground: Ground
    held: support.Support | None
    slips: tuple[Proof, ...]
    shaken: tuple[Proof, ...]

    @property
    def moves(self) -> bool:
        return self.trial.role != STATIC

    def with_causes(self, causes: Sequence[Mapping[str, Any]]) -> TrialErrors:
        """With terms of the causes that concern it, as in the facts of ``overall-diagnosis``."""
        mine = [one for one in causes if self.trial.stem in one["trials"]]
        named = tuple(_named(self.errors.scene, self.errors.filter, mine))
        return replace(self.errors, terms=(*self.errors.terms, *named))


@dataclass(frozen=True, eq=False)
class Weighed:
    """All trials with forces, of a body as heavy as is believed.

    prior : of its parameters. share : part of the stated mass by which the plates read more, where
    they are believed instead; findings : what is reported of that.
    """

    scenes: tuple[tuple[Trial, Scene], ...]
    prior: Prior
    share: float
    findings: tuple[Finding, ...]


def weighed(unit: Unit, person: Person) -> Weighed:
    """Quiet stance judges a stated mass, and trials that agree where nobody stands still."""
    prior = prior_of(unit, person)
    trials = unit.trials("kinematics", "wrench")
    scenes = tuple((t, scene_of(unit, person, prior.phi, t)) for t in trials)
    scenes = tuple((t, s) for t, s in scenes if s.valid.any())
    sd = stated_sd(unit)
    if not scenes or sd is None:
        return Weighed(scenes, prior, 0.0, ())
    standing = [(t, s) for t, s in scenes if t.role == STATIC][:1]
    if standing:
        share, manner = support.weight_share(standing[0][1]), "in quiet stance"
    else:
        standing, manner = list(scenes), "in motion"
        share = support.agreed_share([s for _, s in scenes], sd) or 0.0
    if not support.is_noticed(share, sd):
        return Weighed(scenes, prior, 0.0, ())
    plate = support.loaded_plate([s for _, s in standing])
    stems = tuple(t.stem for t, _ in standing)
    mass_kg = scenes[0][1].mass_kg
    findings = support.stated_mass_findings(share, mass_kg, sd, plate, stems, manner)
    as_read = prior_of(unit, person, share)
    heavier = tuple((t, replace(s, phi=s.phi + as_read.phi - prior.phi)) for t, s in scenes)
    return Weighed(heavier, as_read, share, findings)


def prior_of(
    unit: Unit, person: Person, share: float | None = None, whatever_mass: bool = False
) -> Prior:
    """Of the parameters, none of which is taken for known; the plates' gain shows against a mass
    that a scale has measured.

    share : by what part of the stated mass the plates read more, where they are believed instead.
    whatever_mass : how the stated mass is shared out alone, whatever it is.
    """
    sd, known = stated_sd(unit), {}
    if whatever_mass:
        known["total_mass_sd_percent"] = 0.0
    elif sd is not None:
        known["total_mass_sd_percent"] = 100 * sd if share is None else _READ_TO_PERCENT
    table = unit.read("regression").copy()
    table[[name for name in bsip_names() if not name.startswith("com")]] *= 1 + (share or 0.0)
    none = np.zeros(len(person.skeleton.bodies), dtype=bool)
    return prior_from(unit, table, person, none, **_ORIGINS, **known)


def stated_sd(unit: Unit) -> float | None:
    """Standard deviation of a mass that a table or a recording states, part of it; else None."""
    if unit.read("person").iloc[0]["mass_source"] == PLATES:
        return None
    return 0.01 * unit.config.diagnosis.stated_mass_sd_percent


def diagnosed(
    unit: Unit, prior: Prior, trial: Trial, scene: Scene, least: int = _LEAST_SAMPLES
) -> Diagnosed | None:
    """None where the plates carry the person for fewer than ``least`` samples of the residual."""
    options, facts = unit.config.diagnosis, unit.read("person").iloc[0]
    fewer = slow(scene)
    filter_ = filter_of(fewer, options.cutoff_hz)
    heights = [plate.corners_m[:, 2] for plate in scene.plates]
    height = float(np.mean(heights)) if heights else 0.0  # moments about the plates' surface
    filter_ = replace(filter_, reference_m=np.append(filter_.reference_m[:2], height))
    if len(filter_.frames) < least:
        return None
    full = at_full_rate(filter_, scene, options.cutoff_hz)
    measured, residual = full.one(scene.measured), full.one(scene.measured - scene.predicted)
    contact = unit.facts("identification")["external_contacts"].get(trial.stem)
    rng = np.random.default_rng(crc32(trial.stem.encode()))
    off = _slips(unit, trial) if trial.role != STATIC else []
    markers = alone_and_shaken(fewer, slips_of(fewer, off, options.named_from, rng) if off else ())
    terms = [
        replace(x, columns=filter_(x.columns))
        for x in error_terms(fewer, prior.root, options.landmark_sd_m, options.skin_factor)
    ]
    if contact is not None:
        terms += _of_hands(fewer, filter_)
    anterior = facts[["anterior_x", "anterior_y"]].to_numpy(dtype=float)
    percent = unit.config.reconstruct.cop_min_force_percent_bw
    least_N = 0.01 * percent * scene.mass_kg * GRAVITY_M_S2
    seconds = np.floor(fewer.times_s[filter_.frames]).astype(int)
    ground = ground_of(measured, residual, anterior, least_N, seconds)
    marker_noise_m = unit.facts("kinematics", trial)["marker_noise_m"]
    noise = noise_of_instruments(
        fewer, filter_.reference_m, marker_noise_m, scene.rate_hz, options.cutoff_hz
    )
    errors = TrialErrors(trial.stem, fewer, filter_, residual, tuple(terms), noise)
    held = None if contact is None else support.Support(**contact)
    return Diagnosed(trial, scene, errors, ground, held, *markers)


def _named(scene: Scene, filter_: Filter, causes: Sequence[Mapping[str, Any]]) -> Iterator[Term]:
    """Faults with the sizes that the diagnosis has found, and how they might differ."""
    for one in causes:
        effect, target = EFFECTS.get(one["effect"]), one["target"]
        if effect is None:
            continue  # a pattern without a cause: it belongs to the unknown
        values = np.asarray(one["values"], dtype=float)
        columns = filter_(effect.signature(scene, target, values))
        known = filter_.one(effect.change(scene, target, values))
        name, alone = FAULT + effect.name, len(one["trials"]) == 1
        yield Term(name, target, f"{name} {target} named", alone, columns, known)


def _of_hands(scene: Scene, filter_: Filter) -> Iterator[Term]:
    """A constant force on each hand, of the size from which on it is reported."""
    force = support.LIGHTER * scene.mass_kg * GRAVITY_M_S2 * np.eye(3)
    for hand in support.HANDS:
        place = scene.centre(hand).position_m
        arm = np.cross(place[:, None], force).swapaxes(1, 2)
        columns = np.concatenate([np.broadcast_to(force, arm.shape), arm], axis=1)
        term = FAULT + EFFECTS["unmeasured_contact"].name
        yield Term(term, hand, f"{term} {hand}", True, filter_(columns))


def _slips(unit: Unit, trial: Trial) -> list[Slip]:
    """Markers off their places that the inverse kinematics has found, a slip's before those of
    the whole trial."""
    rows: list[Any] = list(unit.read("marker-events", trial).itertuples())
    slips = [Slip(x.marker, x.start_s, x.statistic, 0.0) for x in rows if x.kind == "slip"]
    for x in rows:
        if x.kind == "offset" and x.statistic > _FAR_OFF:
            size_m = _FAR_OFF * x.size_m / x.statistic
            slips.append(Slip(x.marker, x.start_s - BEFORE_S, x.statistic, size_m))
    return slips
