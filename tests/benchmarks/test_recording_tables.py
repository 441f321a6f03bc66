"""The tables of docs/recordings.md: every file has a row, and sections keep their page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.every_recording import all_rows, table
from benchmarks.sections import marks, read_section, replace_section
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
    text = table(list(rows.values()))
    assert text.startswith("3 files, 1 refused. Quiet standing in 2; in 2 of the 2")
    assert np.all([line.count("|") == 8 for line in text.splitlines()[2:]])


def test_a_section_is_replaced_and_the_rest_kept(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("before\n" + "\n".join(marks("a")) + "\nbetween\n" + "\n".join(marks("b")))
    replace_section(page, "a", "one")
    replace_section(page, "a", "two")
    assert read_section(page, "a") == "two" and read_section(page, "b") == ""
    assert "one" not in page.read_text() and "between" in page.read_text()
    with pytest.raises(ValueError, match="no section"):
        replace_section(page, "c", "three")


@pytest.mark.real
def test_the_page_has_every_recording():
    real_data = ROOT.parent / "shared" / "data"
    if not real_data.is_dir():
        pytest.skip("the real recordings (shared/data beside the repository) are not here")
    names = {str(path.relative_to(real_data)) for path in real_data.glob("*/*")}
    wanted = {name for name in names if name.lower().endswith((".c3d", ".trc", ".csv"))}
    rows = read_section(ROOT / "docs" / "recordings.md", "every recording").splitlines()
    assert wanted == {row.split("|")[1].strip() for row in rows[4:]}
