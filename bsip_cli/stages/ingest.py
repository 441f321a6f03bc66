"""ingest: a recording as markers and ground wrench in SI units and one world frame."""

from __future__ import annotations

from dataclasses import asdict, replace
from shlex import quote

import numpy as np
import pandas as pd

from bsip_cli.body.markersets import load_marker_set
from bsip_cli.errors import BadDataError
from bsip_cli.recordings import momentum_mass
from bsip_cli.recordings.c3d_person import against_table
from bsip_cli.recordings.contacts import (
    Contacts,
    agreeing_mass,
    contact_windows,
    foot_contacts,
)
from bsip_cli.recordings.gaps import FilledMarkers, fill_gaps
from bsip_cli.recordings.labels import match_labels
from bsip_cli.recordings.marker_guess import guess_marker_set, with_numbers_placed, with_pairs_named
from bsip_cli.recordings.measured_mass import (
    differing_plates,
    least_mass,
    mass_finding,
    measured_mass,
)
from bsip_cli.recordings.model import Finding, Plate, Recording
from bsip_cli.recordings.plate_wrench import plates_at_marker_rate, without_zeros
from bsip_cli.recordings.read import assemble
from bsip_cli.recordings.session_findings import findings_about
from bsip_cli.running.unit import Unit
from bsip_cli.segments import SEGMENTS, TRUNK
from bsip_cli.stages.frames import WRENCH, XYZ, columns
from bsip_cli.stages.person_mass import VAGUE_PERCENT, StatedMass, compared, stated_mass
from bsip_cli.stages.survey import opened, prefix_of, reading_of


def run(unit: Unit) -> None:
    """Read one recording; write markers, wrench, plates, contacts and quality."""
    session = reading_of(unit.read("readings"), unit.facts("readings"), unit.own_trial)
    recording = assemble(opened(unit, unit.own_trial, session.written, session.gains()), session)
    prefix, seen = prefix_of(unit), np.isfinite(recording.markers_m[..., 0]).any(axis=0)
    about_set: tuple[Finding, ...] = ()
    if unit.config.marker_set == "auto":
        source = quote(str(unit.own_trial.path))
        guess = guess_marker_set(recording.labels, prefix, source)
        marker_set, about_set = guess.marker_set, guess.findings()
    else:
        marker_set = load_marker_set(unit.config.marker_set)
    seen_as = recording.labels, recording.markers_m
    marker_set, placed = with_numbers_placed(*seen_as, marker_set, prefix)
    labels, paired = with_pairs_named(*seen_as, marker_set, prefix)
    recording = replace(recording, labels=labels)
    how = {"optional": marker_set.optional(), "seen": seen, "prefix": prefix}
    match = match_labels(recording.labels, marker_set.wanted(), **how)
    names = [marker.label for marker in marker_set.markers if marker.label in match.index]
    _require(unit, names, recording)
    findings = [*recording.findings, *about_set, *placed, *paired, *match.findings]
    zeros: dict[str, list[float]] = {}
    if unit.config.ingest.zero_unloaded_plates:
        recording, zeroed, zeros = without_zeros(recording)
        findings += zeroed
    segment = {marker.label: marker.segment for marker in marker_set.markers}
    segments = [segment[name] for name in names]
    positions = recording.markers_m[:, [match.index[name] for name in names]]
    groups = [np.flatnonzero(np.equal(segments, one)).tolist() for one in dict.fromkeys(segments)]
    longest = unit.config.ingest.max_gap_s, unit.config.ingest.max_rigid_gap_s
    filled = fill_gaps(positions, recording.marker_rate_hz, groups, *longest)
    findings += _gap_findings(names, filled)
    plates = plates_at_marker_rate(recording)
    stated = asdict(recording.stated)
    rates = {name: getattr(recording, name) for name in ("marker_rate_hz", "analog_rate_hz")}
    facts = {"marker_set": marker_set.name} | rates
    person = {f"stated_{name}": stated[name] for name in ("mass_kg", "height_m", "sex")}
    contacts, intervals, about_mass, apart = _contacts(
        unit, recording, filled.markers_m, segments, plates, stated_mass(unit, person)
    )
    table, tolerance = unit.person, unit.config.ingest.mass_tolerance_percent
    stated_otherwise = against_table(recording.stated, table.mass_kg, table.height_m, tolerance)
    why, taken = recording.forces_note, "took the markers alone; no frame is compared"
    expected = "a force on the person"
    without = [Finding("forces", "", why, expected, taken, "excluded")] if why else []
    findings = [*about_mass, *without, *findings, *contacts.reasons, *stated_otherwise]
    said = findings_about(session)  # once, of all trials
    for finding in findings:
        if finding.level in ("warning", "excluded", "corrected") and finding not in said:
            unit.say(finding.sentence())
    times = recording.time_s()
    meant = {"marker_set_content": marker_set.as_data()}
    unit.write("markers", _marker_table(times, names, filled), facts | meant | person)
    stretches = [one.record() for one in intervals]
    said_apart = [f"plate {one.subject} contradicts another: {one.found}" for one in apart]
    known = {"mass_stretches": stretches, "plates_apart": said_apart, "zeros": zeros}
    unit.write("wrench", _wrench_table(times, plates, contacts), facts | known)
    corners = [
        {"plate": plate.name, "corner": k} | dict(zip(XYZ, corner, strict=True))
        for plate in recording.plates
        if plate.corners_m is not None
        for k, corner in enumerate(plate.corners_m, start=1)
    ]
    unit.write("plates", corners)
    unit.write("contacts", _contact_table(times, contacts))
    used = Finding("marker_set", "", marker_set.name, "", marker_set.description, "info")
    unit.write("quality", [asdict(finding) for finding in (used, *findings)])


def _require(unit: Unit, names: list[str], recording: Recording) -> None:
    if recording.labels and not np.isfinite(recording.markers_m).any():
        raise BadDataError(
            f"all {len(recording.labels)} markers are missing or marked invalid in every frame",
            file=unit.name,
            expected="positions of markers",
            remedy="reconstruct the trial and export it again",
        )
    if not names:
        raise BadDataError(
            "none of the marker set's labels is in the file",
            file=unit.name,
            expected="the labels of the marker set",
            remedy="name the right marker set in study.toml",
        )


def _contacts(
    unit: Unit,
    recording: Recording,
    markers_m: np.ndarray,
    segments: list[str],
    plates: tuple[Plate, ...],
    stated: StatedMass | None,
) -> tuple[Contacts, tuple[momentum_mass.Interval, ...], list[Finding], list[Finding]]:
    """When what is on the plates, the intervals that show the mass, what is said of that, and of
    that what plates say against each other; markers_m (N, m, 3) on segments (m)."""
    rate_hz, trunk = recording.marker_rate_hz, markers_m[:, np.isin(segments, TRUNK)]
    markers = {one: markers_m[:, np.equal(segments, one)] for one in SEGMENTS}
    own = {side: markers[f"foot_{side}"] for side in "lr" if markers[f"foot_{side}"].shape[1]}
    feet = foot_contacts(own, rate_hz, plates, recording.n_frames, recording.time0_s)
    intervals = momentum_mass.intervals_of(markers, feet.total_N, feet.surely_measured, rate_hz)
    mass, stands_kg, about_mass = _mass_on_plates(unit, stated, intervals)
    alone = momentum_mass.intervals_alone(markers, feet, plates, rate_hz)
    stated_kg = None if stated is None else stated.mass_kg + unit.load_kg()
    apart = differing_plates(alone, stated_kg, unit.config.ingest.mass_gross_percent)
    if mass is None:
        loaded = feet.valid & momentum_mass.upright_frames(markers)
        mass = agreeing_mass(feet.total_N, trunk, loaded, rate_hz)
    reach = momentum_mass.body_reach_m_s2(markers, rate_hz)
    contacts = contact_windows(feet, trunk, mass, rate_hz, stands_kg, reach)
    return contacts, intervals, [*about_mass, *apart], apart


def _mass_on_plates(
    unit: Unit, stated: StatedMass | None, intervals: tuple[momentum_mass.Interval, ...]
) -> tuple[float | None, float | None, list[Finding]]:
    """The mass [kg] on the plates, known loads included (the stated one, unless the plates surely
    show a grossly different one), what the trial's plates show for sure, and what is said of both.
    """
    options = unit.config.ingest
    height_m = unit.person.height_m if stated is None else None
    measured = measured_mass({unit.name: intervals}, options.mass_half_width_percent, height_m)
    if stated is not None and not measured.is_known:
        measured = measured_mass({unit.name: intervals}, VAGUE_PERCENT)
        least = least_mass(intervals, VAGUE_PERCENT)
        more = compared(unit, stated, least, unit.load_kg())
        if not measured.is_known and more and more.is_gross and more.difference_percent > 0:
            measured = least
    comparison = compared(unit, stated, measured, unit.load_kg())
    about = [mass_finding(measured, comparison, stated.source if stated else "")]
    from_plates = stated is None or (comparison is not None and comparison.is_gross)
    measured_kg = measured.mass_kg if measured.is_known else None
    if from_plates:
        return measured_kg, measured_kg, about
    assert stated is not None
    return stated.mass_kg + unit.load_kg(), measured_kg, about


def _gap_findings(names: list[str], filled: FilledMarkers) -> list[Finding]:
    findings, is_open = [], ~np.isfinite(filled.markers_m[..., 0])
    every = (filled.filled, is_open, filled.rigid)
    counts = zip(*(one.sum(axis=0).tolist() for one in every), strict=True)
    for name, (closed, left, rigid) in zip(names, counts, strict=True):
        if closed or left:
            found = f"{closed + left} of {len(is_open)} frames missing"
            action = f"{rigid} filled by the segment's other markers, {closed - rigid} by a spline"
            action += f", {left} left open"
            findings.append(Finding("marker_gaps", name, found, "every frame", action, "info"))
    return findings


# --- tables -----------------------------------------------------------------------------------


def _marker_table(times: np.ndarray, names: list[str], filled: FilledMarkers) -> pd.DataFrame:
    labels = np.tile(np.array(names, dtype=object), len(times))
    table = {"time_s": np.repeat(times, len(names)), "marker": labels}
    table |= columns(XYZ, filled.markers_m.reshape(-1, 3))
    return pd.DataFrame(table | {"filled": filled.filled.ravel()})


def _wrench_table(times: np.ndarray, plates: tuple[Plate, ...], contacts: Contacts) -> pd.DataFrame:
    nothing = np.full((len(times), 6), np.nan)
    total = np.sum([plate.wrench for plate in plates], axis=0) if plates else nothing
    table = {"time_s": times} | columns(WRENCH, total) | {"valid": contacts.valid}
    for plate in plates:
        table |= columns([f"plate{plate.name}_{c}" for c in WRENCH], plate.wrench)
    return pd.DataFrame(table)


def _contact_table(times: np.ndarray, contacts: Contacts) -> pd.DataFrame:
    table, nothing = {"time_s": times}, np.zeros(len(times), dtype=bool)
    for side, name in (("l", "left"), ("r", "right")):
        table[f"{name}_on_ground"] = contacts.on_ground.get(side, nothing)
        table[f"{name}_on_plate"] = contacts.on_plate.get(side, nothing)
    return pd.DataFrame(table | {"valid": contacts.valid})
