"""Signals to bsip, to all its processes and to one worker, at random moments."""

from __future__ import annotations

import os
import random
import signal
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from tests.crash.bench import GONE_S, POLL_S, Bench, Ended, ended, left_after, processes_of

ASKING = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
KINDS = (*ASKING, signal.SIGKILL)
TARGETS = ("parent", "group", "worker")


@dataclass(frozen=True)
class Signal:
    """``after_s``: since bsip could answer signals, or, for a worker, since there was one."""

    kind: signal.Signals
    target: str
    after_s: float

    def __str__(self) -> str:
        return f"{self.kind.name} to {self.target} after {self.after_s:.2f} s"


def answer_all() -> None:
    """A shell has those ignored that it starts in the background, and bsip ignores them then."""
    for kind in ASKING:
        if signal.getsignal(kind) == signal.SIG_IGN:
            signal.signal(kind, signal.SIG_DFL)


def drawn(chance: random.Random, takes_s: float) -> Signal:
    """At any moment; every fourth in the first second, every fourth about the end."""
    moment = chance.choice(
        [
            chance.uniform(0, takes_s),
            chance.uniform(0, takes_s),
            chance.uniform(0, 1.0),
            takes_s * chance.uniform(0.85, 1.05),
        ]
    )
    return Signal(chance.choice(KINDS), chance.choice(TARGETS), moment)


def seconds_of(bench: Bench, out: Path) -> float:
    """How long a run goes on after it could answer signals."""
    process = bench.start(bench.fresh_out(out))
    _wait_until_answering(process)
    began = time.monotonic()
    ended(process)
    return time.monotonic() - began


def what_fails(bench: Bench, out: Path, sent: Signal) -> tuple[list[str], bool]:
    """What did not hold, and whether the signal hit a run at work."""
    process = bench.start(bench.fresh_out(out))
    _wait_until_answering(process)
    hit = _send(process, sent)
    goes_on = sent == Signal(signal.SIGKILL, "worker", sent.after_s)  # with the others' work
    left = left_after(process.pid) if hit and not goes_on else []
    done = ended(process)
    left += left_after(process.pid)
    faults = [
        *(f"still there after {GONE_S:g} s: {line}" for line in left),
        *_wrong_end(bench, out, sent, done),
        *bench.broken_left(out),
        *bench.wrong_next(out),
    ]
    return faults, hit


def _wrong_end(bench: Bench, out: Path, sent: Signal, done: Ended) -> list[str]:
    """Its exit code and its last sentence; it may have been through already."""
    if done.code == 0:
        return [f"exit code 0 with another {name}" for name in bench.others(out)]
    if "Traceback" in done.said:
        return [f"a trace: {done.said}"]
    if sent.kind != signal.SIGKILL:
        last = f"bsip: ended by {sent.kind.name}; what is finished stays"
        is_right = done.code == 128 + sent.kind and last in done.said.splitlines()[-1]
        return [] if is_right else [f"exit code {done.code}: {done.said}"]
    if sent.target != "worker":
        return [] if done.code == -signal.SIGKILL else [f"exit code {done.code}: {done.said}"]
    gone = [name for name in _people(bench) if f"{name}: the process was killed" in done.said]
    others = [name for name in bench.others(out) if name.split("/")[0] not in gone]
    if done.code != 1 or len(gone) != 1:
        return [f"exit code {done.code}: {done.said}"]
    return [f"{gone[0]} was killed, and {name} is not as undisturbed" for name in others]


def _people(bench: Bench) -> list[str]:
    return sorted({name.split("/")[0] for name in bench.whole if name.startswith("sub-")})


def _wait_until_answering(process) -> None:
    """Until bsip has begun: signals to an interpreter that starts end it, as they end any."""
    while process.poll() is None and not _answers(process.pid):
        time.sleep(POLL_S)


def _answers(pid: int) -> bool:
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    caught = next((int(line.split()[1], 16) for line in lines if line.startswith("SigCgt")), 0)
    return bool(caught >> (signal.SIGTERM - 1) & 1)


def _send(process, sent: Signal) -> bool:
    workers: list[int] = []
    while sent.target == "worker" and process.poll() is None and not workers:
        workers = _workers(process.pid)
        time.sleep(POLL_S)
    time.sleep(sent.after_s)
    workers = _workers(process.pid)
    if process.poll() is not None or (sent.target == "worker" and not workers):
        return False
    with suppress(ProcessLookupError):
        if sent.target == "group":
            os.killpg(process.pid, sent.kind)
        else:
            os.kill(workers[0] if sent.target == "worker" else process.pid, sent.kind)
        return True
    return False


def _workers(session: int) -> list[int]:
    lines = processes_of(session).items()
    return [pid for pid, line in lines if "spawn_main" in line]
