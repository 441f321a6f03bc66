"""Are recordings free of a fault after `bsip export --what recording`?

    python -m benchmarks.corrected_recordings DATA --write

A fault is hidden, the study is diagnosed, exported and diagnosed again. It is corrected where it,
at its place, was taken off or is said to be as likely as what was. Free is what is told of nothing
that was taken off, nor of what looked like it, nor of anything new; the column "still told" holds
the first two alone. Of simulated people the true forces are known: error of the plates (root mean
square, the largest of all trials, plates and axes) before and after. Cases are simulated people
and, where DATA has them, real recordings, which have faults of their own. --only TEXT runs the
cases whose line holds it; their rows replace those in docs/results.
"""

from __future__ import annotations

import argparse
import csv
import re
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.measure import RESULTS, bsip, markdown, write_csv
from benchmarks.recordings import STUDIES, make_study
from bsip_cli.recordings.read import read_recording

STAGES = ["ingest", "scale", "ik", "regress", "identify", "reconstruct", "laboratory", "diagnose"]
SEEDS = (5101, 5102)
HEADER = (
    *("hidden", "before", "corrected", "afterwards", "still told", "free"),
    *("error before [N]", "error afterwards [N]"),
)
NOT_CORRECTED = "not corrected"
TASKS = ("static", "sequence", "squat", "hops")
OPENCAP, FIGAROH, ZOO = "opencap_subject4", "figaroh_human", "zoo_children"
CHILDREN = ("HC002D", "HC030A", "HC031A", "HC032A", "HC033A", "HC038A", "HC039A")


Key = tuple[str, str]  # effect and target
Row = tuple[str, ...]


@dataclass(frozen=True)
class Case:
    """A fault as ``bsip inject`` wants it, in a simulated person (a seed) or real recordings."""

    source: int | str
    effect: str
    size: float
    target: str

    def key(self) -> Key:
        """As a diagnosis names it."""
        parts = dict(part.split("=") for part in self.target.split(",") if "=" in part)
        plate, channel = parts.get("plate", ""), self.target.split(",")[0].replace(":", ">")
        if self.effect == "marker_swap":
            return self.effect, "+".join(sorted(channel.split("+")))
        is_of_channel = channel[0] in "fm" and plate
        return self.effect, f"{plate} {channel}" if is_of_channel else plate

    def words(self) -> str:
        where = f"simulated person {self.source}" if isinstance(self.source, int) else self.source
        return f"{self.effect} {self.size:g} {self.target} in {where}"


CASES = (
    Case(SEEDS[0], "sync_offset", 0.012, "-"),
    Case(SEEDS[0], "plate_translation", 0.025, "x,plate=1"),
    Case(SEEDS[0], "plate_gain", 0.05, "fz,plate=2"),
    Case(SEEDS[0], "plate_zero", 15.0, "fx,plate=1"),
    Case(SEEDS[0], "gravity_tilt", 0.015, "x"),
    Case(SEEDS[1], "camera_frame", 0.02, "y"),
    Case(SEEDS[1], "plate_rotation", 0.06, "yaw,plate=1"),
    Case(SEEDS[1], "plate_crosstalk", 0.04, "fz:fy,plate=2"),
    Case(SEEDS[1], "clock_drift", 0.001, "-"),
    Case(SEEDS[1], "marker_swap", 2.0, "RELB+RUA"),
    Case(OPENCAP, "sync_offset", 0.010, "-"),
    Case(OPENCAP, "sync_offset", 0.015, "-"),
    Case(OPENCAP, "plate_translation", 0.020, "x,plate=1"),
    Case(FIGAROH, "plate_rotation", 0.05236, "yaw,plate=1"),
    Case(FIGAROH, "plate_translation", 0.020, "x,plate=1"),
    Case(FIGAROH, "plate_crosstalk", 0.02, "fz:fx,plate=1"),
    Case(FIGAROH, "plate_drift", 0.3, "fz,plate=1"),
    Case(ZOO, "sync_offset", 0.010, "-"),
    Case(ZOO, "plate_translation", 0.030, "x,plate=1"),
)


@dataclass(frozen=True)
class Result:
    """Of all persons: sizes of what is named or in a group before and afterwards, what was
    corrected, and what looked like that; error of the forces [N] before and afterwards, if known.
    """

    before: dict[Key, str]
    corrected: frozenset[Key]
    alike: frozenset[Key]
    after: dict[Key, str]
    error_N: tuple[float, ...] = ()

    def is_corrected(self, case: Case) -> bool:
        return case.key() in self.corrected | self.alike

    def still_told(self) -> set[Key]:
        return (self.corrected | self.alike) & self.after.keys()

    def new(self) -> set[Key]:
        return self.after.keys() - self.before.keys() - {("none", "")}

    def is_free(self) -> bool:
        return not self.new() | self.still_told()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--write", action="store_true", help="into docs/results")
    parser.add_argument("--only", default="", help="cases whose line holds this")
    arguments = parser.parse_args()
    results = {}
    for case in CASES:
        if arguments.only not in case.words():
            continue
        with tempfile.TemporaryDirectory() as scratch:
            if (result := run_case(case, arguments.data, Path(scratch))) is not None:
                results[case] = result
                print(case.words(), result, sep=": ", file=sys.stderr, flush=True)
    rows = table(results)
    print(markdown(HEADER, rows))
    if arguments.write:
        file = RESULTS / "corrected_recordings.csv"
        rows = in_order([*(table_in(file) if file.exists() else []), *rows])
        write_csv(file, HEADER, rows)
    print(summary(rows))


def in_order(rows: Sequence[Row]) -> list[Row]:
    """As the cases are, the last row of each."""
    by_case = {row[0]: row for row in rows}
    return [by_case[case.words()] for case in CASES if case.words() in by_case]


def table_in(file: Path) -> list[Row]:
    with file.open(encoding="utf-8", newline="") as lines:
        return [tuple(row) for row in csv.reader(lines)][1:]


def summary(rows: Sequence[Row]) -> str:
    columns = [dict(zip(HEADER, row, strict=True)) for row in rows]
    corrected = [row for row in columns if row["free"] != NOT_CORRECTED]
    clear = sum(not row["still told"] for row in corrected)
    free = sum(row["free"] == "yes" for row in corrected)
    return (
        f"{len(corrected)} of {len(rows)} faults were named and corrected; {clear} are told of "
        f"nothing that was taken off, {free} of nothing new either."
    )


def run_case(case: Case, data: Path, scratch: Path) -> Result | None:
    """None where a real recording is missing."""
    study, hidden, fixed = (scratch / name for name in ("study", "hidden", "fixed"))
    if isinstance(case.source, int):
        simulated = ["--preset", "diagnosis", "--sequence-s", "20", "--plate-per-foot"]
        simulated += [part for task in TASKS for part in ("--task", task)]
        bsip("simulate", study, *simulated, "--seed", case.source)
    elif case.source == ZOO:
        if not make_children(study, data / ZOO):
            return None
    else:
        source = next(one for one in STUDIES if one.name == case.source and one.diagnosed)
        if not make_study(study, data, source):
            return None
    fault = ("--effect", case.effect, "--size", repr(case.size), "--target", case.target)
    bsip("inject", study, hidden, *fault)
    before = diagnosed(hidden, scratch / "out")
    said = bsip("export", hidden, "--out", scratch / "out", "--what", "recording", "--to", fixed)
    after = diagnosed(fixed, scratch / "again")
    known = isinstance(case.source, int)
    errors = tuple(error_of(study, one) for one in (hidden, fixed)) if known else ()
    return Result(before, *corrected_in(said.stderr), after, errors)


def error_of(study: Path, other: Path) -> float:
    """Largest root mean square difference [N] of one axis of a plate, at the same times."""
    largest = 0.0
    for file in sorted(study.glob("sub-*/*.c3d")):
        true, found = (read_recording(one / file.parent.name / file.name) for one in (study, other))
        first = round((found.time0_s - true.time0_s) * true.analog_rate_hz)
        for mine, its in zip(true.plates, found.plates, strict=True):
            wrench = mine.wrench[max(first, 0) :]
            its_wrench = its.wrench[max(-first, 0) :]
            count = min(len(wrench), len(its_wrench))
            apart = (its_wrench[:count] - wrench[:count])[:, :3]
            largest = max(largest, float(np.sqrt(np.nanmean(apart**2, axis=0)).max()))
    return largest


def make_children(study: Path, data: Path) -> bool:
    """Write the study of seven children; False if a recording is missing."""
    rows = ["participant_id\tsex\tmass_kg\theight_m"]
    for number, child in enumerate(CHILDREN, start=1):
        person = f"sub-{number:02d}"
        rows.append(f"{person}\tother\tn/a\tn/a")
        (study / person).mkdir(parents=True)
        for task in ("static", "straight", "turn"):
            recording = data / f"{child}-{task}.c3d"
            if not recording.exists():
                return False
            copy = study / person / f"{person}_task-{task}.c3d"
            copy.write_bytes(recording.read_bytes())
    (study / "participants.tsv").write_text("\n".join([*rows, ""]))
    return True


def corrected_in(said: str) -> tuple[frozenset[Key], frozenset[Key]]:
    """Effects and targets of the lines ``NAME: corrected: EFFECT TARGET: sizes``, and of what is
    as likely."""
    found, alike = set[Key](), set[Key]()
    for line in said.splitlines():
        _, mark, rest = line.partition(": corrected: ")
        if mark and rest.startswith("labels "):
            pair = rest.split()
            found.add(("marker_swap", "+".join(sorted((pair[1], pair[3])))))
        elif mark and "taken off" in rest:
            others = re.search(r"\(as likely (.*), with the same", rest)
            alike |= {_key(one) for one in others[1].split(" or ")} if others else set()
            found.add(_key(rest.split(":")[0]))
    return frozenset(found), frozenset(alike)


def _key(words: str) -> Key:
    effect, _, target = words.partition(" ")
    return effect, target


def diagnosed(study: Path, out: Path) -> dict[Key, str]:
    """Run the stages; sizes of what is named or in a group, and of labels exchanged by ik."""
    for stage in STAGES:
        bsip(stage, study, "--out", out)
    tables = pd.concat(map(pd.read_parquet, sorted(out.glob("sub-*/sub-??_diagnosis.parquet"))))
    found: dict[Key, str] = {}
    for row in tables[tables["verdict"] != "rejected"].itertuples():
        key, size = (row.effect, row.target), f"{row.parameter} {row.estimate:.3g} {row.unit}"
        found[key] = ", ".join(filter(None, (found.get(key), size if row.parameter else "")))
    events = pd.concat(
        pd.read_parquet(path) for path in sorted(out.glob("sub-*/*_marker-events.parquet"))
    )
    for one in events[events["put_right"].astype(bool)].itertuples():
        pair = "+".join(sorted((str(one.marker), str(one.partner))))
        found["marker_swap", pair] = f"{one.end_s - one.start_s:.3g} s"
    return found


def table(results: dict[Case, Result]) -> list[Row]:
    """A row for each case, with sizes."""
    return [
        (
            case.words(),
            _words(one.before),
            _words(dict.fromkeys(one.corrected, "")),
            _words(one.after),
            _words(dict.fromkeys(one.still_told(), "")),
            NOT_CORRECTED if not one.is_corrected(case) else "yes" if one.is_free() else "no",
            *([f"{x:.2f}" for x in one.error_N] or ["", ""]),
        )
        for case, one in results.items()
    ]


def _words(found: dict[Key, str]) -> str:
    return "; ".join(" ".join(filter(None, (*key, size))) for key, size in sorted(found.items()))


if __name__ == "__main__":
    main()
