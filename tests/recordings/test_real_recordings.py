"""Real recordings: every one reads or is refused in words, and known weights come back."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import ezc3d
import numpy as np
import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d import open_c3d
from bsip_cli.recordings.c3d_content import read_content
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.plate_wrench import plates_at_marker_rate
from bsip_cli.recordings.plates import CHANNELS_OF
from bsip_cli.recordings.read import open_recording, read_recording
from bsip_cli.recordings.session_findings import findings_about
from bsip_cli.recordings.session_reading import session_reading
from bsip_cli.recordings.trial_samples import TrialSamples

pytestmark = pytest.mark.real

GRAVITY = 9.80665
STATIC_KG = {
    "biobuddy_ech/anat_pose_ECH.c3d": 66.0,
    "opencap_subject4/static1.trc": 60.03,
    "btk_pig/PiG_Calibration-FlatFoot-Full.c3d": 46.3,
    "btk_pig/PiG_Calibration-FlatFoot-Hole.c3d": 64.0,
    "return11_static/c3dfile1.c3d": 62.0,
    "pycgm/Sample_Static.c3d": 79.65,
    "btk_functional_ll/FunctionalStatic.c3d": 59.65,
}
REFUSED = {
    "Empty.c3d": "empty",
    "bad_parameter_section.c3d": "LABELS claims 192 bytes",
    "Optotrak.c3d": "promises 992736 bytes",
    "C3DRotationExample.c3d": "no points",
    "Eb015si.c3d": "processor 86 (MIPS), which bsip does not read",
}
EZC3D_MISREADS = {"type1.C3D", "kyowadengyo.c3d", "evart.c3d"}  # header against parameters
NOT_FOLLOWED = {"BKINtechnologies.c3d"}  # ezc3d fills 12 GB before it refuses it
SAME_AS_EZC3D = (
    "biobuddy_ech/anat_pose_ECH.c3d",
    "btk_pig/PiG_Motion-FlatFoot-Full.c3d",
    "btk_functional_ll/FunctionalWalk.c3d",
    "motionanalysis_helenhayes/Sample_Jump2.c3d",
    "type3_running_kistler/Running_0002.c3d",
    "edge_ezc3d/BTS.c3d",
)


@cache
def _read(path: Path) -> Recording:
    return read_recording(path)


def _all(folder: Path) -> list[Path]:
    return sorted(p for p in folder.glob("*/*") if p.suffix.lower() in (".c3d", ".trc"))


def _c3d_files(folder: Path) -> list[Path]:
    return sorted(p for p in folder.iterdir() if p.suffix.lower() == ".c3d")


@pytest.mark.long
def test_every_file_reads_or_is_refused_in_words(real_data):
    refused = {}
    for path in _all(real_data):
        try:
            recording = _read(path)
        except BadDataError as error:
            refused[path.name] = str(error)
            assert str(path) in str(error) and error.expected and error.remedy
            continue
        _check_shapes(recording)
    assert refused.keys() == REFUSED.keys()
    assert all(words in refused[name] for name, words in REFUSED.items())


@pytest.mark.long
def test_the_same_samples_as_ezc3d(real_data):
    """Wherever ezc3d can read a file and its counts are not in doubt, to the last bit."""
    n_compared = 0
    for path in _all(real_data):
        if path.suffix.lower() != ".c3d" or path.name in {*REFUSED, *EZC3D_MISREADS, *NOT_FOLLOWED}:
            continue
        try:
            theirs = ezc3d.c3d(str(path))["data"]
        except (OSError, RuntimeError, ValueError):
            continue
        own = read_content(path)
        positions = np.transpose(theirs["points"][:3], (2, 1, 0))
        np.testing.assert_array_equal(own.positions, positions)
        np.testing.assert_array_equal(own.analog.ravel(), theirs["analogs"].ravel())
        n_compared += 1
    assert n_compared >= 69  # data sets are added, none is taken away


def _check_shapes(recording: Recording) -> None:
    assert recording.markers_m.shape[1:] == (len(recording.labels), 3)
    assert bool(recording.plates) == (recording.forces_note == "")
    np.testing.assert_allclose(
        recording.rotation_world_lab @ recording.rotation_world_lab.T, np.eye(3), atol=1e-12
    )
    assert np.linalg.det(recording.rotation_world_lab) == pytest.approx(1.0)
    for plate in recording.plates:
        assert plate.force_N.shape == plate.moment_Nm.shape == (len(plate.usable), 3)
        assert np.isfinite(plate.wrench[plate.usable]).all()


@pytest.mark.parametrize("name", STATIC_KG)
def test_standing_mass(real_data, name):
    plates = plates_at_marker_rate(_read(real_data / name))
    usable = np.all([plate.usable for plate in plates], axis=0)
    assert usable.mean() > 0.95
    mass_kg = np.mean(sum(plate.lift_N for plate in plates)[usable]) / GRAVITY
    assert mass_kg == pytest.approx(STATIC_KG[name], abs=0.06)


@pytest.mark.parametrize("name", SAME_AS_EZC3D)
def test_same_wrench_as_ezc3d(real_data, name):
    recording = _read(real_data / name)
    platforms = ezc3d.c3d(str(real_data / name), extract_forceplat_data=True)["data"]["platform"]
    rotation = recording.rotation_world_lab
    for plate in recording.plates:
        own = platforms[int(plate.name) - 1]
        force = (rotation @ own["force"]).T
        centre = rotation @ own["corners"].mean(axis=1) * 1e-3
        moment = (rotation @ own["moment"]).T * 1e-3 + np.cross(centre, force)
        good = plate.usable
        np.testing.assert_allclose(plate.force_N[good], force[good], atol=1e-9)
        if not any(
            "FPCOPPOLY" in f.found for f in recording.findings
        ):  # moves moments, not ezc3d's
            np.testing.assert_allclose(plate.moment_Nm[good], moment[good], atol=1e-9)


@pytest.mark.parametrize(
    "name", ["type3_running_kistler/Running_0002.c3d", "edge_ezc3d/FP_Type3.c3d"]
)
def test_kistlers_polynomial_gives_the_centre_of_pressure_of_ezc3d(real_data, name):
    platform = ezc3d.c3d(str(real_data / name), extract_forceplat_data=True)["data"]["platform"][0]
    plate = _read(real_data / name).plates[0]
    loaded = plate.force_N[:, 2] > 200
    point = platform["center_of_pressure"].T[loaded] * 1e-3
    free = plate.moment_Nm[loaded] - np.cross(point, plate.force_N[loaded])
    corners = plate.corners_m
    normal = np.cross(corners[0] - corners[1], corners[0] - corners[3])
    normal /= np.linalg.norm(normal)
    across = np.linalg.norm(np.cross(free, normal), axis=1)  # none about the true point
    assert loaded.any() and np.max(across / plate.force_N[loaded, 2]) < 1e-9


@pytest.mark.parametrize(
    "name",
    [
        "type3_qualisys_c3dorg26/Capture0002.c3d",
        "type3_qualisys_c3dorg26/Walking_Hybrid_1_1.c3d",
        "c3dorg_plate_types/TYPE-3.c3d",
        "ezc3d_rehazenter_qualisys/Qualisys.c3d",
        "sprinter_ja1/JA1Gait35.c3d",
        "hamner_other/run200.trc",
        "opencap_subject4/squats1.trc",
    ],
)
def test_centre_of_pressure_lies_under_the_feet(real_data, name):
    """Of every loaded plate, to a foot's breadth: two markers on a foot tell no more."""
    session = session_reading([TrialSamples.of(open_recording(real_data / name))])
    distances = np.array([verdict.after.distance_m for verdict in session.plates.values()])
    loaded = distances[np.isfinite(distances)]
    assert len(loaded) and loaded.max() < 0.1
    # Sound: nothing is changed. The vertical moments of opencap are reversed, which squats show.
    doubts = {"plate_moment"} if name.startswith("opencap") else set()
    assert {f.check for f in findings_about(session)} == doubts


@pytest.mark.parametrize("times", [1.0, 0.1, 1e-5])
def test_a_centre_of_pressure_goes_with_the_foot_that_rolls(real_data, times):
    """Moments in N cm taken for N mm leave it in the middle of the plate, under the foot; those of
    a unit that no reading has are told."""
    walk = open_recording(real_data / "zoo_children/HC033A-straight.c3d")
    smaller = np.array([1.0, 1.0, 1.0, times, times, times])
    sources = [replace(one, measured=smaller * one.measured) for one in walk.sources]
    session = session_reading([TrialSamples.of(replace(walk, sources=tuple(sources)))])
    for verdict in session.plates.values():
        assert ("passes over it" in verdict.refusal) == (times < 0.1)
        assert verdict.refusal or verdict.reading.moment_scale == pytest.approx(1 / times)
        assert verdict.before.distance_m < 0.06 or times < 0.1
        assert verdict.before.rolls_m > 0.05 or times < 1.0


def test_a_plate_that_no_reading_brings_under_the_feet_is_left_out(real_data):
    """Its load lies 0.4 m beside them, and the weight does not shift between the plates."""
    recording = _read(real_data / "edge_nimble/JH_01.c3d")
    assert [plate.name for plate in recording.plates] == ["2"]
    (left_out,) = [f for f in recording.findings if f.level == "excluded"]
    assert left_out.subject == "1" and "beside the feet" in left_out.found


@pytest.mark.parametrize(
    ("name", "largest_N"),
    [("type1.C3D", 732), ("kyowadengyo.c3d", 787)],
)
def test_layouts_that_ezc3d_alone_misreads(real_data, name, largest_N):
    recording = _read(real_data / "c3dorg_plate_types" / name)
    assert np.max([p.force_N[:, 2].max() for p in recording.plates]) == pytest.approx(
        largest_N, abs=1
    )
    assert not [f for f in recording.findings if f.level == "excluded"]


def test_the_same_trial_in_the_numbers_of_two_processors(real_data):
    pc, dec = (_read(real_data / f"edge_c3dorg/Eb015{k}i.c3d") for k in ("p", "v"))
    np.testing.assert_allclose(dec.markers_m, pc.markers_m, atol=1e-9)
    np.testing.assert_allclose(dec.plates[0].force_N, pc.plates[0].force_N, atol=1e-3)


def test_clipped_samples_of_sample21_are_left_out(real_data):
    """What is left of them acts a metre beside the body: no plate of it is believed."""
    file = real_data / "c3dorg_plate_types/sample21.c3d"
    sources = open_recording(file).sources
    assert [p.usable.mean() for p in sources] == pytest.approx([0.35, 0.35], abs=0.01)
    assert _read(file).forces_note == "every force plate was left out"


def test_duplicates_of_motion_analysis_get_their_names(real_data):
    labels = _read(real_data / "motionanalysis_helenhayes/Sample_Jump2.c3d").labels
    assert len(set(labels)) == len(labels) == 51


def test_squat_moves_as_the_force_says(real_data):
    recording = _read(real_data / "opencap_subject4/squats1.trc")
    force = sum(plate.lift_N for plate in plates_at_marker_rate(recording))
    height = np.convolve(recording.markers_m[..., 2].mean(axis=1), np.ones(15) / 15, "same")
    acceleration = np.gradient(np.gradient(height)) * recording.marker_rate_hz**2
    assert np.corrcoef(acceleration[50:-50], force[50:-50])[0, 1] > 0.9


@pytest.mark.long
@pytest.mark.parametrize(
    ("names", "words"),
    [
        (
            ["opencap_subject4/walking1.trc", "opencap_subject4/walking2.trc"],
            "reversed the moments",
        ),
        (["zoo_children/HC039A-straight.c3d", "zoo_children/HC039A-turn.c3d"], ""),
    ],
)
def test_vertical_moments_go_with_the_turning_body(real_data, names, words):
    trials = [TrialSamples.of(open_recording(real_data / name)) for name in names]
    found = findings_about(session_reading(trials))
    assert bool(words) == bool(found)
    assert all(words in finding.action for finding in found)


@pytest.mark.parametrize(
    ("plate", "one", "other"),
    [(0, "Fz2", "Fz3"), (0, "Fz2", "Fz4"), (1, "Fz1", "Fz4"), (1, "Fz2", "Fz4"), (0, "", "")],
)
def test_exchanged_corners_of_a_plate_with_eight_sensors(real_data, plate, one, other):
    folder = real_data / "type3_qualisys_c3dorg26"
    trials = [open_c3d(folder / f"Walking_Hybrid_1_{k}.c3d") for k in (1, 2)]
    name = trials[0].sources[plate].name
    order = list(CHANNELS_OF[3])
    if one:
        i, j = order.index(one), order.index(other)
        order[i], order[j] = order[j], order[i]
    columns = [CHANNELS_OF[3].index(sensor) for sensor in order]
    changed = []
    for trial in trials:
        sources = list(trial.sources)
        sources[plate] = replace(sources[plate], measured=sources[plate].measured[:, columns])
        changed.append(replace(trial, sources=tuple(sources)))
    session = session_reading([TrialSamples.of(trial) for trial in changed])
    done = {n: v.reading.channels for n, v in session.plates.items() if v.reading.channels}
    assert done == ({name: f"exchanged {one} and {other}"} if one else {})
    assert not any(v.refusal or v.doubted for v in session.plates.values())
