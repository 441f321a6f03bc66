"""TRC tables as programs and editors leave them, and texts that hold no recording."""

from __future__ import annotations

import errno
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.read import read_recording
from bsip_cli.recordings.units import force_in_N, length_in_m, moment_in_Nm
from tests.recordings.recording_writers import (
    standing_markers,
    standing_wrench,
    write_mot,
    write_trc,
)

N = 40
MARKERS, LABELS = standing_markers(N)


def _lines(tmp_path) -> list[str]:
    path = write_trc(tmp_path / "a.trc", np.arange(N) / 100.0, MARKERS, LABELS)
    return path.read_text().splitlines()


def _read(tmp_path, lines):
    (tmp_path / "a.trc").write_text("\n".join(lines) + "\n")
    return read_recording(tmp_path / "a.trc")


def _rows(lines, edit) -> list[str]:
    """The rows of the table edited: ``edit`` gets a row's number and cells."""
    return [*lines[:-N], *("\t".join(edit(k, row.split("\t"))) for k, row in enumerate(lines[-N:]))]


def _is_as_written(recording, labels=LABELS):
    assert recording.labels == tuple(labels)
    own = [LABELS.index(label) for label in labels]
    np.testing.assert_allclose(recording.markers_m, MARKERS[:, own], atol=1e-6)


UNNAMED = {
    "in some rows": (lambda k, cells: cells + ["1", "2", "3"] * 2 * (k % 3 == 1), 2),
    "in the first row only": (lambda k, cells: cells + ["7.5", "8", "9"] * (k == 0), 1),
    "in the last row only": (lambda k, cells: cells + ["7.5", "8", "9"] * (k == N - 1), 1),
    "in all rows": (lambda k, cells: [*cells, "1", "2", "3"], 1),
    "with empty cells": (lambda k, cells: [*cells, *["", "", ""] * 3, *["4"] * 3 * (k > 20)], 4),
    "more and more": (lambda k, cells: cells + ["1", "2", "3"] * (k // 10), 3),
}


@pytest.mark.parametrize("case", UNNAMED)
def test_unnamed_trajectories_behind_the_named(tmp_path, case):
    edit, n = UNNAMED[case]
    recording = _read(tmp_path, _rows(_lines(tmp_path), edit))
    _is_as_written(recording)
    (finding,) = [f for f in recording.findings if f.check == "layout"]
    assert finding.found == f"{n} trajectories without a label"


@pytest.mark.parametrize("place", [0, 3, 6])
def test_unnamed_trajectories_between_the_named(tmp_path, place):
    lines = _lines(tmp_path)
    head = lines[3].split("\t")
    head[2 + 3 * place : 2 + 3 * place] = ["", "", ""]
    lines[3], lines[4] = "\t".join(head), lines[4] + "\tX9\tY9\tZ9"
    at = 2 + 3 * place
    lines = _rows(lines, lambda k, cells: [*cells[:at], "5", "6", "7", *cells[at:]])
    _is_as_written(_read(tmp_path, lines))


@pytest.mark.parametrize("before", ["", "\t"])
@pytest.mark.parametrize("apart", [1, 2, 3])
@pytest.mark.parametrize("place", [1, 5])
def test_unnamed_trajectories_where_names_are_not_three_apart(tmp_path, before, apart, place):
    lines = _lines(tmp_path)
    names = [*LABELS[:place], "", *LABELS[place:]]
    lines[3] = "Frame#\tTime\t" + before * (apart > 1) + ("\t" * apart).join(names)
    at = 2 + 3 * place
    lines = _rows(lines, lambda k, cells: [*cells[:at], "5", "6", "7", *cells[at:]])
    _is_as_written(_read(tmp_path, lines))


def test_a_heading_whose_empty_places_say_nothing_is_refused(tmp_path):
    lines = _lines(tmp_path)
    lines[3] = lines[3].replace("\t\t\tLASI", "\t\t\t\tLASI")
    _is_as_written(_read(tmp_path, lines))
    with pytest.raises(BadDataError, match="cells under 8 labels"):
        _read(tmp_path, _rows(lines, UNNAMED["in all rows"][0]))


def test_a_place_of_the_heading_that_the_table_does_not_have(tmp_path):
    lines = _lines(tmp_path)
    lines[3] = lines[3].replace("\t\t\tLASI", "\t\t\t\t\t\tLASI")
    _is_as_written(_read(tmp_path, lines))


@pytest.mark.parametrize("n", [len(LABELS), len(LABELS) // 3 * 3])
def test_four_columns_for_each_label_are_refused(tmp_path, n):
    """As many cells as four thirds of the labels have, or another number."""
    heading = "Frame#\tTime\t" + "\t\t\t\t".join(LABELS[:n]) + "\t\t\t"

    def with_a_fourth(_: int, cells: list[str]) -> list[str]:
        triples = (cells[k : k + 3] for k in range(2, 2 + 3 * n, 3))
        return cells[:2] + [x for triple in triples for x in (*triple, "1")]

    lines = _lines(tmp_path)
    with pytest.raises(BadDataError, match="labels"):
        _read(tmp_path, _rows([*lines[:3], heading, "", *lines[-N:]], with_a_fourth))


def test_a_table_without_the_line_of_axes(tmp_path):
    lines = _lines(tmp_path)
    recording = _read(tmp_path, [*lines[:4], *lines[-N:]])
    _is_as_written(recording)


def test_numbers_of_markers_with_and_without_the_unnamed(tmp_path):
    lines = _rows(_lines(tmp_path), UNNAMED["in all rows"][0])
    for stated in (8, 9):
        own = [*lines[:2], lines[2].replace("\t8\t", f"\t{stated}\t"), *lines[3:]]
        assert [f.found for f in _read(tmp_path, own).findings if "counts" in f.found] == []
    own = [*lines[:2], lines[2].replace("\t8\t", "\t12\t"), *lines[3:]]
    assert any("counts 12 markers" in f.found for f in _read(tmp_path, own).findings)


@pytest.mark.parametrize(
    "edit",
    [
        lambda k, cells: [*cells, "1"] if k == 5 else cells,
        lambda k, cells: [*cells, "1", "2"] if k % 2 else cells,
        lambda k, cells: cells[:5] + cells[6:] if k == 9 else cells,
        lambda k, cells: cells[:-3],
    ],
)
def test_cells_that_nothing_explains_are_refused(tmp_path, edit):
    with pytest.raises(BadDataError, match="cells under 8 labels"):
        _read(tmp_path, _rows(_lines(tmp_path), edit))


def test_empty_cells_that_an_editor_cut_are_gaps(tmp_path):
    def edit(k, cells):
        return cells[:-6] if 10 <= k < 15 else cells

    recording = _read(tmp_path, _rows(_lines(tmp_path), edit))
    gaps = np.isnan(recording.markers_m[..., 0])
    assert gaps.sum() == 10 and gaps[10:15, -2:].all()


def _commas(line: str) -> str:
    return line.replace(".", ",")


SEPARATED = {
    "tabs and decimal commas": lambda line: _commas(line),
    "semicolons": lambda line: line.replace("\t", ";"),
    "semicolons and decimal commas": lambda line: _commas(line).replace("\t", ";"),
    "commas": lambda line: line.replace("\t", ","),
    "blanks and decimal commas": lambda line: " ".join(_commas(line).split()),
    "blanks around tabs": lambda line: line.replace("\t", " \t "),
}


@pytest.mark.parametrize("case", SEPARATED)
def test_separators_and_decimal_commas(tmp_path, case):
    lines = _lines(tmp_path)
    lines[2] = lines[2].replace("100", "100.5")
    stamps = [f"{k / 100.5:.5f}" for k in range(N)]
    lines = _rows(lines, lambda k, cells: [cells[0], stamps[k], *cells[2:]])
    recording = _read(tmp_path, [lines[0], *map(SEPARATED[case], lines[1:])])
    _is_as_written(recording)
    assert recording.marker_rate_hz == 100.5
    said = [f.found for f in recording.findings if f.check == "layout"]
    assert said == (["decimal commas"] if "decimal" in case else [])


def test_commas_between_thousands(tmp_path):
    def edit(k, cells):
        return [*cells[:2], *(f"{float(x):,.6f}" for x in cells[2:])]

    recording = _read(tmp_path, _rows(_lines(tmp_path), edit))
    _is_as_written(recording)
    assert "commas between thousands" in [f.found for f in recording.findings]


def test_missing_cells_between_semicolons(tmp_path):
    lines = _rows(_lines(tmp_path), lambda k, cells: [*cells[:5], *["", "", ""], *cells[8:]])
    recording = _read(tmp_path, [lines[0], *(line.replace("\t", ";") for line in lines[1:])])
    assert np.isnan(recording.markers_m[:, 1]).all()
    np.testing.assert_allclose(recording.markers_m[:, 2:], MARKERS[:, 2:], atol=1e-6)


UNITS = {
    0.0254: ("in", "inch", "inches", "IN", "Inches", '"'),
    0.3048: ("ft", "feet", "Foot"),
    0.1: ("dm", "decimeters"),
    0.01: ("cm", "Centimetres", "centi"),
    0.001: ("mm", "MM", "Millimeters", "milli", "[mm]"),
    1.0: ("m", "meters", "Metre", "mete"),
}


@pytest.mark.parametrize(("size", "word"), [(size, w) for size, ws in UNITS.items() for w in ws])
def test_units_of_length_in_any_spelling(tmp_path, size, word):
    lines = _lines(tmp_path)
    lines[2] = lines[2].replace("mm", word)

    def edit(k, cells):
        return [*cells[:2], *(f"{float(x) * 1e-3 / size:.9g}" for x in cells[2:])]

    assert length_in_m(word) == size
    recording = _read(tmp_path, _rows(lines, edit))
    _is_as_written(recording)
    assert not any(f.level == "warning" for f in recording.findings)


@pytest.mark.parametrize("word", ["in", "ft", "mm"])
def test_a_stated_unit_that_no_person_fits(tmp_path, word):
    """The numbers are metres or mm: a person of 4 cm, or of 43 m."""
    lines = _lines(tmp_path)
    lines[2] = lines[2].replace("\tmm", f"\t{word}")
    if word == "mm":
        lines = _rows(lines, lambda k, c: [*c[:2], *(f"{float(x) / 1000:.9g}" for x in c[2:])])
    recording = _read(tmp_path, lines)
    _is_as_written(recording)
    assert [f.level for f in recording.findings if f.check == "unit"] == ["corrected"]


@pytest.mark.parametrize(
    ("word", "size"),
    [
        ("N\N{MIDDLE DOT}mm", 1e-3),
        ("N m", 1.0),
        ("kN.m", 1e3),
        ("Nm", 1.0),
        ("N-mm", 1e-3),
        ("Newton-millimeters", 1e-3),
        ("in-lbf", 0.1129848),
        ("lb.ft", 1.3558179),
        ("kgf.cm", 0.0980665),
        ("V", None),
        ("Newton", None),
    ],
)
def test_units_of_moment(word, size):
    assert moment_in_Nm(word) == (size and pytest.approx(size, rel=1e-6))


@pytest.mark.parametrize(
    ("word", "size"),
    [("N", 1.0), ("Newt", 1.0), ("kN", 1e3), ("lbf", 4.448222), ("kp", 9.80665), ("", None)],
)
def test_units_of_force(word, size):
    assert force_in_N(word) == (size and pytest.approx(size, rel=1e-6))


def test_the_case_of_unnamed_trajectories(shared_cases):
    name = "study/sub-01/sub-01_task-squat_run-1.trc"
    own, reference = (
        read_recording(shared_cases / folder / name)
        for folder in ("09-cortex-unnamed-trajectories", "00-reference-trc-mot")
    )
    assert own.labels == reference.labels
    np.testing.assert_array_equal(own.markers_m, reference.markers_m)


def test_the_case_of_inches(shared_cases):
    name = "study/sub-01/sub-01_task-squat_run-1.trc"
    own, reference = (
        read_recording(shared_cases / folder / name)
        for folder in ("14b-trc-inches", "00-reference-trc-mot")
    )
    np.testing.assert_allclose(own.markers_m, reference.markers_m, atol=1e-5)
    assert [f.action for f in own.findings if f.check == "unit"] == ["read lengths in inches"]


@pytest.mark.parametrize(
    "name", ["a.MOT", "A.sto", "a_grf.STO", "a-grf.mot", "a_Forces.mot", "a-FORCE.Mot", "a.grf.mot"]
)
def test_names_of_the_file_of_forces(tmp_path, name):
    _lines(tmp_path)
    (tmp_path / name).write_text("endheader\ntime\tx\n0\t1\n0.1\t1\n")
    with pytest.raises(BadDataError, match="no ground force among the columns"):
        read_recording(tmp_path / "a.trc")


@pytest.mark.parametrize("name", ["b.mot", "a_ik.mot", "agrf.mot", "a_grf.csv", "a_grf_2.mot"])
def test_names_of_other_files(tmp_path, name):
    _lines(tmp_path)
    (tmp_path / name).write_text("x")
    assert "no .mot" in read_recording(tmp_path / "a.trc").forces_note


@pytest.mark.parametrize("other", ["a_grf.mot", "a-forces.sto", "a.sto"])
def test_two_files_of_forces_are_refused(tmp_path, other):
    _lines(tmp_path)
    for name in ("a.MOT", other):
        (tmp_path / name).write_text("x")
    with pytest.raises(BadDataError, match="next to it; expected one file of ground forces"):
        read_recording(tmp_path / "a.trc")


HEAD = "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tUnits\n100\tmm\n"
ONE_MARKER = f"{HEAD}Frame#\tTime\tA\n\t\tX1\tY1\tZ1\n\n"
FORCE = [f"ground_force_{what}{axis}" for what in "vpm" for axis in "xyz"]
TOO_LONG = "x" * 6_000_000
REFUSED_TRC = {
    "many labels": (f"{HEAD}Frame#\tTime\t" + "\t".join("m" * 10**6), "1000000 labels"),
    "a long label": (f"{HEAD}Frame#\tTime\t{'A' * 300}", "has 300 letters"),
    "one line": (TOO_LONG, "a line of more than 4.9 million characters"),
    "one long row": (f"{ONE_MARKER}{TOO_LONG}", "a line of more than 4.9 million"),
    "short lines": ("x\n" * 2000 + ONE_MARKER + "1\t0\t1\t2\t3\n", "no line that begins"),
    "short rows": (ONE_MARKER + "1\t0\n" * 200_000, "a row of 2 cells under 1 labels"),
    "NUL": (f"{ONE_MARKER}1\t0\t1\t2\0\t3\n", "bytes that are no text"),
    "empty": ("", "the file is empty"),
    "steps of a ns": (ONE_MARKER + "1\t0\t1\t2\t3\n2\t1e-9\t1\t2\t3\n", "do not increase evenly"),
    "endless": (ONE_MARKER + "1\t-1e308\t1\t2\t3\n2\t1e308\t1\t2\t3\n", "do not increase evenly"),
}


@pytest.mark.parametrize("case", REFUSED_TRC)
def test_a_trc_that_is_none(tmp_path, case):
    text, found = REFUSED_TRC[case]
    (tmp_path / "a.trc").write_text(text)
    with pytest.raises(BadDataError, match=found) as refusal:
        read_recording(tmp_path / "a.trc")
    assert len(str(refusal.value)) < 500


def test_labels_over_rows_that_are_cut(tmp_path):
    """A table would need far more memory than the file has bytes."""
    labels = "\t\t\t".join(f"M{k}" for k in range(1000))
    whole = "1\t0\t" + "\t".join("1" * 3000)
    path = tmp_path / "a.trc"
    path.write_text(f"{HEAD}Frame#\tTime\t{labels}\n\n{whole}\n" + "1\t0\n" * 1000)
    with pytest.raises(BadDataError, match="rows that are all but empty"):
        read_recording(path)


@pytest.mark.parametrize("ending", ["trc", "mot"])
@pytest.mark.parametrize(
    ("content", "found"),
    [
        (ONE_MARKER.encode("utf-16"), "bytes that are no text"),
        (b"\x02\x50" + bytes(510), "bytes that are no text"),
    ],
)
def test_other_files_by_the_name_of_a_text(tmp_path, ending, content, found):
    _lines(tmp_path)
    (tmp_path / f"a.{ending}").write_bytes(content)
    with pytest.raises(BadDataError, match=rf"a\.{ending}: {found}"):
        read_recording(tmp_path / "a.trc")


def test_a_large_file_is_not_opened(tmp_path, monkeypatch):
    path = tmp_path / "a.trc"
    with path.open("wb") as file:
        file.truncate(2**30 + 1)
    monkeypatch.setattr(Path, "open", None)
    with pytest.raises(BadDataError, match=r"a text of 1\.1 GB"):
        read_recording(path)


def test_a_disk_that_fails(tmp_path, monkeypatch):
    path = tmp_path / "a.trc"
    path.write_text(ONE_MARKER)

    def failing(*_, **__):
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(Path, "open", failing)
    with pytest.raises(BadDataError, match=r"a\.trc: cannot be read \(Input/output error\)"):
        read_recording(path)


def _with_mot(tmp_path: Path, times_s: np.ndarray, n_forces: int = 1):
    _lines(tmp_path)
    force, _ = standing_wrench(len(times_s))
    kinds = [*FORCE[:3], *FORCE[6:]]
    names = [name.replace("force_", f"force_{k}_") for k in range(n_forces) for name in kinds]
    columns = {name: force[:, i % 3] for i, name in enumerate(names)}
    write_mot(tmp_path / "a.mot", times_s, columns)
    return read_recording(tmp_path / "a.trc")


def test_forces_of_absurd_steps_are_left_out(tmp_path):
    recording = _with_mot(tmp_path, np.arange(20) * 1e-9)
    assert recording.plates == () and "do not increase evenly" in recording.forces_note
    recording = _with_mot(tmp_path, np.arange(20) * 1.1e-5)
    assert recording.plates == () and "would be needed for" in recording.forces_note


def test_more_forces_than_plates_in_any_laboratory(tmp_path):
    with pytest.raises(BadDataError, match="300 ground forces"):
        _with_mot(tmp_path, np.arange(N) / 100.0, 300)


def test_a_grid_as_long_as_its_steps_allow(tmp_path):
    """Tiny steps after a tear would make a grid of a thousand times for each larger one."""
    torn = np.cumsum([*[0.01] * 30, -5.0, *([2e-5] * 2 + [0.02]) * 40])
    stamps = np.concatenate([torn, torn[-1] - 100 + 0.01 * np.arange(100)])
    markers, labels = standing_markers(len(stamps))
    path = write_trc(tmp_path / "a.trc", stamps, markers, labels)
    with pytest.raises(BadDataError, match="do not increase evenly"):
        read_recording(path)


@pytest.mark.parametrize("blank", [0.0, 0.2])
def test_memory_is_a_small_multiple_of_the_file(tmp_path, blank):
    rng = np.random.default_rng(1)
    n, labels = 2000, [f"M{k}" for k in range(40)]
    person = np.tile(standing_markers(n)[0], (1, 5, 1))  # feet under the force, which else is none
    markers = person + rng.uniform(-0.02, 0.02, (n, len(labels), 3))
    markers[rng.random(markers.shape[:2]) < blank] = np.nan
    path = write_trc(tmp_path / "a.trc", np.arange(n) / 100.0, markers, labels)
    force, moment = standing_wrench(10 * n)
    columns = dict(zip(FORCE, np.hstack([force, 0 * moment, moment]).T, strict=True))
    mot = write_mot(tmp_path / "a.mot", np.arange(10 * n) / 1000.0, columns)
    read_recording(path)  # imports, caches
    tracemalloc.start()
    try:
        recording = read_recording(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert recording.plates
    assert peak < 6 * (path.stat().st_size + mot.stat().st_size)
