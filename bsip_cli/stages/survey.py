"""ingest, the session first: how the numbers of all its recordings are to be understood."""

from __future__ import annotations

from dataclasses import fields

import pandas as pd

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.body_motion import GateLimits
from bsip_cli.recordings.read import findings_about
from bsip_cli.recordings.scene import no_person
from bsip_cli.recordings.settle import settle_session
from bsip_cli.recordings.trial_samples import TrialSamples
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import column_names
from bsip_cli.stages.session_reading import opened, rows_of
from bsip_cli.study.study import Trial


def run(unit: Unit) -> None:
    """Look at every recording of the participant; write readings, decided for each session."""
    assert unit.participant is not None
    rows: list[dict] = []
    options = unit.config.ingest
    limits = GateLimits(**{one.name: getattr(options, one.name) for one in fields(GateLimits)})
    for session in dict.fromkeys(trial.session for trial in unit.participant.trials):
        seen = [
            survey
            for trial in unit.participant.trials
            if trial.session == session and (survey := _survey(unit, trial)) is not None
        ]
        if not seen:
            continue
        _require_size(unit, seen)
        reading = settle_session(seen, limits)
        rows += rows_of(session or "", reading)
        whose = f"{unit.name}, session {session}" if session else unit.name
        for finding in findings_about(reading):
            unit.warn(f"{whose}: {finding.sentence()}")
    unit.write("readings", pd.DataFrame(rows, columns=column_names("readings")))


def _require_size(unit: Unit, seen: list[TrialSamples]) -> None:
    """The markers are those of somebody as tall as stated, or as people are."""
    assert unit.participant is not None
    heights = [one.height_m for one in seen if one.height_m is not None]
    if heights and (fault := no_person(max(heights), unit.participant.height_m)):
        found, expected, remedy = fault
        raise BadDataError(found, file=unit.name, expected=expected, remedy=remedy)


def _survey(unit: Unit, trial: Trial) -> TrialSamples | None:
    """None where the recording cannot be read: its own turn will say why."""
    try:
        return TrialSamples.of(opened(unit, trial))
    except BadDataError:
        return None
