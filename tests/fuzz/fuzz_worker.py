"""Runs fuzz cases in this process under limits of time and memory; one line of JSON per case.

python -m tests.fuzz.fuzz_worker TARGET FIRST STOP SCRATCH
"""

from __future__ import annotations

import json
import resource
import shutil
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path

from tests.fuzz.fuzz_study import (
    REAL,
    TARGETS,
    Answer,
    Case,
    ask,
    ask_recording,
    damaged,
    make_sound_study,
    new_sentences,
    silent_changes,
)

LIMIT_S = 20
EXTRA_BYTES = 1_500_000_000  # of address space beyond what the imports and one good run took


def main() -> None:
    target, first, stop, scratch = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    warnings.simplefilter("ignore")
    folder = Path(scratch)
    shutil.rmtree(folder, ignore_errors=True)
    answering = _real(folder, target) if target in REAL else _study(folder, target)
    file, again = answering
    content, sound = file.read_bytes(), again()
    if sound.state != "done":
        raise SystemExit(f"the sound file was refused: {sound.sentences}")
    _limit_memory()
    for index in range(first, stop):
        case = Case(target, index)
        file.write_bytes(damaged(content, case))
        print(json.dumps({"index": index, "damage": case.damage().__name__}), flush=True)
        print(json.dumps(_result(again, sound)), flush=True)


def _study(folder: Path, target: str) -> tuple[Path, Callable[[], Answer]]:
    """The file to damage, and how to ask bsip about the study it is in."""
    study, out = make_sound_study(folder / "study", target), folder / "out"

    def again() -> Answer:
        shutil.rmtree(out, ignore_errors=True)
        return ask(study, out)

    return study / TARGETS[target][0], again


def _real(folder: Path, target: str) -> tuple[Path, Callable[[], Answer]]:
    folder.mkdir(parents=True)
    file = folder / Path(REAL[target]).name
    shutil.copy(Path(sys.argv[5]) / REAL[target], file)
    return file, lambda: ask_recording(file)


def _result(again: Callable[[], Answer], sound: Answer) -> dict:
    signal.alarm(LIMIT_S)  # its default action ends the process, and the parent sees it
    start = time.perf_counter()
    try:
        answer = again()
    except Exception:  # noqa: BLE001  what a user would meet as a bug, recorded here
        return {"state": "bug", "words": traceback.format_exc(), **_cost(start)}
    finally:
        signal.alarm(0)
    silent = silent_changes(sound, answer)
    said = new_sentences(sound, answer)
    state = "silent" if silent else answer.state
    if state == "done":
        state = "said" if said else "unchanged"
    words = ", ".join(silent) if silent else " | ".join(said)
    return {"state": state, "words": words[:2000], **_cost(start)}


def _cost(start: float) -> dict[str, float]:
    return {"seconds": time.perf_counter() - start, "peak_MB": _own_peak_kb() / 1024}


def _own_peak_kb() -> int:
    """getrusage would also count what the process that started this one had taken before."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))


def _limit_memory() -> None:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + EXTRA_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


if __name__ == "__main__":
    main()
