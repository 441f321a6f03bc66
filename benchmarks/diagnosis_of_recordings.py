"""What bsip says of real recordings as they are, and with one injected cause each.

    python -m benchmarks.diagnosis_of_recordings DATA --write

DATA is a folder with the recordings listed in SUBJECTS; those that are missing are left out. Every
case leaves a file in --results and is not run again while that is there: remove the folder to
judge other code. --only NAME (may be repeated) runs these recordings only, --no-runs none.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from benchmarks.diagnosis_answers import Answer, answer_of
from benchmarks.diagnosis_page import tables
from benchmarks.injected_causes import CAUSES, Cause
from benchmarks.measure import RESULTS, ROOT, markdown, run_child, write_csv
from benchmarks.recordings import STUDIES, Source, make_study

STAGES = ("ingest", "scale", "ik", "regress", "identify", "reconstruct", "diagnose", "extend")
BAD_DATA = 3  # some trial was refused, the rest is done
AS_IT_IS = "as it is"
_BY_NAME = {source.name: source for source in STUDIES}


@dataclass(frozen=True)
class Subject:
    """A person's recordings, and where things are injected.

    moving : tasks that hold what is in all trials, the first what is in one. segment, marker,
    pair : where a mass, a slip and an exchange sit. up : the vertical force in the axes of the
    file. Nothing is injected where ``moving`` is empty.
    """

    source: Source
    moving: tuple[str, ...] = ()
    segment: str = ""
    marker: str = ""
    pair: str = ""
    up: str = "fz"


def _some(name: str, *tasks: str) -> Source:
    """A study of benchmarks/recordings.py with some of its trials only."""
    source = _BY_NAME[name]
    return replace(source, files={task: source.files[task] for task in tasks})


SUBJECTS = (
    Subject(_BY_NAME["biobuddy_ech"]),  # hands on a rail: nothing else is asked of its trials
    Subject(
        _some("opencap_subject4", "static", "squats", "sitstand"),
        ("squats", "sitstand"),
        "forearm_r",
        "L.ASIS",
        "L_elbow_lat+L_elbow_med",
        up="fy",
    ),
    Subject(_BY_NAME["figaroh_human"], ("sequence",), "hand_r", "LASI", "LANK+LHEE"),
    Subject(_BY_NAME["btk_pig (Full)"]),
    Subject(_BY_NAME["btk_pig (Hole)"]),
    Subject(
        Source("return11_static", "F\t58.35\t1.60", "", {"static": "return11_static/c3dfile1.c3d"})
    ),
    Subject(
        Source(
            "hamner_other",
            "M\tn/a\tn/a",
            "",
            {"runa": "hamner_other/run200", "runb": "hamner_other/run300"},
        )
    ),
    Subject(
        Source(
            "motionanalysis_helenhayes",
            "M\tn/a\tn/a",
            "",
            {"jump": "motionanalysis_helenhayes/Sample_Jump2.c3d"},
        )
    ),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--write", action="store_true", help="into docs/results")
    parser.add_argument("--results", type=Path, default=Path("out/diagnosis_of_recordings"))
    parser.add_argument("--only", action="append", help="a recording's name")
    parser.add_argument("--no-runs", action="store_true", help="write what is there already")
    arguments = parser.parse_args()
    chosen = [one for one in SUBJECTS if not arguments.only or one.source.name in arguments.only]
    for subject in () if arguments.no_runs else chosen:
        run_subject(subject, arguments.data, arguments.results)
    found = tables(read_results(arguments.results, SUBJECTS), CAUSES, AS_IT_IS)
    for name, (header, rows) in found.items():
        print(f"{name}\n\n{markdown(header, rows)}\n")
        if arguments.write and rows:
            write_csv(RESULTS / f"{name}.csv", header, rows)


def run_subject(subject: Subject, data: Path, results: Path) -> None:
    """All cases of one person that have no result yet."""
    cases: list[Cause | None] = [None, *(CAUSES if subject.moving else ())]
    missing = [cause for cause in cases if not _file(results, subject, cause).exists()]
    if not missing:
        return
    with tempfile.TemporaryDirectory() as scratch:
        study = Path(scratch) / "study"
        if not make_study(study, data, subject.source):
            return
        for number, cause in enumerate(missing):
            answer = run_case(subject, cause, study, Path(scratch) / f"case{number}")
            _keep(_file(results, subject, cause), answer)
            print(f"{subject.source.name}: {_words(cause)}: {answer.cpu_s:.0f} CPU-s", flush=True)


def run_case(subject: Subject, cause: Cause | None, study: Path, scratch: Path) -> Answer:
    """Inject one cause into a copy of the study (or none) and run the pipeline on it."""
    recordings, refused = study, ""
    if cause is not None:
        recordings = scratch / "injected"
        refused = inject(subject, cause, study, recordings)
    if refused:
        return Answer(refused=refused)
    answer = pipeline(recordings, scratch / "out")
    return replace(answer, place=filled(cause.place, subject)) if cause else answer


def inject(subject: Subject, cause: Cause, study: Path, copy: Path) -> str:
    """Write the copy with the cause in it; returns why it was refused, or nothing."""
    tasks = subject.moving if cause.everywhere else subject.moving[:1]
    size = cause.size
    if cause.over_trial:
        size /= duration_s(subject, study, tasks[0])
    command = [sys.executable, "-m", "bsip_cli", "inject", str(study), str(copy)]
    command += ["--effect", cause.effect, "--size", repr(size)]
    command += ["--target", filled(cause.target, subject)]
    for task in tasks:
        command += ["--effect-tasks", task]
    used = run_child(command, folder=ROOT, allowed=BAD_DATA)
    said = used.stderr.replace(f"{study.parent}/", "")
    return "" if used.code == 0 else said.strip().splitlines()[0]


def pipeline(study: Path, out: Path) -> Answer:
    """All stages up to the extension."""
    cpu_s, said = 0.0, []
    for stage in STAGES:
        command = [sys.executable, "-m", "bsip_cli", stage, str(study), "--out", str(out)]
        used = run_child(command, folder=ROOT, allowed=BAD_DATA)
        cpu_s += used.cpu_s
        said += [line for line in used.stderr.splitlines() if line.startswith(f"{stage}:")]
    return answer_of(out / "sub-01", cpu_s, said)


def filled(text: str, subject: Subject) -> str:
    """A target with the recording's own segment, marker, pair and vertical."""
    return text.format(
        segment=subject.segment, marker=subject.marker, pair=subject.pair, up=subject.up
    )


def duration_s(subject: Subject, study: Path, task: str) -> float:
    """Of a trial, from its recording."""
    from bsip_cli.recordings.read import read_recording

    files = sorted((study / "sub-01").glob(f"sub-01_task-{task}.*"))
    recording = next(path for path in files if path.suffix in (".c3d", ".trc"))
    times = read_recording(recording).time_s()
    return float(times[-1] - times[0])


def read_results(results: Path, subjects: Sequence[Subject]) -> dict[str, dict[str, Answer]]:
    """By recording and cause in words, what was answered; and the targets meant."""
    found: dict[str, dict[str, Answer]] = {}
    for subject in subjects:
        for cause in (None, *CAUSES):
            file = _file(results, subject, cause)
            if file.exists():
                stored = json.loads(file.read_text(encoding="utf-8"))
                found.setdefault(subject.source.name, {})[_words(cause)] = Answer.read(stored)
    return found


def _words(cause: Cause | None) -> str:
    return AS_IT_IS if cause is None else cause.words


def _file(results: Path, subject: Subject, cause: Cause | None) -> Path:
    name = "none" if cause is None else cause.effect
    return results / subject.source.name / f"{name}.json"


def _keep(file: Path, answer: Answer) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_suffix(".part")
    partial.write_text(json.dumps(asdict(answer), indent=1) + "\n", encoding="utf-8")
    partial.replace(file)


if __name__ == "__main__":
    main()
