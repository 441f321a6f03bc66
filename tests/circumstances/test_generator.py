"""Circumstances drawn from a seed: what they are, and how often bsip may be wrong about them."""

from collections import Counter
from dataclasses import replace

import ezc3d
import numpy as np
import pytest

from bsip_cli.recordings.c3d_content import read_content
from tests.circumstances.generator import draw, sound_export, write
from tests.circumstances.judge import (
    CRASHED,
    DISTURBED,
    OUTCOMES,
    REPAIRED,
    RIGHT,
    SAID,
    WRONG,
    WRONGLY_REPAIRED,
)
from tests.circumstances.run import can_be_mended, examined, share, table
from tests.circumstances.things import KINDS, THINGS

SEED = 36
# Shares of what was changed; of the sound: disturbed.
AT_MOST = {WRONG: 0.0, WRONGLY_REPAIRED: 0.01, CRASHED: 0.0, DISTURBED: 0.0}
RIGHT_OR_REPAIRED = 0.85  # at least, of what can be


@pytest.fixture(scope="module")
def few():
    return examined(SEED, range(12))


def test_no_sound_recording_is_disturbed(few):
    assert not [j for j in few if j.outcome == DISTURBED], table(few)


def test_nothing_crashes(few):
    assert not [j for j in few if j.outcome == CRASHED], table(few)


def test_every_circumstance_has_an_outcome_and_a_wrong_one_says_what(few):
    assert all(j.outcome in OUTCOMES for j in few)
    assert all(j.wrong for j in few if j.outcome == WRONGLY_REPAIRED)


@pytest.mark.long(minutes=20)
def test_a_hundred_circumstances_keep_the_limits():
    judgements = examined(SEED, range(100), jobs=2)
    changed = [j for j in judgements if "sound" not in j.kinds]
    sound = [j for j in judgements if "sound" in j.kinds]
    print(table(judgements))
    for outcome, limit in AT_MOST.items():
        of = sound if outcome == DISTURBED else changed
        assert share(of, outcome) <= limit, (outcome, table(judgements))
    assert share(can_be_mended(judgements), RIGHT, REPAIRED) >= RIGHT_OR_REPAIRED, table(judgements)


@pytest.mark.long(minutes=1)
@pytest.mark.parametrize(
    ("seed", "number", "outcome"),
    [
        (1401, 19, SAID),  # forces of half of the trials are nobody's: said in the others too
        (1402, 178, REPAIRED),  # the forces' rate, taken for a delay and a reversed channel
        (1402, 36, REPAIRED),  # points in mm, and no moments
        (1402, 105, REPAIRED),  # of two rates the likelier
    ],
)
def test_draws_that_were_wrong_once(seed, number, outcome):
    (judgement,) = examined(seed, [number])
    assert judgement.outcome == outcome, judgement


def test_the_same_seed_draws_the_same():
    first, second = draw(SEED, 7), draw(SEED, 7)
    assert first.words == second.words
    for a, b in zip(first.truth.trials, second.truth.trials, strict=True):
        np.testing.assert_array_equal(a.markers_m, b.markers_m)


def test_draws_cover_all_kinds_and_leave_enough_sound():
    drawn = [draw(SEED, number) for number in range(250)]
    counts = Counter(kind for circumstance in drawn for kind in circumstance.kinds)
    assert counts["sound"] >= 0.15 * 250
    assert {kind for kind in KINDS if counts[kind] >= 5} == set(KINDS)
    assert {len(c.things) for c in drawn} == {0, 1, 2, 3}


@pytest.mark.parametrize("thing", THINGS, ids=lambda thing: thing.id)
def test_every_thing_changes_what_is_written(thing, tmp_path):
    """The same session, exported soundly and with the thing, differs in some file."""
    circumstance = next(
        c
        for n in range(50)
        if thing in (c := draw(SEED, n, thing.id)).things and len(c.things) == 1
    )
    sound = replace(circumstance, export=sound_export(circumstance.export.format))
    sound.export.stated_mass = circumstance.export.stated_mass
    sound.export.stated_height = circumstance.export.stated_height
    write([circumstance], tmp_path / "changed")
    write([sound], tmp_path / "sound")
    changed = {p.name: p.read_bytes() for p in (tmp_path / "changed").rglob("*") if p.is_file()}
    untouched = {p.name: p.read_bytes() for p in (tmp_path / "sound").rglob("*") if p.is_file()}
    assert changed != untouched


def test_a_sound_c3d_says_what_the_truth_is(tmp_path):
    circumstance = next(
        c for n in range(50) if (c := draw(SEED, n, "sound")).export.format == "c3d"
    )
    write([circumstance], tmp_path / "study")
    trial = circumstance.truth.trials[0]
    file = tmp_path / "study" / circumstance.participant
    content = ezc3d.c3d(
        str(file / f"{circumstance.participant}_{trial.name}.c3d"), extract_forceplat_data=True
    )
    points = content["data"]["points"][:3].transpose(2, 1, 0) / 1000
    np.testing.assert_allclose(points, trial.markers_m, atol=1e-6)
    total = sum(plate["force"].T for plate in content["data"]["platform"])
    np.testing.assert_allclose(total, trial.force_N.sum(axis=1), atol=0.01)


def test_invalid_points_keep_their_coordinates(tmp_path):
    circumstance = next(
        c for n in range(50) if len((c := draw(SEED, n, "residuals_negative")).things) == 1
    )
    write([circumstance], tmp_path / "study")
    trial = circumstance.truth.trials[0]
    file = tmp_path / "study" / circumstance.participant
    content = read_content(file / f"{circumstance.participant}_{trial.name}.c3d")
    assert not content.is_valid.any()
    np.testing.assert_allclose(content.positions / 1000, trial.markers_m, atol=1e-6)
