"""scale: the person's skeleton from a static trial, refined over frames of all trials."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.body.markersets import MarkerSet, load_marker_set
from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import Skeleton, load_skeleton
from bsip_cli.errors import BadDataError
from bsip_cli.motion.calibration import Calibration, calibrate
from bsip_cli.motion.plausible_body import Doubt, doubts_about, words_of
from bsip_cli.motion.scaling import Refinement, ScalingOptions, TrialMarkers, refine_over_trials
from bsip_cli.recordings.scene import Stature, stature
from bsip_cli.running.unit import Unit
from bsip_cli.segments import how_held, in_words, without_side
from bsip_cli.stages.frames import XYZ, columns, markers_from, ordered_markers
from bsip_cli.stages.person_mass import ENTRY, TABLE, person_mass
from bsip_cli.study.study import Trial

_QUIET_S = 1.0
_NEARLY_ALL = 0.95  # of the markers that the best second shows


@dataclass(frozen=True, eq=False)
class _Recorded:
    """Markers of one trial: times (N,), labels, positions (N, m, 3)."""

    trial: Trial
    times: np.ndarray
    labels: tuple[str, ...]
    positions: np.ndarray


def run(unit: Unit) -> None:
    """Read all trials' markers; write skeleton, marker-positions and person."""
    skeleton, configured = load_skeleton(unit.config.skeleton), unit.config.marker_set
    recorded = [
        _Recorded(trial, *markers_from(unit.read("markers", trial)))
        for trial in unit.trials("markers", "wrench")
    ]
    still = _calibrating_trial(unit, recorded)
    _, quiet = _unrest(still)
    if configured == "auto":  # what ingest recognised from the trial's labels
        content = unit.facts("markers", still.trial)["marker_set_content"]
        marker_set = MarkerSet.from_data(content)
    else:
        marker_set = load_marker_set(configured)
    sex, height_m = unit.person.sex, _height_m(unit, recorded)
    tracks = [dict(zip(x.labels, x.positions.swapaxes(0, 1), strict=True)) for x in recorded]
    quietly = {label: track[quiet] for label, track in tracks[recorded.index(still)].items()}
    seen = {label: track[np.isfinite(track[:, 0])] for label, track in quietly.items()}
    standing = {label: places.mean(axis=0) for label, places in seen.items() if len(places)}
    calibration = calibrate(skeleton, marker_set, standing, sex, height_m, tracks)
    _require_markers(unit, marker_set, calibration.person)
    mass = person_mass(unit, [one.trial for one in recorded], calibration.stature_m)
    if configured == "auto":
        unit.say(f"marker set {marker_set.name}, recognised by the labels")
        _warn_strangers(unit, marker_set, recorded)
    for note in calibration.notes:
        unit.say(note)
    fit = _refine(unit, calibration, recorded, still, quiet)
    kg = mass.mass_kg
    _doubt(unit, doubts_about(fit.person, fit.poses.q, sex, height_m, kg))
    _warn_missing(unit, marker_set, fit.person)
    unit.write("skeleton", _skeleton_table(skeleton, calibration, fit))
    unit.write("marker-positions", _marker_table(skeleton, calibration, fit))
    ahead = calibration.anterior
    statures = Stature.of_all([stature(one.labels, one.positions) for one in recorded])
    # how the markers' height differs from the stated one, which ingest has said
    fault = statures.against(height_m) if statures is not None and height_m is not None else None
    row = {"sex": sex, "mass_kg": kg, "mass_source": mass.source, "plate_mass_kg": mass.plate_kg}
    of_height = TABLE if unit.person.height_m is not None else ENTRY
    row |= {"mass_note": mass.note, "height_m": calibration.stature_m}
    row["height_source"] = of_height if height_m is not None else "markers"
    row |= {"height_note": "; ".join((fault[0], fault[2])) if fault else ""}
    row |= {"anterior_x": ahead[0], "anterior_y": ahead[1]}
    row |= {"calibration_trial": still.trial.stem, "marker_rms_m": fit.poses.rms_m()}
    facts = {"marker_set": marker_set.name, "rms_before_m": fit.rms_before_m}
    unit.write("person", [row], facts)


def _height_m(unit: Unit, recorded: list[_Recorded]) -> float | None:
    """As participants.tsv states it, else the first recording that does; None without either."""
    if unit.person.height_m is not None:
        return unit.person.height_m
    for one in recorded:
        if (height_m := unit.facts("markers", one.trial)["stated_height_m"]) is not None:
            unit.say(f"height {height_m:.2f} m, as {one.trial.stem} states it")
            return float(height_m)
    return None


def _doubt(unit: Unit, doubts: list[Doubt]) -> None:
    """What no person can be is refused, what few are is said."""
    for one in doubts:
        unit.say(f"is this a person? {words_of([one])}")
    if gross := [one for one in doubts if one.is_gross]:
        raise BadDataError(
            words_of(gross),
            file=unit.name,
            expected="a person",
            remedy="check units and labels of the recordings (`bsip check` says how they are read)",
        )


def _require_markers(unit: Unit, marker_set: MarkerSet, person: Person) -> None:
    """Every segment with mass has markers on it or beyond it, or may be held."""
    allowed = unit.config.scale.may_be_held
    skeleton = person.skeleton
    held = [skeleton.segments[i] for i in skeleton.bodies if person.held[i]]
    if lost := [name for name in held if without_side(name) not in allowed]:
        serve = [f"{marker_set.on(name) or 'some'} on the {in_words(name)}" for name in lost]
        may_be_held = json.dumps([*allowed, *dict.fromkeys(map(without_side, lost))])
        raise BadDataError(
            f"no markers on the {', '.join(map(in_words, lost))}",
            expected="; ".join(serve),
            remedy="record these, or let the segment be held at the neutral pose: study.toml "
            f"[scale] may_be_held = {may_be_held}",
        )


def _warn_strangers(unit: Unit, marker_set: MarkerSet, recorded: list[_Recorded]) -> None:
    known = {marker.label for marker in marker_set.markers}
    for one in recorded:
        strange = [label for label in one.labels if label not in known]
        if strange:
            unit.say(
                f"{one.trial.stem} has markers that the calibrating trial's set "
                f"{marker_set.name} does not know, left out: {', '.join(strange)}"
            )


# --- which frames -----------------------------------------------------------------------------


def _calibrating_trial(unit: Unit, recorded: list[_Recorded]) -> _Recorded:
    if not recorded:
        raise BadDataError(
            "no trial with markers",
            file=unit.name,
            expected="at least one",
            remedy="see what ingest refused",
        )
    if static := [one for one in recorded if one.trial.role == "static"]:
        return static[0]
    quietest = min(recorded, key=lambda one: _unrest(one)[0])
    unit.say(f"no static trial; the quietest second of {quietest.trial.stem} calibrates")
    return quietest


def _unrest(one: _Recorded) -> tuple[float, slice]:
    """Mean marker speed [m/s] in the quietest second, and that second, among those that show nearly
    as many markers as the best: people walk in and out."""
    step = float(np.median(np.diff(one.times))) if len(one.times) > 1 else 1.0
    width = min(max(2, round(_QUIET_S / step)), len(one.times))
    if width < 3:
        return np.inf, slice(0, len(one.times))
    speed = np.linalg.norm(np.diff(one.positions, axis=0), axis=2) / step
    seen = np.isfinite(speed)
    count = seen.sum(axis=1)
    mean = np.where(seen, speed, 0.0).sum(axis=1) / np.maximum(count, 1)
    mean[count == 0] = np.inf
    whole = np.ones(width - 1) / (width - 1)
    windows, shown = np.convolve(mean, whole, mode="valid"), np.convolve(count, whole, mode="valid")
    windows[shown < _NEARLY_ALL * shown.max()] = np.inf
    start = int(np.argmin(windows))
    return float(windows[start]), slice(start, start + width)


# --- the fit ----------------------------------------------------------------------------------


def _refine(
    unit: Unit, calibration: Calibration, recorded: list[_Recorded], still: _Recorded, quiet: slice
) -> Refinement:
    """Fitted to all trials, one after the other put into the person's order of markers."""

    def in_order(one: _Recorded, frames: slice = slice(None)) -> TrialMarkers:
        positions = ordered_markers(one.labels, one.positions[frames], calibration.person.markers)
        return TrialMarkers(one.times[frames], positions)

    middle = (quiet.start + quiet.stop) // 2
    options = unit.config.scale
    standing, trials = in_order(still, slice(middle, middle + 1)), map(in_order, recorded)
    how = ScalingOptions(**options.model_dump(exclude={"frames", "may_be_held"}))
    ik = unit.config.ik.model_dump(exclude={"undetermined_sd_rad", "held_sd_rad"})
    return refine_over_trials(
        calibration, standing, recorded.index(still), trials, options.frames, how, ik
    )


# --- what is written --------------------------------------------------------------------------


def _warn_missing(unit: Unit, marker_set: MarkerSet, person: Person) -> None:
    skeleton = person.skeleton
    for i in np.flatnonzero(person.held):
        segment, parent = skeleton.segments[i], skeleton.segments[skeleton.parents[i]]
        known = marker_set.on(segment)
        serve = f"; {known} would do" if known else ""
        held = how_held(segment, f", in line with the {in_words(parent)}")
        unit.say(f"no markers on the {in_words(segment)}: {held}{serve}")


def _skeleton_table(skeleton: Skeleton, calibration: Calibration, fit: Refinement) -> pd.DataFrame:
    first, person = calibration.person, fit.person
    parents = [skeleton.segments[i] if i >= 0 else "" for i in skeleton.parents]
    moved = person.joint_positions_m() - first.joint_positions_m()
    table: dict[str, object] = {"segment": list(skeleton.segments), "parent": parents}
    table |= {"joint": list(skeleton.joints), "joint_type": list(skeleton.joint_types)}
    table |= columns([f"joint_{name}" for name in XYZ], person.joint_in_parent_m)
    table |= columns([f"origin_{name}" for name in XYZ], person.origin_in_joint_m)
    table |= {name: getattr(person, name) for name in ("parent_tilt_rad", "child_tilt_rad")}
    table |= {"length_m": person.lengths_m, "first_guess_m": first.lengths_m}
    table |= {"length_sd_m": fit.length_sd_m, "joint_shift_m": np.linalg.norm(moved, axis=1)}
    return pd.DataFrame(table | {"held": person.held})


def _marker_table(skeleton: Skeleton, calibration: Calibration, fit: Refinement) -> pd.DataFrame:
    first, person = calibration.person, fit.person
    moved = person.marker_positions_m - first.marker_positions_m
    seen = np.isfinite(fit.poses.residual_m)
    squares = np.where(seen, fit.poses.residual_m, 0.0) ** 2
    rms = np.sqrt(squares.sum(axis=0) / np.maximum(seen.sum(axis=0), 1))
    segments = [skeleton.segments[i] for i in person.marker_segments]
    table: dict[str, object] = {"marker": list(person.markers), "segment": segments}
    table |= columns(XYZ, person.marker_positions_m) | {"weight": person.marker_weights}
    table |= {"shift_m": np.linalg.norm(moved, axis=1)}
    return pd.DataFrame(table | {"residual_m": np.where(seen.any(axis=0), rms, np.nan)})
