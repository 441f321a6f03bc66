"""Sessions to scores: record them, run the command line, compare."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from tests.blind.blind_cases import Session
from tests.blind.blind_running import (
    Recorded,
    cpu_seconds,
    record_study,
    run_pipeline,
    write_atomically,
)
from tests.blind.blind_scoring import Score, score, score_of_clean_trial

Pipeline = Callable[[Path, Sequence[str], int], list[str]]


@dataclass(frozen=True)
class Batch:
    """What became of some sessions. cpu_s : of their recordings, and of the stages."""

    scores: tuple[Score, ...]
    problems: tuple[str, ...]
    cpu_s: tuple[float, float]


def run_batch(
    sessions: Sequence[Session],
    folder: Path,
    stages: Sequence[str],
    jobs: int,
    pipeline: Pipeline = run_pipeline,
) -> Batch:
    """Answers to all cases of some sessions; ``folder`` keeps recordings, truth and artifacts."""
    start = cpu_seconds()
    recorded = recordings_of(sessions, folder, jobs)
    shutil.rmtree(folder / "out", ignore_errors=True)  # of another version of bsip
    between = cpu_seconds()
    problems = pipeline(folder, stages, jobs)
    end = cpu_seconds()
    scores = [one for case in recorded for one in score(folder / "out", case)]
    scores += clean_trials(sessions, recorded, folder / "out")
    return Batch(tuple(scores), tuple(problems), (between - start, end - between))


def recordings_of(sessions: Sequence[Session], folder: Path, jobs: int) -> list[Recorded]:
    """Those that an interrupted run has made, or made now."""
    path = folder / "truth.json"
    if path.exists():
        return [Recorded.from_record(one) for one in json.loads(path.read_text())]
    shutil.rmtree(folder, ignore_errors=True)
    recorded = record_study(sessions, folder, jobs)
    write_atomically(path, json.dumps([asdict(one) for one in recorded]))
    return recorded


def clean_trials(
    sessions: Sequence[Session], recorded: Sequence[Recorded], out: Path
) -> list[Score]:
    """The clean squat of everybody in whose other trials something is hidden."""
    people = {case.session: case.participant for case in recorded}
    return [
        score_of_clean_trial(
            out, people[host.name], host.name, f"{people[host.name]}_task-squat_run-1"
        )
        for host in sessions
        if host.whole is None
    ]
