"""ingest, the session first: how the numbers of all its recordings are to be understood."""

from __future__ import annotations

from dataclasses import asdict, fields

import pandas as pd

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.assemble import findings_about
from bsip_cli.recordings.plate_reading import PlateReading
from bsip_cli.recordings.read import open_recording
from bsip_cli.recordings.settle import Scene, SessionReading, Survey, Verdict, settle_session
from bsip_cli.recordings.under_the_feet import Evidence
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import column_names
from bsip_cli.study.study import Trial


def run(unit: Unit) -> None:
    """Look at every recording of the participant; write readings, decided for each session."""
    assert unit.participant is not None
    rows: list[dict] = []
    for session in dict.fromkeys(trial.session for trial in unit.participant.trials):
        seen = [
            survey
            for trial in unit.participant.trials
            if trial.session == session and (survey := _survey(unit, trial)) is not None
        ]
        if not seen:
            continue
        reading = settle_session(seen)
        rows += _rows(session or "", reading)
        whose = f"{unit.name}, session {session}" if session else unit.name
        for finding in findings_about(reading):
            unit.warn(f"{whose}: {finding.sentence()}")
    unit.write("readings", pd.DataFrame(rows, columns=column_names("readings")))


def reading_of(unit: Unit, trial: Trial) -> SessionReading:
    """What the survey decided for the session of a trial."""
    table = unit.read("readings")
    rows = table[table["session"] == (trial.session or "")].to_dict("records")
    if not rows:
        return SessionReading()
    scene = Scene(rows[0]["mirrored"], int(rows[0]["axis"]))
    return SessionReading(scene, {row["plate"]: _verdict(row) for row in rows if row["plate"]})


def _survey(unit: Unit, trial: Trial) -> Survey | None:
    """None where the recording cannot be read: its own turn will say why."""
    try:
        opened = open_recording(trial.path)
    except BadDataError:
        return None
    return Survey.of(opened.with_plates(unit.config.ingest.plates))


# --- rows -------------------------------------------------------------------------------------

_EVIDENCE = tuple(field.name for field in fields(Evidence))


def _rows(session: str, reading: SessionReading) -> list[dict]:
    scene = {"session": session, "mirrored": reading.scene.mirrored, "axis": reading.scene.axis}
    plates = reading.plates or {"": Verdict()}
    return [scene | {"plate": name} | _row(verdict) for name, verdict in plates.items()]


def _row(verdict: Verdict) -> dict:
    reading = asdict(verdict.reading)
    nothing = float("nan")
    x, y, z = reading.pop("centre_m") or [nothing] * 3
    half_x, half_y = reading.pop("half_size_m") or [nothing] * 2
    row = reading | {
        "reversed_round": reading.pop("mirrored"),
        "centre_x_m": x,
        "centre_y_m": y,
        "centre_z_m": z,
        "half_size_x_m": half_x,
        "half_size_y_m": half_y,
        "refusal": verdict.refusal,
        "repeats": " ".join(verdict.repeats),
    }
    unknown = Evidence(*[nothing] * len(_EVIDENCE))
    for when, found in (("before", verdict.before), ("after", verdict.after)):
        row |= {f"{when}_{name}": value for name, value in asdict(found or unknown).items()}
    return row


def _verdict(row: dict) -> Verdict:
    centre = (row["centre_x_m"], row["centre_y_m"], row["centre_z_m"])
    half = (row["half_size_x_m"], row["half_size_y_m"])
    reading = PlateReading(
        moment_scale=row["moment_scale"],
        point_scale=row["point_scale"],
        about=row["about"],
        centre_m=None if pd.isna(centre[0]) else centre,
        turn=int(row["turn"]),
        mirrored=bool(row["reversed_round"]),
        sign=int(row["sign"]),
        place_of=row["place_of"],
        half_size_m=None if pd.isna(half[0]) else half,
    )
    before, after = (
        Evidence(*(row[f"{when}_{name}"] for name in _EVIDENCE)) for when in ("before", "after")
    )
    return Verdict(reading, before, after, row["refusal"], tuple(row["repeats"].split()))
