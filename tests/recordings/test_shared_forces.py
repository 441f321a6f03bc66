"""Trials with one table of forces, whole or cut, and the one trial that is not as all others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.recordings.plate_reading import AS_STATED, Opened
from bsip_cli.recordings.read import assemble, open_recording
from bsip_cli.recordings.session_reading import reading_of_files
from bsip_cli.recordings.shared_forces import Course, of_twins, same_movements
from bsip_cli.recordings.trial_samples import TrialSamples
from bsip_cli.recordings.written import Written
from tests.recordings.standing_on_two_plates import LABELS, motion, of_c3d, of_table, opened

BLOCK_S = 0.02


def walk(seconds: float, seed: int, start_s: float = 0.0) -> np.ndarray:
    """The total of steps of uneven size and length, from ``start_s`` on, in blocks."""
    rng = np.random.default_rng(seed)
    fine_s = np.arange(0.0, 12.0, 0.002)
    steps = np.cumsum(rng.uniform(0.45, 0.65, 30))
    heights = rng.uniform(0.8, 1.3, 30)
    total = sum(
        h * np.exp(-(((fine_s - t) / 0.09) ** 2)) for t, h in zip(steps, heights, strict=True)
    )
    total = 300.0 + 500.0 * total + rng.normal(0, 1.0, len(fine_s))
    first = round(start_s / 0.002)
    cut = total[first : first + round(seconds / 0.002)]
    return cut[: len(cut) // 10 * 10].reshape(-1, 10).mean(axis=1)


def path(seconds: float, start_s: float = 0.0, turns_m: float = 0.0) -> np.ndarray:
    times = start_s + np.arange(round(seconds / BLOCK_S)) * BLOCK_S
    return np.column_stack([1.2 * times, turns_m * np.sin(times), 0.02 * np.cos(11 * times)])


@pytest.mark.parametrize("start_s", [0.4, 0.41, 1.237, 3.004])
@pytest.mark.parametrize("seconds", [1.0, 2.5])
def test_a_part_of_a_recording_is_known_again(start_s, seconds):
    whole = Course(walk(6.0, 1), path(6.0))
    part = Course(walk(seconds, 1, start_s), path(seconds, start_s))
    assert same_movements([("a", whole), ("b", part)]) == [("a", "b")]
    assert same_movements([("b", part), ("a", whole)]) == [("b", "a")]
    assert of_twins([("a", whole), ("b", part)]) == {}


@pytest.mark.parametrize("start_s", [0.4, 1.237])
def test_a_part_of_anothers_forces(start_s):
    whole = Course(walk(6.0, 1), path(6.0), goes=40.0)
    part = Course(walk(2.5, 1, start_s), path(2.5, start_s, turns_m=0.3), goes=2.0)
    assert of_twins([("a", whole), ("b", part)]) == {"b": "a"}
    unsure = replace(part, goes=38.0)
    assert of_twins([("a", whole), ("b", unsure)]) == {"a": "b", "b": "a"}


@pytest.mark.parametrize("seed", range(2, 12))
def test_other_steps_of_one_person_are_others(seed):
    courses = [("a", Course(walk(6.0, 1), path(6.0))), ("b", Course(walk(2.5, seed), path(2.5)))]
    assert same_movements(courses) == [] and of_twins(courses) == {}


def test_a_step_in_two_recordings_says_nothing():
    """Nothing but one change: it is alike wherever the two are laid together."""
    rng = np.random.default_rng(3)
    courses = [
        (name, Course(np.where(np.arange(n) < at, 0.0, 650.0) + rng.normal(0, 1, n)))
        for name, n, at in (("a", 200, 90), ("b", 120, 70))
    ]
    assert same_movements(courses) == []


# --- the one odd trial ----------------------------------------------------------------------------


def named(one: Opened, name: str) -> Opened:
    return replace(one, recording=replace(one.recording, path=one.recording.path.with_name(name)))


def reading(trials: list[Opened]):
    def read(written: Written) -> list[TrialSamples]:
        return [TrialSamples.of(one) for one in trials]

    return reading_of_files(read(Written()), read, None, None, 15.0)


def exchanged(sources):
    one, other = sources
    return [
        replace(one, description=replace(other.description, name=one.name)),
        replace(other, description=replace(one.description, name=other.name)),
    ]


def far_away() -> Opened:
    """Nobody stands on the plates."""
    return opened(of_c3d(), motion()[0] + np.array([3.0, -2.0, 0.0]))


@pytest.mark.parametrize(
    ("sound", "odd"),
    [
        (2, [opened(exchanged(of_c3d()))]),
        (3, [opened(exchanged(of_c3d()))] * 2),
        (1, [far_away()]),
        (2, [far_away()] * 2),
    ],
)
def test_few_trials_that_are_otherwise_cost_the_others_nothing(sound, odd):
    trials = [named(opened(of_c3d()), f"t{k}") for k in range(sound)]
    trials += [named(one, f"odd{k}") for k, one in enumerate(odd)]
    found = reading(trials)
    assert found.odd == {f"odd{k}": "forces" for k in range(len(odd))} and not found.refusals()
    assert all(one.reading == AS_STATED for one in found.plates.values())
    assert assemble(trials[0], found).plates
    without = assemble(trials[-1], found)
    assert not without.plates and "the other trials" in without.forces_note


def test_which_of_two_is_odd_is_not_known():
    trials = [named(opened(of_c3d()), "a"), named(opened(exchanged(of_c3d())), "b")]
    found = reading(trials)
    assert found.odd == {}


def test_one_trial_with_left_and_right_exchanged_is_refused():
    trials = [named(opened(of_table()), f"t{k}") for k in range(3)]
    sides = str.maketrans("LR", "RL")
    labels = tuple(one[0].translate(sides) + one[1:] for one in LABELS)
    other = replace(trials[-1].recording, labels=labels)
    trials[-1] = replace(trials[-1], recording=other)
    found = reading(trials)
    assert found.odd == {"t2": "sides"} and not found.refusals()
    with pytest.raises(Exception, match="left and right are exchanged"):
        assemble(trials[-1], found)
    assert assemble(trials[0], found).plates


def test_measured_forces_of_another_trial_cut_otherwise(real_data, tmp_path):
    """run200 with 2 s of run300's forces, under its own times."""
    folder = real_data / "hamner_other"
    (tmp_path / "run300.trc").write_bytes((folder / "run300.trc").read_bytes())
    (tmp_path / "run200.trc").write_bytes((folder / "run200.trc").read_bytes())
    lines = (folder / "run300_grf.mot").read_text().splitlines(keepends=True)
    (tmp_path / "run300_grf.mot").write_text("".join(lines))
    first = next(k for k, line in enumerate(lines) if line.startswith("time")) + 1
    del lines[first : first + 20]
    (tmp_path / "run200_grf.mot").write_text("".join(lines))
    trials = [open_recording(tmp_path / f"run{speed}.trc") for speed in (200, 300)]
    assert reading(trials).twins == {"run200": "run300"}


def test_the_same_person_moves(real_data):
    """Sound trials of one session share nothing, and none is odd."""
    names = ("static1", "squats1", "walking1", "DJ1")
    trials = [open_recording(real_data / f"opencap_subject4/{name}.trc") for name in names]
    found = reading(trials)
    assert found.odd == {} and found.twins == {}


def test_paths_of_the_mass_are_of_the_blocks():
    one = opened(of_c3d())
    course = TrialSamples.of(one).course
    assert len(course.path_m) == len(course.total_N) > 40
    total = motion()[1].sum(axis=0)[:, 2]
    assert np.abs(course.total_N - total.reshape(-1, 2).mean(axis=1)).max() < 1e-6
