"""A trial's artifacts as the scene that effects and diagnosis work on, and the named causes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.body.person import Person
from bsip_cli.diagnosis.cause import Blocks, Cause, method_of
from bsip_cli.diagnosis.held_out import FOLDS
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.plates import ALL, PlateZero, Turned
from bsip_cli.effects.scene import Plate, Scene
from bsip_cli.motion.inverse_kinematics import posed
from bsip_cli.recordings.plate_wrench import silent_frames
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import (
    XYZ,
    TrialSignals,
    load_phi,
    markers_from,
    ordered_markers,
    parameters_of,
    signals_of,
)
from bsip_cli.statistics.methods import OM, RM
from bsip_cli.study.study import Trial

_NAMED = ("named", "ambiguous")
_LOADED_N = 20.0
_HALF_M = 0.3  # of a plate whose outline no file states


def scene_of(unit: Unit, person: Person, phi: np.ndarray, trial: Trial | None = None) -> Scene:
    """Motion, plates and marker residuals of a trial; phi (10 n,) of the person alone.

    Known loads are part of what is simulated. The markers bear the labels that the poses rest on.
    """
    times, labels, positions = markers_from(unit.read("markers", trial))
    markers, events = ordered_markers(labels, positions, person.markers), "marker-events"
    markers = with_labels_corrected(markers, times, person.markers, unit.read(events, trial))
    signals = signals_of(unit, person, trial)
    scene = without_markers(signals, person, phi + load_phi(unit, person, trial))
    plates = plates_of(unit.read("plates", trial), signals.plates)
    zeros = unit.facts("wrench", trial).get("zeros", {})
    rates = (unit.facts("markers", trial)[f"{what}_rate_hz"] for what in ("marker", "analog"))
    resampled = not np.isclose(*rates)
    plates = tuple(
        replace(p, zeroed=p.name in zeros, silent=silent_frames(p.wrench, resampled))
        for p in plates
    )
    limit_m, residual_m = unit.config.ik.robust_limit_m, posed(person, scene.q).residuals(markers)
    return replace(scene, plates=plates, robust_limit_m=limit_m, residual_m=residual_m)


def without_markers(signals: TrialSignals, person: Person, phi: np.ndarray) -> Scene:
    """The same without single plates too; phi (10 n,) with known loads."""
    motion = signals.times_s, person, signals.q, signals.v, signals.a
    return Scene(*motion, phi, plates=(), valid=signals.valid, wrench=signals.wrench)


def with_labels_corrected(
    markers_m: np.ndarray, times_s: np.ndarray, names: tuple[str, ...], events: pd.DataFrame
) -> np.ndarray:
    """(N, m, 3) markers with labels exchanged back where ``ik`` did so (``marker-events``)."""
    found = markers_m.copy()
    for one in events[events["put_right"].astype(bool)].itertuples():
        pair = [names.index(one.marker), names.index(one.partner)]
        frames = np.flatnonzero((times_s >= one.start_s) & (times_s <= one.end_s))[:, None]
        found[frames, pair] = found[frames, pair[::-1]]
    return found


def outline(corners: pd.DataFrame, name: str) -> np.ndarray | None:
    """(4, 3) corners of a plate in a ``plates`` table, if it has any."""
    rows = corners[corners["plate"].astype(str) == name].sort_values("corner")
    return rows[XYZ].to_numpy() if len(rows) else None


def plates_of(corners: pd.DataFrame, readings: Mapping[str, np.ndarray]) -> tuple[Plate, ...]:
    """Every plate that has a reading (N, 6); where a file states no place, about its mean load."""
    found = []
    for name, reading in readings.items():
        stated = place = outline(corners, name)
        loaded = np.nan_to_num(reading[:, 2]) > _LOADED_N
        if place is None and loaded.any():  # a square in the lab's axes about the mean load
            force, moment = reading[loaded, :3].mean(axis=0), reading[loaded, 3:].mean(axis=0)
            middle = np.array([-moment[1] / force[2], moment[0] / force[2], 0.0])
            place = middle + _HALF_M * np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
        if place is not None:
            found.append(Plate(name, place, reading, is_placed=stated is not None))
    return tuple(found)


# --- the causes that the diagnosis of a person named, as science takes them -----------------------


def causes_of(unit: Unit) -> tuple[Cause, ...]:
    """In the order of rank; what is unexplained is no cause that a model could be extended by."""
    found = unit.facts("overall-diagnosis").get("causes", [])
    causes = [one for one in found if one["effect"] in EFFECTS and one["verdict"] in _NAMED]
    keys = [(EFFECTS[one["effect"]], one["target"], tuple(one["trials"])) for one in causes]
    sizes = [(np.array(one["values"]), np.array(one["folds"])) for one in causes]
    return tuple(Cause(*key, *both) for key, both in zip(keys, sizes, strict=True))


def is_corrected(effect: Effect) -> bool:
    """Of the plates, the clocks, or the axes of laboratory and cameras."""
    return effect.of_the_forces or isinstance(effect, Turned)


def causes_here(unit: Unit, plates: Sequence[str], zeroed: Sequence[str] = ()) -> list[Cause]:
    """What the diagnosis names in a recording, on the plates that it has.

    Where it did not look at it: what it names of the instruments in all others of the session, at
    least two, and what the laboratory of the person is known to have, but for offsets of plates
    whose zero this recording shows (``zeroed``).
    """
    analysed, causes = unit.facts("overall-diagnosis")["trials"], causes_of(unit)
    here = [one for one in causes if unit.name in one.trials]
    if unit.name in analysed:
        return here
    session = {t.stem for t in unit.person.trials if t.session == unit.own_trial.session}
    others = session & set(analysed)
    shared = [
        one
        for one in causes
        if one.effect.scope == "laboratory"
        and is_corrected(one.effect)
        and others <= set(one.trials)
    ]
    shared = shared if len(others) > 1 else []
    known = {(one.effect.name, one.target) for one in shared}
    named = of_the_laboratory(unit, "named")
    named = named[named["scope"] == "laboratory"]
    for (effect, target), sizes in named.groupby(["effect", "target"], sort=False):
        if (effect, target) not in known:
            values = sizes["estimate"].to_numpy()
            cause = Cause(EFFECTS[str(effect)], str(target), (unit.name,), values, values[None])
            shared.append(cause)
    for one in shared:
        gone = zeroed if isinstance(one.effect, PlateZero) else ()
        if one.target.split(" ")[0] in {"", ALL, *plates} - {*gone}:
            here.append(one)
    return here


def of_the_laboratory(unit: Unit, *verdicts: str) -> pd.DataFrame:
    """Rows about the laboratory of a person who was in one only, with others, or about this
    session in it."""
    of_all = unit.facts("laboratory")["persons"].items() if unit.has("laboratory") else ()
    mine = [number for number, persons in of_all if {unit.person.id} < {*persons}]
    if len(mine) != 1:  # alone the person's own diagnosis, which asks more of it, is the answer
        return empty_table("laboratory")
    rows = unit.read("laboratory", laboratory=mine, verdict=verdicts)
    session = "_ses-".join(filter(None, (unit.person.id, unit.own_trial.session)))
    return rows[(rows["scope"] == "laboratory") | (rows["who"] == session)]


def cause_record(
    effect: str,
    target: str,
    trials: tuple[str, ...],
    values: np.ndarray,
    folds: list[list[float]] | None = None,
    bounds: dict[str, float] | None = None,
    verdict: str = "named",
) -> dict[str, object]:
    """A cause for ``extend``; of the same sizes in every fold where ``folds`` says none."""
    sizes = values.tolist()
    known = {"effect": effect, "target": target, "trials": list(trials), "verdict": verdict}
    return known | {"values": sizes, "folds": folds or [sizes] * FOLDS, "bounds": bounds or {}}


def body_as_sized(unit: Unit, phi: np.ndarray) -> np.ndarray:
    """(10 n,) the body for which the causes were sized: RM's (10 n,), made as heavy as the
    plates read where the diagnosis believes them instead of the stated mass."""
    return phi * (1 + unit.facts("overall-diagnosis")["heavier_by"])


@dataclass(frozen=True, eq=False)
class ExtendedModels:
    """Of a trial, OM with the causes that concern it, added one after the other.

    scene : with the body for which the causes were sized. om : (10 n,) OM's parameters. steps : the
    causes so far, and the parameters (10 n,) that were identified with them. Known loads are part
    of all parameters.
    """

    scene: Scene
    om: np.ndarray
    steps: tuple[tuple[list[Cause], np.ndarray], ...]


def extended_models(unit: Unit, person: Person) -> ExtendedModels | None:
    """As ``extend`` found them; None where no cause concerns the trial, or OM is not known."""
    causes, extended = causes_of(unit), unit.read("extended-bsip")
    own = [k for k, cause in enumerate(causes) if unit.own_trial.stem in cause.trials]
    if not own or extended.empty:
        return None
    methods, phi = parameters_of(pd.concat([unit.read("bsip"), extended]), person)
    body = dict(zip(methods, phi.T, strict=True))
    scene, known = scene_of(unit, person, body_as_sized(unit, body[RM])), load_phi(unit, person)
    steps = tuple(
        ([causes[j] for j in own[: place + 1]], body[method_of(causes[: k + 1])] + known)
        for place, k in enumerate(own)
    )
    return ExtendedModels(scene, body[OM] + known, steps)


def blocks_of(unit: Unit, stem: str) -> Blocks:
    """How the diagnosis cut a trial that it analysed."""
    facts = unit.facts("overall-diagnosis")
    return Blocks(**facts["blocks"][stem], block_s=facts["block_s"], folds=facts["folds"])
