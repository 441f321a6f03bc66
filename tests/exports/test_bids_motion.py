"""BIDS-Motion: columns, their list and their sidecar agree with each other and with the data."""

from __future__ import annotations

import io
import json

import numpy as np
import pandas as pd
import pytest

from bsip_cli.body.exports.bids_motion import (
    channels,
    channels_json,
    channels_tsv,
    motion_json,
    motion_tsv,
)
from bsip_cli.body.exports.opensim_motion import coordinates
from tests.body.standing_person import standing

# Of the specification (BIDS 1.10, Motion).
REQUIRED = ["name", "component", "type", "tracked_point", "units"]
COMPONENTS = {"x", "y", "z", "quat_x", "quat_y", "quat_z", "quat_w", "n/a"}
TYPES = {"ACCEL", "ANGACCEL", "GYRO", "JNTANG", "LATENCY", "MAGN", "MISC", "ORNT", "POS", "VEL"}


@pytest.fixture(scope="module")
def written():
    rng, skeleton = np.random.default_rng(1), standing().person.skeleton
    markers = rng.normal(size=(5, 2, 3))
    markers[2, 1] = np.nan
    q = np.tile(standing().q, (5, 1))
    q[:, 0] = np.arange(5)
    determined = np.array([True, True, False, True, True])
    wrench = rng.normal(size=(5, 6))
    columns = channels(["A", "B"], markers, skeleton, q, determined, {"1": wrench})
    table = pd.read_csv(io.StringIO(channels_tsv(columns)), sep="\t", keep_default_na=False)
    motion = pd.read_csv(io.StringIO(motion_tsv(columns)), sep="\t", header=None, na_values="n/a")
    sidecar = json.loads(motion_json(columns, "walking", 100.0, "1.2"))
    return markers, skeleton, q, determined, wrench, table, motion, sidecar


def test_channels_are_as_the_specification_lists_them(written):
    *_, table, motion, _ = written
    assert list(table.columns[:5]) == REQUIRED
    assert set(table["component"]) <= COMPONENTS and set(table["type"]) <= TYPES
    assert len(table) == motion.shape[1] and table["name"].is_unique
    frames = json.loads(channels_json())["reference_frame"]["Levels"]
    assert set(table["reference_frame"]) == set(frames)
    assert (table.loc[table["type"] == "JNTANG", "units"] == "deg").all()


def test_values_are_the_recording_and_its_gaps(written):
    markers, skeleton, q, determined, wrench, table, motion, _ = written
    found = dict(zip(table["name"], motion.to_numpy(float).T, strict=True))
    for k, name in enumerate("AB"):
        seen = np.stack([found[f"{name}_{axis}"] for axis in "xyz"], axis=1)
        assert seen == pytest.approx(markers[:, k], abs=1e-8, nan_ok=True)
    assert found["lower_torso_tx"] == pytest.approx([0, 1, np.nan, 3, 4], nan_ok=True)
    assert found["plate1_mz"] == pytest.approx(wrench[:, 5], abs=1e-8)
    angle = np.rad2deg(coordinates(skeleton, q)["hip_r_rx"])
    assert found["hip_r_rx"][determined] == pytest.approx(angle[determined], abs=1e-6)


def test_sidecar_counts_what_is_there(written):
    *_, table, motion, sidecar = written
    assert (sidecar["TaskName"], sidecar["SamplingFrequency"]) == ("walking", 100.0)
    assert sidecar["MotionChannelCount"] == motion.shape[1]
    counts = table["type"].value_counts()
    assert {f"{k}ChannelCount": n for k, n in counts.items()}.items() <= sidecar.items()
    assert sidecar["TrackedPointsCount"] == table["tracked_point"].nunique()
    assert sidecar["RecordingDuration"] == pytest.approx(0.05)
