"""Whether loads and prefixes of study.toml fit the study: nothing named that is not there."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Mapping, Sequence

from bsip_cli.body.skeleton import Skeleton
from bsip_cli.config import Load
from bsip_cli.errors import UsageError
from bsip_cli.study.study import Study

_REMEDY = "correct [[loads]] in study.toml"


def check_prefixes(prefixes: Mapping[str, str], study: Study) -> None:
    """Every prefix belongs to a participant of the study.

    Raises
    ------
    UsageError
        The first that does not, with the nearest known name.
    """
    known = [participant.id for participant in study.participants]
    _check_names("ingest.prefixes", prefixes, known, "correct [ingest] prefixes in study.toml")


def check_segments(loads: Sequence[Load], skeleton: Skeleton) -> None:
    """Every load sits on a segment of the skeleton that has mass.

    Raises
    ------
    UsageError
        The first load that does not, with the nearest known name.
    """
    for k, load in enumerate(loads):
        _check_names(f"loads.{k}.segment", [load.segment], skeleton.body_names)


def check_trials(loads: Sequence[Load], study: Study) -> None:
    """Every load is carried in some trial, and names nothing that the study does not have.

    Raises
    ------
    UsageError
        The first load that names an unknown participant, task or run, or that no trial carries.
    """
    trials = [trial for participant in study.participants for trial in participant.trials]
    participants = sorted({trial.participant_id for trial in trials})
    tasks = sorted({trial.task for trial in trials})
    runs = sorted({trial.run for trial in trials if trial.run is not None})
    for k, load in enumerate(loads):
        _check_names(f"loads.{k}.participants", load.participants, participants)
        _check_names(f"loads.{k}.tasks", load.tasks, tasks)
        _check_names(f"loads.{k}.runs", map(str, load.runs), [str(run) for run in runs])
        if not any(load.is_carried_in(t.participant_id, t.task, t.run) for t in trials):
            raise UsageError(
                f"loads.{k}: {load.mass_kg:g} kg on {load.segment} are carried in no recording",
                expected="participants, tasks and runs that some recording has together",
                remedy=_REMEDY,
            )


def _check_names(
    option: str, names: Iterable[str], known: Collection[str], remedy: str = _REMEDY
) -> None:
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1, cutoff=0.4)
            raise UsageError(
                f"{option}: there is no {name}" + (f" (did you mean {near[0]}?)" if near else ""),
                expected=f"one of {', '.join(known)}" if known else "none, no recording has any",
                remedy=remedy,
            )
