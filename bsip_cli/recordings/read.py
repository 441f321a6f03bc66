"""The one door to recordings: a path in, a recording out, with the forces of the plates whose
numbers are understood, or the reason for none."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.ndimage import uniform_filter1d

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.errors import BadDataError
from bsip_cli.files.regular import check_regular
from bsip_cli.recordings.contacts import foot_contacts
from bsip_cli.recordings.model import Finding, Plate, Recording
from bsip_cli.recordings.momentum_mass import Interval, intervals_alone
from bsip_cli.recordings.plate_reading import AS_STATED, Opened, PlateSource, lift_N
from bsip_cli.recordings.plate_wrench import plates_at_marker_rate, steady_pull, without_zeros
from bsip_cli.recordings.plates import LOADED_N
from bsip_cli.recordings.scene import by_segment
from bsip_cli.recordings.session_findings import (
    about_delay,
    about_drift,
    about_own_units,
    about_place,
    about_sides,
    findings_about,
    other_pace,
)
from bsip_cli.recordings.session_reading import SessionReading, Verdict, session_reading
from bsip_cli.recordings.trial_samples import TrialSamples
from bsip_cli.recordings.trunk_motion import low_pass, trunk_reach_m_s2

_ABSURD_N = 15_000.0
_LIGHTLY_LOADED_N = 20.0
_ROUNDING_N = 1e-6
_PULL_SHARE = 0.2  # of the push's impulse
_WINDOW_S = 0.1
_QUIET_SHARE = 0.05  # of the mean load: more is movement, in which both feet press at once
_LEAST_CHANGE_N = 1.0
_TOGETHER = 0.8  # correlation
_MOSTLY_BORNE = 75  # per cent of the time, or less, in which less than the weight is on the plates
_BORNE = 0.2  # of the weight: a standing person's total changes less
_UNLOADED = Verdict()
_WITHOUT_PLACE = (
    "this recording lacks the plate with which it was exchanged in the others",
    "left the plate out",
    "excluded",
)


def read_recording(path: Path) -> Recording:
    """Read a ``.c3d``, or a ``.trc`` with the file of ground forces beside it.

    This trial alone decides how its numbers are to be understood.
    """
    opened = open_recording(path)
    return assemble(opened, session_reading([TrialSamples.of(opened)]))


def open_recording(path: Path) -> Opened:
    """A recording whose plates are still as the file has them."""
    path = Path(path)
    check_regular(path)
    suffix = path.suffix.lower()
    if suffix == ".c3d":
        from bsip_cli.recordings.c3d import open_c3d

        return open_c3d(path)
    if suffix == ".trc":
        from bsip_cli.recordings.trc_mot import open_trc_mot

        return open_trc_mot(path)
    raise BadDataError(
        f"a recording of type '{suffix}'",
        expected="a .c3d or a .trc file",
        remedy="export it as C3D",
        file=path,
    )


def assemble(opened: Opened, session: SessionReading) -> Recording:
    """The recording with its plates, understood as all trials of the session say."""
    opened = opened.in_frame(session.frame)
    recording = opened.recording
    delay_s = session.delays_s.get(recording.path.stem, 0.0)
    opened = opened.with_forces_from(delay_s)
    delayed = about_delay(delay_s, session.delays_s)
    delayed += about_drift(session.drifts_s.get(recording.path.stem, 0.0))
    findings = [*findings_about(session), *delayed, *about_sides(recording)]
    paces = (one.get(recording.path.stem, 1.0) for one in (session.paces, session.maybe_paces))
    surely, maybe = (other_pace(times, recording.marker_rate_hz) for times in paces)
    if maybe and not surely:
        expected, action = "accelerations as large as forces make them", "took the stated rate"
        findings.append(Finding("rate", "cameras", f"perhaps {maybe}", expected, action, "warning"))
    foreign = _not_its_own(recording, session)
    if note := recording.forces_note or foreign or surely:
        return replace(recording, findings=(*recording.findings, *findings), forces_note=note)
    plates: list[Plate] = []
    reversed_names, missing = [], []
    findings += about_own_units(session.units_of(recording.path.stem))
    verdicts = session.plates_of(recording.path.stem)
    by_name = {source.name: source for source in opened.sources}
    for source in opened.sources:
        verdict = verdicts.get(source.name, _UNLOADED)
        if verdict.repeats:
            continue
        if verdict.refusal:
            missing.append(source)
            continue
        if other := verdict.reading.place_of:
            if other not in by_name:
                findings.append(about_place(source.name, *_WITHOUT_PLACE))
                missing.append(source)
                continue
            source = source.in_place_of(by_name[other])
        plate = source.plate(verdict.reading)
        if fault := _no_person(plate, recording.analog_rate_hz):
            findings.append(fault)
            missing.append(source)
            continue
        findings += [*source.findings(verdict.reading), *_without_side_force(plate)]
        plates.append(plate)
        if verdict.reading.sign < 0:
            findings.append(_reversed(plate))
            reversed_names.append(plate.name)
    plates, about = _without_missing(plates, missing)
    findings += about
    findings += sign_doubts(plates, reversed_names, recording.analog_rate_hz)
    note = why_no_forces(plates, bool(opened.sources))
    note = note or lost_zeros(plates, reversed_names, recording)
    return replace(
        recording,
        plates=() if note else tuple(plates),
        findings=(*recording.findings, *findings),
        forces_note=note,
    )


def _without_missing(
    plates: Sequence[Plate], missing: Sequence[PlateSource]
) -> tuple[list[Plate], list[Finding]]:
    """Unusable while a plate that is left out is loaded: the others are not the whole force then.

    Where a plate has an outline, the feet show when somebody stands on it.
    """
    alone, findings = np.array(True), []
    for source in missing:
        if source.plate(AS_STATED).corners_m is not None:
            continue
        loaded = source.usable & (np.abs(lift_N(source)) > LOADED_N)
        if plates and loaded.any():
            found = f"left out, and loaded in {loaded.mean():.0%} of the time"
            action = "left out the other plates' forces of that time"
            expected = "all that bears the person"
            findings.append(
                Finding("plate_missing", source.name, found, expected, action, "excluded")
            )
        alone = alone & ~loaded
    return [replace(plate, usable=plate.usable & alone) for plate in plates], findings


def masses_alone(recording: Recording) -> dict[str, tuple[Interval, ...]]:
    """What each plate shows of the person's mass while it bears the person alone."""
    recording, *_ = without_zeros(recording)
    markers, rate_hz = by_segment(recording.labels, recording.markers_m), recording.marker_rate_hz
    plates = plates_at_marker_rate(recording)
    own = {side: markers[name] for side in "lr" if (name := f"foot_{side}") in markers}
    feet = foot_contacts(own, rate_hz, plates, recording.n_frames)
    return intervals_alone(markers, feet, plates, rate_hz)


def _not_its_own(recording: Recording, session: SessionReading) -> str:
    """Why this trial's forces are not those of its markers; empty if they may be.

    Raises BadDataError where left and right are exchanged in this trial alone.
    """
    name, give = recording.path.stem, "give each trial its own force table"
    if session.odd.get(name) == "sides":
        raise BadDataError(
            "left and right are exchanged all over the body, in this trial alone",
            expected="left on the left, as in the other trials of the session",
            remedy="export it in the axes of the others, or exchange its left and right labels",
            file=recording.path,
        )
    if session.odd.get(name) == "forces":
        return (
            "as the forces of the other trials of the session are understood, they carry and drive "
            "the body; this trial's do not, and nothing makes one person of both; look whether "
            "they are this trial's, and exported as the others are"
        )
    if unit := session.odd.get(name):
        return (
            "read in N, they carry another mass than those of the session's other trials, as if "
            f"they were in {unit}; export all in N"
        )
    if twin := session.twins.get(name):
        return f"its forces are those of {twin} too, where the markers move otherwise; {give}"
    if other := session.of_others.get(name):
        return (
            "its forces do not last as long as its markers, and those of other trials of the "
            "session neither, but as long as each other's: here as the markers of "
            f"{other}; {give}"
        )
    return ""


def why_no_forces(plates: Sequence[Plate], had_some: bool = True) -> str:
    """Empty, or why these plates give no forces."""
    if not had_some:
        return "the file has no usable force plates"
    if not plates:
        return "every force plate was left out"
    if not any(plate.usable.any() for plate in plates):
        return "the force plates have no usable sample"
    total = np.sum([np.where(p.usable, p.lift_N, 0.0) for p in plates], axis=0)
    largest, pull = np.max(total, initial=0.0), -np.min(total, initial=0.0)
    if largest < LOADED_N and pull > LOADED_N:
        return (
            f"the force plates push by {largest:.3g} N at most and pull by up to {pull:.0f} N: "
            "their sign is not that of the session's other trials; export all with one"
        )
    if largest < LOADED_N:
        found = f"the force plates were never loaded (at most {largest:.3g} N)"
        if not total.any():
            return found
        return (
            f"{found}; if these are kN, kgf, N per kg or parts of the weight, export them in N or "
            "state the person's mass; if the plates were set to zero under the person, record again"
        )
    return ""


def _no_person(plate: Plate, rate_hz: float) -> Finding | None:
    """Why a plate's forces in this trial are no person's, even from another zero."""
    pulled = steady_pull(plate, rate_hz)
    lift = plate.lift_N[plate.usable] - (plate.lift_N[pulled].mean() if pulled.any() else 0)
    if not len(lift):
        return None
    largest = np.percentile(np.abs(lift), 99.5)
    pull = -lift[lift < -_LIGHTLY_LOADED_N].sum()
    push = lift[lift > _LIGHTLY_LOADED_N].sum()
    if largest >= _ABSURD_N:
        check, found = "plate_force", f"vertical forces up to {largest / 1000:.1f} kN"
        expected = f"less than {_ABSURD_N / 1000:.0f} kN"
    elif pull > _PULL_SHARE * push and lift.min() < -LOADED_N:
        found = f"pushes up to {max(lift.max(), 0):.0f} N and pulls up to {-lift.min():.0f} N"
        check, expected = "plate_sign", "pushes only"
    else:
        return None
    return Finding(check, plate.name, found, expected, "left the plate out", "excluded")


def _without_side_force(plate: Plate) -> list[Finding]:
    """Of a plate that measures no horizontal force under its load, along one axis or both."""
    loaded = plate.usable & (plate.lift_N > LOADED_N)
    side = np.abs(plate.force_N[loaded, :2]).max(axis=0, initial=0.0)
    axes = [name for name, most in zip("XY", side, strict=True) if most <= _ROUNDING_N]
    if not (loaded.any() and axes):
        return []
    found = f"no horizontal force along the lab's {' and '.join(axes)} whatever it bears"
    expected = "a force of three components"
    action = "took it as zero, though nobody stands without pushing sideways; look whether "
    action += "the export lacks it"
    return [Finding("plate_force", plate.name, found, expected, action, "warning")]


def _reversed(plate: Plate) -> Finding:
    lift = plate.lift_N[plate.usable]
    loaded = lift[np.abs(lift) > _LIGHTLY_LOADED_N]
    found = "a pull: the action on the plate"
    if len(loaded):
        found = f"median vertical force on the body {-np.median(loaded):.0f} N"
    action = "reversed all six components"
    return Finding("plate_sign", plate.name, found, "a push (positive)", action, "corrected")


def sign_doubts(
    plates: Sequence[Plate], reversed_names: Collection[str], rate_hz: float
) -> list[Finding]:
    """A warning for each reversed plate whose load changes together with the others' load.

    In quiet standing the weight is constant, so the loads change in opposite directions. If
    they would without the reversal, the plate's zero is wrong rather than its sign.
    """
    findings, width = [], max(1, round(_WINDOW_S * rate_hz))
    for plate in plates:
        others = [other for other in plates if other is not plate]
        good = np.logical_and.reduce([p.usable for p in plates])
        if plate.name not in reversed_names or not others or good.sum() < rate_hz:
            continue
        own = uniform_filter1d(plate.lift_N[good], width)
        rest = uniform_filter1d(np.sum([p.lift_N[good] for p in others], axis=0), width)
        if not all(
            load.mean() > LOADED_N and _LEAST_CHANGE_N < load.std() < _QUIET_SHARE * load.mean()
            for load in (own, rest)
        ):
            continue
        if (correlation := float(np.corrcoef(own, rest)[0, 1])) < _TOGETHER:
            continue
        found = (
            f"reversed, its load changes together with the other plates' (r = {correlation:.2f}, "
            f"the sum by {(own + rest).std():.1f} N; as recorded by {(own - rest).std():.1f} N)"
        )
        expected = "opposite changes in quiet standing"
        action = "kept it reversed; if its zero is lost instead, its load and the sum are wrong"
        findings.append(Finding("plate_sign", plate.name, found, expected, action, "warning"))
    return findings


def lost_zeros(plates: Sequence[Plate], reversed_names: list[str], recording: Recording) -> str:
    """Empty, or that the plates were set to zero under the person.

    Then a plate that somebody leaves reads a pull, as one does whose sign is the other one; but
    reversed, all plates together go less with the motion of the trunk than as recorded.
    """
    if not 0 < len(reversed_names) < len(plates):
        return ""
    if (reach := trunk_reach_m_s2(recording)) is None:
        return ""
    frames = np.arange(recording.n_frames) / recording.marker_rate_hz
    times = np.arange(len(plates[0].usable)) / recording.analog_rate_hz
    lifts = [np.where(plate.usable, plate.lift_N, 0.0) for plate in plates]
    smooth = [low_pass(np.interp(frames, times, lift), recording.marker_rate_hz) for lift in lifts]
    total = np.sum(smooth, axis=0)
    signs = [-1 if plate.name in reversed_names else 1 for plate in plates]
    recorded = np.einsum("p,pn->n", signs, smooth)
    weight = np.percentile(total, _MOSTLY_BORNE)
    needed = weight / GRAVITY_M_S2 * reach
    if np.var(total - needed) < max(2.0 * np.var(recorded - needed), (_BORNE * weight) ** 2):
        return ""
    some = " and ".join(reversed_names)
    return (
        f"plate {some} pulls, and reversed it makes all plates together read from "
        f"{total.min():.0f} to {total.max():.0f} N of a person whose trunk hardly rises or falls, "
        f"as recorded the same throughout to {np.std(recorded):.0f} N: the plates were set to zero "
        "under the person; record again, with the plates set to zero while nobody stands on them"
    )
