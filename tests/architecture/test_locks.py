"""The locks: every file by its hash, every dependency of pyproject.toml within its range."""

from __future__ import annotations

import re
import tomllib
from functools import cache
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]
NEEDS = {
    "requirements.lock": [
        *PROJECT["project"]["dependencies"],
        *EXTRAS["dev"],
        *PROJECT["build-system"]["requires"],
    ],
    "requirements-cluster.lock": EXTRAS["cluster"],
    "requirements-docs.lock": EXTRAS["docs"],
}
HASH = re.compile(r"--hash=sha256:[0-9a-f]{64}")
LOCKED = pytest.mark.parametrize(
    ("lock", "need"), [(lock, need) for lock, needs in NEEDS.items() for need in needs]
)


@cache
def pins(lock: str) -> dict[str, Requirement]:
    """The requirement of each package, by its name."""
    found = [Requirement(line.split(" --hash")[0]) for line in lines(lock)]
    return {canonicalize_name(pin.name): pin for pin in found}


@cache
def lines(lock: str) -> list[str]:
    """Logical lines, without comments."""
    text = (ROOT / lock).read_text(encoding="utf-8").replace("\\\n", " ")
    return [re.sub(r"\s+", " ", line) for line in text.splitlines() if not line.startswith("#")]


@pytest.mark.parametrize("lock", NEEDS)
def test_every_line_is_one_version_and_its_hashes(lock):
    assert len(lines(lock)) > 10
    for line in lines(lock):
        pin, *hashes = line.split(" --hash")
        assert [part.operator for part in Requirement(pin).specifier] == ["=="], line
        assert hashes
        assert all(HASH.fullmatch(f"--hash{rest}") for rest in hashes), line


@pytest.mark.parametrize("lock", NEEDS)
def test_names_no_place(lock):
    """No index, no address, no path: pip takes the files from where its user has it look."""
    assert not re.search(r"://|/|--(?!hash=)", (ROOT / lock).read_text(encoding="utf-8"))


@LOCKED
def test_a_dependency_is_pinned_within_its_range(lock, need):
    wanted = Requirement(need)
    pin = pins(lock)[canonicalize_name(wanted.name)]
    assert wanted.specifier.contains(next(iter(pin.specifier)).version)
    assert pin.marker is None
