"""What is written to C3D is what was simulated."""

from __future__ import annotations

import json
from dataclasses import replace

import ezc3d
import numpy as np
import pytest

from bsip_cli.errors import UsageError
from bsip_cli.simulate.options import PRESETS, Laboratory, Rates, Richness, StudyOptions
from bsip_cli.simulate.recording import (
    FULL_SCALE,
    marker_paths,
    measure_trial,
    plate_wrenches,
    plates_of,
    rigid_paths,
    walkway_pose,
    write_trial,
)
from bsip_cli.simulate.study import simulate_study
from tests.simulate.conftest import NOTHING_RICH

QUIET = replace(NOTHING_RICH, quantised=True)


def _written(tmp_path, trial, person, richness, laboratory=None, rates=None):
    laboratory = laboratory or Laboratory()
    path = tmp_path / "trial.c3d"
    rng = np.random.default_rng(5)
    rates = rates or Rates(100, 1000)
    measured = measure_trial(trial, person, rates, laboratory, richness, rng, 0.03)
    write_trial(path, measured, richness.quantised)
    recorded = ezc3d.c3d(str(path), extract_forceplat_data=True)
    return recorded, measured.pose, plates_of(laboratory)


@pytest.mark.parametrize("task", ["squat", "walking", "basketball"])
def test_the_plate_reads_back_the_true_wrench(tmp_path, trial, person, task):
    here = trial(task)
    c3d, pose, plates = _written(tmp_path, here, person, QUIET)
    force, moment = plate_wrenches(here, plates, pose)[0]
    n = len(here.time_s)
    read = c3d["data"]["platform"][0]
    half_step = 0.5 * FULL_SCALE / 2**15 * (1.0 + 1e-5)
    assert np.all(np.abs(read["force"].T - force[:n]) <= half_step[:3].max() + 1e-3)
    at_centre = moment - np.cross(plates[0].centre_m, force)
    slack = half_step[3:].max() / 1000.0 + 0.05 * half_step[:3].max() + 1e-3
    assert np.abs(read["moment"].T / 1000.0 - at_centre).max() <= slack
    loaded = force[:, 2] > 100.0
    assert loaded.any()
    cop = (
        plates[0].centre_m[:2]
        + np.stack([-at_centre[loaded, 1], at_centre[loaded, 0]], axis=1) / force[loaded, 2:]
    )
    assert np.abs(read["center_of_pressure"][:2, loaded].T / 1000.0 - cop).max() < 1e-3


def test_a_standing_person_presses_down_inside_the_corners(tmp_path, trial, person):
    c3d, _, _ = _written(tmp_path, trial("static"), person, Richness())
    read = c3d["data"]["platform"][0]
    assert read["force"][2].mean() == pytest.approx(9.81 * person.mass_kg, rel=1e-3)
    raw = c3d["data"]["analogs"][0]
    assert raw[2].mean() < 0.0  # Vicon: z of the plate points down
    corners = read["corners"][:2]
    cop = read["center_of_pressure"][:2].mean(axis=1)
    assert np.all(corners.min(axis=1) < cop)
    assert np.all(cop < corners.max(axis=1))


def test_integer_parameters_are_integers(tmp_path, trial, person):
    c3d, _, _ = _written(tmp_path, trial("static"), person, Richness())
    group = c3d["parameters"]["FORCE_PLATFORM"]
    for name in ("USED", "TYPE", "CHANNEL", "ZERO"):
        assert np.issubdtype(np.asarray(group[name]["value"]).dtype, np.integer), name
    assert group["ORIGIN"]["value"][2, 0] < 0.0
    assert group["CORNERS"]["value"].shape == (3, 4, 1)


def test_without_noise_markers_are_rigid_on_their_bones(trial, person):
    here = trial("squat")
    poses = here.poses.part(slice(None, None, 10))
    paths = marker_paths(person, poses, 100.0, NOTHING_RICH, np.random.default_rng(0))
    for label, path in rigid_paths(person, poses).items():
        assert np.array_equal(paths[label], path)
    for a, b in (("RKNEL", "RKNEM"), ("C7", "LAC"), ("RASIS", "LPSIS"), ("LCAL", "LMT2")):
        distance = np.linalg.norm(paths[a] - paths[b], axis=1)
        assert np.ptp(distance) < 1e-12


def test_skin_moves_by_millimetres(trial, person):
    here = trial("squat")
    poses = here.poses.part(slice(None, None, 10))
    skin = replace(NOTHING_RICH, soft_tissue=1.0)
    marked = {m: person.markers[m] for m in ("RKNEL", "RKNEM", "LKNEL", "LKNEM")}
    paths = marker_paths(person, poses, 100.0, skin, np.random.default_rng(0))
    bones = rigid_paths(person, poses)
    travel = [np.ptp(paths[m] - bones[m], axis=0).max() for m in marked]
    assert 0.003 < max(travel) < 0.04
    heel = np.ptp(paths["RCAL"] - bones["RCAL"], axis=0).max()
    assert heel < 0.006


def test_lost_markers_are_invalid_points(tmp_path, trial, person):
    c3d, _, _ = _written(tmp_path, trial("squat"), person, Richness())
    points = c3d["data"]["points"][:3]
    residuals = c3d["data"]["meta_points"]["residuals"][0]
    lost = np.isnan(points).any(axis=0)
    assert lost.any()
    assert np.all(residuals[lost] < 0.0)
    assert np.all(residuals[~lost] >= 0.0)


def test_a_second_plate_takes_the_next_footfall(tmp_path, trial, person):
    c3d, _, _ = _written(
        tmp_path, trial("walking"), person, Richness(), Laboratory(plates=2), Rates(100, 500)
    )
    first, second = c3d["data"]["platform"]
    assert first["force"][2].max() > 5.0 * person.mass_kg
    assert second["force"][2].max() > 5.0 * person.mass_kg


def test_with_a_plate_per_foot_each_feels_its_own(trial):
    """Together what one plate under both would feel; apart, the feet push against each other."""
    here, one, two = trial("squat"), Laboratory(), Laboratory(plate_per_foot=True)
    pose = walkway_pose(here, one, 0.0)
    ((force, moment),) = plate_wrenches(here, plates_of(one), pose)
    apart = plate_wrenches(here, plates_of(two), pose, apart=True)
    assert np.abs(sum(f for f, _ in apart) - force).max() < 1e-9
    assert np.abs(sum(m for _, m in apart) - moment).max() < 1e-9
    for plate, (own, turning) in zip(plates_of(two), apart, strict=True):
        assert own[:, 2].min() > 0.2 * force[:, 2].mean()
        x, y = -turning[:, 1] / own[:, 2], turning[:, 0] / own[:, 2]
        assert max(plate.distance_m(np.array([a, b, 0.0])) for a, b in zip(x, y, strict=True)) == 0
    (left, _), (right, _) = apart
    across = plates_of(two)[0].axes[:, 1]  # to the right
    assert (left @ across).mean() > 8.0 > -8.0 > (right @ across).mean()


def test_another_run_is_another_movement_of_the_same_person(tmp_path):
    tasks, seconds = ("static", "squat"), {"static": 0.5, "squat": 2.0}
    options = StudyOptions(participants=1, tasks=tasks, durations_s=seconds)
    simulate_study(tmp_path / "a", options)
    simulate_study(tmp_path / "b", replace(options, tasks=("squat",)))
    simulate_study(tmp_path / "c", replace(options, tasks=("squat",), run=2))
    first, alone, again = (
        tmp_path / study / "sub-01" / f"sub-01_task-squat_run-{run}.c3d"
        for study, run in (("a", 1), ("b", 1), ("c", 2))
    )
    assert first.read_bytes() == alone.read_bytes()
    assert first.read_bytes() != again.read_bytes()
    people, tables = zip(
        *(
            (
                json.loads((tmp_path / study / "truth" / "sub-01_truth.json").read_text()),
                (tmp_path / study / "participants.tsv").read_text(),
            )
            for study in "abc"
        ),
        strict=True,
    )
    assert people[0]["person"] == people[1]["person"] == people[2]["person"]
    assert len(set(tables)) == 1


def test_study_layout_and_truth(tmp_path):
    options = StudyOptions(
        participants=2, tasks=("static", "throwing"), durations_s={"static": 0.5, "throwing": 1.6}
    )
    people = simulate_study(tmp_path, options)
    table = (tmp_path / "participants.tsv").read_text().splitlines()
    assert table[0] == "participant_id\tsex\tmass_kg\theight_m"
    assert [row.split("\t")[1] for row in table[1:]] == ["M", "F"]
    assert (tmp_path / "sub-02" / "sub-02_task-throwing_run-1.c3d").is_file()
    record = json.loads((tmp_path / "truth" / "sub-02_truth.json").read_text())
    masses = [s["mass_kg"] for s in record["person"]["segments"].values()]
    assert sum(masses) == pytest.approx(people[1].mass_kg)
    assert abs(float(table[2].split("\t")[2]) - sum(masses)) < 0.6
    ball = record["trials"]["sub-02_task-throwing_run-1"]["ball"]
    assert 0.15 <= ball["mass_kg"] <= 0.4
    assert 0.0 < ball["release_s"] < 1.6


def test_the_sample_fits_into_eleven_megabytes():
    """From the format: 16 bytes per point and frame, 4 per analog sample, blocks of 512."""
    options = PRESETS["sample"]
    size = 0
    for task in options.tasks:
        rates, seconds = options.rates_of(task), options.durations_s[task]
        per_frame = 38 * 16 + 6 * 4 * rates.analog_hz // rates.marker_hz
        size += seconds * rates.marker_hz * per_frame + 4096
    truth_file = 25_000
    assert options.participants * (size + truth_file) < 11e6


def test_impossible_options_are_refused(tmp_path):
    with pytest.raises(UsageError, match="marker rate"):
        simulate_study(tmp_path, StudyOptions(rates={"default": Rates(120, 1000)}))
    with pytest.raises(UsageError, match="unknown tasks"):
        simulate_study(tmp_path, StudyOptions(tasks=("dancing",)))


@pytest.mark.parametrize("task", ["steps", "walking", "running"])
def test_unmeasured_feet_stand_beside_the_plate(trial, person, task):
    here = trial(task)
    centre, half = here.plan.plate_centre_m, 0.3
    for side in "lr":
        ankle = here.poses.origin_m[f"foot_{side}"][:, 0] - centre[0]
        length = person.lengths_m[f"foot_{side}"]
        loaded = here.feet[side][0][:, 1] > 1.0
        off, on = loaded & ~here.on_plate[side], loaded & here.on_plate[side]
        heel, toe = ankle - 0.27 * length, ankle + 0.73 * length
        assert np.all((heel[off] > half) | (toe[off] < -half))
        assert np.all((heel[on] > -half) & (toe[on] < half))
    assert any(contact.on_plate for contact in here.contacts)
