"""Hold the diagnosis against people of another simulator (`second_world`).

Run from the checkout. Every case, with nothing or something hidden in it, goes through ``bsip`` as
a black box, from ``ingest`` to ``diagnose``; a Markdown table tells what was hidden beside what is
said. The recordings come from code that shares none with ``bsip_cli.simulate`` and none for forces
with any part of ``bsip_cli``. A study or an answer that is there is not made again.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pandas as pd
from blind_running import ROOT, STAGES, CommandError, run_pipeline, write_atomically
from blind_scoring import PERSON as ALL_TRIALS
from blind_scoring import read_answer
from blind_tables import markdown
from second_world.people import CASES, Case
from second_world.study import PERSON, write_study
from tqdm import tqdm

NOTHING = "nothing"


def main(arguments: Sequence[str] | None = None) -> None:
    options = parsed(arguments)
    known = {case.name: case for case in CASES}
    if unknown := set(options.only) - set(known):
        raise SystemExit(f"no case {', '.join(sorted(unknown))}; there are {', '.join(known)}")
    cases = [known[name] for name in options.only] or list(CASES)
    with ProcessPoolExecutor(options.jobs, max_tasks_per_child=1) as pool:
        asked = [(case, options.results / case.name) for case in cases]
        problems = list(tqdm(pool.map(answer, asked), total=len(asked), unit="case"))
    table = pd.DataFrame(row for case in CASES for row in rows_of(case, options.results))
    write_atomically(options.results / "second_world.md", markdown(table))
    print(markdown(table))
    if said := [problem for problem in problems if problem]:
        raise SystemExit("\n".join(said))


def parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    add("--results", type=Path, default=ROOT / "out" / "second_world", help="folder of results")
    add("--jobs", type=int, default=1, help="cases at once")
    add("--only", action="append", default=[], metavar="NAME", help="a case; may be repeated")
    return parser.parse_args(arguments)


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
    """What the diagnosis says of all trials together, and of each alone; [] without an answer."""
    whole = diagnosis_of(results / case.name)
    if not whole.is_file():
        return []
    hidden = case.hidden.in_words() if case.hidden else NOTHING
    files = {ALL_TRIALS: whole}
    for path in sorted(whole.parent.glob(f"{PERSON}_task-*_diagnosis.parquet")):
        files[path.stem.removeprefix(f"{PERSON}_").removesuffix("_diagnosis")] = path
    said = {source: what_is_said(path, source) for source, path in files.items()}
    return [
        {"case": case.name, "hidden": hidden, "asked": source, **words}
        for source, words in said.items()
        if source == ALL_TRIALS or any(words.values())
    ]


def what_is_said(path: Path, source: str) -> dict[str, str]:
    """Causes named with sizes and intervals, and classes that cannot be told apart."""
    found = read_answer(path, source)
    rows = found.rows[found.rows["verdict"] == "named"]
    classes = (
        " or ".join(f"{effect} {target}".strip() for effect, target in members)
        for members in found.classes
    )
    named = (f"{effect} {target}".strip() for effect, target in found.named)
    sizes = [
        f"{row.parameter} {row.estimate:.3g} {row.unit} ({row.ci_low:.3g} to {row.ci_high:.3g})"
        for row in rows.itertuples()
        if pd.notna(row.estimate)
    ]
    return {
        "named": "; ".join(named),
        "sizes": "; ".join(sizes),
        "classes": "; ".join(classes),
    }


if __name__ == "__main__":
    main()
