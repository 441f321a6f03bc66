"""The command as a user calls it, and a study folder that is cheap to make."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

PARTICIPANTS = "participant_id\tsex\tmass_kg\theight_m\nsub-01\tM\t70\t1.80\nsub-02\tF\t60\tn/a\n"


@dataclass(frozen=True)
class Answer:
    """What a call of the command left behind."""

    code: int
    out: str
    err: str

    @property
    def summary(self) -> str:
        """The last line, which counts what became of the units."""
        return self.err.splitlines()[-1]


@pytest.fixture(scope="session")
def bsip() -> Callable[..., Answer]:
    def call(*arguments: object) -> Answer:
        command = [sys.executable, "-m", "bsip_cli", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        return Answer(done.returncode, done.stdout, done.stderr)

    return call


@pytest.fixture
def failing(monkeypatch) -> Callable[[str, Callable[[Path], bool], OSError], None]:
    """Makes a method of ``Path`` raise for the paths of which something holds."""

    def make(method: str, of: Callable[[Path], bool], error: OSError) -> None:
        sound = getattr(Path, method)

        def fail(path: Path, *arguments, **options):
            if of(path):
                raise error
            return sound(path, *arguments, **options)

        monkeypatch.setattr(Path, method, fail)

    return make


@pytest.fixture
def empty_study(tmp_path) -> Path:
    """Two participants whose recordings hold nothing."""
    root = tmp_path / "study"
    for name in ("sub-01", "sub-02"):
        (root / name).mkdir(parents=True)
        (root / name / f"{name}_task-static.c3d").write_bytes(b"")
    (root / "participants.tsv").write_text(PARTICIPANTS)
    return root
