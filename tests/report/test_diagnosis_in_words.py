"""What the report says of a diagnosis, for people who know nothing of it."""

import numpy as np
import pandas as pd
import pytest
from fake_study import attribution, detection, diagnosis, gains

from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.report.diagnosis import (
    UNNAMED,
    candidates_of,
    causes_of,
    gain_sentence,
    headline,
    limits_of,
    limits_sentence,
    verdict_words,
)
from bsip_cli.report.effect_words import EFFECT_WORDS, place_label, size_words
from bsip_cli.report.figures.wrench_residual import amplitude_spectrum
from bsip_cli.report.participant.attribution import pooled_shares
from bsip_cli.report.participant.diagnosis import gain_blocks
from bsip_cli.report.participant.residual import phases_of, residuals_of
from bsip_cli.report.records import EXTENDED, with_all_causes

TRIALS = ["sub-01_task-sequence_run-1", "sub-01_task-basketball_run-1"]


@pytest.fixture
def found() -> pd.DataFrame:
    return diagnosis(TRIALS)


def test_every_effect_has_words():
    assert set(EFFECT_WORDS) == {*EFFECTS, UNNAMED}


def test_the_verdict_says_what_how_large_how_sure_and_where(found):
    text = " ".join(verdict_words(found, detection(TRIALS), None))
    assert text.startswith(
        "Something is wrong: 1 cause named and 1 narrowed down to rivals that look alike here."
    )
    assert "Plate 1 is turned by +2.0 degrees — yaw 2.01° (95 % interval 1.75 to 2.26)." in text
    assert "Seen in sequence (run 1) and basketball (run 1)." in text
    assert "Chance alone would bring as much in 0.5 % of cases" in text
    assert "removes 8.0 % (95 % interval 4.0 to 12.0 %)" in text
    assert text.count(EFFECT_WORDS["plate_rotation"].consequence) == 1  # plate_zero's is the same


def test_rivals_come_with_what_tells_them_apart(found):
    text = " ".join(verdict_words(found, detection(TRIALS), None))
    assert "One of these, which these recordings cannot tell apart: Channel fz has" in text
    assert "; or 1.00 kg more move with the left hand" in text
    both = f"{EFFECTS['plate_zero'].remedy}; or {EFFECTS['added_mass'].remedy}"
    assert f"To tell them apart: {both}." in text
    assert "pray" not in text  # the sentence's own advice names one of the rivals' only


def test_nothing_wrong(found):
    none = found[found["verdict"] == "rejected"]
    first = pd.DataFrame([{**none.iloc[0], "effect": "none", "verdict": "named", "rank": 1}])
    said = verdict_words(pd.concat([first, none]), detection(TRIALS), None)
    assert said[0] == "Nothing wrong above the noise was found."
    assert said[1] == "Looked at: basketball (run 1) and sequence (run 1)."


def test_something_that_cannot_be_named(found):
    row = found[found["effect"] == "plate_zero"].assign(
        effect=UNNAMED, verdict="named", class_id="", sentence="something goes along with fz"
    )
    assert headline(row) == "Something is wrong: 1 that cannot be named."
    text = " ".join(verdict_words(row, detection(TRIALS), None))
    assert "Something is wrong that cannot be named. Something goes along with fz" in text


def test_a_cause_named_twice_is_a_warning(found):
    again = found[found["rank"] == 1].assign(rank=5)
    text = " ".join(verdict_words(pd.concat([found, again]), detection(TRIALS), None))
    assert "Named more than once: force plate turned or tilted: plate 1." in text


def test_candidates_keep_their_order_and_their_reason(found):
    candidates = candidates_of(found)
    assert [one.verdict for one in candidates] == ["named", "ambiguous", "ambiguous", "rejected"]
    assert len(candidates[0].numbers) == 2
    assert candidates[3].why_not() == "chance brings as much in 40 % of cases"
    assert "chance" not in candidates[3].what()
    assert [len(cause) for cause in causes_of(candidates)] == [1, 2]


# --- limits -------------------------------------------------------------------------------------


def test_limits_are_those_of_all_recordings_and_of_what_was_not_found(found):
    limits = {(x.effect, x.target, x.parameter): x for x in limits_of(detection(TRIALS), found)}
    assert limits["sync_offset", "", "delay"].in_words() == "2.5 ms"
    assert limits["sync_offset", "", "delay"].trials == 2
    assert limits["added_mass", "hand_r", "mass"].size == pytest.approx(0.93)
    assert not {("plate_rotation", "1"), ("added_mass", "hand_l")} & {k[:2] for k in limits}


def test_limits_in_a_sentence(found):
    nothing = found[found["verdict"] == "rejected"]
    assert limits_sentence(limits_of(detection(TRIALS), nothing)) == (
        "A delay between forces and markers under 2.5 ms, a plate shifted by less than 6.0 mm, a "
        "vertical gain wrong by less than 1.1 % or a mass on the left hand under 0.95 kg could not "
        "have been seen in these recordings."
    )
    assert limits_sentence(()) == ""


def test_units_that_people_read():
    assert size_words("yaw", "rad", 0.035) == "2.0°"
    assert size_words("rate_error", "1", 7.5e-5) == "75 ppm"
    assert size_words("coefficient", "1", 0.0262) == "2.6 %"
    assert size_words("mass", "kg", 18.2) == "18 kg"
    assert place_label("plate_crosstalk", "1 fx>fy") == "plate 1, fx into fy"
    assert place_label("added_mass", "hand_l") == "left hand"
    assert place_label("sync_offset", "") == ""
    assert place_label("unmeasured_contact", "hand_l+hand_r") == "left hand and right hand"
    assert place_label("plate_gain", "all fz") == "all plates, fz"


# --- gains --------------------------------------------------------------------------------------


def test_gains_lead_with_what_improves():
    text = gain_sentence(gains())
    assert "COP, anterior-posterior 12.00 → 6.00 mm (50 % less, 40 to 60 %)" in text
    worse = gains().assign(component=["cop_ap", "mz"], ci_high=[60.0, -1.0])
    assert gain_sentence(worse).endswith("It rises in moment, lab Z (up).")
    assert gain_sentence(worse[1:]).endswith("in the model, no component follows better.")
    (grid,) = gain_blocks(gains())
    assert "held out: basketball (run 1)" in grid.caption
    assert [row[4].mark for row in grid.cells()] == ["better", ""]


def test_the_verdict_tells_gains_where_they_are(found):
    with_them = verdict_words(found, detection(TRIALS), gains())
    assert set(with_them) - set(verdict_words(found, detection(TRIALS), None)) == {
        gain_sentence(gains())
    }


# --- residual and attribution -------------------------------------------------------------------


def test_thirds_of_the_frames_by_vertical_force():
    force = np.array([9.0, 1, 2, 3, 4, 5, 6, 7, 8, np.nan])
    valid = np.ones(10, dtype=bool)
    assert list(phases_of(force, valid)) == [2, 0, 0, 0, 1, 1, 1, 2, 2, -1]
    assert (phases_of(force, ~valid) == -1).all()


def test_residuals_are_measured_less_simulated_before_and_after():
    columns = ["fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm", "cop_ap_m", "cop_ml_m"]
    frames = [
        pd.DataFrame({"time_s": [0.0, 0.1], "method": name, "valid": [True, False]}).assign(
            **dict.fromkeys(columns, value)
        )
        for name, value in (
            ("measured", 1.0),
            ("RM", 5.0),
            ("OM", 0.4),
            ("OM+sync_offset", 0.5),
            ("OM+sync_offset+breathing", 0.9),
        )
    ]
    found = residuals_of(with_all_causes(pd.concat(frames)), "cop_ap")
    assert list(found) == ["OM", EXTENDED]
    np.testing.assert_allclose(found["OM"], [600.0, np.nan])
    np.testing.assert_allclose(found[EXTENDED], [100.0, np.nan])


def test_spectrum_peaks_at_the_pace_and_leaves_gaps_out():
    t = np.arange(3000) / 100.0
    wave = np.sin(2 * np.pi * 3.0 * t)
    wave[1000:1100] = np.nan
    frequency, amplitude = amplitude_spectrum(wave, 100.0)
    assert frequency[np.argmax(amplitude)] == pytest.approx(3.0)
    assert (amplitude**2).sum() * frequency[0] == pytest.approx(0.5, rel=0.05)
    assert len(amplitude_spectrum(np.full(50, np.nan), 100.0)[0]) == 0


def test_trials_count_by_their_squared_error():
    one = attribution(load_skeleton("hansen2017"))
    other = one.assign(share_percent=0.0, rmse=10.0, n=300)
    pooled = pooled_shares([one, other]).set_index(["component", "segment", "group"])
    row = pooled.loc[("cop_ap", "lower_torso", "centre_of_mass")]
    assert row["share_percent"] == pytest.approx(90.0 * 100 * 25 / (100 * 25 + 300 * 100))
    assert row["rmse"] == pytest.approx(np.sqrt((100 * 25 + 300 * 100) / 400))
