"""Names that others chose forge no line, steer no terminal and stop no command."""

from __future__ import annotations

import os
import unicodedata
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.errors import BadDataError, printable
from bsip_cli.report.blocks import Document, Paragraph, Section, render
from tests.recordings.recording_writers import standing_markers, write_trc

FORGED = "bsip run: 30 done"
NAMES = {
    "line": f"a\n{FORGED}",
    "return": f"a\r{FORGED}",
    "separator": f"a\u2028{FORGED}",
    "escape": "a\x1b[2J\x1b]0;title\x07",
    "override": "a\u202egnp.exe\u202c",
    "isolate": "a\u2067b\u2069\u200f",
    "bytes": os.fsdecode(b"a\xff\xfe"),
}
STEERING = {"Cc", "Cf", "Cs", "Zl", "Zp"}


def check(*printed: str) -> None:
    """Nothing steers, and no line is forged."""
    for text in printed:
        lines = text.split("\n")
        assert not [c for c in "".join(lines) if unicodedata.category(c) in STEERING]
        assert not [line for line in lines if line.startswith(FORGED)]
        assert "Traceback" not in text


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_errors(name):
    error = BadDataError(f"found {name}", expected=name, remedy=name, file=Path(name))
    check(str(error), printable(name))


def test_what_is_no_danger_stays():
    assert printable("Épaule gauche, 5\N{NO-BREAK SPACE}m, 体") == (
        "Épaule gauche, 5\N{NO-BREAK SPACE}m, 体"
    )


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_a_report(name):
    section = Section("s", name, (Paragraph(f"It is {name}, 5 mm."),))
    page = render(Document(name, name, (), (section,)))
    page.encode()
    assert "It is a?" in page and "5\N{NO-BREAK SPACE}mm" in page
    check(page)


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_a_recording_and_its_labels(bsip, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    markers, labels = standing_markers(10)
    label = name.encode("utf-8", "replace").decode().replace("\r", "\x85").replace("\n", "\x0b")
    path = write_trc(tmp_path / "a.trc", np.arange(10) / 100.0, markers, [label, *labels[1:]])
    path = path.rename(tmp_path / f"{name}.trc")
    said = bsip("markers", path)
    check(said.out, said.err)
    assert said.code == 3 and "8 markers, 10 frames" in said.out
    (made,) = tmp_path.glob("*.toml")
    check(made.read_text(encoding="utf-8"))
    again = bsip("markers", path, "--marker-set", made)
    check(again.out, again.err)
    assert again.code in (0, 3)
    lost = bsip("markers", f"{name}.c3d")
    check(lost.err)
    assert lost.code == 3


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_a_terminal_of_few_letters(bsip, tmp_path, monkeypatch, encoding):
    markers, labels = standing_markers(10)
    path = write_trc(tmp_path / "a.trc", np.arange(10) / 100.0, markers, [*labels[1:], "体"])
    monkeypatch.setenv("PYTHONIOENCODING", encoding)
    monkeypatch.chdir(tmp_path)
    said = bsip("markers", path)
    assert said.code == 3 and said.err == ""
    assert "体" in said.out or "\\u4f53" in said.out


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_a_study(bsip, empty_study, name):
    (empty_study / "sub-01" / f"{name}.c3d").write_bytes(b"")
    cell = name.encode("utf-8", "surrogateescape").replace(b"\n", b"\x0b")
    with (empty_study / "participants.tsv").open("ab") as table:
        table.write(
            b'"%s"\tM\t70\t1.8\nsub-02\t"%s"\t70\t1.8\n' % (name.encode(errors="replace"), cell)
        )
    root = empty_study.rename(empty_study.with_name(name))
    said = bsip("ingest", root, "--out", root.with_name("out"))
    check(said.out, said.err)
    assert said.code in (2, 3)
    said = bsip("inject", root, root.with_name("copy"), "--effect", "plate_gain", "--size", "5")
    check(said.out, said.err)
    assert said.code in (2, 3)
