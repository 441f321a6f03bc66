"""What is no regular file is never opened; configuration that nobody means is refused soon."""

import errno
import os
import socket
from pathlib import Path

import pytest

from bsip_cli.body.exports.osim import load_body_map
from bsip_cli.body.markersets import load_marker_set
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.config import load_config
from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.files.regular import check_regular, fault_of
from bsip_cli.recordings.read import read_recording
from bsip_cli.study.participants import read_people

READERS = {
    "options": lambda path: load_config([path]),
    "marker set": lambda path: load_marker_set(str(path)),
    "skeleton": lambda path: load_skeleton(str(path)),
    "map of bodies": lambda path: load_body_map(str(path)),
}
NO_TOML = {
    "brackets": b"a = " + b"[" * 100_000,
    "brackets in lines": b"a = [\n" + b"[\n" * 50_000,
    "deep": b"a = " + b"[" * 50 + b"]" * 50,
    "deep by dots": b"a." * 30 + b"a = 1",
    "long by dots": b"a." * 50_000 + b"a = 1",
    "digits": b"a = " + b"9" * 9_000,
    "hexadecimal": b"a = 0x" + b"f" * 9_000,
    "65 bits": b"a = 9223372036854775808",
    "NUL": b'a = "\0"',
    "UTF-16": "a = 1".encode("utf-16"),
    "Latin-1": 'a = "é"'.encode("latin-1"),
    "large": b"#\n" * 600_000,
}
WRONG = {
    "ingest.max_gap_s = inf": "finite number",
    "ingest.max_gap_s = 1e400": "finite number",
    "ingest.max_gap_s = -nan": "finite number",
    "ingest.max_gap_s = -0.1": "greater than or equal to 0",
    "ingest.max_gap_s = true": "valid number",
    "ingest.max_gap_s = '0.1'": "valid number",
    "ingest.max_gap_s = 1979-05-27": "valid number",
    "ingest.max_gap_s = {a = {b = 1}}": "valid number",
    "ingest.plates = [1.5]": "valid integer",
    "ingest.plates = 1": "valid array",
    "ingest.prefixes = [1]": "prefixes = ",
    "ingest.prefixes = {a = 1}": "valid string",
    "scale.frames = 1000000000000": "less than or equal to 10000",
    "ik.iterations = 1000000000000": "less than or equal to 10000",
}


def refused(read, path: Path) -> str:
    with pytest.raises(UsageError) as refusal:
        read(path)
    sentence = str(refusal.value)
    assert str(path) in sentence and len(sentence) < 500
    return sentence


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("case", NO_TOML)
def test_what_is_no_toml(tmp_path, reader, case):
    path = tmp_path / "a.toml"
    path.write_bytes(NO_TOML[case])
    refused(READERS[reader], path)


@pytest.mark.parametrize("line", WRONG)
def test_options_of_another_type_or_size(tmp_path, line):
    path = tmp_path / "study.toml"
    path.write_text(line)
    sentence = refused(READERS["options"], path)
    assert WRONG[line] in sentence and line.split()[0] in sentence


def test_many_faults_are_counted(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text("".join(f"a{k} = 1\n" for k in range(5_000)))
    with pytest.raises(UsageError, match=r"unknown option a19.*; and 4980 more"):
        load_config([path])


@pytest.mark.parametrize(
    ("reader", "text", "found"),
    [
        ("marker set", '[segments]\nhead = {A = ""}\n[weights]\nA = inf\n', "weight of 0 or more"),
        ("skeleton", "segments = 3", "not a skeleton"),
        ("skeleton", "[[segments]]\nname = 1\nparent = ''\njoint = ''\n", "not a skeleton"),
        (
            "skeleton",
            "[[segments]]\nname = 'a'\nparent = ''\njoint = 'b'\ntype = ['free']\ntable = ''\n",
            "values that are no text",
        ),
        ("map of bodies", "groups = 3", "not a map"),
        ("map of bodies", "[[groups]]\nbodies = 'pelvis'\nsegments = [1]\njoints = []", "no list"),
    ],
)
def test_other_shapes(tmp_path, reader, text, found):
    path = tmp_path / "a.toml"
    path.write_text(text)
    assert found in refused(READERS[reader], path)


@pytest.mark.parametrize("name", ["a.c3d", "a.trc", "a.toml", "participants.tsv"])
def test_a_disk_that_fails(tmp_path, failing, name):
    path = tmp_path / name
    path.write_text("a = 1\n")
    read = {".toml": READERS["marker set"], ".tsv": read_people}.get(path.suffix, read_recording)
    failing("open", lambda opened: opened == path, OSError(errno.EIO, "Input/output error"))
    with pytest.raises((BadDataError, UsageError), match="Input/output error"):
        read(path)


# --- what is no regular file is named and never opened: who opens a FIFO waits for ever -----------


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
