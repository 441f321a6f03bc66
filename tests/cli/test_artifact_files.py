"""Artifacts as files: whole or not there, described, and refused when they are something else."""

from __future__ import annotations

import json
import os

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bsip_cli import artifacts
from bsip_cli.artifacts import (
    read_artifact,
    read_header,
    write_artifact,
    write_artifact_in_parts,
    write_atomically,
)
from bsip_cli.commands.look import info
from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.schemas import SCHEMAS

NOTES = {"made_by": {"stage": "identify"}, "messages": [], "facts": {}}
BLOCKS = pd.DataFrame({"trial": ["a", "b"], "start_s": [0.0, 1.0], "end_s": [1.0, np.nan]})


@pytest.fixture
def path(tmp_path):
    return tmp_path / "sub-01" / "sub-01_used-blocks.parquet"


@pytest.fixture
def written(path):
    write_artifact(path, "used-blocks", BLOCKS, NOTES)
    return path


# --- writing ------------------------------------------------------------------------------------


def test_comes_back_as_written(written):
    pd.testing.assert_frame_equal(read_artifact(written, "used-blocks"), BLOCKS, check_dtype=False)
    header = {"kind": "used-blocks", "schema_version": 1, "provenance": NOTES}
    assert read_header(written) == header


def test_columns_carry_unit_frame_and_meaning(written):
    field = pq.read_schema(written).field("start_s")
    assert field.type == pa.float64()
    assert field.metadata[b"unit"] == b"s"
    assert field.metadata[b"meaning"] == b"interval that was used"


@pytest.mark.parametrize("before", [None, b"what was there"])
def test_interrupted_write_leaves_nothing_half(path, before):
    """Neither under the final name nor beside it; what was there stays."""
    path.parent.mkdir()
    if before is not None:
        path.write_bytes(before)

    def write(temporary):
        assert temporary != path
        temporary.write_bytes(b"half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_atomically(path, write)
    assert [file.read_bytes() for file in path.parent.iterdir()] == [before] * (before is not None)


def test_full_disk_leaves_the_earlier_artifact(written, monkeypatch):
    content = written.read_bytes()

    def full(temporary, *_):
        temporary.write_bytes(content[:100])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(artifacts, "_write_tables", full)
    with pytest.raises(UsageError) as caught:
        write_artifact(written, "used-blocks", BLOCKS.iloc[:1], NOTES)
    assert "cannot be written (No space left on device)" in str(caught.value)
    assert [file.read_bytes() for file in written.parent.iterdir()] == [content]


def test_place_that_cannot_be_written_to(tmp_path):
    (tmp_path / "sub-01").write_text("a file where the folder should be")
    with pytest.raises(UsageError, match="--out"):
        write_artifact(tmp_path / "sub-01" / "x.parquet", "used-blocks", BLOCKS, NOTES)


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        (BLOCKS.drop(columns="end_s"), r"missing columns \['end_s'\]"),
        (BLOCKS.assign(colour="red"), r"unknown columns \['colour'\]"),
    ],
)
def test_wrong_columns_are_a_bug_of_the_stage(path, frame, said):
    with pytest.raises(ValueError, match=said):
        write_artifact(path, "used-blocks", frame, NOTES)
    assert not path.exists()


def test_families_of_columns():
    schema = SCHEMAS["kinematics"]
    assert schema.column("q_waist_x").unit == "m, rad, 1"
    assert schema.column("q_").name == "q_*"
    assert schema.column("r_waist_x") is None


# --- reading ------------------------------------------------------------------------------------


def test_only_wanted_rows_are_read(path):
    parts = (BLOCKS.assign(start_s=BLOCKS["start_s"] + k) for k in range(3))
    write_artifact_in_parts(path, "used-blocks", parts, lambda: NOTES)
    found = read_artifact(path, "used-blocks", trial=["b", "c"])
    assert found["start_s"].tolist() == [1.0, 2.0, 3.0]
    assert set(found["trial"]) == {"b"}
    assert read_artifact(path, "used-blocks", trial=["c"]).empty


def test_wanted_rows_of_an_empty_table(path):
    write_artifact(path, "used-blocks", BLOCKS.iloc[:0], NOTES)
    assert list(read_artifact(path, "used-blocks", trial=["a"])) == list(BLOCKS)


@pytest.mark.parametrize(
    "damage",
    [
        lambda path: pq.write_table(pa.table({"x": [1, 2]}), path),
        lambda path: path.write_bytes(path.read_bytes()[:-30]),
        lambda path: path.write_text("trial,start_s,end_s\n"),
        lambda path: path.write_bytes(b""),
        lambda path: path.unlink(),
    ],
    ids=["foreign", "truncated", "text", "empty", "absent"],
)
def test_what_is_no_artifact_is_refused_by_name(written, damage):
    damage(written)
    with pytest.raises(BadDataError) as caught:
        read_artifact(written, "used-blocks")
    assert str(written) in str(caught.value)
    assert "is not an artifact of bsip" in str(caught.value)


def test_damage_in_the_middle_is_refused(written):
    """The header stands at the end of the file, so it alone proves nothing."""
    content = bytearray(written.read_bytes())
    content[4:120] = bytes(116)
    written.write_bytes(content)
    for read in (read_header, read_artifact):
        with pytest.raises(BadDataError, match="has changed since bsip wrote it"):
            read(written, "used-blocks")


def with_header(path, **changes):
    table = pq.read_table(path)
    header = json.loads(table.schema.metadata[b"bsip"]) | changes
    pq.write_table(table.replace_schema_metadata({"bsip": json.dumps(header)}), path)


def test_unknown_version_names_the_command_to_rerun(written):
    with_header(written, schema_version=99)
    with pytest.raises(BadDataError) as caught:
        read_artifact(written, "used-blocks")
    assert str(caught.value) == (
        f"{written}: holds used-blocks version 99; expected used-blocks version 1. "
        "To correct it: run `bsip identify` again."
    )


@pytest.mark.parametrize("change", ["without", "with"])
def test_other_columns_are_another_version(written, change):
    table = pq.read_table(written)
    name = table.column_names[-1] if change == "without" else "colour"
    other = table.drop([name]) if change == "without" else table.append_column(name, table[0])
    pq.write_table(other, written)
    for read in (read_header, read_artifact):
        with pytest.raises(BadDataError, match=f"holds used-blocks {change} {name}, as another"):
            read(written, "used-blocks")


def test_another_kind_under_this_name(written):
    with pytest.raises(BadDataError, match="holds used-blocks version 1; expected bsip version 1"):
        read_artifact(written, "bsip")


# --- damage -------------------------------------------------------------------------------------


def test_no_flipped_byte_is_read_as_another_number(path):
    """Whatever byte of the file is hit: the same table, or a sentence that names the file."""
    rng = np.random.default_rng(8)
    table = pd.DataFrame(
        {"trial": ["a"] * 400, "start_s": rng.normal(size=400), "end_s": np.arange(400.0)}
    )
    write_artifact(path, "used-blocks", table, NOTES)
    sound = path.read_bytes()
    refused = 0
    for place in range(0, len(sound), 7):
        damaged = bytearray(sound)
        damaged[place] ^= 0xFF
        path.write_bytes(damaged)
        try:
            found = read_artifact(path, "used-blocks")
        except BadDataError as error:
            assert str(path) in str(error)
            refused += 1
        else:
            pd.testing.assert_frame_equal(found, table, check_dtype=False)
    assert refused > 0.5 * len(range(0, len(sound), 7))


# --- metadata that are not bsip's: refused in one sentence, or printed as they are ----------------


MADE_BY = {
    "stage": "scale",
    "bsip_version": "0.1.0",
    "libraries": {"numpy": "2.0"},
    "inputs": {"a": "0"},
    "options": {"x": 1},
}
PROVENANCE = {"made_by": MADE_BY, "messages": ["said"], "facts": {"n": 1}}
HEADER = {"kind": "refusal", "schema_version": 1, "provenance": PROVENANCE}

WRONG_HEADERS = {
    "no key": None,
    "no JSON": b"{",
    "no UTF-8": b'"\xff"',
    "brackets": b"[" * 100_000,
    "many digits": b'{"kind": ' + b"9" * 10_000 + b"}",
    "list": [1],
    "number": 5,
    "nothing": {},
    "no provenance": {"kind": "refusal", "schema_version": 1},
    "kind is a number": HEADER | {"kind": 5},
    "kind is a list": HEADER | {"kind": ["refusal"]},
    "version is a text": HEADER | {"schema_version": "1"},
    "provenance is a list": HEADER | {"provenance": []},
    "made by a text": HEADER | {"provenance": PROVENANCE | {"made_by": "scale"}},
    "stage is a number": HEADER | {"provenance": PROVENANCE | {"made_by": MADE_BY | {"stage": 1}}},
    "inputs are a list": HEADER | {"provenance": PROVENANCE | {"made_by": {"inputs": [1]}}},
    "messages are a text": HEADER | {"provenance": PROVENANCE | {"messages": "said"}},
    "messages are lists": HEADER | {"provenance": PROVENANCE | {"messages": [["said"]]}},
    "facts are a list": HEADER | {"provenance": PROVENANCE | {"facts": []}},
    "amended by a text": HEADER | {"provenance": PROVENANCE | {"amended_by": "extend"}},
}


def write(path, header):
    content = header if isinstance(header, bytes | None) else json.dumps(header).encode()
    notes = {} if content is None else {b"bsip": content}
    column = pa.field("trial", pa.string(), metadata={b"\xff": b"\xfe", b"unit": b"a\nforged"})
    pq.write_table(pa.table([["a"]], schema=pa.schema([column], metadata=notes)), path)
    return path


@pytest.mark.parametrize("case", WRONG_HEADERS)
def test_metadata_of_another_shape(tmp_path, case):
    path = write(tmp_path / "a.parquet", WRONG_HEADERS[case])
    for read in (read_header, lambda file: read_artifact(file, "refusal")):
        with pytest.raises(BadDataError, match="is not an artifact of bsip"):
            read(path)
    with pytest.raises(BadDataError, match="is not an artifact of bsip"):
        list(info(path))


@pytest.mark.parametrize("made_by", [MADE_BY, {}])
def test_foreign_texts_are_shown_in_their_line(tmp_path, monkeypatch, made_by):
    provenance = PROVENANCE | {"made_by": made_by, "messages": ["a\nforged"]}
    path = write(tmp_path / "a.parquet", HEADER | {"provenance": provenance})
    monkeypatch.setattr("bsip_cli.artifacts._check_intact", lambda _: None)
    lines = list(info(path))
    assert "warning   a?forged" in lines
    assert not [line for line in lines if "\n" in line]


@pytest.mark.parametrize(
    ("make", "found"),
    [
        (lambda path: write(path, WRONG_HEADERS["list"]), "is not an artifact of bsip"),
        (lambda path: path.write_bytes(b"no artifact"), "is not an artifact of bsip"),
        (os.mkfifo, "is a FIFO"),
        (lambda path: None, "does not exist"),
    ],
)
def test_the_command(tmp_path, bsip, make, found):
    make(path := tmp_path / "a.parquet")
    said = bsip("info", path)
    (line,) = said.err.splitlines()
    assert said.code == 3 and f"{path}: " in line and found in line
