"""What is no regular file is named and never opened: who opens a FIFO waits for ever."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.files.regular import check_regular, fault_of
from bsip_cli.recordings.read import read_recording
from tests.cli.test_odd_configuration import READERS


@pytest.fixture
def fifo(tmp_path):
    """Makes a FIFO of a name."""

    def made(name: str) -> Path:
        os.mkfifo(tmp_path / name)
        return tmp_path / name

    return made


def test_regular_files_pass(tmp_path):
    file = tmp_path / "a.c3d"
    file.write_bytes(b"")
    (tmp_path / "link.c3d").symlink_to(file)
    assert fault_of(file) == fault_of(tmp_path / "link.c3d") == ""
    check_regular(file)


def test_what_is_found_is_named(tmp_path, fifo, monkeypatch):
    monkeypatch.chdir(tmp_path)  # the name of a socket is short
    (tmp_path / "broken").symlink_to("nowhere.c3d")
    (tmp_path / "circle").symlink_to("circle")
    with socket.socket(socket.AF_UNIX) as one:
        one.bind("socket")
    names = {
        "broken": "is a broken symbolic link to nowhere.c3d",
        "circle": "cannot be looked at (Too many levels of symbolic links)",
        fifo("fifo").name: "is a FIFO",
        "socket": "is a socket",
        "absent": "does not exist",
        "/dev/null": "is a device",
        ".": "is a folder",
        "n" * 300: "cannot be looked at (File name too long)",
        "a\0b": "cannot be looked at (embedded null byte)",
    }
    assert {name: fault_of(Path(name)) for name in names} == names


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_closed_file(tmp_path):
    file = tmp_path / "a.c3d"
    file.touch(mode=0)
    with pytest.raises(BadDataError, match="no permission"):
        check_regular(file)


@pytest.mark.parametrize("ending", ["c3d", "trc", "TRC"])
def test_a_fifo_is_no_recording(fifo, ending):
    with pytest.raises(BadDataError, match="is a FIFO"):
        read_recording(fifo(f"a.{ending}"))


@pytest.mark.parametrize("kind", READERS)
def test_a_fifo_is_no_toml(fifo, kind):
    with pytest.raises(UsageError, match="is a FIFO"):
        READERS[kind](fifo("a.toml"))


def test_commands_refuse_a_fifo(fifo, bsip, tmp_path):
    recording = fifo("a.trc")
    assert (said := bsip("markers", recording)).code == 3 and "is a FIFO" in said.err
    hidden = ("--effect", "plate_gain", "--size", "5")
    assert (said := bsip("inject", recording, tmp_path / "b.trc", *hidden)).code == 2
    assert "is a FIFO" in said.err
