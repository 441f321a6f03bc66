"""The long blind suite: hide, diagnose, compare, and write the tables into docs/results.

Run from the checkout (``make blind``). One result file per case; what is there is not done again,
so an interrupted run goes on. To judge another version of bsip remove the folder of results; with
recordings that were kept (``--keep``), its ``cases`` alone.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import pandas as pd
from tqdm import tqdm

from tests.blind.blind_cases import CATALOGUE, Case, Session, long_suite
from tests.blind.blind_running import (
    ROOT,
    STAGES,
    TABLES,
    Recorded,
    cpu_seconds,
    record_study,
    run_pipeline,
    write_atomically,
)
from tests.blind.blind_scoring import Score, score, score_of_clean_trial
from tests.blind.blind_tables import lead, tables, write_csv

BATCH = 8  # people of one study; an interruption loses at most their work


def main(arguments: Sequence[str] | None = None) -> None:
    options = parsed(arguments)
    asked = ("draws", "nulls", "pairs", "outside", "seed", "effects")
    settings = {name: getattr(options, name) for name in asked}
    sessions = long_suite(*settings.values())
    keep_settings(options.results, settings)
    stages = STAGES if options.without_extend else (*STAGES, "reconstruct", "extend")
    if not options.only_tables:
        run_missing(sessions, options.results, stages, options.jobs, options.keep)
    write_tables(options.results, settings, options.tables)


def parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    add("--results", type=Path, default=ROOT / "out" / "blind", help="folder of results")
    add("--tables", type=Path, default=TABLES, help="folder that gets them")
    add("--draws", type=int, default=10, help="cases per effect of the catalogue")
    add("--nulls", type=int, default=40, help="people with nothing hidden")
    add("--pairs", type=int, default=20, help="cases of two effects")
    add("--outside", type=int, default=2, help="cases of each kind outside the catalogue")
    add("--seed", type=int, default=2027, help="draws effects, sizes, places and people")
    add("--effects", nargs="+", choices=CATALOGUE, default=list(CATALOGUE), help="only these")
    add("--jobs", type=int, default=2, help="processes at once")
    add("--keep", action="store_true", help="keep recordings and artifacts")
    add("--without-extend", action="store_true", help="no gains on held-out data")
    add("--only-tables", action="store_true", help="write the tables of the results that exist")
    return parser.parse_args(arguments)


def keep_settings(results: Path, settings: dict) -> None:
    """Results of other settings belong to other cases of the same names."""
    path = results / "settings.json"
    if not path.exists():
        write_atomically(path, json.dumps(settings))
    elif json.loads(path.read_text()) != settings:
        raise SystemExit(f"{results} holds results of {path.read_text()}; name another --results")


def run_missing(
    sessions: Sequence[Session], results: Path, stages: Sequence[str], jobs: int, keep: bool
) -> None:
    """Batches of sessions of which some case has no result yet."""
    missing = [s for s in sessions if any(not path_of(results, c).exists() for c in s.cases)]
    with tqdm(total=len(sessions), initial=len(sessions) - len(missing), unit="session") as bar:
        for start in range(0, len(missing), BATCH):
            batch = missing[start : start + BATCH]
            folder = results / f"batch-{batch[0].name}"
            done = run_batch(batch, folder, stages, jobs)
            for problem in done.problems:
                tqdm.write(problem)
            write_results(results, batch, done)
            if not keep:
                shutil.rmtree(folder)
            bar.update(len(batch))


def path_of(results: Path, case: Case | Score) -> Path:
    name = case.name if isinstance(case, Case) else case.case
    return results / "cases" / f"{name}.json"


def write_results(results: Path, sessions: Sequence[Session], done: Batch) -> None:
    """A file per case with its scores; a failed batch says in each which problems it had."""
    trials = sum(len(session.cases) for session in sessions)
    common = {
        "cpu_s_recording": done.cpu_s[0] / trials,
        "cpu_s_stages": done.cpu_s[1] / trials,
        "problems": list(done.problems),
    }
    for case in dict.fromkeys(one.case for one in done.scores):
        scores = [one for one in done.scores if one.case == case]
        record = {"scores": list(map(asdict, scores)), **common}
        write_atomically(path_of(results, scores[0]), json.dumps(record, indent=1))


def write_tables(results: Path, settings: dict, target: Path) -> None:
    """The tables of all results as data files; what they come to is printed."""
    records = [json.loads(path.read_text()) for path in sorted(results.glob("cases/*.json"))]
    if not records:
        raise SystemExit(f"no results in {results}")
    scores = pd.DataFrame([score for record in records for score in record["scores"]])
    spent = sum(record["cpu_s_recording"] + record["cpu_s_stages"] for record in records)
    asked = ", ".join(f"{name} {value}" for name, value in settings.items())
    print(f"{len(records)} results ({asked}), {spent:.0f} CPU-s in all. {lead(scores)}")
    for name, table in tables(scores).items():
        write_csv(target, name, table)


# --- sessions to scores: record them, run the command line, compare -------------------------------


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


if __name__ == "__main__":
    main()
