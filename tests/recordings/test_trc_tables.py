"""TRC tables as programs and editors leave them: names, widths, separators, units."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.read import read_recording
from bsip_cli.recordings.units import force_in_N, length_in_m, moment_in_Nm
from tests.recordings.recording_writers import standing_markers, write_trc

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
    lines[2] = lines[2].replace("100.0", "100.5")
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
