"""Text files whose forces are in another unit than N, or whose times are wrong by a factor."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bsip_cli.recordings.read import assemble, findings_about, open_recording
from bsip_cli.recordings.session_reading import reading_of_files
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

SIZES = {"kN": 1e-3, "pounds-force": 1 / 4.44822, "kilogram-force": 1 / 9.80665}
TRIALS = ("walking1", "squats1", "static1")


def lengths(*pairs: tuple[float, float]) -> list[Lengths | None]:
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
    odds = likely_paces(lengths((2.5, 2.0), (5.0, 4.0), (7.51, 6.0)))
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
    assert of_other_trials(lengths(*pairs)) == whose


def test_one_length_is_a_hint_however_often_it_comes():
    once, often = (likely_paces(lengths(*[(2.5, 2.0)] * n)) for n in (1, 9))
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
    assert all(odds < 0 for odds in likely_paces(lengths(*pairs)).values())


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
    opened = [open_recording(path) for path in paths]

    def read(written: Written):
        return [TrialSamples.of(one.as_written(written)) for one in opened]

    return reading_of_files(read(AS_WRITTEN), read, stated_kg, None, 15.0)


def test_sound_files_are_read_as_they_are(real_data):
    found = settled([real_data / f"opencap_subject4/{name}.trc" for name in (*TRIALS, "DJ1")])
    assert found.written == AS_WRITTEN


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
