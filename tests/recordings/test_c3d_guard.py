"""ezc3d in a process of its own: what it reads comes back, and its end is told in words."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings import c3d_content
from bsip_cli.recordings.c3d_content import read_by_ezc3d
from bsip_cli.recordings.c3d_format import numbers, texts
from bsip_cli.recordings.read import read_recording
from tests.recordings.recording_writers import (
    PlateSpec,
    standing_markers,
    standing_wrench,
    write_c3d,
)

N = 20


@pytest.fixture
def path(tmp_path):
    markers, labels = standing_markers(N)
    force, moment = standing_wrench(10 * N)
    return write_c3d(tmp_path / "a.c3d", markers, labels, [PlateSpec(force, moment)])


def test_samples_and_parameters_come_back(path):
    samples = read_by_ezc3d(path.read_bytes(), path)
    markers, labels = standing_markers(N)
    np.testing.assert_allclose(samples.positions, 1e3 * markers, atol=1e-3)
    assert samples.residuals.shape == (N, len(labels)) and samples.analog.shape == (6, 10 * N)
    assert texts(samples.parameters["POINT"], "LABELS") == labels
    assert numbers(samples.parameters["FORCE_PLATFORM"], "CORNERS").shape == (3, 4, 1)


def test_labels_that_are_no_utf8(path):
    content = path.read_bytes()
    label = standing_markers(1)[1][0].encode()
    path.write_bytes(content.replace(label, b"\xe9" + label[1:], 1))
    labels = texts(read_by_ezc3d(path.read_bytes(), path).parameters["POINT"], "LABELS")
    assert labels[0] == "\u00e9" + label[1:].decode()


@pytest.mark.parametrize(
    ("child", "words"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "SIGSEGV"),
        ("raise SystemExit(7)", "exit code 7"),
        ("bytearray(10**12)", "MemoryError"),
        ("import sys; sys.stderr.write('odd bytes.'); sys.exit(3)", "cannot read it: odd bytes"),
        ("import time; time.sleep(60)", "did not finish within"),
    ],
)
def test_a_child_that_dies_or_hangs_is_one_sentence(path, tmp_path, monkeypatch, child, words):
    script = tmp_path / "child.py"
    script.write_text(child)
    monkeypatch.setattr(c3d_content, "_CHILD", script)
    monkeypatch.setattr(c3d_content, "_CPU_S", 1)
    monkeypatch.setattr(c3d_content, "_WALL_PER_CPU", 3)
    with pytest.raises(BadDataError, match=words) as caught:
        read_recording(path)
    assert str(path) in str(caught.value) and caught.value.remedy


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not keep the limit")
def test_the_child_has_a_limit_of_memory(path, monkeypatch):
    monkeypatch.setattr(c3d_content, "_MEMORY_BYTES", 60_000_000)
    with pytest.raises(BadDataError, match="ezc3d"):
        read_by_ezc3d(path.read_bytes(), path)


def test_other_counts_than_the_files_are_refused(path, monkeypatch):
    """Whatever ezc3d makes of a file, its counts must be those that fill the file."""
    shorter = read_by_ezc3d(path.read_bytes(), path)
    monkeypatch.setattr(
        c3d_content,
        "read_by_ezc3d",
        lambda *_: c3d_content.Samples(
            shorter.parameters, shorter.positions[:, 1:], shorter.residuals, shorter.analog
        ),
    )
    with pytest.raises(BadDataError, match="ezc3d reads 7 points"):
        read_recording(path)


def test_one_child_for_a_recording(path, monkeypatch):
    seen = []
    original = c3d_content.subprocess.run
    monkeypatch.setattr(
        c3d_content.subprocess, "run", lambda *a, **k: seen.append(a) or original(*a, **k)
    )
    read_recording(path)
    assert len(seen) == 1
