"""What the simulator hides is, by the mapping, what the catalogue's effects would print."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import ezc3d
import numpy as np
import pytest

from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.scene import Plate, Scene
from bsip_cli.instruments.readings import Instruments
from bsip_cli.simulate.effects import Effect as HiddenEffect
from bsip_cli.simulate.effects import drawn, pair_up
from bsip_cli.simulate.options import Asked, Laboratory, StudyOptions
from bsip_cli.simulate.recording import plates_of
from bsip_cli.simulate.study import simulate_study
from tests.blind import outside_effects  # noqa: F401 (the simulator knows them from here on)
from tests.blind.blind_cases import CATALOGUE as RANGES
from tests.blind.blind_cases import OUTSIDE
from tests.blind.blind_truth import MAPPINGS, PLATE, Expected, equivalents, expected
from tests.effects.moving_scene import RATE_HZ, moving, standing_still

# A trial from the start of the clock: what effects of the instruments need to know of it.
TRIAL = {"recorded_from_s": 0.0, "duration_s": 6.0}
SQUAT_S = 3.0


def hidden(name: str, size: float, target: str = "") -> HiddenEffect:
    return drawn(Asked(name, size, target), np.random.default_rng(4))


def instruments_of(wrench: np.ndarray) -> Instruments:
    """The simulated lab's plate, in the middle of nowhere, shows a wrench about the origin."""
    sensing = plates_of(Laboratory())[0]
    readings = sensing.reading(wrench[:, :3], wrench[:, 3:], np.zeros(3))[None]
    points = np.zeros((len(wrench), 1, 3))
    up = np.array([0.0, 0.0, 1.0])
    return Instruments(("A",), points, RATE_HZ, (sensing,), readings, RATE_HZ, up)


def shown_with(effect: HiddenEffect, scene: Scene) -> tuple[Scene, slice]:
    """The scene as the plate with the effect shows it, and the frames that are left of it."""
    after = effect.measured(instruments_of(scene.predicted))
    sensing, simulated = after.plates[0], plates_of(Laboratory())[0]
    shown = np.hstack(sensing.lab_wrench(after.readings[0], np.zeros(3)))
    first = round(after.start_s * RATE_HZ)
    kept = slice(first, first + len(shown))
    wrench = np.full((len(scene.times_s), 6), np.nan)
    wrench[kept] = shown
    plate = Plate(PLATE, simulated.corners_m(), wrench, sensing.sensor_m)
    return replace(scene, plates=(plate,)), kept


def values_of(effect: Effect, scene: Scene, sought: Expected) -> np.ndarray:
    """The parameters of an effect whose printed numbers are its parameters."""
    return np.array([sought.values[p.name] for p in effect.parameters(scene, sought.target)])


CHANNELS = ("fx", "fy", "fz", "mx", "my", "mz")
PAIRS_OF_FORCES = [(a, b) for a in CHANNELS[:3] for b in CHANNELS[:3] if a != b]
OF_THE_PLATE = [
    *(("plate_gain", 0.04, channel) for channel in CHANNELS[:3]),
    *(("plate_zero", 12.0, channel) for channel in CHANNELS),
    *(("plate_drift", -1.5, channel) for channel in CHANNELS),
    *(("plate_crosstalk", 0.02, f"{a}:{b}") for a, b in PAIRS_OF_FORCES),
    ("plate_translation", 0.02, ""),
    ("plate_rotation", 0.05, "yaw"),
    ("plate_rotation", -0.03, "tilt_x"),
    ("sync_offset", 0.012, ""),
    ("sync_offset", -0.012, ""),
    ("clock_drift", 0.0005, ""),
    ("clock_drift", -0.0005, ""),
]


@pytest.mark.parametrize(("name", "size", "target"), OF_THE_PLATE)
def test_instruments_err_as_the_mapped_effect_says(name, size, target):
    """Sign, frame and unit: the catalogue's change for the mapped truth is what the plate shows."""
    record = hidden(name, size, target).record()
    scene, kept = shown_with(hidden(name, size, target), moving())
    sought, effect = expected(record, TRIAL), EFFECTS[name]
    assert sought.target in effect.targets(scene)
    change = effect.change(scene, sought.target, values_of(effect, scene, sought))[kept]
    too_much = scene.plates[0].wrench[kept] - scene.predicted[kept]
    largest = np.abs(too_much).max()
    assert largest > 0.1
    off = np.abs(change - too_much)
    if name in ("sync_offset", "clock_drift"):  # from what was measured, which ends
        assert off[60:-60].max() < 1e-2 * largest
    else:
        assert off.max() < 1e-9


def test_a_tilted_lab_tilts_the_weight_as_the_mapped_angles_say():
    tilt = hidden("gravity_tilt", 0.02)
    scene, _ = shown_with(tilt, standing_still())
    sought = expected(tilt.record(), TRIAL)
    values = np.array([sought.values["angle_x"], sought.values["angle_y"]])
    change = EFFECTS["gravity_tilt"].change(scene, "", values)
    too_much = scene.plates[0].wrench - scene.predicted
    np.testing.assert_allclose(change[:, :3], too_much[:, :3], atol=1e-6)
    assert sought.values["angle"] == pytest.approx(0.02)


PAIR = RANGES["marker_swap"].targets[0]
PERSONAL = {
    "added_mass": (1.0, "hand_l"),
    "released_object": (0.5, "hand_r"),
    "wobbling_mass": (3.0, "thigh_l"),
    "breathing": (0.1, ""),
    "unmeasured_contact": (30.0, "hand_r"),
    "joint_centre": (0.02, "hip_l"),
    "missing_joint": (0.3, ""),
    "marker_shift": (0.03, "RKNEM"),
    "marker_swap": (0.5, PAIR),
    "over_smoothing": (3.0, ""),
    "segment_inertia": (0.3, "thigh_r"),
    "implement": (0.4, "hand_r"),
    "external_force": (50.0, "upper_torso"),
    "object_handled": (1.2, "hand_l"),
    "marker_slide": (0.03, "LELB"),
}


def simulated(folder: Path, **effects: tuple[float, str]) -> Path:
    asked = tuple(Asked(name, *given) for name, given in effects.items())
    options = StudyOptions(
        participants=1, tasks=("squat",), durations_s={"squat": SQUAT_S}, effects=asked
    )
    simulate_study(folder, options)
    return folder


@pytest.fixture(scope="module")
def everything(tmp_path_factory) -> tuple[list[dict], dict]:
    """Truth of a squat with all personal effects at once."""
    folder = simulated(tmp_path_factory.mktemp("everything"), **PERSONAL)
    truth = json.loads((folder / "truth" / "sub-01_truth.json").read_text())
    return truth["effects"], truth["trials"]["sub-01_task-squat_run-1"]


@cache
def scene_with_markers() -> Scene:
    scene = moving()
    plate = Plate(PLATE, scene.plates[0].corners_m, scene.predicted)
    return replace(scene, plates=(plate,))


@pytest.mark.parametrize("name", PERSONAL)
def test_the_diagnosis_prints_what_the_mapping_expects(name, everything):
    """Names of parameters, their units, and targets."""
    records, trial = everything
    record = next(record for record in records if record["effect"] == name)
    scene, effect, sought = scene_with_markers(), EFFECTS[name], expected(record, trial)
    if name == "marker_swap":  # its candidates come from residuals of exchanged labels
        assert sought.target == PAIR and set(sought.values) == {"start", "end"}
        return
    if name != "wobbling_mass":  # looked for only where somebody lands
        assert sought.target in effect.targets(scene)
    parameters = effect.parameters(scene, sought.target)
    typical = np.array([p.scan[0] if p.scan else p.typical for p in parameters])
    printed = {n: unit for n, unit, _ in effect.reported(scene, sought.target, typical)}
    printed["shift"] = "m"  # the length of a marker's printed shift
    assert set(sought.values) <= set(printed)
    sizes = [n for n, x in sought.values.items() if x == record["size"]]
    assert all(printed[n] == record["unit"] for n in sizes)


def test_a_mass_in_the_hand_is_as_heavy_as_the_mapping_says(everything):
    records, trial = everything
    scene = standing_still()
    for name in ("added_mass", "released_object"):
        record = next(r for r in records if r["effect"] == name)
        sought, effect = expected(record, trial), EFFECTS[name]
        values = np.zeros(len(effect.parameters(scene, sought.target)))
        values[0] = sought.values["mass"]
        if name == "released_object":
            values[1] = sought.values["release_time"]
            assert 0.35 * SQUAT_S <= values[1] <= 0.65 * SQUAT_S
        change = effect.change(scene, sought.target, values)
        assert change[0, 2] == pytest.approx(record["size"] * 9.80665)


def test_a_contact_that_lifts_takes_load_from_the_plates(everything):
    records, trial = everything
    record = next(r for r in records if r["effect"] == "unmeasured_contact")
    sought, effect, scene = expected(record, trial), EFFECTS["unmeasured_contact"], moving()
    forces = [sought.values[f"force_{axis}"] for axis in "xyz"]
    start, end = sought.values["start"], sought.values["end"]
    values = np.array([*forces, (start + end) / 2, end - start])
    change = effect.change(scene, sought.target, values)
    touching = (scene.times_s >= start) & (scene.times_s <= end)
    assert change[touching, 2].mean() == pytest.approx(-30.0, rel=0.02)
    np.testing.assert_allclose(change[scene.times_s > end + 0.02], 0.0)
    printed = {n: x for n, _, x in effect.reported(scene, sought.target, values)}
    assert all(printed[n] == pytest.approx(x) for n, x in sought.values.items())


@pytest.mark.parametrize("name", ["marker_shift", "marker_swap"])
def test_times_of_marker_errors_are_those_in_the_file(name, tmp_path):
    clean = simulated(tmp_path / "clean")
    spoilt = simulated(tmp_path / "spoilt", **{name: PERSONAL[name]})
    recording = Path("sub-01") / "sub-01_task-squat_run-1.c3d"
    points = [ezc3d.c3d(str(s / recording))["data"]["points"][:3] for s in (clean, spoilt)]
    off = np.nanmax(np.abs(points[0] - points[1]), axis=(0, 1)) > 1.0
    truth = json.loads((spoilt / "truth" / "sub-01_truth.json").read_text())
    trial = truth["trials"]["sub-01_task-squat_run-1"]
    sought = expected(truth["effects"][0], trial)
    first, last = np.flatnonzero(off)[[0, -1]] / 100.0
    begin = sought.values["from_time" if name == "marker_shift" else "start"]
    assert first == pytest.approx(begin, abs=0.05)
    assert last == pytest.approx(sought.values.get("end", SQUAT_S), abs=0.05)


def test_every_effect_is_mapped_and_can_be_simulated():
    assert set(MAPPINGS) == set(EFFECTS) == set(RANGES)
    for name, allowed in {**RANGES, **OUTSIDE}.items():
        for target in allowed.targets:
            for size in (allowed.least, allowed.most):
                pair_up([name], [size], [target])


def test_a_pair_of_markers_has_no_order():
    assert Expected("marker_swap", "A+B", {}).same_target("B+A")
    assert not Expected("marker_swap", "A+B", {}).same_target("A+C")


def test_what_nothing_tells_apart_depends_on_the_recordings():
    gain = hidden("plate_gain", 0.03, "fz").record()
    assert equivalents(gain, {"squat"}) == {"plate_zero", "added_mass"}
    assert equivalents(gain, {"squat", "hops"}) == set()
    assert equivalents(hidden("plate_gain", 0.03, "fx").record(), {"squat"}) == set()
    assert equivalents(hidden("plate_rotation", 0.03, "yaw").record(), {"squat"}) == set()
    tilted = hidden("plate_rotation", 0.03, "tilt_x").record()
    assert equivalents(tilted, {"squat"}) == {"gravity_tilt", "plate_zero"}
