"""ingest: a recording as markers and ground wrench in SI units and one world frame."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pandas as pd

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.markersets import MarkerSet, load_marker_set
from bsip_cli.body.names import TRUNK
from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_person import against_table
from bsip_cli.recordings.contacts import ContactWindows, contact_windows, plate_loads
from bsip_cli.recordings.free_plates import nobody_near
from bsip_cli.recordings.gaps import FilledMarkers, fill_gaps
from bsip_cli.recordings.labels import match_labels
from bsip_cli.recordings.marker_guess import guess_marker_set
from bsip_cli.recordings.model import Finding, Recording
from bsip_cli.recordings.read import read_recording
from bsip_cli.recordings.repeated_frames import without_repeats
from bsip_cli.recordings.resample import FrameWrench, wrench_at_marker_rate
from bsip_cli.recordings.standing_mass import about_mass, plate_mass
from bsip_cli.recordings.zero import plate_zero, subtract_zero
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import WRENCH


def run(unit: Unit) -> None:
    """Read one recording; write markers, wrench, plates, contacts and quality."""
    assert unit.trial is not None
    recording = _chosen_plates(unit, read_recording(unit.trial.path))
    marker_set = _marker_set(unit, recording)
    match = match_labels(
        recording.labels,
        marker_set.wanted(),
        optional=marker_set.optional(),
        seen=np.isfinite(recording.markers_m[..., 0]).any(axis=0),
        prefix=_prefix(unit),
    )
    names = [marker.label for marker in marker_set.markers if marker.label in match.index]
    _require(unit, names)
    recording, repeats = without_repeats(recording)
    findings = [*recording.findings, *match.findings, *repeats]
    if unit.config.ingest.zero_unloaded_plates:
        recording, zeroed = _without_zero(recording)
        findings += zeroed
    filled = _fill(unit, recording, marker_set, names, match.index)
    findings += _gap_findings(names, filled)
    wrench = wrench_at_marker_rate(recording)
    trunk = _markers_on(marker_set, names, filled, TRUNK)
    contacts = _contacts(unit, recording, marker_set, names, filled, wrench)
    findings += contacts.reasons
    findings += _mass_findings(unit, recording, wrench, contacts, trunk)
    findings += _stated_otherwise(unit, recording)
    if recording.forces_note:
        unit.warn(f"{unit.name}: kinematics only: {recording.forces_note}")
    for finding in findings:
        if finding.level in ("warning", "excluded", "corrected"):
            unit.warn(f"{unit.name}: {_sentence(finding)}")
    times = recording.time_s()
    facts = {
        "marker_set": marker_set.name,
        "marker_rate_hz": recording.marker_rate_hz,
        "analog_rate_hz": recording.analog_rate_hz,
    }
    said = asdict(recording.stated)
    stated = {f"stated_{name}": said[name] for name in ("mass_kg", "height_m", "sex")}
    unit.write("markers", _marker_table(times, names, filled), facts | stated)
    unit.write("wrench", _wrench_table(times, wrench, contacts), facts)
    unit.write("plates", _plate_table(recording))
    unit.write("contacts", _contact_table(times, contacts))
    unit.write("quality", _quality_table(marker_set, findings))


def _chosen_plates(unit: Unit, recording: Recording) -> Recording:
    wanted = unit.config.ingest.plates
    if not wanted:
        return recording
    chosen = tuple(plate for plate in recording.plates if plate.name in map(str, wanted))
    return replace(recording, plates=chosen)


def _without_zero(recording: Recording) -> tuple[Recording, list[Finding]]:
    done = [
        subtract_zero(
            plate,
            plate_zero(plate, recording.analog_rate_hz, surely_free=nobody_near(recording, plate)),
        )
        for plate in recording.plates
    ]
    return replace(recording, plates=tuple(plate for plate, _ in done)), [f for _, f in done]


def _prefix(unit: Unit) -> str:
    assert unit.participant is not None
    return unit.config.ingest.prefixes.get(unit.participant.id, "")


def _marker_set(unit: Unit, recording: Recording) -> MarkerSet:
    if unit.config.marker_set != "auto":
        return load_marker_set(unit.config.marker_set)
    return guess_marker_set(recording.labels)


def _require(unit: Unit, names: list[str]) -> None:
    if not names:
        raise BadDataError(
            "none of the marker set's labels is in the file",
            file=unit.name,
            expected="the labels of the marker set",
            remedy="name the right marker set in study.toml",
        )


def _segment_of(marker_set: MarkerSet) -> dict[str, str]:
    return {marker.label: marker.segment for marker in marker_set.markers}


def _fill(unit, recording, marker_set, names, index) -> FilledMarkers:
    positions = recording.markers_m[:, [index[name] for name in names]]
    segment = _segment_of(marker_set)
    groups: dict[str, list[int]] = {}
    for k, name in enumerate(names):
        groups.setdefault(segment[name], []).append(k)
    options = unit.config.ingest
    return fill_gaps(
        positions,
        recording.marker_rate_hz,
        list(groups.values()),
        options.max_gap_s,
        options.max_rigid_gap_s,
    )


def _markers_on(
    marker_set: MarkerSet, names: list[str], filled: FilledMarkers, segments: tuple[str, ...]
) -> np.ndarray:
    """The markers of some segments, (n_frames, k, 3)."""
    segment = _segment_of(marker_set)
    return filled.markers_m[:, [k for k, n in enumerate(names) if segment[n] in segments]]


def _contacts(unit, recording, marker_set, names, filled, wrench: FrameWrench) -> ContactWindows:
    feet = {side: _markers_on(marker_set, names, filled, (f"foot_{side}",)) for side in "lr"}
    feet = {side: markers for side, markers in feet.items() if markers.shape[1]}
    return contact_windows(
        feet,
        dict.fromkeys(feet),
        recording.marker_rate_hz,
        plate_loads(recording, wrench),
        _markers_on(marker_set, names, filled, TRUNK),
        _mass_kg(unit, wrench),
    )


def _mass_findings(
    unit: Unit,
    recording: Recording,
    wrench: FrameWrench,
    contacts: ContactWindows,
    trunk_markers_m: np.ndarray,
) -> list[Finding]:
    """The plates' reading of the person's mass against the stated one, with known loads."""
    assert unit.participant is not None
    carried = plate_mass(
        wrench.total[:, 2], contacts.valid, trunk_markers_m, recording.marker_rate_hz
    )
    stated = unit.participant.mass_kg
    expected = None if stated is None else stated + unit.load_kg()
    finding = about_mass(carried, expected, unit.config.ingest.mass_tolerance_percent)
    return [finding] if finding else []


def _stated_otherwise(unit: Unit, recording: Recording) -> list[Finding]:
    """Where the file states another person than participants.tsv."""
    assert unit.participant is not None
    mass_kg, height_m = unit.participant.mass_kg, unit.participant.height_m
    tolerance = unit.config.ingest.mass_tolerance_percent
    return against_table(recording.stated, mass_kg, height_m, tolerance)


def _mass_kg(unit: Unit, wrench: FrameWrench) -> float:
    """Mass on the plates: stated mass and known loads, or what the plates carry in mid-trial."""
    assert unit.participant is not None
    if unit.participant.mass_kg is not None:
        return unit.participant.mass_kg + unit.load_kg()
    vertical = wrench.total[:, 2]
    loaded = vertical[vertical > 100.0]
    return float(np.median(loaded) / GRAVITY_M_S2) if len(loaded) else 70.0


def _gap_findings(names: list[str], filled: FilledMarkers) -> list[Finding]:
    findings = []
    is_open = ~np.isfinite(filled.markers_m[..., 0])
    for k, name in enumerate(names):
        closed, left = int(filled.filled[:, k].sum()), int(is_open[:, k].sum())
        if closed or left:
            rigid = int(filled.rigid[:, k].sum())
            found = f"{closed + left} of {len(is_open)} frames missing"
            action = (
                f"{rigid} filled by the segment's other markers, {closed - rigid} by a spline, "
                f"{left} left open"
            )
            findings.append(Finding("marker_gaps", name, found, "every frame", action, "info"))
    return findings


def _sentence(finding: Finding) -> str:
    subject = f" {finding.subject}" if finding.subject else ""
    expected = f" (expected {finding.expected})" if finding.expected else ""
    check = finding.check.replace("_", " ")
    return f"{check}{subject}: {finding.found}{expected}; {finding.action}"


# --- tables -----------------------------------------------------------------------------------


def _marker_table(times: np.ndarray, names: list[str], filled: FilledMarkers) -> pd.DataFrame:
    positions = filled.markers_m.reshape(-1, 3)
    return pd.DataFrame(
        {
            "time_s": np.repeat(times, len(names)),
            "marker": np.tile(np.array(names, dtype=object), len(times)),
            "x_m": positions[:, 0],
            "y_m": positions[:, 1],
            "z_m": positions[:, 2],
            "filled": filled.filled.ravel(),
        }
    )


def _wrench_table(times, wrench: FrameWrench, contacts: ContactWindows) -> pd.DataFrame:
    total = wrench.total if len(wrench.names) else np.full((len(times), 6), np.nan)
    table = pd.DataFrame(total, columns=WRENCH)
    table.insert(0, "time_s", times)
    table["valid"] = contacts.valid
    for name, rows in zip(wrench.names, wrench.per_plate, strict=True):
        for k, column in enumerate(WRENCH):
            table[f"plate{name}_{column}"] = rows[:, k]
    return table


def _plate_table(recording: Recording) -> pd.DataFrame:
    rows = [
        (plate.name, k + 1, *corner)
        for plate in recording.plates
        if plate.corners_m is not None
        for k, corner in enumerate(plate.corners_m)
    ]
    table = pd.DataFrame(rows, columns=["plate", "corner", "x_m", "y_m", "z_m"])
    return table.astype({"plate": object, "corner": int, "x_m": float, "y_m": float, "z_m": float})


def _contact_table(times: np.ndarray, contacts: ContactWindows) -> pd.DataFrame:
    table = {"time_s": times}
    for side, name in (("l", "left"), ("r", "right")):
        nothing = np.zeros(len(times), dtype=bool)
        table[f"{name}_on_ground"] = contacts.on_ground.get(side, nothing)
        table[f"{name}_on_plate"] = contacts.on_plate.get(side, nothing)
    table["valid"] = contacts.valid
    return pd.DataFrame(table)


def _quality_table(marker_set: MarkerSet, findings: list[Finding]) -> pd.DataFrame:
    known = Finding("marker_set", "", marker_set.name, "", marker_set.description, "info")
    columns = ["check", "subject", "found", "expected", "action", "level"]
    rows = [[getattr(finding, name) for name in columns] for finding in (known, *findings)]
    return pd.DataFrame(rows, columns=columns)
