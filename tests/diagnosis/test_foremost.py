"""What several trials show is likelier than what one trial shows alone."""

from __future__ import annotations

import numpy as np

from bsip_cli.diagnosis.body_patterns import Tether
from bsip_cli.diagnosis.candidates import Candidate
from bsip_cli.diagnosis.explanation import Explanation, Fit
from bsip_cli.diagnosis.foremost import foremost
from bsip_cli.diagnosis.held_out import Gain
from bsip_cli.diagnosis.judging import Tried
from bsip_cli.diagnosis.signatures import Place
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import Effect

NOTHING = np.zeros((1, 0))
TETHER, TILT, PUSH = Tether(), EFFECTS["gravity_tilt"], EFFECTS["unmeasured_contact"]


def explained(effect: Effect, *trials: int, target: str = "") -> Explanation:
    return Explanation(Place(Candidate(effect, target, ()), trials), np.zeros(1))


def tried(explanation: Explanation, score: float) -> Tried:
    gain = Gain(np.ones(2), np.ones(2, dtype=bool), 2.0)
    fit = Fit((explanation,), np.zeros(1), NOTHING)
    return Tried(explanation, score, 0.0, gain, fit, False, True, False)


def after(*known: Explanation) -> Fit:
    return Fit(known, np.zeros(1), NOTHING)


def test_what_lasts_and_was_found_in_another_trial_counts_more():
    pull, tilt = tried(explained(TETHER, 3), 467), tried(explained(TILT, 3), 547)
    assert foremost([pull, tilt], after()) is tilt
    assert foremost([pull, tilt], after(explained(TETHER, 0, 1))) is pull


def test_what_differs_between_trials_counts_with_all_of_them():
    pushes, tilt = [tried(explained(PUSH, t), 300) for t in (0, 1)], tried(explained(TILT, 0), 500)
    assert foremost([*pushes, tilt], after()) in pushes
    assert foremost([pushes[0], tilt], after()) is tilt


def test_what_lasts_counts_where_it_is_alone():
    gain = EFFECTS["plate_gain"]
    gains, tilt = [tried(explained(gain, t), 300) for t in (0, 1)], tried(explained(TILT, 0), 500)
    assert foremost([*gains, tilt], after()) is tilt


def test_what_lasts_was_found_only_at_its_own_place():
    gain = EFFECTS["plate_gain"]
    second, tilt = tried(explained(gain, 3, target="2 mx"), 467), tried(explained(TILT, 3), 547)
    assert foremost([second, tilt], after(explained(gain, 0, target="1 fz"))) is tilt
    assert foremost([second, tilt], after(explained(gain, 0, target="2 mx"))) is second


def test_a_name_is_preferred_where_none_explains_hardly_more():
    pull = tried(explained(TETHER, 0), 100)
    named, too_little = tried(explained(TILT, 0), 96), tried(explained(TILT, 0), 94)
    assert foremost([pull, named], after()) is named
    assert foremost([pull, too_little], after()) is pull
