"""The judge: exact artifacts are right, and each kind of wrong number is seen."""

from dataclasses import replace

import numpy as np
import pytest

from tests.circumstances.comparison import compare, truth_wrenches
from tests.circumstances.generator import draw
from tests.circumstances.judge import (
    DISTURBED,
    MISNAMED,
    REFUSED,
    RIGHT,
    SAID,
    WRONG,
    WRONGLY_REPAIRED,
    judge,
    judge_by_conclusion,
)
from tests.circumstances.taken import Taken, TakenTrial, Word


def exact(trial, labels):
    """What a perfect reader would have made of a trial, its lab turned and shifted."""
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    seen = trial.seen_from(turn, np.array([0.4, -1.0, 0.0]))
    ratio = len(seen.analog_s) // len(seen.time_s)
    plates = np.concatenate([seen.force_N, seen.moment_Nm], axis=2)[::ratio]
    return TakenTrial(
        time_s=seen.time_s,
        markers_m={name: seen.markers_m[:, k] for k, name in enumerate(labels)},
        valid=np.ones(len(seen.time_s), bool),
        wrench=plates.sum(axis=1),
        plates={str(k + 1): plates[:, k] for k in range(plates.shape[1])},
    )


@pytest.fixture(scope="module")
def circumstance():
    """Two loaded plates, moments in N m though N mm is said."""
    return next(
        c
        for n in range(60)
        if (c := draw(3, n, "moments_wrong")).session.laboratory == "side-by-side"
        and len(c.things) == 1
    )


def compared(circumstance, change):
    trial, labels = circumstance.truth.trials[0], circumstance.truth.labels
    lost = np.zeros(trial.markers_m.shape[:2], bool)
    return compare(change(exact(trial, labels)), trial, labels, lost, 700.0)


def with_plates(taken, change):
    plates = change(dict(taken.plates))
    return replace(taken, plates=plates, wrench=sum(plates.values()))


def test_exact_numbers_are_right(circumstance):
    comparison = compared(circumstance, lambda taken: taken)
    assert comparison.wrong == {}
    assert comparison.has_forces


def mirrored(taken):
    flip = np.array([1.0, -1.0, 1.0])
    return replace(taken, markers_m={k: v * flip for k, v in taken.markers_m.items()})


def slower(taken):
    return replace(taken, time_s=taken.time_s * 1.01)


def longer(taken):
    return replace(taken, markers_m={k: 1.02 * v for k, v in taken.markers_m.items()})


def a_wild_point(taken):
    wild = {k: v.copy() for k, v in taken.markers_m.items()}
    wild["RASIS"][10:40] = -16.512
    return replace(taken, markers_m=wild)


def fallen(taken):
    return replace(taken, markers_m={k: v[:, [0, 2, 1]] for k, v in taken.markers_m.items()})


def twice(taken):
    return with_plates(taken, lambda p: {**p, "3": p["1"]})


def exchanged(taken):
    def swap(plates):
        first, second = plates["1"].copy(), plates["2"].copy()
        first[:, :3], second[:, :3] = plates["2"][:, :3], plates["1"][:, :3]
        return {"1": first, "2": second}

    return with_plates(taken, swap)


def renamed(taken):
    return with_plates(taken, lambda p: {"left": p["2"], "right": p["1"]})


def test_plates_may_have_any_name_and_order(circumstance):
    assert compared(circumstance, renamed).wrong == {}


def beside(taken):
    """The centre of pressure 20 mm aside."""
    return with_plates(
        taken, lambda p: {k: w + [[0, 0, 0, 0, 1, 0]] * (-0.02 * w[:, 2:3]) for k, w in p.items()}
    )


def twisted(taken):
    five = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 5.0])
    return with_plates(taken, lambda p: {k: w + five for k, w in p.items()})


@pytest.mark.parametrize(
    ("change", "quantity"),
    [
        (mirrored, "handedness"),
        (slower, "rate"),
        (longer, "scale"),
        (a_wild_point, "markers"),
        (fallen, "vertical"),
        (twice, "force"),
        (exchanged, "cop"),
        (beside, "cop"),
        (twisted, "moment"),
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_each_wrong_number_is_seen(circumstance, change, quantity):
    assert quantity in compared(circumstance, change).wrong


def judged(circumstance, change, *words, exit_code=0):
    labels = circumstance.truth.labels
    trials = {t.name: change(exact(t, labels)) for t in circumstance.truth.trials}
    return judge(circumstance, Taken(exit_code, trials, words))


def outcome_of(circumstance, change, *words):
    return judged(circumstance, change, *words).outcome


def word(level, text, trial=""):
    return Word(trial, level, "", text)


def nothing_valid(taken):
    return replace(taken, valid=np.zeros(len(taken.time_s), bool))


def mostly_lost(taken):
    return replace(taken, valid=np.arange(len(taken.time_s)) < 0.5 * len(taken.time_s))


UNIT = "ANALOG:UNITS says N mm; read the moments in N m"


@pytest.mark.parametrize(
    ("change", "words", "outcome"),
    [
        (lambda t: t, [], RIGHT),
        (lambda t: t, [word("corrected", UNIT)], "repaired"),
        (beside, [], WRONG),
        (beside, [word("excluded", "contacts: a foot beside the plates; moment")], WRONG),
        (beside, [word("info", UNIT)], WRONG),
        (beside, [word("warning", UNIT)], SAID),
        (beside, [word("warning", UNIT, "task-static")], WRONG),
        (beside, [word("warning", "force plates were switched on")], WRONG),
        (beside, [word("warning", "plate 1: its frame may be wrong")], SAID),
        (beside, [word("corrected", UNIT)], WRONGLY_REPAIRED),
        (beside, [word("corrected", UNIT), word("printed", UNIT)], WRONGLY_REPAIRED),
        (beside, [word("corrected", UNIT), word("warning", "moments of plate 1 doubted")], SAID),
        (nothing_valid, [word("excluded", UNIT)], REFUSED),
        (mostly_lost, [], MISNAMED),
        (nothing_valid, [word("excluded", "the left hand holds something")], MISNAMED),
    ],
)
def test_outcome_goes_by_numbers_and_words(circumstance, change, words, outcome):
    assert outcome_of(circumstance, change, *words) == outcome


def test_a_false_word_disturbs_a_sound_recording():
    sound = next(c for n in range(60) if (c := draw(3, n, "sound")).session.laboratory != "walkway")
    assert outcome_of(sound, lambda t: t) == RIGHT
    assert outcome_of(sound, lambda t: t, word("corrected", UNIT)) == DISTURBED


def test_a_mass_in_pounds_needs_a_word():
    pounds = next(c for n in range(200) if len((c := draw(3, n, "mass_in_pounds")).things) == 1)
    assert outcome_of(pounds, lambda t: t) == WRONG
    said = word("warning", "plate_mass: 76 kg on the plates, the stated 168 kg look like pounds")
    assert outcome_of(pounds, lambda t: t, said) != WRONG


@pytest.mark.parametrize("per_frame", [1, 2, 5, 8])
def test_the_truth_at_a_frame_is_not_late(circumstance, per_frame):
    """A force that rises evenly is at each frame what it is at its time."""
    trial = circumstance.truth.trials[0].sampled(100.0, per_frame)
    rising = np.broadcast_to(trial.analog_s[:, None, None], trial.force_N.shape)
    found = truth_wrenches(replace(trial, force_N=rising))[1:-1, 0, 0]
    np.testing.assert_allclose(found, trial.time_s[1:-1], atol=1e-9)


@pytest.mark.parametrize(
    ("conclusion", "outcome"),
    [
        ("Large error, cause unknown.", SAID),
        ("1. Plate 1 reads the moment about the vertical with a constant offset.", SAID),
        ("1. The left hand holds 1 kg.", WRONG),
        ("", WRONG),
    ],
)
def test_what_is_silent_when_read_may_be_said_in_the_end(circumstance, conclusion, outcome):
    silent = judged(circumstance, twisted)
    assert silent.outcome == WRONG
    assert judge_by_conclusion(silent, conclusion).outcome == outcome
