"""A MOT whose forces are given about one place: that place stays, the torque changes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.instruments.trc_mot_files import rewrite_trc_mot

COUNT, PLACE = 20, np.array([0.9, 0.0, 0.4])
SAID = ["bsip 1: corrected; before: sha256 ab12", "delay 9 ms (95 % interval 8 to 10) taken off"]
MORE = np.array([0.0, 20.0, 0.0, 1.0, 0.0, 2.0])


def heavier(before):
    return replace(before, readings=before.readings + MORE)


def aside(before):
    return replace(before, points_m=before.points_m + 0.01)


def rewritten(tmp_path, change=heavier) -> tuple[Path, np.ndarray, np.ndarray]:
    """The TRC file's copy, and the force and torque before."""
    times, rng = np.arange(COUNT) / 100, np.random.default_rng(3)
    force = rng.normal([5.0, 700.0, -3.0], 2.0, (COUNT, 3))
    torque = rng.normal(0.0, 30.0, (COUNT, 3))
    names = "\t".join(f"ground_force_{k}" for k in ("vx", "vy", "vz", "px", "py", "pz"))
    names += "\t" + "\t".join(f"ground_torque_{a}" for a in "xyz")
    rows = np.column_stack([times, force, np.tile(PLACE, (COUNT, 1)), torque])
    lines = ["m", f"nRows={COUNT}", "nColumns=10", "endheader", f"time\t{names}"]
    lines += ["\t".join(f"{x:.9g}" for x in row) for row in rows]
    (tmp_path / "in.mot").write_text("\n".join([*lines, ""]))
    head = "PathFileType\t4\t(X/Y/Z)\tin.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n"
    head += f"100\t100\t{COUNT}\t1\tm\nFrame#\tTime\tA\t\t\n\t\tX1\tY1\tZ1\n\n"
    body = [f"{k + 1}\t{t:.5f}\t0.1\t1.0\t0.2" for k, t in enumerate(times)]
    (tmp_path / "in.trc").write_text(head + "\n".join([*body, ""]))

    copy = tmp_path / "new" / "in.trc"
    copy.parent.mkdir()
    rewrite_trc_mot(tmp_path / "in.trc", copy, change, SAID)
    return copy, force, torque


def test_a_place_that_is_no_centre_of_pressure_stays(tmp_path):
    copy, force, torque = rewritten(tmp_path)
    found = np.loadtxt(copy.with_suffix(".mot"), skiprows=5 + len(SAID))
    assert np.allclose(found[:, 1:4], force + MORE[:3], atol=1e-5)
    assert np.allclose(found[:, 4:7], PLACE)
    assert np.allclose(found[:, 7:], torque + MORE[3:], atol=1e-5)


def test_what_is_done_to_markers_alone_is_told_beside_the_forces(tmp_path):
    copy = rewritten(tmp_path, aside)[0]
    before, after = (
        p.read_text().splitlines() for p in (tmp_path / "in.mot", copy.with_suffix(".mot"))
    )
    end = before.index("endheader")
    assert after == [*before[:end], *SAID, *before[end:]]
    assert copy.read_text() != (tmp_path / "in.trc").read_text()


def test_opensim_reads_the_rewritten_files(tmp_path):
    opensim = pytest.importorskip("opensim", reason="the opensim package is not installed")
    copy, force, _ = rewritten(tmp_path)
    table = opensim.TimeSeriesTable(str(copy.with_suffix(".mot")))
    assert (table.getNumRows(), table.getNumColumns()) == (COUNT, 9)
    vertical = table.getDependentColumn("ground_force_vy").to_numpy()
    assert np.allclose(vertical, force[:, 1] + MORE[1], atol=1e-5)
    assert opensim.Storage(str(copy.with_suffix(".mot"))).getSize() == COUNT
    assert opensim.MarkerData(str(copy)).getNumFrames() == COUNT


def test_another_rate_is_stated_in_both_files(tmp_path):
    copy = rewritten(tmp_path, lambda before: before.said_slower(1.25))[0]
    forces = np.loadtxt(copy.with_suffix(".mot"), skiprows=5 + len(SAID))
    markers = [line.split("\t") for line in copy.read_text().splitlines()]
    assert np.allclose(forces[:, 0], np.arange(COUNT) / 80, atol=1e-6)
    assert [float(row[1]) for row in markers[-COUNT:]] == pytest.approx(np.arange(COUNT) / 80)
    assert markers[2][:2] == ["80", "80"]
