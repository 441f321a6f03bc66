"""Disturb bsip again and again: nothing is lost, nothing is left.

    python -m tests.crash.disturbances [--rounds 120] [--seed 1] [--jobs 1]

Every open, read, write, fsync, rename and unlink on the study and the results fails in turn (EIO,
EMFILE; a disk that is full or read-only from there on) while an artifact is written or read and
while a stage is run in one process. Then come rounds with all of bsip's processes: in a third of
them a call fails, in the others TERM, INT, HUP or KILL comes at a random moment to bsip, to all its
processes or to a worker. Afterwards what has a final name must be whole, no process and no lock may
be left, bsip has ended with a documented exit code and a sentence; and the next run must end with
the bytes of a run that nothing disturbed. Signals before bsip's own first line, while Python
starts, are left out: nothing can answer them.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tests.crash import faults, signals
from tests.crash.bench import UPSTREAM, Bench, benches, by_processes, make_study
from tests.crash.every_call import every_call

SIGNALLED = ("ingest", "--jobs", "2")


@dataclass(frozen=True)
class Round:
    """One disturbance; ``disturb`` tells what did not hold, and whether a run at work was hit."""

    name: str
    kind: str
    disturb: Callable[[Path], tuple[list[str], bool]]


def fault_rounds(folder: Path, chance: random.Random, names: Sequence[str]) -> list[Round]:
    """A round for every call."""
    library, rounds = faults.compiled(folder), []
    for bench in benches(by_processes, folder, names):
        for call in faults.calls_of(bench, library, folder / "out", chance):

            def disturb(out: Path, bench: Bench = bench, call: faults.Call = call):
                return faults.what_fails(bench, library, out, call), True

            words = " ".join(bench.command)
            rounds.append(Round(f"{words}: {call}", f"{call.name} fails", disturb))
    return rounds


def signal_rounds(folder: Path, chance: random.Random, count: int) -> list[Round]:
    signals.answer_all()
    study = make_study(folder / "study_of_three", participants=3)
    bench = Bench.of(by_processes, study, folder / "before_signals", *SIGNALLED)
    takes_s = signals.seconds_of(bench, folder / "out")
    rounds = []
    for sent in (signals.drawn(chance, takes_s) for _ in range(count)):

        def disturb(out: Path, sent: signals.Signal = sent):
            return signals.what_fails(bench, out, sent)

        rounds.append(Round(str(sent), f"{sent.kind.name} to {sent.target}", disturb))
    return rounds


def disturbed(rounds: Sequence[Round], folder: Path, jobs: int) -> tuple[Counter[str], list[str]]:
    """How many of each kind hit a run at work, and all that did not hold."""
    hits: Counter[str] = Counter()
    wrong: list[str] = []
    outs = [folder / f"out-{k}" for k, _ in enumerate(rounds)]
    with ThreadPoolExecutor(jobs) as pool:
        done = pool.map(lambda one, out: one.disturb(out), rounds, outs)
        for number, (one, (found, hit)) in enumerate(zip(rounds, done, strict=True), 1):
            hits[one.kind] += hit
            wrong += [f"{one.name}: {what}" for what in found]
            print("".join(f"FAULT: {one.name}: {what}\n" for what in found), end="", flush=True)
            print(f"{number} of {len(rounds)}, {len(wrong)} faults", file=sys.stderr)
    return hits, wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=120, help="that start bsip's processes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="rounds at once")
    given = parser.parse_args()
    hits: Counter[str] = Counter()
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        for counts, found in _all(Path(name), given):
            hits += counts
            wrong += found
    for kind, count in sorted(hits.items()):
        print(f"{count:4d}  {kind}")
    print(f"{hits.total()} disturbances hit a run at work, {len(wrong)} faults")
    return 1 if wrong else 0


def _all(folder: Path, given: argparse.Namespace) -> Iterator[tuple[Counter[str], list[str]]]:
    for what in ("write", "read", *UPSTREAM):
        counts, wrong = every_call(what, folder / what, given.seed)
        print("".join(f"FAULT: {fault}\n" for fault in wrong), end="", flush=True)
        yield Counter({f"{call} fails ({what})": n for call, n in counts.items()}), wrong
    chance = random.Random(given.seed)
    calls = fault_rounds(folder, chance, tuple(UPSTREAM))
    wanted = min(len(calls), given.rounds // 3)
    chosen = [calls[k * len(calls) // wanted] for k in range(wanted)]
    rounds = [*chosen, *signal_rounds(folder, chance, given.rounds - wanted)]
    chance.shuffle(rounds)  # a run that is ended early has met all kinds
    yield disturbed(rounds, folder, given.jobs)


if __name__ == "__main__":
    sys.exit(main())
