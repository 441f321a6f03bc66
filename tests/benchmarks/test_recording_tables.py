"""The tables of real recordings: every file has a row."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from benchmarks.every_recording import FILE, all_rows, summary
from tests.recordings.recording_writers import (
    PlateSpec,
    standing_markers,
    standing_wrench,
    write_c3d,
)

ROOT = Path(__file__).parents[2]


@pytest.fixture
def data(tmp_path) -> Path:
    n, ratio = 200, 10
    force, moment = standing_wrench(n * ratio)
    force[:, 2] = 70 * 9.80665
    markers, labels = standing_markers(n)
    (tmp_path / "lab").mkdir()
    for name, sign in (("sound", 1.0), ("reversed", -1.0)):
        plate = PlateSpec(force, moment, sign=sign)
        write_c3d(tmp_path / "lab" / f"{name}.c3d", markers, labels, [plate], ratio=ratio)
    (tmp_path / "lab" / "empty.c3d").write_bytes(b"")
    return tmp_path


def test_every_file_has_a_row(data):
    rows = {row.name: row for row in all_rows(data)}
    assert set(rows) == {"lab/empty.c3d", "lab/reversed.c3d", "lab/sound.c3d"}
    assert rows["lab/empty.c3d"].read == "refused"
    assert "the file is empty" in rows["lab/empty.c3d"].findings
    for name, alone_kg in (("sound", 70.0), ("reversed", -70.0)):
        weighed = rows[f"lab/{name}.c3d"].weighed
        assert weighed.is_standing and weighed.own_kg == pytest.approx(70.0, abs=0.01)
        assert weighed.alone_kg == pytest.approx(alone_kg, abs=0.01)
        assert abs(weighed.difference_percent()) < 0.01
    assert "reversed all six components" in rows["lab/reversed.c3d"].findings
    text = summary(list(rows.values()))
    assert text.startswith("3 files, 1 refused. Quiet standing in 2; in 2 of the 2")


@pytest.mark.real
def test_the_table_has_every_recording():
    real_data = ROOT.parent / "shared" / "data"
    if not real_data.is_dir():
        pytest.skip("the real recordings (shared/data beside the repository) are not here")
    names = {str(path.relative_to(real_data)) for path in real_data.glob("*/*")}
    wanted = {name for name in names if name.lower().endswith((".c3d", ".trc", ".csv"))}
    with FILE.open(encoding="utf-8", newline="") as file:
        assert wanted == {row["recording"] for row in csv.DictReader(file)}
