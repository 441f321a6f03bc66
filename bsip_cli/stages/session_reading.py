"""A session's reading as rows of the artifact `readings`, and back."""

from __future__ import annotations

from dataclasses import asdict, fields

import pandas as pd

from bsip_cli.recordings.plate_reading import FrameChange, PlateReading
from bsip_cli.recordings.plate_source import Opened
from bsip_cli.recordings.read import open_recording
from bsip_cli.recordings.settle import SessionReading, Verdict
from bsip_cli.recordings.under_the_feet import Evidence
from bsip_cli.running.unit import Unit
from bsip_cli.study.study import Trial

_CENTRE = ("centre_x_m", "centre_y_m", "centre_z_m")
_HALF = ("half_size_x_m", "half_size_y_m")
_EVIDENCE = tuple(field.name for field in fields(Evidence))


def opened(unit: Unit, trial: Trial) -> Opened:
    """A trial's recording, of the plates that count."""
    found: Opened = unit.recordings.get(trial.stem) or open_recording(trial.path)
    return found.with_plates(unit.config.ingest.plates)


def rows_of(session: str, reading: SessionReading) -> list[dict]:
    """One row per plate; one without a name where none was loaded."""
    frame = {"session": session, **asdict(reading.frame)}
    plates = reading.plates or {"": Verdict()}
    return [frame | {"plate": name} | _row(verdict) for name, verdict in plates.items()]


def _row(verdict: Verdict) -> dict:
    reading = asdict(verdict.reading)
    centre = reading.pop("centre_m") or [float("nan")] * 3
    half = reading.pop("half_size_m") or [float("nan")] * 2
    row = reading | {
        "reversed_round": reading.pop("mirrored"),
        **dict(zip(_CENTRE, centre, strict=True)),
        **dict(zip(_HALF, half, strict=True)),
        "refusal": verdict.refusal,
        "rivals": "|".join(verdict.rivals),
        "doubted": verdict.doubted,
        "repeats": " ".join(verdict.repeats),
    }
    unknown = Evidence(*[float("nan")] * len(_EVIDENCE))
    for when, found in (("before", verdict.before), ("after", verdict.after)):
        row |= {f"{when}_{name}": value for name, value in asdict(found or unknown).items()}
    return row


def _verdict(row: dict) -> Verdict:
    centre, half = (tuple(row[name] for name in names) for names in (_CENTRE, _HALF))
    as_written = ("moment_scale", "point_scale", "about", "place_of", "reversed_channel")
    reading = PlateReading(
        **{name: row[name] for name in as_written},
        centre_m=None if pd.isna(centre[0]) else centre,
        turn=int(row["turn"]),
        mirrored=bool(row["reversed_round"]),
        sign=int(row["sign"]),
        half_size_m=None if pd.isna(half[0]) else half,
    )
    before, after = (
        Evidence(*(row[f"{when}_{name}"] for name in _EVIDENCE)) for when in ("before", "after")
    )
    rivals, repeats = tuple(filter(None, row["rivals"].split("|"))), tuple(row["repeats"].split())
    return Verdict(reading, before, after, row["refusal"], rivals, row["doubted"], repeats)


def reading_of(unit: Unit, trial: Trial) -> SessionReading:
    """What the survey decided for the session of a trial."""
    table = unit.read("readings")
    rows = table[table["session"] == (trial.session or "")].to_dict("records")
    if not rows:
        return SessionReading()
    first = rows[0]
    frame = FrameChange(
        first["moved"],
        int(first["axis"]),
        first["turned_deg"],
        first["turned_sd_deg"],
        first["unsure_m"],
        bool(first["corners_only"]),
    )
    return SessionReading(frame, {row["plate"]: _verdict(row) for row in rows if row["plate"]})
