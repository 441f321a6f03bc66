"""Text recordings need little memory, and what no recording holds is refused in words."""

from __future__ import annotations

import errno
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.read import read_recording
from tests.recordings.recording_writers import (
    standing_markers,
    standing_wrench,
    write_mot,
    write_trc,
)

N = 50
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
    markers, labels = standing_markers(N)
    write_trc(tmp_path / "a.trc", np.arange(N) / 100.0, markers, labels)
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
    markers, labels = standing_markers(N)
    write_trc(tmp_path / "a.trc", np.arange(N) / 100.0, markers, labels)
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
