"""Contact windows and plate zeros on real trials whose contacts are known."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bsip_cli.recordings.contacts import (
    ContactWindows,
    contact_windows,
    foot_contacts,
    plate_loads,
)
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.plate_wrench import plate_zero, wrench_at_marker_rate
from bsip_cli.recordings.read import read_recording

pytestmark = pytest.mark.real

OPENCAP = (r"L_(calc|toe|5meta)", r"r_(calc|toe|5meta)", r"C7|[Lr]\.(ASIS|PSIS)|[LR]_Shoulder")
HAMNER = (r"L(CAL|TOE|MT5)", r"R(CAL|TOE|MT5)", r"C7|CLAV|.ACR|.ASI|.PSI")
BIOBUDDY = (r"L(CAL|MFH5|MFH1|TT2)", r"R(CAL|MFH5|MFH1|TT2)", r"C7|T10|SUP|[LR](ASIS|PSIS)")
PIG = (r"L(HEE|TOE|ANK)", r"R(HEE|TOE|ANK)", r"C7|T10|CLAV|STRN|[LR](ASI|PSI)|SACR")


def _columns(recording: Recording, pattern: str) -> list[int]:
    return [i for i, label in enumerate(recording.labels) if re.fullmatch(pattern, label)]


def _windows(path: Path, names: tuple[str, str, str], mass_kg: float) -> ContactWindows:
    recording = read_recording(path)
    left, right, trunk = (recording.markers_m[:, _columns(recording, name)] for name in names)
    loads = plate_loads(recording, wrench_at_marker_rate(recording))
    rate_hz = recording.marker_rate_hz
    feet = foot_contacts({"l": left, "r": right}, rate_hz, loads, recording.n_frames)
    return contact_windows(feet, trunk, mass_kg, rate_hz)


@pytest.mark.parametrize(
    ("name", "markers", "mass_kg", "least"),
    [
        ("opencap_subject4/static1.trc", OPENCAP, 60.0, 1.0),
        ("opencap_subject4/squats1.trc", OPENCAP, 60.0, 1.0),
        ("hamner_other/run200.trc", HAMNER, 72.6, 0.98),
        ("biobuddy_ech/anat_pose_ECH.c3d", BIOBUDDY, 66.0, 0.98),
        ("biobuddy_ech/right_knee.c3d", BIOBUDDY, 66.0, 0.98),
    ],
)
def test_all_contacts_on_plates(real_data, name, markers, mass_kg, least):
    assert _windows(real_data / name, markers, mass_kg).valid.mean() >= least


def test_chair_is_named(real_data):
    windows = _windows(real_data / "opencap_subject4/STS1.trc", OPENCAP, 60.0)
    assert 0.4 < windows.valid.mean() < 0.7
    assert any("seat" in finding.found for finding in windows.reasons)


@pytest.mark.parametrize("name", ["DJ1", "DJ2"])
def test_box_before_the_drop_is_left_out_and_the_landing_kept(real_data, name):
    windows = _windows(real_data / f"opencap_subject4/{name}.trc", OPENCAP, 60.0)
    assert not windows.valid[:100].any()
    assert windows.valid[125:].all()


def test_first_and_last_steps_of_gait_are_left_out(real_data):
    path = real_data / "btk_pig/PiG_Motion-FlatFoot-Full.c3d"
    windows = _windows(path, PIG, 46.3)
    assert 0.1 < windows.valid.mean() < 0.3
    assert not windows.valid[:80].any() and not windows.valid[-80:].any()


def test_unloaded_belt_has_its_offset(real_data):
    recording = read_recording(real_data / "biobuddy_ech/right_knee.c3d")
    loaded, unloaded = (plate_zero(p, recording.analog_rate_hz) for p in recording.plates)
    assert not loaded.is_known()
    assert unloaded.offset[2] == pytest.approx(9.0, abs=0.2)
