"""What a run costs that has nothing to do, for a cohort of copies of one simulated person.

    python -m benchmarks.no_op [--people 200] [--jobs 2]

One person is run; the results are copied under other names, with the provenance that each copy
would have. Prints seconds of the clock of `bsip run`: of the first call, which hashes every file,
of the next ones, and with --verify, beside those of `bsip info`, which only starts.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from pathlib import Path

from benchmarks.measure import bsip
from bsip_cli.artifacts import read_artifact, read_header, write_artifact
from bsip_cli.pipeline import STAGES
from bsip_cli.running.session import open_study
from bsip_cli.running.unit import Unit
from bsip_cli.simulate.options import Rates, StudyOptions
from bsip_cli.simulate.study import simulate_study
from bsip_cli.study.study import Participant, Study

OPTIONS = StudyOptions(
    participants=1,
    seed=3,
    sexes="M",
    tasks=("static", "sequence", "squat"),
    durations_s={"static": 1.0, "sequence": 6.0, "squat": 4.0},
    rates={"default": Rates(marker_hz=50, analog_hz=250)},
)


def timed(*arguments: object) -> tuple[float, str]:
    """Seconds of a call, and its last line."""
    began = time.monotonic()
    used = bsip(*arguments)
    return time.monotonic() - began, (used.stderr or used.stdout).splitlines()[-1]


def copy_recordings(study: Path, people: int) -> None:
    header, row = (study / "participants.tsv").read_text().splitlines()[:2]
    rows = [row.replace("sub-01", f"sub-{k:04d}") for k in range(1, people + 1)]
    (study / "participants.tsv").write_text("\n".join([header, *rows]) + "\n")
    for k in range(1, people + 1):
        name = f"sub-{k:04d}"
        (study / name).mkdir()
        for file in (study / "sub-01").iterdir():
            shutil.copyfile(file, study / name / file.name.replace("sub-01", name))


def copy_results(study: Path, out: Path, made: Path) -> None:
    """Of the one person to everybody, in the order of the stages."""
    opened = open_study(study, out, (), None)
    for person in opened.study.participants:
        alone = Study(study, (person,))
        shutil.copytree(made / "sub-01" / "figures", out / person.id / "figures")
        shutil.copyfile(made / "sub-01" / "report.html", out / person.id / "report.html")
        for stage in STAGES:
            if stage.level != "cohort":
                trials = person.trials if stage.level == "trial" else (None,)
                for trial in trials:
                    copy_unit(Unit(stage, alone, out, opened.config, person, trial), made, person)


def copy_unit(unit: Unit, made: Path, person: Participant) -> None:
    for kind in (*unit.stage.writes, *unit.stage.amends):
        path = unit.path(kind)
        source = made / "sub-01" / path.name.replace(person.id, "sub-01")
        table, notes = read_artifact(source, kind), read_header(source, kind)["provenance"]
        if "file" in table.columns:
            table["file"] = table["file"].str.replace("sub-01", person.id)
        if kind in unit.stage.amends:
            maker = read_header(path, kind)["provenance"]["made_by"]
            notes |= {"made_by": maker, "amended_by": unit.made_by}
        else:
            notes = {k: v for k, v in notes.items() if k != "amended_by"} | {
                "made_by": unit.made_by
            }
        write_artifact(path, kind, table, notes)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        study, made, out = (Path(folder) / name for name in ("study", "made", "out"))
        simulate_study(study, OPTIONS)
        print(timed("run", study, "--out", made, "--participant", "sub-01")[1])
        copy_recordings(study, asked.people)
        copy_results(study, out, made)
        start_s, _ = timed("info")
        print(f"{start_s:6.1f} s  bsip info")
        for more in ([], [], [], ["--verify"]):
            seconds, last = timed("run", study, "--out", out, "--jobs", asked.jobs, *more)
            print(f"{seconds:6.1f} s  bsip run {' '.join(more)}  ({last.split(';')[0]})")


if __name__ == "__main__":
    main()
