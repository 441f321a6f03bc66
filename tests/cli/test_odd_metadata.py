"""Parquet files whose metadata are not bsip's: refused in one sentence, or printed as they are."""

from __future__ import annotations

import json
import os

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bsip_cli.artifacts import read_artifact, read_header
from bsip_cli.commands.look import info
from bsip_cli.errors import BadDataError

MADE_BY = {
    "stage": "scale",
    "bsip_version": "0.1.0",
    "libraries": {"numpy": "2.0"},
    "inputs": {"a": "0"},
    "options": {"x": 1},
}
PROVENANCE = {"made_by": MADE_BY, "messages": ["said"], "facts": {"n": 1}}
HEADER = {"kind": "refusal", "schema_version": 1, "provenance": PROVENANCE}

WRONG = {
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


@pytest.mark.parametrize("case", WRONG)
def test_metadata_of_another_shape(tmp_path, case):
    path = write(tmp_path / "a.parquet", WRONG[case])
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
        (lambda path: write(path, WRONG["list"]), "is not an artifact of bsip"),
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
