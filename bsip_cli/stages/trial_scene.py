"""A trial's artifacts as the scene that effects and diagnosis work on, and the named causes."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pandas as pd

from bsip_cli.body.person import Person
from bsip_cli.diagnosis.cause import Blocks, Cause
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.scene import Plate, Scene
from bsip_cli.motion.inverse_kinematics import posed
from bsip_cli.recordings.plate_wrench import silent_frames
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import WRENCH, coordinates_from, load_phi, markers_from, ordered_markers
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
    scene = motion_and_wrench_of(unit, person, phi, trial)
    plates = plates_of(unit.read("plates", trial), unit.read("wrench", trial))
    zeros = unit.facts("wrench", trial).get("zeros", {})
    rates = (unit.facts("markers", trial)[f"{what}_rate_hz"] for what in ("marker", "analog"))
    resampled = not np.isclose(*rates)
    plates = tuple(
        replace(p, zeroed=p.name in zeros, silent=silent_frames(p.wrench, resampled))
        for p in plates
    )
    limit_m, residual_m = unit.config.ik.robust_limit_m, posed(person, scene.q).residuals(markers)
    return replace(scene, plates=plates, robust_limit_m=limit_m, residual_m=residual_m)


def motion_and_wrench_of(
    unit: Unit, person: Person, phi: np.ndarray, trial: Trial | None = None
) -> Scene:
    """The same without single plates and without markers."""
    kinematics, wrench = unit.read("kinematics", trial), unit.read("wrench", trial)
    return Scene(
        kinematics["time_s"].to_numpy(),
        person,
        *coordinates_from(kinematics, person.skeleton),
        phi + load_phi(unit, person, trial),
        plates=(),
        valid=wrench["valid"].to_numpy() & kinematics["determined"].to_numpy(),
        wrench=wrench[WRENCH].to_numpy(),
    )


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


def plate_names(wrench: pd.DataFrame) -> tuple[str, ...]:
    """Of the plates whose readings a ``wrench`` table holds."""
    found = (re.fullmatch(r"(?:plate)?(.*)_fx_N", str(column)) for column in wrench)
    return tuple(one[1] for one in found if one)


def outline(corners: pd.DataFrame, name: str) -> np.ndarray | None:
    """(4, 3) corners of a plate in a ``plates`` table, if it has any."""
    rows = corners[corners["plate"].astype(str) == name].sort_values("corner")
    return rows[["x_m", "y_m", "z_m"]].to_numpy() if len(rows) else None


def plates_of(corners: pd.DataFrame, wrench: pd.DataFrame) -> tuple[Plate, ...]:
    """Every plate that has a reading; where a file states no place, about its mean load."""
    found = []
    for number in plate_names(wrench):
        reading = wrench[[f"plate{number}_{c}" for c in WRENCH]].to_numpy()
        place = outline(corners, number)
        loaded = np.nan_to_num(reading[:, 2]) > _LOADED_N
        if place is None and loaded.any():  # a square in the lab's axes about the mean load
            force, moment = reading[loaded, :3].mean(axis=0), reading[loaded, 3:].mean(axis=0)
            middle = np.array([-moment[1] / force[2], moment[0] / force[2], 0.0])
            place = middle + _HALF_M * np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
        if place is not None:
            found.append(Plate(number, place, reading))
    return tuple(found)


# --- the causes that the diagnosis of a person named, as science takes them -----------------------


def causes_of(unit: Unit) -> tuple[Cause, ...]:
    """In the order of rank; what is unexplained is no cause that a model could be extended by."""
    found = unit.facts("overall-diagnosis").get("causes", [])
    causes = [one for one in found if one["effect"] in EFFECTS and one["verdict"] in _NAMED]
    keys = [(EFFECTS[one["effect"]], one["target"], tuple(one["trials"])) for one in causes]
    sizes = [(np.array(one["values"]), np.array(one["folds"])) for one in causes]
    return tuple(Cause(*key, *both) for key, both in zip(keys, sizes, strict=True))


def body_as_sized(unit: Unit, phi: np.ndarray) -> np.ndarray:
    """(10 n,) the body for which the causes were sized: RM's (10 n,), made as heavy as the
    plates read where the diagnosis believes them instead of the stated mass."""
    return phi * (1 + unit.facts("overall-diagnosis")["heavier_by"])


def blocks_of(unit: Unit, stem: str) -> Blocks:
    """How the diagnosis cut a trial that it analysed."""
    facts = unit.facts("overall-diagnosis")
    return Blocks(**facts["blocks"][stem], block_s=facts["block_s"], folds=facts["folds"])
