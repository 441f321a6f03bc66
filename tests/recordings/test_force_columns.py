"""Columns of force tables in the namings of laboratories, and TRC with MOT drawn from a seed."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.mot import meaning_of, read_mot
from bsip_cli.recordings.read import read_recording
from bsip_cli.recordings.units import length_in_m
from tests.recordings.recording_writers import (
    Y_UP_FROM_Z_UP,
    standing_markers,
    standing_wrench,
    write_mot,
    write_trc,
)

N = 60
with Path(__file__).with_name("force_columns.csv").open(encoding="utf-8", newline="") as _file:
    DIALECTS = {name: parts for name, *parts in list(csv.reader(_file))[1:]}  # two plates


def _values() -> dict[str, np.ndarray]:
    """Nine numbers of two plates that tell where they come from: 111 is force x of plate 1."""
    time = np.arange(N) / 100.0
    return {
        f"{plate}{kind}{axis}": 100 * (plate + 1) + 10 * kind + axis + time
        for plate in range(2)
        for kind in range(3)
        for axis in range(3)
    }


def _columns(dialect: str) -> dict[str, np.ndarray]:
    *names, plates = DIALECTS[dialect]
    return {
        names[kind].format(p=name, a=a, A=a.upper()): _values()[f"{plate}{kind}{axis}"]
        for plate, name in enumerate(plates.split())
        for kind in range(3)
        for axis, a in enumerate("xyz")
    }


def _write(path, columns, edit=lambda text: text):
    write_mot(path, np.arange(N) / 100.0, columns)
    path.write_text(edit(path.read_text()))
    return path


@pytest.mark.parametrize("dialect", DIALECTS)
def test_each_naming_gives_every_column_its_place(tmp_path, dialect):
    mot = read_mot(_write(tmp_path / "a.mot", _columns(dialect)))
    assert len(mot.forces) == 2 and mot.findings == ()
    for plate, force in enumerate(mot.forces):
        for kind, values in enumerate((force.force_N, force.point, force.moment)):
            for axis in range(3):
                np.testing.assert_allclose(values[:, axis], _values()[f"{plate}{kind}{axis}"])


@pytest.mark.parametrize(
    ("names", "plate"),
    [
        ("F_ap_1 F_v_1 F_ml_1 COP_ap_1 M_v_1", "1"),
        ("L_AP_force L_V_force L_ML_force L_AP_cop L_V_moment", "l"),
        ("FP2_Fap FP2_Fv FP2_Fml FP2_COPap FP2_Mv", "2"),
        ("FAP FV FML COPap TV", ""),
        ("GRF_ap_R GRF_vert_R GRF_ml_R cop_ap_R torque_vertical_R", "r"),
        (
            "Plate_1_Anterior-Posterior_Force Vertical_Force_1 1_Medio-lateral_Force "
            "Plate_1_Anteroposterior_CoP Vertical_Moment_1",
            "1",
        ),
    ],
)
def test_ahead_aside_and_up(names, plate):
    found = [meaning_of(name) for name in names.split()]
    assert [one.plate for one in found] == [plate] * 5
    assert [one.axis for one in found] == list("xyzxy")
    assert [one.quantity[:5] for one in found[:4]] == ["force"] * 3 + ["point"]
    assert found[4].quantity in ("moment", "torque")


@pytest.mark.parametrize(
    "name",
    [
        "pelvis_tilt",
        "knee_angle_l",
        "com_vx",
        "emg_vastus",
        "x1",
        "walker_knee_r_on_tibia_r_in_ground_fx",
        "hip_flexion_moment",
        "forearm_l_x_y",
        "mompox",
        "time_for_step",
        "time",
    ],
)
def test_what_is_no_ground_force(name):
    assert meaning_of(name) is None


def test_columns_that_are_not_understood_are_named(tmp_path):
    more = {f"emg {k}": np.zeros(N) for k in range(15)} | {"pelvis_tx": np.zeros(N)}
    (finding,) = read_mot(_write(tmp_path / "a.mot", _columns("opensim") | more)).findings
    assert finding.level == "info"
    assert finding.found.startswith(
        "16 columns of the forces that are not understood: emg 0, emg 1"
    )
    assert finding.found.endswith("emg 11 and 4 more")


@pytest.mark.parametrize(
    ("lost", "said"),
    [
        ("ground_force_1_px", "only y and z of the point of plate '1'"),
        ("ground_force_2_vx", "only y and z of the force of plate '2'"),
        ("ground_torque_2_y", "only x and z of the torque of plate '2'"),
    ],
)
def test_half_a_vector_is_refused(tmp_path, lost, said):
    columns = _columns("opensim")
    del columns[lost]
    with pytest.raises(BadDataError, match=said):
        read_mot(_write(tmp_path / "a.mot", columns))


def test_two_columns_of_one_meaning_are_refused(tmp_path):
    columns = _columns("opensim") | {"Fx1": np.ones(N)}
    with pytest.raises(BadDataError, match="columns 'ground_force_1_vx' and 'Fx1', which say the"):
        read_mot(_write(tmp_path / "a.mot", columns))


def _decimal_commas(text: str) -> str:
    head, table = text.split("endheader")
    return head + "endheader" + table.replace(".", ",")


EDITS = {
    "blank lines": lambda text: text.replace("endheader\n", "endheader\n\n\n").replace(
        "\n0.3", "\n\n0.3"
    ),
    "no endheader": lambda text: text.split("endheader\n")[1],
    "blanks": lambda text: text.replace("\t", "    "),
    "padded": lambda text: text.replace("\t", "\t      ").replace("\n0", "\n     0"),
    "tab at the end": lambda text: text.replace("\n", "\t\n"),
    "semicolons": lambda text: text.replace("\t", ";"),
    "semicolons and decimal commas": lambda text: _decimal_commas(text).replace("\t", ";"),
    "tabs and decimal commas": _decimal_commas,
    "commas": lambda text: text.replace("\t", ","),
    "commas over blanks": lambda text: text.replace("\t", ", "),
    "a heading with tabs over blanks": lambda text: "Fz2\n0".join(
        part.replace("\t", "  ") if k else part for k, part in enumerate(text.split("Fz2\n0"))
    ),
    "time in capitals": lambda text: text.replace("\ntime\t", "\nTIME\t"),
    "time of a program": lambda text: text.replace("\ntime\t", "\nAbs Time (s)\t"),
    "time in German": lambda text: text.replace("\ntime\t", "\nZeit [s]\t"),
    "numbers of frames before the time": lambda text: re.sub(
        r"(?m)^(?=0\.|0\t)", "7\t", text.replace("\ntime\t", "\nFrame#\tTime_s\t")
    ),
    "carriage returns": lambda text: text.replace("\n", "\r\n"),
}


@pytest.mark.parametrize("edit", EDITS)
def test_layouts_of_the_table(tmp_path, edit):
    mot = read_mot(_write(tmp_path / "a.sto", _columns("plate in front"), EDITS[edit]))
    np.testing.assert_allclose(mot.stamps.values, np.arange(N) / 100.0)
    for plate, force in enumerate(mot.forces):
        np.testing.assert_allclose(force.force_N[:, 1], _values()[f"{plate}01"])
        np.testing.assert_allclose(force.moment[:, 2], _values()[f"{plate}22"])


def test_a_row_of_units_is_kept_as_what_the_file_says(tmp_path):
    units = "s\t" + "\t".join(
        ["kN"] * 3 + ["mm"] * 3 + ["N.mm"] * 3 + ["N"] * 3 + ["m"] * 3 + [""] * 3
    )
    edit = lambda text: text.replace("\n0\t", f"\n{units}\n0\t", 1)  # noqa: E731
    one, other = read_mot(_write(tmp_path / "a.mot", _columns("nexus"), edit)).forces
    assert (one.point_unit, one.moment_unit) == ("mm", "N.mm")
    assert (other.point_unit, other.moment_unit) == ("m", "")
    np.testing.assert_allclose(one.force_N[:, 0], 1000 * _values()["000"])
    np.testing.assert_allclose(other.force_N[:, 0], _values()["100"])
    with pytest.raises(BadDataError, match="forces in 'V'"):
        read_mot(
            _write(tmp_path / "a.mot", _columns("nexus"), lambda t: edit(t).replace("kN", "V"))
        )


@pytest.mark.parametrize(
    "word", ["nan", "NaN", "NAN", "", "-nan", "inf", "-nan(ind)", "N/A", "1.#QNAN"]
)
def test_spellings_of_a_missing_number(tmp_path, word):
    path = _write(tmp_path / "a.mot", _columns("opensim"))
    rows = path.read_text().splitlines()
    cells = rows[20].split("\t")
    cells[4:7] = [word] * 3
    path.write_text("\n".join([*rows[:20], "\t".join(cells), *rows[21:]]))
    point = read_mot(path).forces[0].point
    assert np.isnan(point).any(axis=1).sum() == 1 and np.isnan(point[14]).all()


def test_a_word_amid_the_numbers_is_refused(tmp_path):
    path = _write(
        tmp_path / "a.mot", _columns("opensim"), lambda text: text.replace("\t112.5", "\toff")
    )
    with pytest.raises(BadDataError, match="'off' is no number"):
        read_mot(path)


def test_a_cut_last_row_is_left_out_and_said(tmp_path):
    path = _write(tmp_path / "a.mot", _columns("opensim"), lambda text: text[:-60])
    mot = read_mot(path)
    assert len(mot.stamps.values) == N - 1
    assert [f.found for f in mot.findings][-1] == "the last row of forces is cut"


def _standing(tmp_path, keep="vpt", unload=slice(0, 0), nan="pt", edit=lambda columns: columns):
    """One plate that is unloaded in a stretch, where what ``nan`` names is missing."""
    markers, labels = standing_markers(N)
    write_trc(tmp_path / "a.trc", np.arange(N) / 100.0, markers @ Y_UP_FROM_Z_UP.T, labels)
    force, moment = standing_wrench(N)
    point = np.column_stack([-moment[:, 1], moment[:, 0], 0 * force[:, 2]]) / force[:, 2:]
    parts = {"v": force, "p": point, "t": moment - np.cross(point, force)}
    parts["v"][unload] = parts["t"][unload] = 0
    for kind in nan:
        parts[kind][unload] = np.nan
    names = {"v": "Fx{}", "p": "COPx{}", "t": "Tx{}"}
    columns = {
        names[kind].format(1).replace("x", a): (parts[kind] @ Y_UP_FROM_Z_UP.T)[:, i]
        for kind in keep
        for i, a in enumerate("xyz")
    }
    write_mot(tmp_path / "a.mot", np.arange(N) / 100.0, edit(columns))
    return read_recording(tmp_path / "a.trc")


@pytest.mark.parametrize("nan", ["p", "t", "pt"])
def test_no_force_needs_no_point(tmp_path, nan):
    recording = _standing(tmp_path, unload=slice(0, 20), nan=nan)
    (plate,) = recording.plates
    assert plate.usable.all() and not plate.wrench[:20].any()
    assert "analog_nan" not in [f.check for f in recording.findings]


def test_a_force_that_is_nothing_but_rounding_needs_no_point(tmp_path):
    def with_rounding(columns):
        return {k: x + (1e-9 if k.startswith("F") else 0) for k, x in columns.items()}

    plate = _standing(tmp_path, unload=slice(0, 20), edit=with_rounding).plates[0]
    assert plate.usable.all()


@pytest.mark.parametrize("names", ["F{} A{} T{}", "F{} COP{} T{}", "F{}1 COP{} M{}"])
def test_what_is_zero_by_definition_may_be_left_out(tmp_path, names):
    """The height of points on the floor, and level torques there; of one plate also its number."""
    force, point, torque = names.split()

    def flat(columns):
        named = {"F": force, "C": point, "T": torque}
        kept = [name for name in columns if name not in ("COPy1", "Tx1", "Tz1")]
        return {named[name[0]].format(name[-2]): columns[name] for name in kept}

    whole, read = _standing(tmp_path), _standing(tmp_path, edit=flat)
    np.testing.assert_allclose(read.plates[0].wrench, whole.plates[0].wrench, atol=1e-9)
    (said,) = (f for f in read.findings if f.check == "columns")
    assert (said.level, said.found) == ("info", "no columns for a part of its point and moment")


def test_three_columns_of_one_letter_are_accelerations(tmp_path):
    more = {f"A{axis}1": np.ones(N) for axis in "xyz"}
    recording = _standing(tmp_path, keep="vt", edit=lambda columns: columns | more)
    assert "no columns for its point" in [f.found for f in recording.findings]


def test_a_missing_point_under_load_stays_lost(tmp_path):
    def without_point(columns):
        columns["COPy1"][30] = np.nan
        return columns

    plate = _standing(tmp_path, unload=slice(0, 10), edit=without_point).plates[0]
    np.testing.assert_array_equal(np.flatnonzero(~plate.usable), [30])


def test_forces_without_point_and_moment_are_kinematics_only(tmp_path):
    recording = _standing(tmp_path, keep="v")
    assert recording.plates == ()
    assert "no columns for the point and none for the moment" in recording.forces_note


def test_a_missing_moment_is_said(tmp_path):
    recording = _standing(tmp_path, keep="vp")
    assert len(recording.plates) == 1
    (found,) = [f for f in recording.findings if f.check == "columns"]
    assert (found.level, found.action) == ("warning", "took the free torque as zero")


def test_a_missing_point_is_said(tmp_path):
    recording = _standing(tmp_path, keep="vt")
    assert "no columns for its point" in [f.found for f in recording.findings]


def test_the_case_of_missing_points_without_load(shared_cases):
    name = "study/sub-01/sub-01_task-steps_run-1.trc"
    own, reference = (
        read_recording(shared_cases / folder / name)
        for folder in ("03-mot-nan-cop-when-unloaded", "00-reference-trc-mot")
    )
    for plate, same in zip(own.plates, reference.plates, strict=True):
        assert plate.usable.all()
        loaded = plate.force_N[:, 2] > 0
        np.testing.assert_allclose(plate.wrench[loaded], same.wrench[loaded], atol=1e-6)


def test_the_case_of_forces_only(shared_cases):
    folder = shared_cases / "19d-mot-forces-only-person-at-lab-origin/study/sub-01"
    recording = read_recording(folder / "sub-01_task-static.trc")
    assert recording.plates == () and "no centre of pressure is known" in recording.forces_note


CHOICES: Mapping[str, tuple] = {
    "rate_hz": (50, 59.94, 60, 85, 100, 119.88, 120, 200, 240, 250, 300, 1000 / 3, 500),
    "ratio": (1, 2, 5, 8, 10, 20),
    "start_s": (0.0, 0.0, 0.01, 3.21, 100.5, 54_321.25),
    "digits": (2, 3, 4, 6),
    "clock": ("s", "ms", "us", "from 0", "from 1"),
    "force_clock": ("s", "ms", "us", "from 0", "from 1"),
    "unit": ("mm", "m", "in", "cm", "Inches", "meters", ""),
    "missing": (np.nan, 0.0, -16512.0, -9999.0, 1e7, 9999999.0),
    "mark": ("\t", ";"),
    "comma": (False, False, True),
    "unnamed": (0, 0, 1, 2),
    "ending": (".mot", ".MOT", "_grf.mot", "-forces.sto"),
    "dialect": tuple(DIALECTS),
    "has_units_row": (False, False, True),
}


def _stamps(times: np.ndarray, clock: str, digits: int) -> list[str]:
    if clock.startswith("from"):
        return [str(int(clock[-1]) + k) for k in range(len(times))]
    size, left = {"s": (1, digits), "ms": (1e3, max(digits - 2, 0)), "us": (1e6, 0)}[clock]
    return [f"{size * t:.{left}f}" for t in times]


def _write_drawn_trc(folder: Path, rng, drawn, times, markers, labels) -> Path:
    """Six decimals in the file's unit; NaN as the drawn sign."""
    size = length_in_m(drawn["unit"]) or 1e-3
    written = np.where(np.isnan(markers), drawn["missing"], markers @ Y_UP_FROM_Z_UP.T / size)
    rate = f"{drawn['rate_hz']:.6g}"
    head = [
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate",
        f"{rate}\t{rate}\t{len(times)}\t{len(labels)}\t{drawn['unit']}\t{rate}",
        "Frame#\tTime\t" + "\t\t\t".join(labels),
        "\t\t" + "\t".join(f"{a}{k + 1}" for k in range(len(labels)) for a in "XYZ"),
        "",
    ]
    rows = []
    stamps = _stamps(times, drawn["clock"], drawn["digits"])
    for k, (stamp, frame) in enumerate(zip(stamps, written, strict=True)):
        cells = ["" if np.isnan(x) else f"{x:.6f}" for x in frame.ravel()]
        extra = ["1.5", "2.5", "3.5"] * drawn["unnamed"] * (rng.random() < 0.7)
        rows.append("\t".join([str(k + 1), stamp, *cells, *extra]))
    rows = [row.replace(".", ",") if drawn["comma"] else row for row in rows]
    lines = [line.replace("\t", drawn["mark"]) for line in [*head, *rows]]
    path = folder / "a.trc"
    path.write_text("\n".join(["PathFileType\t4\t(X/Y/Z)\ta.trc", *lines]) + "\n")
    return path


def _write_drawn_mot(folder: Path, drawn, times, force, moment) -> None:
    point = np.column_stack([-moment[:, 1], moment[:, 0], 0 * force[:, 2]]) / force[:, 2:]
    parts = (force, point, moment - np.cross(point, force))
    *names, plates = DIALECTS[drawn["dialect"]]
    plate = plates.split()[0]
    heading = ["time"]
    heading += [name.format(p=plate, a=a, A=a.upper()) for name in names for a in "xyz"]
    table = np.hstack([values @ Y_UP_FROM_Z_UP.T for values in parts])
    stamps = _stamps(times, drawn["force_clock"], drawn["digits"])
    rows = [
        "\t".join([s, *(f"{x:.6f}" for x in row)]) for s, row in zip(stamps, table, strict=True)
    ]
    rows = [row.replace(".", ",") if drawn["comma"] else row for row in rows]
    units = ["\t".join(["s", *["N"] * 3, *["m"] * 3, *["Nm"] * 3])] * drawn["has_units_row"]
    lines = [line.replace("\t", drawn["mark"]) for line in ["\t".join(heading), *units, *rows]]
    head = ["forces", f"nRows={len(rows)}", "inDegrees=yes", "endheader", ""]
    (folder / f"a{drawn['ending']}").write_text("\n".join([*head, *lines]) + "\n")


def _check_drawn(folder: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    drawn = {name: values[rng.integers(len(values))] for name, values in CHOICES.items()}
    n = int(rng.integers(60, 300))
    markers, labels = standing_markers(n)
    markers += rng.normal(0, 1e-4, markers.shape)
    markers[rng.random(markers.shape[:2]) < 0.05] = np.nan
    force, moment = standing_wrench(n * drawn["ratio"])
    rate_hz, force_hz = drawn["rate_hz"], drawn["rate_hz"] * drawn["ratio"]
    times = drawn["start_s"] + np.arange(n) / rate_hz
    path = _write_drawn_trc(folder, rng, drawn, times, markers, labels)
    times = drawn["start_s"] + np.arange(len(force)) / force_hz
    _write_drawn_mot(folder, drawn, times, force, moment)
    recording = read_recording(path)
    assert recording.labels == tuple(labels), drawn
    assert recording.marker_rate_hz == pytest.approx(rate_hz, rel=2e-5), drawn
    np.testing.assert_allclose(recording.markers_m, markers, atol=2e-6, err_msg=str(drawn))
    (plate,) = recording.plates
    assert recording.analog_rate_hz == pytest.approx(force_hz, rel=2e-5), drawn
    assert plate.usable.mean() > 0.97, drawn
    usable = plate.usable[: len(force)]
    own, true = plate.wrench[: len(usable)], np.hstack([force, moment])[: len(usable)]
    sample_and_a_half = 1.5 * np.abs(np.diff(true, axis=0)).max(axis=0) + 1e-3
    assert (np.abs(own - true)[usable] < sample_and_a_half).all(), drawn


@pytest.mark.parametrize("seed", range(40))
def test_drawn_recordings_are_read_as_they_were(tmp_path, seed):
    _check_drawn(tmp_path, seed)


@pytest.mark.long
@pytest.mark.parametrize("first", range(100, 1100, 100))
def test_a_thousand_drawn_recordings(tmp_path, first):
    for seed in range(first, first + 100):
        folder = tmp_path / str(seed)
        folder.mkdir()
        _check_drawn(folder, seed)
