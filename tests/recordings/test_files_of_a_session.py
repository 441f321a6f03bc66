"""Files unlike the others of a session: forces of another trial, in other units, odd trials."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bsip_cli.recordings.plate_reading import AS_STATED, Opened
from bsip_cli.recordings.read import assemble, open_recording
from bsip_cli.recordings.session_findings import findings_about
from bsip_cli.recordings.session_reading import reading_of_files
from bsip_cli.recordings.shared_forces import Course, of_twins, same_movements
from bsip_cli.recordings.trial_samples import TrialSamples
from bsip_cli.recordings.written import (
    AS_WRITTEN,
    Lengths,
    Written,
    force_N,
    force_unit,
    force_unit_words,
    likely_paces,
    of_other_trials,
)
from bsip_cli.stages.survey import facts_of, reading_of, rows_of
from bsip_cli.study.trials import Trial
from tests.recordings.standing_on_two_plates import LABELS, motion, of_c3d, of_table, opened


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
    times = start_s + np.arange(round(seconds / 0.02)) * 0.02
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


def reading(trials: list[Opened], stated_kg: float | None = None):
    def read(written: Written) -> list[TrialSamples]:
        return [TrialSamples.of(one.as_written(written)) for one in trials]

    return reading_of_files(read(AS_WRITTEN), read, stated_kg, None, 15.0)


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
    doubts = [one for one in findings_about(found) if one.level == "warning"]
    assert len(doubts) == (len(odd) == sound)  # no majority
    assert all("in odd0" in one.found for one in doubts)


@pytest.mark.parametrize("odd", [exchanged(of_c3d()), of_c3d(moment_scale=1e-3)])
def test_what_is_decided_of_a_session_reaches_each_trial(odd):
    """Through the survey's table and its facts, whose other session says nothing of this one."""
    trials = [named(opened(x), f"sub-a_task-t{k}") for k, x in enumerate((of_c3d(), odd))]
    trials.append(named(far_away(), "sub-a_task-far"))
    names = [one.recording.path.stem for one in trials]
    for some in (trials[:2], trials[:1] + trials[2:]):
        found = reading(some)
        table, facts = pd.DataFrame(rows_of("", found)), facts_of(found, names)
        facts["against"] |= {"sub-b_task-t0": "forces"}
        own = (Trial("sub-a", "t0", one, Path(one), "sequence") for one in names)
        for one, trial in zip(trials, own, strict=True):
            read = reading_of(table, facts, trial)
            assert findings_about(read) == findings_about(found)
            assert assemble(one, read).findings == assemble(one, found).findings


@pytest.mark.parametrize(
    ("make", "n_sound", "n_odd", "faults", "words"),
    [
        (of_c3d, 1, 1, {"moment_scale": 1e-3}, "in N m, a thousand times"),
        (of_c3d, 1, 2, {"moment_scale": 1e-3}, "in N m, a thousand times"),
        (of_table, 2, 1, {"moment_scale": 1e3, "point_scale": 1e3}, "N mm, read the points of"),
        (of_table, 1, 1, {"point_scale": 1e2}, "points of force in cm"),
    ],
)
def test_trials_in_other_units_cost_the_sound_ones_nothing(make, n_sound, n_odd, faults, words):
    trials = [named(opened(make()), f"t{k}") for k in range(n_sound)]
    trials += [named(opened(make(**faults)), f"odd{k}") for k in range(n_odd)]
    found = reading(trials)
    assert not found.odd and not found.refusals() and not findings_about(found)
    assert list(found.moment_scales) == [f"odd{k}" for k in range(n_odd)]
    sound, *_, odd = (assemble(one, found) for one in trials)
    for right, own in zip(sound.plates, odd.plates, strict=True):
        np.testing.assert_allclose(own.moment_Nm, right.moment_Nm, atol=1e-6)
    assert [words in one.action for one in odd.findings] == [True] and not sound.findings


def test_which_of_two_is_odd_is_not_known():
    trials = [named(opened(of_c3d()), "a"), named(opened(exchanged(of_c3d())), "b")]
    assert reading(trials).odd == {}


def test_one_of_two_is_no_reason_to_correct_the_session():
    trials = [named(opened(exchanged(of_c3d())), "a"), named(far_away(), "b")]
    alone, both = reading(trials[:1]), reading(trials)
    assert not alone.refusals() and not alone.is_as_stated
    assert both.odd == {} and both.is_refused


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


def test_paths_of_the_mass_are_of_the_blocks():
    one = opened(of_c3d())
    course = TrialSamples.of(one).course
    assert len(course.path_m) == len(course.total_N) > 40
    total = motion()[1].sum(axis=0)[:, 2]
    assert np.abs(course.total_N - total.reshape(-1, 2).mean(axis=1)).max() < 1e-6


SIZES = {"kN": 1e-3, "pounds-force": 1 / 4.44822, "kilogram-force": 1 / 9.80665}
TRIALS = ("walking1", "squats1", "static1")


def of_seconds(*pairs: tuple[float, float]) -> list[Lengths | None]:
    return [Lengths(markers_s, forces_s, 0.01) for markers_s, forces_s in pairs]


@pytest.mark.parametrize("unit", SIZES)
@pytest.mark.parametrize("stated_kg", [70.0, None])
@pytest.mark.parametrize("body_kg", [60.0, 85.0])  # body-mass indices of 20 and 28
def test_the_unit_that_alone_makes_the_person(unit, stated_kg, body_kg):
    stated_kg = stated_kg and body_kg
    assert force_unit(body_kg * SIZES[unit], stated_kg, 1.75, 15.0, 0.95) == unit


@pytest.mark.parametrize("body_kg", [60.0, 85.0])
def test_forces_by_the_persons_mass_or_weight_need_the_mass(body_kg):
    for mass_kg, size_N in ((1.0, body_kg), (1 / 9.80665, 9.80665 * body_kg)):
        unit = force_unit(mass_kg, body_kg, 1.75, 15.0, 0.95)
        assert force_N(unit, body_kg) == pytest.approx(size_N) and force_N(unit, None) == 1.0
        assert f"{size_N:.4g}" in force_unit_words(force_N(unit, body_kg))


@pytest.mark.parametrize(
    ("mass_kg", "stated_kg", "height_m"),
    [
        (70.0, 70.0, 1.75),  # in N
        (70.0 / 4.44822, 45.0, 1.75),  # another person's mass is stated
        (35.0, 70.0, 1.75),  # a gain of a half, or one foot beside the plates
        (8.0, None, 1.15),  # a child of 16 kg that stands on the plates with one foot
        (1 / 9.81, None, 1.75),  # parts of the weight, or 102 kg
        (15.7, 70.0, None),  # nobody's stature is known
        (0.0, 70.0, 1.75),
    ],
)
def test_a_unit_that_is_not_sure_is_not_taken(mass_kg, stated_kg, height_m):
    assert force_unit(mass_kg, stated_kg, height_m, 15.0, 0.95) == ""


def test_lengths_that_differ_by_one_factor_in_several_trials_are_a_pace():
    odds = likely_paces(of_seconds((2.5, 2.0), (5.0, 4.0), (7.51, 6.0)))
    assert max(odds, key=odds.__getitem__) == 1.25 and odds[1.25] > 5


@pytest.mark.parametrize(
    ("pairs", "whose"),
    [
        (((2.0, 3.0), (3.0, 2.0)), {0: 1, 1: 0}),
        (((2.0, 3.0), (3.0, 4.5), (4.5, 2.0)), {0: 1, 1: 2, 2: 0}),  # in a ring
        (((2.0, 4.0), (5.0, 5.0), (4.0, 2.0)), {0: 2, 2: 0}),
        (((2.0, 3.0), (3.0, 4.5)), {}),  # a rate
        (((2.0, 3.0), (3.0, 2.0), (6.0, 5.0)), {}),  # cut anyhow
        (((10.0, 10.03), (10.02, 9.99)), {}),  # of one length, one file padded
        (((10.0, 10.05), (10.06, 10.0), (10.03, 9.98), (9.99, 10.04)), {}),
    ],
)
def test_trials_that_have_each_others_forces(pairs, whose):
    assert of_other_trials(of_seconds(*pairs)) == whose


def test_one_length_is_a_hint_however_often_it_comes():
    once, often = (likely_paces(of_seconds(*[(2.5, 2.0)] * n)) for n in (1, 9))
    assert once == often and once[1.25] < 0


@pytest.mark.parametrize(
    "pairs",
    [
        ((2.0, 2.0), (5.0, 5.01)),  # alike
        ((2.5, 2.0), (5.5, 5.0), (7.5, 7.0)),  # so much longer
        ((2.5, 2.0), (5.0, 2.7), (7.0, 7.9)),  # cut anyhow
    ],
)
def test_files_that_are_cut_are_no_pace(pairs):
    assert all(odds < 0 for odds in likely_paces(of_seconds(*pairs)).values())


# --- measured files, written otherwise --------------------------------------------------------
def rewritten(data: Path, folder: Path, name: str, force=1.0, times=1.0, of_forces=1.0) -> Path:
    """Forces in a unit of so many N, and the times of either file slower by a factor."""
    trc = (data / f"opencap_subject4/{name}.trc").read_text().splitlines()
    number = next(k for k, line in enumerate(trc) if line.startswith("DataRate"))
    rates = trc[number + 1].split("\t")
    trc[number + 1] = "\t".join([f"{float(one) / times:g}" for one in rates[:2]] + rates[2:])
    for k, line in enumerate(trc):
        if re.match(r"\d+\t\s*[\d.]+\t", line):
            frame, time, rest = line.split("\t", 2)
            trc[k] = f"{frame}\t{float(time) * times:.6f}\t{rest}"
    (folder / f"{name}.trc").write_text("\n".join(trc) + "\n")
    mot = (data / f"opencap_subject4/{name}_grf.mot").read_text().splitlines()
    first = next(k for k, line in enumerate(mot) if line.startswith("time"))
    names = mot[first].split()
    are_forces = [bool(re.search(r"_v[xyz]$|torque|_m[xyz]$", one)) for one in names]
    for k in range(first + 1, len(mot)):
        cells = [
            float(x) / (force if f else 1.0)
            for x, f in zip(mot[k].split(), are_forces, strict=True)
        ]
        mot[k] = "\t".join([f"{cells[0] * of_forces:.6f}", *(f"{x:.6f}" for x in cells[1:])])
    (folder / f"{name}_grf.mot").write_text("\n".join(mot) + "\n")
    return folder / f"{name}.trc"


def settled(paths: list[Path], stated_kg: float | None = 62.6):
    return reading([open_recording(path) for path in paths], stated_kg)


def test_sound_trials_of_one_person_are_read_as_they_are(real_data):
    found = settled([real_data / f"opencap_subject4/{name}.trc" for name in (*TRIALS, "DJ1")])
    assert found.written == AS_WRITTEN
    assert found.odd == {} and found.twins == {}


@pytest.mark.parametrize(("unit", "newton"), [("kN", 1000.0), ("pounds-force", 4.44822)])
def test_one_trial_in_another_unit_is_left_without_forces(real_data, tmp_path, unit, newton):
    paths = [real_data / f"opencap_subject4/{name}.trc" for name in TRIALS]
    paths[1] = rewritten(real_data, tmp_path, TRIALS[1], force=newton)
    found = settled(paths, stated_kg=None)
    assert found.odd == {TRIALS[1]: unit} and found.written == AS_WRITTEN
    assert unit in assemble(open_recording(paths[1]), found).forces_note
    assert assemble(open_recording(paths[0]), found).plates


@pytest.mark.parametrize(("unit", "newton"), [("kN", 1000.0), ("pounds-force", 4.44822)])
def test_measured_forces_in_another_unit(real_data, tmp_path, unit, newton):
    sound = [real_data / f"opencap_subject4/{name}.trc" for name in TRIALS]
    wrong = [rewritten(real_data, tmp_path, name, force=newton) for name in TRIALS]
    found = settled(wrong)
    assert found.written == Written(newton)
    assert found.plates.keys() == settled(sound).plates.keys()
    (said,) = (one for one in findings_about(found) if one.check == "unit")
    assert unit in said.action


@pytest.mark.parametrize(
    ("whose", "times"), [("times", 0.8), ("times", 2.0), ("of_forces", 0.5), ("of_forces", 1.25)]
)
def test_measured_times_of_either_file_that_are_wrong_by_a_factor(
    real_data, tmp_path, whose, times
):
    paths = [rewritten(real_data, tmp_path, name, **{whose: times}) for name in TRIALS]
    found = settled(paths).written
    mine, other = (found.pace, found.force_pace)[:: 1 if whose == "times" else -1]
    assert (mine, other) == (pytest.approx(times), 1.0)
