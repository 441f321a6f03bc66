"""The command, and a study folder that is cheap to make."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.program import Program

COLUMNS = "participant_id\tsex\tmass_kg\theight_m"


@pytest.fixture(scope="session")
def bsip() -> Program:
    return Program()


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


def write_table(root: Path, *lines: str) -> None:
    """participants.tsv, with a line for each."""
    (root / "participants.tsv").write_text("\n".join([COLUMNS, *lines, ""]))


def make_people(root: Path, count: int) -> None:
    """Folders of participants, in each a recording that holds nothing."""
    for name in (f"sub-{k:02d}" for k in range(1, count + 1)):
        (root / name).mkdir(parents=True, exist_ok=True)
        (root / name / f"{name}_task-static.c3d").write_bytes(b"")


@pytest.fixture
def empty_study(tmp_path) -> Path:
    """Two participants whose recordings hold nothing."""
    root = tmp_path / "study"
    make_people(root, 2)
    write_table(root, "sub-01\tM\t70\t1.80", "sub-02\tF\t60\tn/a")
    return root
