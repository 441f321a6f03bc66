"""Compiled code: where its cache may lie, found again, discarded when broken, and done without."""

from __future__ import annotations

import errno
import importlib.util
import os
import stat
from pathlib import Path

import numba
import numpy as np
import pytest

from bsip_cli.caches import cache_home
from bsip_cli.motion import compiled


@pytest.fixture
def temporary(tmp_path, monkeypatch) -> Path:
    """The folder for temporary files of a user whose home takes none."""
    (tmp_path / "file").write_text("")
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "file" / "home"))
    monkeypatch.setattr("tempfile.tempdir", str(shared))
    cache_home.cache_clear()
    yield shared
    cache_home.cache_clear()


def own(temporary: Path) -> Path:
    return temporary / f"bsip-cache-{os.geteuid()}"


def test_the_home_comes_first(temporary, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_home() == tmp_path / "home" / ".cache"


def test_of_homes_the_named_one_and_a_link_there_is_followed(temporary, tmp_path, monkeypatch):
    (tmp_path / "scratch").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "scratch")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "link"))
    assert cache_home() == tmp_path / "scratch"


def test_nothing_is_made_in_the_working_folder(temporary, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", "relative")
    before = sorted(tmp_path.iterdir())
    assert cache_home() == own(temporary)
    assert sorted(tmp_path.iterdir()) == before


def test_without_a_home_it_is_the_users_alone(temporary):
    assert cache_home() == own(temporary)
    assert stat.S_IMODE(own(temporary).stat().st_mode) == 0o700


@pytest.mark.parametrize("home", ["file/home", "home"])
def test_a_folder_or_home_of_another_user_is_not_taken(temporary, tmp_path, monkeypatch, home):
    """``sudo`` may leave the caller's HOME."""
    me = os.geteuid()
    monkeypatch.setenv("HOME", str(tmp_path / home))
    monkeypatch.setattr(os, "geteuid", lambda: me + 1)
    assert cache_home() is None


@pytest.mark.parametrize("kind", ["open to anybody", "link"])
def test_a_folder_that_is_not_the_users_alone_is_not_taken(temporary, tmp_path, kind):
    if kind == "link":
        own(temporary).symlink_to(tmp_path)
    else:
        own(temporary).mkdir()
        own(temporary).chmod(0o777)
    assert cache_home() is None


def test_where_others_may_rename_it_no_folder_is_made(temporary):
    temporary.chmod(0o777)
    assert cache_home() is None
    assert not own(temporary).exists()


SOURCE = """
from bsip_cli.motion.compiled import compiled

@compiled
def total(x):
    s = x[0]
    for k in range(1, x.size):
        s += x[k]
    return s
"""
X = np.array([0.5, 2.0, 4.25])


@pytest.fixture
def source(tmp_path, monkeypatch) -> Path:
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    file = tmp_path / "code" / "summing.py"
    file.parent.mkdir()
    file.write_text(SOURCE)
    return file


@pytest.fixture
def nowhere(source, monkeypatch):
    """Neither beside the code nor in the home can anything be written, not by root either."""
    (source.parent / "__pycache__").write_text("")
    (source.parent / "file").write_text("")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(source.parent / "file" / "home"))
    monkeypatch.setattr("tempfile.tempdir", str(source.parent))
    cache_home.cache_clear()
    yield
    cache_home.cache_clear()


def another_process(file: Path):
    """The function as a process finds it that has not called it yet."""
    spec = importlib.util.spec_from_file_location("summing", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.total


def hits(function, x=X) -> int:
    """How often the cache served a first call; its result is checked."""
    assert function(x) == x.sum()
    return sum(function.stats.cache_hits.values())


def kept(file: Path) -> list[Path]:
    return sorted(file.parent.rglob("*.nbc"))


def test_is_compiled_once(source):
    assert [hits(another_process(source)) for _ in range(3)] == [0, 1, 1]
    assert len(kept(source)) == 1


def test_each_signature_has_a_file_of_its_own(source):
    """So that two processes that begin at once cannot take each other's for theirs."""
    first, second = another_process(source), another_process(source)
    integers = np.arange(5)
    assert [hits(first), hits(second, integers)] == [0, 0]
    assert [hits(another_process(source)), hits(another_process(source), integers)] == [1, 1]
    assert len(kept(source)) == 2


@pytest.mark.parametrize("other", ["code", "numba"])
def test_of_other_code_or_another_numba_it_is_compiled_anew(source, monkeypatch, other):
    hits(another_process(source))
    if other == "code":
        source.write_text(SOURCE.replace("s = x[0]", "s = 0.0 + x[0]"))
    else:
        monkeypatch.setattr(numba, "__version__", "0.1")
    assert hits(another_process(source)) == 0


def one_bit(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


@pytest.mark.parametrize(
    "damage",
    [lambda content: b"", lambda content: content[:100], lambda content: b"\x80garbage", one_bit],
    ids=["empty", "truncated", "garbage", "one bit"],
)
def test_what_is_broken_is_made_anew(source, damage):
    hits(another_process(source))
    (file,) = kept(source)
    file.write_bytes(damage(file.read_bytes()))
    assert [hits(another_process(source)) for _ in range(2)] == [0, 1]


def test_what_cannot_be_read_is_compiled(source):
    hits(another_process(source))
    (file,) = kept(source)
    file.unlink()
    file.mkdir()
    assert hits(another_process(source)) == 0


def test_a_full_disk_costs_the_cache_only(source, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(compiled._Sealed, "save", full)
    assert [hits(another_process(source)) for _ in range(2)] == [0, 0]


def test_read_only_install_without_a_home(source, nowhere):
    assert [hits(another_process(source)) for _ in range(2)] == [0, 1]
    (file,) = kept(source)
    assert file.is_relative_to(cache_home())
    assert cache_home().parent == source.parent


def test_no_place_at_all(source, nowhere, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(source.parent / "file"))
    assert [hits(another_process(source)) for _ in range(2)] == [0, 0]
    assert cache_home() is None
