"""Hold the diagnosis against people of another simulator (`second_world`).

Run from the checkout. Every case, with nothing or something hidden in it, goes through ``bsip`` as
a black box, from ``ingest`` to ``diagnose``; a table tells what was hidden beside what is
said. With ``--seed`` people are drawn whom nobody has looked at. The recordings come from code that
shares none with ``bsip_cli.simulate`` and none for forces with any part of ``bsip_cli``. A study or
an answer that is there is not made again.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pandas as pd
from tqdm import tqdm

from tests.blind.blind_running import ROOT, STAGES, TABLES, CommandError, run_pipeline
from tests.blind.blind_tables import write_csv
from tests.blind.second_world.people import CASES, Case, drawn_cases
from tests.blind.second_world.study import PERSON, drawn, write_study

NOTHING = "nothing"


def main(arguments: Sequence[str] | None = None) -> None:
    options = parsed(arguments)
    people = CASES if options.seed is None else drawn_cases(options.seed)
    known = {case.name: case for case in people}
    if unknown := set(options.only) - set(known):
        raise SystemExit(f"no case {', '.join(sorted(unknown))}; there are {', '.join(known)}")
    cases = [known[name] for name in options.only] or list(people)
    with ProcessPoolExecutor(options.jobs, max_tasks_per_child=1) as pool:
        asked = [(case, options.results / case.name) for case in cases]
        problems = list(tqdm(pool.map(answer, asked), total=len(asked), unit="case"))
    table = pd.DataFrame(row for case in people for row in rows_of(case, options.results))
    print(table.to_string())
    write_csv(options.tables, options.results.name.replace("-", "_"), table)
    if said := [problem for problem in problems if problem]:
        raise SystemExit("\n".join(said))


def parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    add("--results", type=Path, help="folder of results, for each seed its own")
    add("--tables", type=Path, default=TABLES, help="folder that gets the table")
    add("--seed", type=int, help="people drawn from it instead")
    add("--jobs", type=int, default=1, help="cases at once")
    add("--only", action="append", default=[], metavar="NAME", help="a case; may be repeated")
    options = parser.parse_args(arguments)
    name = "second_world" if options.seed is None else f"second_world-{options.seed}"
    options.results = options.results or ROOT / "out" / name
    return options


def answer(asked: tuple[Case, Path]) -> str:
    """Make a case's study and have it diagnosed; returns what went wrong, if it did."""
    case, folder = asked
    if diagnosis_of(folder).is_file():
        return ""
    if not (folder / "study" / "participants.tsv").is_file():
        write_study(folder / "study", case)
    try:
        return "\n".join(run_pipeline(folder, STAGES, jobs=1))
    except CommandError as error:
        return str(error)


def diagnosis_of(folder: Path) -> Path:
    return folder / "out" / PERSON / f"{PERSON}_diagnosis.parquet"


def rows_of(case: Case, results: Path) -> list[dict[str, str]]:
    """One row per cause or class that is told of a person; [] without an answer."""
    path = diagnosis_of(results / case.name)
    if not path.is_file():
        return []
    hidden = " and ".join(one.in_words() for one in case.hidden) or NOTHING
    _, _, lab, _ = drawn(case)
    found = pd.read_parquet(path)
    said = found[found["verdict"].isin(["named", "ambiguous"])]
    causes = said["class_id"].where(said["class_id"] != "", said["rank"].astype(str))
    return [
        {"case": case.name, "hidden": hidden, "the lab's own": lab.in_words(), **in_words(rows)}
        for _, rows in said.groupby(causes, sort=False)
    ]


def in_words(rows: pd.DataFrame) -> dict[str, str]:
    """A cause with its numbers, or the members of a class."""
    members = dict.fromkeys(f"{row.effect} {row.target or ''}".strip() for row in rows.itertuples())
    numbers = [
        f"{row.parameter} {row.estimate:.3g} {row.unit} ({row.ci_low:.3g} to {row.ci_high:.3g})"
        for row in rows.itertuples()
        if len(members) == 1 and pd.notna(row.estimate)
    ]
    trials = str(rows["trials"].iloc[0]).replace(f"{PERSON}_task-", "").replace("_run-1", "")
    return {"told": " or ".join(members), "numbers": "; ".join(numbers), "in": trials}


if __name__ == "__main__":
    main()
