"""Draw circumstances, let `bsip ingest` read them, print the table of outcomes.

Of what is wrong without a word there, the whole of `bsip run` is asked.

python -m tests.circumstances.run --n 1000 --seed 5 --jobs 2 [--only KIND] [--keep ID]
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from itertools import product
from pathlib import Path

from tests.circumstances.generator import Circumstance, draw, write
from tests.circumstances.judge import (
    CRASHED,
    DISTURBED,
    MISNAMED,
    OUTCOMES,
    REPAIRED,
    RIGHT,
    WRONG,
    WRONGLY_REPAIRED,
    Judgement,
    judge,
    judge_by_conclusion,
)
from tests.circumstances.sound import LABORATORIES, PEOPLE, sound_session
from tests.circumstances.taken import Taken, concluded, ingest
from tests.circumstances.things import KINDS, NO_EXPORT

BATCH = 20
WORST = (CRASHED, DISTURBED, WRONGLY_REPAIRED, WRONG, MISNAMED)


def examined(
    seed: int, ids: Sequence[int], jobs: int = 1, only: str = "", folder: Path | None = None
) -> list[Judgement]:
    """Judge the circumstances `ids` of a seed; folder : keeps study and results of one."""
    tasks = [(seed, batch, only, folder) for batch in _batches(seed, ids, only)]
    if jobs == 1:
        return _counted(map(_examine, tasks), len(ids))
    for laboratory, person in product(LABORATORIES, range(PEOPLE)):
        sound_session(laboratory, person)  # before the processes part, so that each has them
    with ProcessPoolExecutor(jobs) as pool:
        return _counted(pool.map(_examine, tasks), len(ids))


def _counted(batches: Iterable[list[Judgement]], number: int) -> list[Judgement]:
    """All judgements by id, with a count of them on a terminal."""
    judgements: list[Judgement] = []
    for batch in batches:
        judgements += batch
        if sys.stderr.isatty():
            print(f"\r{len(judgements)} of {number}", end="", file=sys.stderr)
    return sorted(judgements, key=lambda j: j.id)


def _batches(seed: int, ids: Sequence[int], only: str) -> Iterator[list[int]]:
    """Several people to a study, since a process of bsip starts slowly."""
    alone = {number for number in ids if draw(seed, number, only).needs_own_table}
    together = [number for number in ids if number not in alone]
    yield from ([number] for number in alone)
    yield from (together[k : k + BATCH] for k in range(0, len(together), BATCH))


def _examine(task: tuple[int, list[int], str, Path | None]) -> list[Judgement]:
    seed, ids, only, kept = task
    circumstances = [draw(seed, number, only) for number in ids]
    with tempfile.TemporaryDirectory() as passing:
        folder = kept or Path(passing)
        write(circumstances, folder / "study")
        taken = ingest(folder / "study", folder / "out")
    if len(ids) > 1 and _cannot_be_told_apart(taken):
        return [j for number in ids for j in _examine((seed, [number], only, kept))]
    judgements = [judge(c, taken[c.participant]) for c in circumstances]
    return [
        judge_by_conclusion(j, _conclusion(c)) if j.outcome == WRONG else j
        for c, j in zip(circumstances, judgements, strict=True)
    ]


def _conclusion(circumstance: Circumstance) -> str:
    """Of the whole run, which takes a minute."""
    with tempfile.TemporaryDirectory() as passing:
        folder = Path(passing)
        write([circumstance], folder / "study")
        return concluded(folder / "study", folder / "out")


def _cannot_be_told_apart(taken: dict[str, Taken]) -> bool:
    """A bug, or a refusal of the whole study: whose?"""
    return any(t.exit_code == 1 or not (t.words or t.trials) for t in taken.values())


def share(judgements: list[Judgement], *outcomes: str) -> float:
    """Of the judgements."""
    return sum(j.outcome in outcomes for j in judgements) / max(len(judgements), 1)


def can_be_mended(judgements: list[Judgement]) -> list[Judgement]:
    """Those that were changed in nothing but how right forces are written."""
    return [j for j in judgements if not {"sound", NO_EXPORT} & set(j.kinds)]


def table(judgements: list[Judgement]) -> str:
    """Outcomes by kind, and the ids of the worst."""
    changed = [j for j in judgements if "sound" not in j.kinds]
    width = max(len(o) for o in OUTCOMES) + 2
    rows = [("all that was changed", changed)]
    rows += [(kind, [j for j in judgements if kind in j.kinds]) for kind in ("sound", *KINDS)]
    names = [name for name, _ in rows]
    lines = [" " * width + "n".rjust(6) + "  " + "  ".join(names)]
    for outcome in OUTCOMES:
        cells = [
            f"{100 * share(some, outcome):.1f}".rjust(len(name)) if some else "-".rjust(len(name))
            for name, some in rows
        ]
        count = sum(j.outcome == outcome for j in judgements)
        lines.append(outcome.ljust(width) + str(count).rjust(6) + "  " + "  ".join(cells))
    counts = "  ".join(str(len(some)).rjust(len(name)) for name, some in rows)
    lines.append("n".ljust(width) + str(len(judgements)).rjust(6) + "  " + counts)
    mendable = can_be_mended(judgements)
    good = share(mendable, RIGHT, REPAIRED)
    lines.append(f"right or repaired: {good:.1%} of {len(mendable)} that can be")
    for outcome in WORST:
        of_it = [j for j in judgements if j.outcome == outcome]
        things = Counter(thing for j in of_it for thing in j.things)
        if of_it:
            lines.append(f"{outcome}: ids {' '.join(str(j.id) for j in of_it)}")
            lines.append("    " + ", ".join(f"{t} {n}" for t, n in things.most_common(12)))
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=100)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", default="", help="a kind, the name of a thing, or sound")
    parser.add_argument("--keep", type=int, help="redo this id and keep its folder")
    parser.add_argument("--json", type=Path, help="write all judgements there")
    asked = parser.parse_args()
    if asked.keep is not None:
        folder = Path(tempfile.mkdtemp(prefix=f"circumstance-{asked.keep}-"))
        (judgement,) = examined(asked.seed, [asked.keep], 1, asked.only, folder)
        print(json.dumps(asdict(judgement), indent=1, ensure_ascii=False))
        print(folder)
        return
    judgements = examined(asked.seed, range(asked.n), asked.jobs, asked.only)
    if asked.json:
        asked.json.write_text(json.dumps([asdict(j) for j in judgements], indent=1))
    print(table(judgements))


if __name__ == "__main__":
    main()
