"""ingest, the session first: how the numbers of all its recordings are to be understood.

Written as rows of ``readings``, and read back for each trial.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from functools import partial
from typing import Any

import pandas as pd

from bsip_cli.errors import BadDataError
from bsip_cli.files.fingerprints import file_hash
from bsip_cli.recordings.body_motion import GateLimits
from bsip_cli.recordings.gaps import without_repeats
from bsip_cli.recordings.label_words import bones
from bsip_cli.recordings.labels import person_of
from bsip_cli.recordings.measured_mass import plate_gains
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.momentum_mass import Interval
from bsip_cli.recordings.one_person import other_bodies
from bsip_cli.recordings.plate_reading import FrameChange, Opened, PlateReading
from bsip_cli.recordings.read import assemble, masses_alone, open_recording
from bsip_cli.recordings.scene import Stature, no_person
from bsip_cli.recordings.session_findings import findings_about
from bsip_cli.recordings.session_reading import SessionReading, Verdict, reading_of_files
from bsip_cli.recordings.shared_forces import same_movements
from bsip_cli.recordings.trial_samples import TrialSamples
from bsip_cli.recordings.under_the_feet import Evidence
from bsip_cli.recordings.written import AS_WRITTEN, Written
from bsip_cli.running.unit import Unit
from bsip_cli.study.study import Trial

_EVIDENCE = tuple(field.name for field in fields(Evidence))
_CENTRE = ("centre_x_m", "centre_y_m", "centre_z_m")
_SCALES = ("moment_scales", "point_scales")
_ODD = ("of_others", "twins", "odd", "against")
_OF_TRIALS = ("delays_s", "drifts_s", "paces", "maybe_paces", *_ODD, *_SCALES)
NO_GAINS: Mapping[str, float] = {}
_HALF = ("half_size_x_m", "half_size_y_m")
_NO_TEST = "what is found in one is no test of the other; remove one of them"


def run(unit: Unit) -> None:
    """Look at every recording of the participant; write readings, decided for each session."""
    rows: list[dict[str, object]] = []
    facts = facts_of(SessionReading(), [])
    options = unit.config.ingest
    limits = GateLimits(**{one.name: getattr(options, one.name) for one in fields(GateLimits)})
    copies = _say_copies(unit, unit.person.trials)
    every: list[TrialSamples] = []
    for session in dict.fromkeys(trial.session for trial in unit.person.trials):
        mine = [trial for trial in unit.person.trials if trial.session == session]
        seen = _surveyed(unit, mine, limits)
        if not seen:
            continue
        every += [one for one in seen if one.name not in copies]
        heights = [one.height_m for one in seen if one.height_m is not None]
        if heights and (fault := no_person(max(heights), unit.person.height_m)):
            found, expected, remedy = fault
            raise BadDataError(found, file=unit.name, expected=expected, remedy=remedy)
        # where the height that participants.tsv states, or else a recording, is not the markers'
        in_files = (one.stated_height_m for one in seen if one.stated_height_m is not None)
        stated_m = unit.person.height_m or next(in_files, None)
        usual = Stature.of_all([one.stature for one in seen])
        if stated_m is not None and usual is not None and (wrong := usual.against(stated_m)):
            unit.say(Finding("stated_person", "", *wrong, "warning").sentence())
        if said := other_bodies({one.name: one.sizes for one in seen}):
            unit.say(said)
        stated = unit.person.mass_kg, unit.person.height_m, options.mass_gross_percent
        read = partial(_surveyed, unit, mine, limits)
        reading = reading_of_files(seen, read, *stated, limits)
        if gains := _gains(unit, mine, reading):
            read = partial(_surveyed, unit, mine, limits, gains=gains)
            reading = reading_of_files(read(), read, *stated, limits).with_gains(gains)
        rows += rows_of(session or "", reading)
        for name, of_trials in facts_of(reading, [one.name for one in seen]).items():
            facts[name] |= of_trials
        whose = f"{unit.name}, session {session}" if session else unit.name
        for finding in findings_about(reading):
            unit.warn(f"{whose}: {finding.sentence()}")
    for first, again in same_movements([(one.name, one.course) for one in every]):
        unit.say(
            f"{again} has the forces of {first}, or of a part of it, and moves alike: one "
            f"recording exported twice, or one has the other's forces; {_NO_TEST}"
        )
    unit.write("readings", rows, facts)


def _gains(unit: Unit, trials: Sequence[Trial], reading: SessionReading) -> dict[str, float]:
    """Of plates that surely read another force than the load; with known loads in some trials no
    masses agree, and none is sure."""
    if sum(not (one.refusal or one.repeats) for one in reading.plates.values()) < 2:
        return {}
    shown: dict[str, dict[str, Sequence[Interval]]] = {}
    masses = [unit.person.mass_kg]
    for trial in trials:
        try:
            recording = assemble(opened(unit, trial, reading.written), reading)
        except BadDataError:  # its own turn will say why
            continue
        masses.append(recording.stated.mass_kg)
        for plate, intervals in masses_alone(recording).items():
            shown.setdefault(plate, {})[trial.stem] = intervals
    options, stated_kg = unit.config.ingest, next((kg for kg in masses if kg is not None), None)
    limits = options.mass_half_width_percent, options.mass_tolerance_percent
    return plate_gains(shown, stated_kg, *limits, options.mass_gross_percent)


def _say_copies(unit: Unit, trials: Sequence[Trial]) -> set[str]:
    """One movement under two names would be held out from itself; the names of copies."""
    first: dict[str, Trial] = {}
    copies = set()
    for trial in trials:
        try:
            content = file_hash(trial.path)
        except BadDataError:  # in memory, or not readable, which its own turn will say
            continue
        one = first.setdefault(content, trial)
        if one is not trial:
            copies.add(trial.stem)
            unit.say(f"{trial.path.name} is a copy of {one.path.name}: {_NO_TEST}")
    return copies


def _surveyed(
    unit: Unit,
    trials: Sequence[Trial],
    limits: GateLimits,
    written: Written = AS_WRITTEN,
    gains: Mapping[str, float] = NO_GAINS,
) -> list[TrialSamples]:
    """Of the recordings that can be read; of the others their own turn will say why."""
    seen = []
    for trial in trials:
        try:
            found = opened(unit, trial, written, gains)
        except BadDataError:
            continue
        one = TrialSamples.of(found, limits)
        if one.height_m is not None and no_person(one.height_m, unit.person.height_m):
            try:
                person_of(found.recording.labels, bones, prefix_of(unit))
            except BadDataError as two:  # people are no giant
                raise BadDataError(
                    two.found, expected=two.expected, remedy=two.remedy, file=trial.path
                ) from two
        seen.append(one)
    return seen


# --- to rows and back -------------------------------------------------------------------------


def opened(
    unit: Unit, trial: Trial, written: Written = AS_WRITTEN, gains: Mapping[str, float] = NO_GAINS
) -> Opened:
    """A trial's recording, of the plates that count and of the person whose markers do, without
    positions that repeat the last one."""
    found: Opened = unit.recordings.get(trial.stem) or open_recording(trial.path)
    found = found.as_written(written).with_gains(gains)
    if prefix := prefix_of(unit):
        recording = found.recording
        own = sorted(person_of(recording.labels, bones, prefix).names)
        labels = tuple(recording.labels[k] for k in own)
        recording = replace(recording, labels=labels, markers_m=recording.markers_m[:, own])
        found = replace(found, recording=recording)
    recording, repeats = without_repeats(found.recording)
    recording = replace(recording, findings=(*recording.findings, *repeats))
    return replace(found, recording=recording).with_plates(unit.config.ingest.plates)


def prefix_of(unit: Unit) -> str:
    """What the participant's labels begin with where a file holds several people."""
    return unit.config.ingest.prefixes.get(unit.person.id, "")


def rows_of(session: str, reading: SessionReading) -> list[dict[str, object]]:
    """One row per plate; one without a name where none was loaded."""
    frame = {"session": session, **asdict(reading.frame)}
    plates = reading.plates or {"": Verdict()}
    return [frame | {"plate": name} | _row(verdict) for name, verdict in plates.items()]


def facts_of(reading: SessionReading, trials: Sequence[str]) -> dict[str, dict[str, float | str]]:
    """Of a session of these ``trials``: by name, and then by trial, what is not of a plate."""
    written = {
        name: dict.fromkeys(trials if value != 1.0 else [], value)
        for name, value in asdict(reading.written).items()
    }
    return {name: dict(getattr(reading, name)) for name in _OF_TRIALS} | written


def _row(verdict: Verdict) -> dict[str, object]:
    row, nothing = asdict(verdict.reading), float("nan")
    places = *(row.pop("centre_m") or [nothing] * 3), *(row.pop("half_size_m") or [nothing] * 2)
    row |= {"reversed_round": row.pop("mirrored"), "refusal": verdict.refusal}
    row |= dict(zip((*_CENTRE, *_HALF), places, strict=True)) | {"doubted": verdict.doubted}
    row |= {"gain": verdict.gain}
    row |= {"rivals": "|".join(verdict.alternatives), "repeats": " ".join(verdict.repeats)}
    unknown = Evidence(*[nothing] * len(_EVIDENCE))
    for when, found in (("before", verdict.before), ("after", verdict.after)):
        row |= {f"{when}_{name}": value for name, value in asdict(found or unknown).items()}
    return row


def _verdict(row: Mapping[Any, Any]) -> Verdict:
    centre, half = (tuple(row[name] for name in names) for names in (_CENTRE, _HALF))
    same = ("moment_scale", "point_scale", "about", "place_of", "channels")
    known = {name: row[name] for name in same} | {"mirrored": bool(row["reversed_round"])}
    known |= {"turn": int(row["turn"]), "sign": int(row["sign"])}
    known |= {"centre_m": None if pd.isna(centre[0]) else centre}
    reading = PlateReading(**known, half_size_m=None if pd.isna(half[0]) else half)
    before, after = (
        Evidence(*(row[f"{when}_{name}"] for name in _EVIDENCE)) for when in ("before", "after")
    )
    others, repeats = filter(None, row["rivals"].split("|")), row["repeats"].split()
    said = {name: row[name] for name in ("refusal", "doubted", "gain")}
    said |= {"alternatives": tuple(others), "repeats": tuple(repeats)}
    return Verdict(reading, before, after, **said)


def reading_of(table: pd.DataFrame, facts: Mapping[str, Any], trial: Trial) -> SessionReading:
    """What the survey decided, by its ``readings`` and their facts, for a trial's session."""
    rows = table[table["session"] == (trial.session or "")].to_dict("records")
    if not rows:
        return SessionReading()
    first = rows[0]
    known = {name: first[name] for name in ("moved", "turned_deg", "turned_sd_deg", "unsure_m")}
    axis, is_of_corners = int(first["axis"]), bool(first["corners_only"])
    frame = FrameChange(**known, axis=axis, corners_only=is_of_corners)
    plates = {row["plate"]: _verdict(row) for row in rows if row["plate"]}
    written = {name: facts[name].get(trial.stem, 1.0) for name in asdict(AS_WRITTEN)}
    mine = trial.stem.partition("_task-")[0]  # person and session
    of_trials: dict[str, Any] = {
        name: {k: value for k, value in facts[name].items() if k.partition("_task-")[0] == mine}
        for name in _OF_TRIALS
    }
    return SessionReading(frame, plates, **of_trials, written=Written(**written))
