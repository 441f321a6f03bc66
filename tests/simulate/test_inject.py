"""Effects hidden in recorded files: read back by the readers of the fitted side."""

from __future__ import annotations

import json
from pathlib import Path

import ezc3d
import numpy as np
import pytest

from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.read import read_recording
from bsip_cli.simulate.effects import Effect, drawn
from bsip_cli.simulate.options import Asked, Laboratory, Rates, Richness
from bsip_cli.simulate.recording import measure_trial, write_trial
from bsip_cli.simulate.study import inject_command, inject_recording
from tests.recordings.recording_writers import write_mot, write_trc
from tests.simulate.conftest import person_of, trial_of_task

G = 9.81


def effect_of(name: str, size: float, target: str = "") -> Effect:
    return drawn(Asked(name, size, target), np.random.default_rng(2))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Path:
    """A squat as a lab would have recorded it, two plates, the second one unloaded."""
    path = tmp_path_factory.mktemp("recorded") / "sub-01_task-squat_run-1.c3d"
    rng, laboratory = np.random.default_rng(5), Laboratory(plates=2)
    trial, person = trial_of_task("squat"), person_of(3)
    write_trial(path, measure_trial(trial, person, Rates(100, 500), laboratory, Richness(), rng))
    return path


@pytest.fixture(scope="module")
def trc(tmp_path_factory, recorded) -> Path:
    """The same as TRC and MOT, Y up."""
    folder = tmp_path_factory.mktemp("trc")
    here = read_recording(recorded)
    points = here.markers_m[..., [1, 2, 0]]
    file, times = folder / "sub-01_task-squat_run-1.trc", np.arange(len(points)) / 100
    write_trc(file, times, points, here.labels)
    force, moment = here.plates[0].force_N, here.plates[0].moment_Nm
    point = np.stack([-moment[:, 1], moment[:, 0]], axis=1) / force[:, 2:]
    twist = moment[:, 2] - point[:, 0] * force[:, 1] + point[:, 1] * force[:, 0]
    zero = np.zeros(len(force))
    names = [f"ground_force_{k}" for k in ("vx", "vy", "vz", "px", "py", "pz")]
    names += [f"ground_torque_{a}" for a in "xyz"]
    values = (force[:, 1], force[:, 2], force[:, 0], point[:, 1], zero, point[:, 0])
    columns = dict(zip(names, (*values, zero, twist, zero), strict=True))
    write_mot(file.with_suffix(".mot"), np.arange(len(force)) / 500, columns)
    return file


def injected(source: Path, folder: Path, *effects: Effect) -> tuple[Recording, Recording]:
    """The recording before and after, as the fitted side reads them."""
    copy = folder / source.name
    inject_recording(source, copy, effects)
    return read_recording(source), read_recording(copy)


@pytest.mark.parametrize("kind", ["recorded", "trc"])
def test_an_added_mass_weighs_and_pulls_where_its_markers_are(request, tmp_path, kind):
    source = request.getfixturevalue(kind)
    before, after = injected(source, tmp_path, effect_of("added_mass", 4.0, "hand_r"))
    force = after.plates[0].force_N - before.plates[0].force_N
    assert force[:, 2].mean() == pytest.approx(4.0 * G, abs=1.5)
    assert np.nanmax(np.abs(after.markers_m - before.markers_m)) < 1e-5
    labels = [before.labels.index(name) for name in ("RWRR", "RWRU", "RHAND")]
    hand = np.repeat(before.markers_m[:, labels].mean(axis=1), 5, axis=0)[: len(force)]
    moment = after.plates[0].moment_Nm - before.plates[0].moment_Nm
    miss = moment - np.cross(hand, force)
    assert np.nanpercentile(np.abs(miss), 95) < 0.8
    if kind == "recorded":
        assert np.abs(after.plates[1].force_N - before.plates[1].force_N).max() < 1e-4


@pytest.mark.parametrize("kind", ["recorded", "trc"])
def test_a_delay_comes_through_the_file(request, tmp_path, kind):
    source = request.getfixturevalue(kind)
    before, after = injected(source, tmp_path, effect_of("sync_offset", 0.03))
    assert len(after.markers_m) == len(before.markers_m) - 3
    assert np.nanmax(np.abs(after.markers_m - before.markers_m[3:])) < 1e-6
    late = before.plates[0].force_N[: -3 * 5]
    assert np.abs(after.plates[0].force_N - late).max() < 0.01


def test_a_shifted_plate_moves_the_cop_and_nothing_else(tmp_path, recorded):
    effect = effect_of("plate_translation", 0.02, "x,plate=1")
    before, after = injected(recorded, tmp_path, effect)
    force, moment = before.plates[0].force_N, after.plates[0].moment_Nm
    assert np.abs(after.plates[0].force_N - force).max() < 1e-3
    expected = before.plates[0].moment_Nm - np.cross([0.02, 0.0, 0.0], force)
    assert np.abs(moment - expected).max() < 1e-3
    assert np.abs(after.plates[1].moment_Nm - before.plates[1].moment_Nm).max() < 1e-3


def test_all_else_in_a_c3d_file_stays(tmp_path, recorded):
    injected(recorded, tmp_path, effect_of("plate_gain", 0.05, "fz,plate=1"))
    old, new = (ezc3d.c3d(str(path)) for path in (recorded, tmp_path / recorded.name))
    assert np.array_equal(old["data"]["points"], new["data"]["points"], equal_nan=True)
    residuals = [c["data"]["meta_points"]["residuals"] for c in (old, new)]
    assert np.array_equal(*residuals)
    analogs = [c["data"]["analogs"][0] for c in (old, new)]
    assert np.abs(np.delete(analogs[1] - analogs[0], 2, axis=0)).max() == 0.0
    assert np.abs(analogs[1][2] - 1.05 * analogs[0][2]).max() < 1e-3
    check_parameters(old, new)


def check_parameters(old, new) -> None:
    """Two C3D files have the same parameters, but for where their data start."""
    for group, parameters in old["parameters"].items():
        for name, entry in parameters.items():
            if not name.startswith("__") and name != "DATA_START":
                copy = new["parameters"][group][name]
                assert np.array_equal(np.asarray(entry["value"]), np.asarray(copy["value"])), name
                assert entry["type"] == copy["type"], name


def test_marker_effects_leave_the_forces_alone(tmp_path, recorded, trc):
    for source in (recorded, trc):
        effect = effect_of("marker_shift", 0.03, "RKNEL,from_s=1")
        before, after = injected(source, tmp_path, effect)
        travel = np.linalg.norm(after.markers_m - before.markers_m, axis=2)
        knee = before.labels.index("RKNEL")
        seen = np.isfinite(travel[106:, knee])
        assert seen.mean() > 0.5
        assert np.abs(travel[106:, knee][seen] - 0.03).max() < 1e-5
        assert np.nanmax(np.delete(travel, knee, axis=1)) < 1e-5
        assert np.abs(after.plates[0].force_N - before.plates[0].force_N).max() < 1e-3


def test_a_tilted_lab_turns_markers_and_forces_together(tmp_path, recorded):
    before, after = injected(recorded, tmp_path, effect_of("gravity_tilt", 0.03, "x"))
    lean = after.plates[0].force_N.mean(axis=0)
    upright = before.plates[0].force_N.mean(axis=0)
    angle = np.arctan2(lean[1], lean[2]) - np.arctan2(upright[1], upright[2])
    assert angle == pytest.approx(-0.03, abs=1e-4)
    top, ankle = (before.labels.index(name) for name in ("FHEAD", "RMALL"))
    up = [np.nanmean(r.markers_m[:, top] - r.markers_m[:, ankle], axis=0) for r in (before, after)]
    turned = [np.arctan2(v[1], v[2]) for v in up]
    assert turned[1] - turned[0] == pytest.approx(-0.03, abs=1e-3)


@pytest.mark.parametrize("name", ["unmeasured_contact", "missing_joint", "segment_inertia"])
def test_what_would_change_the_movement_is_refused(tmp_path, recorded, name):
    with pytest.raises(UsageError, match="cannot be hidden in measured data"):
        inject_command(recorded, tmp_path / "x.c3d", [], 1, [name], [0.3], [], [])
    assert not (tmp_path / "x.c3d").exists()


def test_a_mot_file_does_not_say_where_plates_lie(tmp_path, trc):
    with pytest.raises(BadDataError, match="where the plates lie"):
        inject_recording(trc, tmp_path / trc.name, [effect_of("plate_rotation", 0.03)])


@pytest.mark.parametrize(
    ("name", "target", "words"),
    [
        ("added_mass", "tail", "no marker of 'tail' is in the recording; expected labels.*RHAND"),
        ("marker_shift", "TAIL", "no marker 'TAIL'; expected one of .*RHAND"),
        ("plate_zero", "fz,plate=9", "no plate 9"),
    ],
)
def test_what_a_file_does_not_have_is_said_of_that_file(tmp_path, recorded, name, target, words):
    with pytest.raises(BadDataError, match=f"squat_run-1.c3d: .*{words}"):
        inject_recording(recorded, tmp_path / "x.c3d", [effect_of(name, 0.1, target)])
    assert not (tmp_path / "x.c3d").exists()


def test_a_mot_file_without_points_where_nobody_stands(tmp_path, trc):
    """As OpenSim writes them; a delay moves the forces over these rows."""
    source = tmp_path / "in" / trc.name
    source.parent.mkdir()
    source.write_text(trc.read_text())
    *head, last = trc.with_suffix(".mot").read_text().splitlines()
    start = head.index("endheader") + 2
    rows = [line.split() for line in (*head[start:], last)]
    for row in rows[:50]:
        row[1:] = ["0"] * 3 + ["NaN"] * 3 + ["0"] * 3
    text = "\n".join([*head[:start], *("\t".join(row) for row in rows)])
    source.with_suffix(".mot").write_text(text + "\n")
    copy = tmp_path / "out" / trc.name
    copy.parent.mkdir()
    inject_recording(source, copy, [effect_of("sync_offset", -0.033)])
    (plate,) = read_recording(copy).plates
    assert np.isfinite(plate.force_N).all() and np.isfinite(plate.moment_Nm).all()
    loaded = plate.force_N[:, 2] > 100
    assert loaded[48:60].all()
    height_m = plate.moment_Nm[loaded, 0] / plate.force_N[loaded, 2]
    assert np.ptp(height_m) < 0.5  # the centre of pressure stays under the feet


def test_a_mot_file_s_plates_feel_under_the_feet(tmp_path, trc):
    """What leaks into a channel acts where the feet stand, not at the lab's origin."""
    before, after = injected(trc, tmp_path, effect_of("plate_crosstalk", 0.02, "fy:fx"))
    was, now = before.plates[0], after.plates[0]
    leak = now.force_N - was.force_N
    load = was.force_N[:, 2]
    assert np.abs(leak - 0.02 * load[:, None] * [1, 0, 0]).max() < 1e-3
    moment = now.moment_Nm - was.moment_Nm
    y = -moment[:, 2] / leak[:, 0]
    assert np.ptp(y) < 1e-3
    assert y.mean() == pytest.approx(np.average(was.moment_Nm[:, 0] / load, weights=load), abs=0.01)
    assert np.abs(moment[:, :2]).max() < 1e-2


def test_a_study_is_copied_with_its_truth(tmp_path, recorded, trc):
    study, out = tmp_path / "study", tmp_path / "out"
    for number, source in enumerate((recorded, trc), start=1):
        person = f"sub-{number:02d}"
        (study / person).mkdir(parents=True)
        for file in source.parent.glob("sub-01*"):
            copy = study / person / file.name.replace("sub-01", person)
            copy.write_bytes(file.read_bytes())
    (study / "participants.tsv").write_text("participant_id\tsex\tmass_kg\theight_m\n")
    arguments = {"effects": ["plate_zero"], "sizes": [12.0], "targets": [], "effect_tasks": []}
    assert inject_command(study, out, ["sub-01"], 1, **arguments) == 0
    same = [
        path.relative_to(study)
        for path in sorted(study.rglob("*.*"))
        if path.read_bytes() == (out / path.relative_to(study)).read_bytes()
    ]
    assert [str(path) for path in same] == [
        "participants.tsv",
        "sub-02/sub-02_task-squat_run-1.mot",
        "sub-02/sub-02_task-squat_run-1.trc",
    ]
    truth = json.loads((out / "truth" / "sub-01_injected.json").read_text())
    assert truth["effects"][0]["effect"] == "plate_zero"
    assert truth["trials"]["sub-01_task-squat_run-1"]["effects"] == ["plate_zero"]
    with pytest.raises(UsageError, match="not empty"):
        inject_command(study, out, [], 1, **arguments)


def test_a_trial_that_cannot_take_it_is_copied_as_it_is_and_said(tmp_path, trc, capsys):
    study = tmp_path / "study" / "sub-01"
    study.mkdir(parents=True)
    for file in trc.parent.glob("sub-01*"):
        (study / file.name).write_bytes(file.read_bytes())
    arguments = {"effects": ["plate_rotation"], "sizes": [0.02], "targets": [], "effect_tasks": []}
    assert inject_command(study.parent, tmp_path / "out", [], 1, **arguments) == 3
    assert "where the plates lie" in capsys.readouterr().err
    for file in study.iterdir():
        assert (tmp_path / "out" / "sub-01" / file.name).read_bytes() == file.read_bytes()


def test_an_origin_from_the_centre_to_the_sensor(recorded, tmp_path):
    """As some laboratories write it: with the opposite sign, sideways too."""
    c3d = ezc3d.c3d(str(recorded))
    origin = c3d["parameters"]["FORCE_PLATFORM"]["ORIGIN"]
    value = np.asarray(origin["value"], dtype=float)
    sideways = np.array([3.0, -2.0, 0.0])[:, None]
    origin["value"] = sideways - np.sign(value[2]) * value * np.array([0, 0, -1.0])[:, None]
    assert (origin["value"][2] > 0).all()
    source, copy = tmp_path / recorded.name, tmp_path / "copy.c3d"
    c3d.write(str(source))
    inject_recording(source, copy, [effect_of("plate_gain", 0.05, "fz,plate=1")])
    before, after = (read_recording(file).plates[0].force_N for file in (source, copy))
    loaded = before[:, 2] > 100
    assert after[loaded, 2] / before[loaded, 2] == pytest.approx(1.05, abs=1e-4)
    assert np.allclose(after[:, :2], before[:, :2], atol=1e-3)
