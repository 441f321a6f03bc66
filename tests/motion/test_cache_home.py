"""Code that is run lies in the cache: no other user may put any there."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from bsip_cli.caches import cache_home


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


def test_of_homes_the_named_one(temporary, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "named"))
    assert cache_home() == tmp_path / "named"


def test_a_link_in_the_home_is_followed(temporary, tmp_path, monkeypatch):
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


def test_a_folder_that_anybody_may_write_to_is_not_taken(temporary):
    own(temporary).mkdir()
    own(temporary).chmod(0o777)
    assert cache_home() is None


def test_a_link_among_temporary_files_is_not_followed(temporary, tmp_path):
    own(temporary).symlink_to(tmp_path)
    assert cache_home() is None


def test_where_others_may_rename_it_no_folder_is_made(temporary):
    temporary.chmod(0o777)
    assert cache_home() is None
    assert not own(temporary).exists()
