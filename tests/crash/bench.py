"""A small study, a command that is disturbed on it, and what must hold afterwards."""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from bsip_cli.artifacts import read_artifact, read_header
from bsip_cli.errors import BadDataError
from bsip_cli.simulate.study import simulate_study
from tests.small_study import small

GONE_S = 5.0  # within which all processes are gone after a signal, or after their parent
POLL_S = 0.005
_OWN = (".fingerprints.json", ".lock")
_UNFINISHED = ".*.bsip-part"


def make_study(folder: Path, participants: int) -> Path:
    simulate_study(folder, small(("MF" * participants)[:participants], static=1.0))
    return folder


@dataclass(frozen=True)
class Ended:
    """How a run ended, its words, and the processes that it left."""

    code: int
    said: str
    left: tuple[str, ...] = ()


Run = Callable[[Path, Path, Sequence[str], Mapping[str, str]], Ended]
"""A command on a study, with results in a folder, under variables of the environment."""


@dataclass(frozen=True)
class Bench:
    """``command`` on ``study`` with the results in ``before``, and what it makes undisturbed."""

    study: Path
    command: tuple[str, ...]
    before: Path
    whole: Mapping[str, bytes]
    run_command: Run

    @classmethod
    def of(cls, run: Run, study: Path, before: Path, *command: str) -> Bench:
        """Where ``before`` is not there, the command begins without any results."""
        before.mkdir(exist_ok=True)
        out = before.with_name(f"{before.name}_whole_{'_'.join(command)}")
        shutil.copytree(before, out)
        done = run(study, out, command, {})
        if done.code:
            raise RuntimeError(f"the undisturbed run ended with {done.code}: {done.said}")
        return cls(study, command, before, files_of(out), run)

    def fresh_out(self, out: Path) -> Path:
        shutil.rmtree(out, ignore_errors=True)
        return shutil.copytree(self.before, out)

    def run(self, out: Path, environment: Mapping[str, str]) -> Ended:
        return self.run_command(self.study, out, self.command, environment)

    def start(self, out: Path) -> subprocess.Popen:
        return start(self.study, out, self.command, {})

    # --- what must hold, as a list of what does not -------------------------------------------

    def broken_left(self, out: Path) -> list[str]:
        """What has a final name is whole; no lock is held."""
        files = files_of(out)
        unknown = [name for name in files if name not in self.whole and "_refusal-" not in name]
        pages = [name for name, text in files.items() if name.endswith(".html")]
        tables = [out / name for name in files if name.endswith(".parquet")]
        return [
            *(f"{name} is there, which no run makes" for name in unknown),
            *(f"{name} is cut" for name in pages if not files[name].endswith(b"</html>")),
            *(fault for fault in map(_unreadable, tables) if fault),
            *(f"{lock} is held" for lock in out.rglob(".lock") if _is_held(lock)),
        ]

    def wrong_next(self, out: Path) -> list[str]:
        """The next run ends well, with the undisturbed bytes and nothing half written."""
        command = [word for word in self.command if word != "--force"]
        done = self.run_command(self.study, out, command, {})
        left = [str(path) for path in out.rglob(_UNFINISHED)]
        return [
            *([f"the next run ended with {done.code}: {done.said}"] if done.code else []),
            *(f"the next run leaves {name} other than undisturbed" for name in self.others(out)),
            *(f"left over after the next run: {name}" for name in left),
        ]

    def others(self, out: Path) -> list[str]:
        """Names of files that are not what the undisturbed run makes."""
        found = files_of(out)
        names = sorted(found.keys() | self.whole.keys())
        return [name for name in names if found.get(name) != self.whole.get(name)]


UPSTREAM = {"ingest": (), "regress": ("ingest", "scale")}
"""Cheap stages whose calls fail, and what is upstream of them."""


def benches(run: Run, folder: Path, names: Sequence[str]) -> Iterator[Bench]:
    """Each stage where its results are not there yet, and where they are and are made again."""
    study = make_study(folder / "study", participants=1)
    for name in names:
        before = folder / f"before_{name}"
        for stage in UPSTREAM[name]:
            run(study, before, (stage,), {})
        yield Bench.of(run, study, before, name)
        yield Bench.of(run, study, before.with_name(f"{before.name}_whole_{name}"), name, "--force")


def by_processes(
    study: Path, out: Path, command: Sequence[str], environment: Mapping[str, str]
) -> Ended:
    """As users run it."""
    process = start(study, out, command, environment)
    done = ended(process)
    return Ended(done.code, done.said, tuple(left_after(process.pid)))


def start(
    study: Path, out: Path, command: Sequence[str], environment: Mapping[str, str]
) -> subprocess.Popen:
    """In a session of its own, by which its processes are known."""
    name, *options = command
    return subprocess.Popen(
        [sys.executable, "-m", "bsip_cli", name, str(study), "--out", str(out), *options],
        env={**os.environ, **environment},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def ended(process: subprocess.Popen) -> Ended:
    _, said = process.communicate()
    return Ended(process.returncode, said)


def processes_of(session: int) -> dict[int, str]:
    """Command lines by process of those in a session that are no zombies."""
    found = {}
    for place in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, its_session = (place / "stat").read_text().rsplit(")", 1)[1].split()[:4]
            if int(its_session) == session and state != "Z":
                found[int(place.name)] = (place / "cmdline").read_bytes().decode()
        except (FileNotFoundError, ProcessLookupError):
            continue  # it has ended meanwhile
    return found


def left_after(session: int, seconds: float = GONE_S) -> list[str]:
    """Processes of a session that are there still after so many seconds."""
    until = time.monotonic() + seconds
    while (left := processes_of(session)) and time.monotonic() < until:
        time.sleep(POLL_S)
    return [f"{pid} {line}" for pid, line in left.items()]


def files_of(out: Path) -> dict[str, bytes]:
    """Every file under a final name, by its path in the results."""
    paths = (path for path in sorted(out.rglob("*")) if path.is_file() and path.name not in _OWN)
    final = (path for path in paths if not path.match(_UNFINISHED))
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in final}


def _unreadable(path: Path) -> str:
    try:
        read_artifact(path, read_header(path)["kind"])
    except BadDataError as error:
        return str(error)
    return ""


def _is_held(lock: Path) -> bool:
    with lock.open("a") as handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False
