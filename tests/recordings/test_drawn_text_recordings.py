"""TRC with MOT drawn from a seed over clocks, digits, units, namings and layouts: known truth."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.recordings.read import read_recording
from bsip_cli.recordings.units import length_in_m
from tests.recordings.recording_writers import Y_UP_FROM_Z_UP, standing_markers, standing_wrench
from tests.recordings.test_force_columns import DIALECTS

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


def _write_trc(folder: Path, rng, drawn, times, markers, labels) -> Path:
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


def _write_mot(folder: Path, drawn, times, force, moment) -> None:
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


def _check(folder: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    drawn = {name: values[rng.integers(len(values))] for name, values in CHOICES.items()}
    n = int(rng.integers(60, 300))
    markers, labels = standing_markers(n)
    markers += rng.normal(0, 1e-4, markers.shape)
    markers[rng.random(markers.shape[:2]) < 0.05] = np.nan
    force, moment = standing_wrench(n * drawn["ratio"])
    rate_hz, force_hz = drawn["rate_hz"], drawn["rate_hz"] * drawn["ratio"]
    times = drawn["start_s"] + np.arange(n) / rate_hz
    path = _write_trc(folder, rng, drawn, times, markers, labels)
    times = drawn["start_s"] + np.arange(len(force)) / force_hz
    _write_mot(folder, drawn, times, force, moment)
    recording = read_recording(path)
    assert recording.labels == tuple(labels), drawn
    assert recording.marker_rate_hz == pytest.approx(rate_hz, rel=2e-5), drawn
    np.testing.assert_allclose(recording.markers_m, markers, atol=2e-6, err_msg=str(drawn))
    (plate,) = recording.plates
    assert recording.analog_rate_hz == pytest.approx(force_hz, rel=2e-5), drawn
    assert plate.usable.mean() > 0.97, drawn
    usable = plate.usable[: len(force)]
    own, true = plate.wrench()[: len(usable)], np.hstack([force, moment])[: len(usable)]
    sample_and_a_half = 1.5 * np.abs(np.diff(true, axis=0)).max(axis=0) + 1e-3
    assert (np.abs(own - true)[usable] < sample_and_a_half).all(), drawn


@pytest.mark.parametrize("seed", range(40))
def test_drawn_recordings_are_read_as_they_were(tmp_path, seed):
    _check(tmp_path, seed)


@pytest.mark.long
@pytest.mark.parametrize("first", range(100, 1100, 100))
def test_a_thousand_drawn_recordings(tmp_path, first):
    for seed in range(first, first + 100):
        folder = tmp_path / str(seed)
        folder.mkdir()
        _check(folder, seed)
