"""Run bsip again and again on one study, disturb it at random moments, and see what it left.

    python tests/crash/disturbances.py [--rounds 100] [--seed 1]

What a disturbance leaves under a final name must be whole; the next run must complete, with the
bytes of a run that nothing disturbed.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from bsip_cli.artifacts import read_artifact, read_header
from bsip_cli.errors import BadDataError
from bsip_cli.pipeline import STAGES
from bsip_cli.schemas import SCHEMAS
from bsip_cli.simulate.options import Rates, StudyOptions
from bsip_cli.simulate.study import simulate_study

LEFT_KB = (8, 4000)
"""So much room is on the disk before it is full."""

ENOUGH_KB = 200_000
AMENDED = {SCHEMAS[kind].file_name for stage in STAGES for kind in stage.amends}


def study_options(participants: int) -> StudyOptions:
    return StudyOptions(
        participants=participants,
        seed=3,
        sexes="MF",
        tasks=("static", "sequence"),
        durations_s={"static": 1.0, "sequence": 6.0},
        rates={"default": Rates(marker_hz=50, analog_hz=250)},
    )


@dataclass
class Bench:
    """A study, the undisturbed results, and a folder of results that is disturbed."""

    folder: Path
    chance: random.Random
    participants: int
    study: Path = field(init=False)
    out: Path = field(init=False)
    whole: dict[str, bytes] = field(init=False)
    takes_s: float = field(init=False)
    faults: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.study, self.out = self.folder / "study", self.folder / "out"
        simulate_study(self.study, study_options(self.participants))
        began = time.monotonic()
        done = self.run()
        self.takes_s = time.monotonic() - began
        if done.returncode:
            raise RuntimeError(f"the undisturbed run ended with {done.returncode}: {done.stderr}")
        self.whole = self.files()
        self.empty()

    def files(self) -> dict[str, bytes]:
        """Every file under a final name, by its path in the results."""
        paths = sorted(path for path in self.out.rglob("*") if path.is_file())
        final = (path for path in paths if not path.name.startswith("."))
        return {path.relative_to(self.out).as_posix(): path.read_bytes() for path in final}

    def empty(self) -> None:
        """Take all results away, but leave the folder: it may be a disk of its own."""
        for path in self.out.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()

    def start(self) -> subprocess.Popen:
        command = [sys.executable, "-m", "bsip_cli", "run", str(self.study)]
        return subprocess.Popen(
            [*command, "--out", str(self.out), "--jobs", "2"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def run(self) -> subprocess.CompletedProcess:
        return self.ended(self.start())

    def ended(self, process: subprocess.Popen) -> subprocess.CompletedProcess:
        _, said = process.communicate()
        return subprocess.CompletedProcess(process.args, process.returncode, "", said)

    def wait_at_random(self) -> None:
        time.sleep(self.chance.uniform(0.0, self.takes_s))

    # --- what must hold ---------------------------------------------------------------------

    def fault(self, what: str) -> None:
        self.faults.append(what)
        print(f"FAULT: {what}", file=sys.stderr)

    def check_what_is_left(self, disturbance: str) -> None:
        """Every file is that of the undisturbed run; or it is whole, where it may be another:
        not yet amended, or of the group while somebody was missing."""
        for name, content in self.files().items():
            if content == self.whole.get(name):
                continue
            if not name.startswith("group/") and Path(name).stem.split("_")[-1] not in AMENDED:
                self.fault(f"{disturbance}: {name} is not what an undisturbed run makes")
            if name.endswith(".html") and not content.endswith(b"</html>"):
                self.fault(f"{disturbance}: {name} is cut")
            if name.endswith(".parquet"):
                self.check_readable(disturbance, self.out / name)

    def check_readable(self, disturbance: str, path: Path) -> None:
        try:
            read_artifact(path, read_header(path)["kind"])
        except BadDataError as error:
            self.fault(f"{disturbance}: {error}")

    def check_completion(self, disturbance: str) -> None:
        """The next run ends well, with the undisturbed files and nothing half written."""
        done = self.run()
        if done.returncode:
            self.fault(f"after {disturbance}: exit code {done.returncode}: {done.stderr}")
        found = self.files()
        names = sorted(found.keys() | self.whole.keys())
        if other := [name for name in names if found.get(name) != self.whole.get(name)]:
            self.fault(f"after {disturbance}: not as undisturbed: {', '.join(other)}")
        if left := [str(path) for path in self.out.rglob(".*.part")]:
            self.fault(f"after {disturbance}: left over: {', '.join(left)}")
        self.empty()

    def check_told(self, disturbance: str, done: subprocess.CompletedProcess, words: str) -> bool:
        """Whether the run was refused: then in one clear sentence, and with exit code 2."""
        if done.returncode == 0:
            return False
        if done.returncode != 2 or words not in done.stderr or "Traceback" in done.stderr:
            self.fault(f"{disturbance}: exit code {done.returncode}: {done.stderr}")
        return True


# --- disturbances: each returns whether it hit a run at work --------------------------------------


def killed(bench: Bench) -> bool:
    """SIGKILL to bsip with all its processes."""
    process = bench.start()
    bench.wait_at_random()
    running = process.poll() is None
    if running:
        os.killpg(process.pid, signal.SIGKILL)
    bench.ended(process)
    return running


def one_process_killed(bench: Bench) -> bool:
    """SIGKILL to one of bsip's processes, as where memory runs out."""
    process = bench.start()
    bench.wait_at_random()
    listed = subprocess.run(["pgrep", "-g", str(process.pid)], capture_output=True, text=True)
    others = [int(pid) for pid in listed.stdout.split() if int(pid) != process.pid]
    hit = process.poll() is None and bool(others)
    if hit:
        try:
            os.kill(bench.chance.choice(others), signal.SIGKILL)
        except ProcessLookupError:
            hit = False
    bench.ended(process)
    return hit


def two_at_once(bench: Bench) -> bool:
    """A second bsip on the same results."""
    first = bench.start()
    time.sleep(bench.chance.uniform(0.0, bench.takes_s / 2))
    second = bench.start()
    ends = [bench.ended(process) for process in (first, second)]
    refused = [bench.check_told("two at once", end, "another bsip") for end in ends]
    return any(refused)


def disk_full(bench: Bench) -> bool:
    """The results' disk is full in the middle."""
    used_kb = shutil.disk_usage(bench.out).used // 1024
    _resize(bench.out, used_kb + bench.chance.randint(*LEFT_KB))
    hit = bench.check_told("full disk", bench.run(), "No space left on device")
    bench.check_what_is_left("full disk")
    _resize(bench.out, ENOUGH_KB)
    return hit


def made_read_only(bench: Bench) -> bool:
    """The results' disk becomes read-only in the middle."""
    process = bench.start()
    bench.wait_at_random()
    while not _remount(bench.out, "ro") and process.poll() is None:
        time.sleep(0.01)  # a file is being written
    hit = bench.check_told("read-only disk", bench.ended(process), "Read-only file system")
    bench.check_what_is_left("read-only disk")
    _remount(bench.out, "rw")
    return hit


def _resize(disk: Path, size_kb: int) -> None:
    subprocess.run(["mount", "-o", f"remount,size={size_kb}k", str(disk)], check=True)


def _remount(disk: Path, mode: str) -> bool:
    done = subprocess.run(["mount", "-o", f"remount,{mode}", str(disk)], capture_output=True)
    return done.returncode == 0


ANYWHERE: tuple[Callable[[Bench], bool], ...] = (killed, one_process_killed, two_at_once)
ON_OWN_DISK: tuple[Callable[[Bench], bool], ...] = (disk_full, made_read_only)


def mount_own_disk(folder: Path) -> bool:
    """A small disk for the results, where this user may make one."""
    folder.mkdir(exist_ok=True)
    command = ["mount", "-t", "tmpfs", "-o", f"size={ENOUGH_KB}k", "tmpfs", str(folder)]
    return subprocess.run(command, capture_output=True).returncode == 0


def disturb(bench: Bench, kinds: tuple[Callable[[Bench], bool], ...], rounds: int) -> Counter[str]:
    """Disturb until ``rounds`` disturbances have hit a run at work; how many of each kind.

    Where a run came through, and else every eighth time, the results are begun anew.
    """
    hits: Counter[str] = Counter()
    while hits.total() < rounds:
        kind = bench.chance.choice(kinds)
        name = kind.__name__.replace("_", " ")
        hit = kind(bench)
        hits[name] += hit
        bench.check_what_is_left(name)
        if not hit or bench.chance.random() < 1 / 8:
            bench.check_completion(name)
        print(f"{hits.total()} of {rounds} disturbances, {len(bench.faults)} faults", flush=True)
    bench.check_completion("all")
    return hits


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        own_disk = mount_own_disk(folder / "out")
        try:
            bench = Bench(folder, random.Random(arguments.seed), participants=2)
            kinds = (*ANYWHERE, *(ON_OWN_DISK if own_disk else ()))
            hits = disturb(bench, kinds, arguments.rounds)
        finally:
            if own_disk:
                subprocess.run(["umount", str(folder / "out")], check=True)
    for kind, count in sorted(hits.items()):
        print(f"{count:4d}  {kind}")
    if not own_disk:
        print("   -  disk full, made read only: only root can mount a disk for it")
    print(f"{hits.total()} disturbances, {len(bench.faults)} faults")
    return 1 if bench.faults else 0


if __name__ == "__main__":
    sys.exit(main())
