"""What the report says of a diagnosis, for people who know nothing of it."""

import numpy as np
import pandas as pd
import pytest

from bsip_cli.diagnosis.marker_proof import SOFT_TISSUE
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.nameless import ALONG
from bsip_cli.report.blocks import Paragraph
from bsip_cli.report.budget import (
    budget_sentences,
    found_share,
    numbered_pieces,
    overall_pieces,
    pieces,
)
from bsip_cli.report.causes import (
    EFFECT_WORDS,
    UNNAMED,
    USUAL,
    candidates_of,
    causes_of,
    check_for,
    limits_of,
    limits_sentence,
    place_label,
    separating_recording,
    size_words,
)
from bsip_cli.report.participant import limit_blocks, nearest
from bsip_cli.report.verdict import (
    Verdict,
    cause_line,
    cause_text,
    change_sentence,
    gain_sentence,
    light_of,
    verdict_of,
)
from bsip_cli.report.words import probability_words
from tests.report.fake_study import changes, detection, diagnosis, error_budget, gains

TRIALS = ["sub-01_task-sequence_run-1", "sub-01_task-basketball_run-1"]


@pytest.fixture
def found() -> pd.DataFrame:
    return diagnosis(TRIALS)


def test_every_effect_has_words():
    assert set(EFFECT_WORDS) == {*EFFECTS, UNNAMED, SOFT_TISSUE}


def paragraphs(said: Verdict) -> tuple[str, ...]:
    """Everything, in order."""
    limits = (said.limits,) if said.limits else ()
    return (said.headline, *said.causes, *said.results, *said.advice, *limits)


def text_of(*tables) -> str:
    return " ".join(paragraphs(verdict_of(*tables)))


def test_the_verdict_says_what_how_large_how_sure_and_where(found):
    text = text_of(found, detection(TRIALS))
    assert text.startswith("2 findings. Searched: 2 recordings.")
    assert (
        "Plate 1 is turned by +2.0 degrees (about the vertical: 95 % interval 1.75 to 2.26°), in "
        "both recordings analysed. Probability 99.5 %; explains 8.0 % (4.0 to 12.0 %) of the "
        in text
    )
    assert text.count(EFFECT_WORDS["plate_rotation"].sentence) == 1  # plate_zero's is the same
    assert f"Findings 1 and 2: {EFFECT_WORDS['plate_rotation'].sentence}" in text
    group = found.replace({"effect": {"added_mass": "plate_gain"}})
    assert "Findings 1 and 2: The measured forces" in text_of(group, detection(TRIALS))
    assert "Finding 1: It is a matter of the laboratory" in text  # the group may be the person's


def test_what_only_the_markers_prove_says_so(found):
    proof = found[found["rank"] == 1].assign(
        effect="missing_joint",
        target="upper_torso",
        parameter="flexion",
        gain_percent=np.nan,
        what="the trunk bends twice",
        remark="; this is 40 % of what the markers leave, and the forces do not show it",
    )
    text = text_of(proof, detection(TRIALS))
    assert "); this is 40 % of what the markers leave, and the forces do not show it, in" in text


def test_a_trial_of_which_something_was_told_before_is_looked_at_too(found):
    leaning = found[found["rank"] == 1].assign(trials="sub-01_task-stairs", rank=9)
    text = text_of(pd.concat([found, leaning]), detection(TRIALS))
    assert "Recordings analysed: basketball (run 1), sequence (run 1) and stairs." in text
    assert "only in sequence (run 1) and basketball (run 1)" in text
    standing = leaning.assign(class_id="W")
    assert "stairs" not in text_of(pd.concat([found, standing]), detection(TRIALS))[-400:]


def test_how_sure_is_a_probability_and_what_it_explains(found):
    text = text_of(found.assign(gain_ci_low=-1.0), detection(TRIALS))
    assert "Probability 99.5 %; explains an unsure part (−1.0 to 12.0 %)" in text
    sure = text_of(found.assign(probability=1 - 1e-9, gain_ci_high=140.0), detection(TRIALS))
    assert "Probability over 99.9 %; explains 8.0 % (4.0 to 100.0 %) of" in sure
    told = found[found["rank"] == 1].assign(probability=np.nan, gain_percent=np.nan)
    assert cause_text(causes_of(candidates_of(told))[0], TRIALS).endswith(
        "in both recordings analysed."
    )


def test_probabilities_have_digits_where_these_say_something():
    words = [probability_words(p) for p in (0.0004, 0.04, 0.9504, 0.9996, np.nan)]
    assert words == ["under 0.1 %", "4.0 %", "95.0 %", "over 99.9 %", ""]


def test_a_group_comes_with_what_tells_its_members_apart(found):
    text = text_of(found, detection(TRIALS))
    assert (
        "One of these, which these recordings cannot distinguish, only in basketball (run 1): (a) "
        "channel fz has an offset of +9.8 N (95 % interval 8.8 to 10.8 N), probability 58.0 %; (b) "
        "1.00 kg more move with the left hand (95 % interval 0.90 to 1.10 kg), probability 38.0 %. "
        "Together 96.0 %; (a) explains 4.0 % (2.0 to 6.0 %) of the squared difference" in text
    )
    assert "To distinguish them: step off the plate for five seconds: an offset stays" in text
    assert "pray" not in text  # the sentence's own advice is that of one member only


def test_members_of_a_group_may_be_of_different_recordings(found):
    both = found["effect"] == "added_mass"
    text = text_of(
        found.assign(trials=found["trials"].mask(both, ", ".join(TRIALS))), detection(TRIALS)
    )
    assert "cannot distinguish: (a) channel fz has an offset" in text
    assert "8.8 to 10.8 N), only in basketball (run 1), probability 58.0 %; (b)" in text
    assert "0.90 to 1.10 kg), in both recordings analysed, probability 38.0 %." in text


def test_what_quiet_standing_tells_gives_its_advice_once(found):
    """The static recording is none of those that were searched."""
    read = "the plates read 60.0 kg, 2.6 kg less than stated"
    rows = found[found["class_id"] != ""].assign(
        class_id="W",
        trials="sub-01_task-static",
        sentence=f"{read}: a gain; to distinguish them, weigh it",
        what=f"{read}: a gain",
        short="a gain",
        against=read,
        probability=1 / 3,
    )
    text = text_of(rows, detection(TRIALS))
    assert "cannot distinguish, in static: (a) the plates read 60.0 kg" in text
    assert "weigh it" not in text and text.count("To distinguish them") == 1
    assert "Together 66.7 %, else the stated mass is wrong; (a) explains" in text
    assert "Either the stated mass is wrong or what the plates measure" in text
    several = rows.assign(short=["a gain", "an offset"])
    (group,) = causes_of(candidates_of(several))
    assert cause_line(group, TRIALS) == (
        "The plates read 60.0 kg, 2.6 kg less than stated: either a gain, an offset, or the "
        "stated mass is wrong (probability of the last 33.3 %)."
    )
    assert "The measured forces are not the true ones" not in text


def test_a_marker_has_the_interval_of_its_distance(found):
    one = found[found["rank"] == 1].assign(effect="marker_shift", target="LASI", unit="m")
    sizes = {"shift": (0.026, 0.02, 0.03), "shift_z": (0.014, 0.0139, 0.0141)}
    parts = [
        one.assign(parameter=name, estimate=x, ci_low=low, ci_high=high)
        for name, (x, low, high) in sizes.items()
    ]
    rows = pd.concat(parts).assign(what="marker LASI sits 26 mm from its place throughout")
    said = text_of(rows, detection(TRIALS))
    assert "26 mm from its place throughout (95 % interval 20 to 30 mm)" in said


def test_what_tells_a_group_apart_depends_on_all_of_it():
    hands = [("added_mass", "hand_l"), ("added_mass", "hand_r")]
    assert separating_recording(hands).endswith("one at a time: left hand and right hand")
    assert "hop three times" in separating_recording(
        [("gravity_tilt", ""), ("plate_rotation", "1")]
    )
    unknown = [("sync_offset", ""), ("over_smoothing", "")]
    both = f"{EFFECTS['sync_offset'].remedy}; {EFFECTS['over_smoothing'].remedy}"
    assert separating_recording(unknown) == both
    steps = separating_recording([(f"plate_{x}", "1 fz") for x in ("gain", "zero", "drift")])
    assert steps.count("step off the plate for five seconds") == 1
    assert "plates, cables" in separating_recording([("sync_offset", ""), (UNNAMED, "fx")])


def test_nothing_wrong(found):
    none = found[found["verdict"] == "rejected"]
    first = pd.DataFrame([{**none.iloc[0], "effect": "none", "verdict": "named", "rank": 1}])
    said = verdict_of(pd.concat([first, none]), detection(TRIALS))
    assert said.headline.startswith("No fault found. None of the")
    assert paragraphs(said)[1] == "Recordings analysed: basketball (run 1) and sequence (run 1)."
    assert paragraphs(said)[2].startswith("Too small to see: ")


def test_a_large_error_is_one_plain_line_and_hides_faults(found):
    large = found[found["rank"] == 1].assign(
        effect=UNNAMED, target="", parameter="error", trials=TRIALS[0],
        short="23 N of the vertical force (RMS) remain unexplained",
        against="large is 15.2 N and more",
    )  # fmt: skip
    said = verdict_of(large, detection(TRIALS))
    assert said.headline.startswith("Large error, cause unknown.")
    assert said.limits == "Faults of any size may hide behind so large an error."
    (cause,) = causes_of(candidates_of(large))
    assert cause_line(cause, TRIALS) == (
        "Error of unknown cause: 23 N of the vertical force (RMS) remain unexplained, only in "
        "sequence (run 1); large is 15.2 N and more."
    )
    both = pd.concat([large, found[found["rank"] > 1]])
    assert light_of(both, detection(TRIALS)).title == "Large error, cause unknown; 2 findings"


def test_a_single_finding_is_named(found):
    ball = found[found["rank"] == 1].assign(effect="released_object", class_id="", rank=9)
    assert light_of(ball, detection(TRIALS)).title == "1 finding: object held and let go"
    both = pd.concat([found, ball])
    assert light_of(both, detection(TRIALS)).title == "3 findings"


def test_something_that_cannot_be_named(found):
    row = found[found["effect"] == "plate_zero"].assign(
        effect=UNNAMED, verdict="named", class_id="", what="something goes along with fz"
    )
    assert light_of(row, detection(TRIALS)).title == "1 finding: error of unknown cause"
    text = text_of(row, detection(TRIALS))
    assert "Something goes along with fz (95 % interval 8.8 to 10.8 N)" in text
    check = (
        "It acts like constant offset of a plate's channel (plate 1, vertical force); to check, "
    )
    assert f"{EFFECT_WORDS[UNNAMED].meaning} {check}step off the plate" in text
    assert "bsip extend" not in text  # what has no name cannot be put into a model


def test_a_cause_named_twice_is_a_warning(found):
    again = pd.concat([found, found[found["rank"] == 1].assign(rank=5)])
    warning = "Named more than once: force plate turned or tilted: plate 1."
    assert warning in text_of(again, detection(TRIALS))
    apart = again.assign(trials=[TRIALS[rank == 5] for rank in again["rank"]])
    assert warning not in text_of(apart, detection(TRIALS))  # in two recordings, once each


def test_candidates_keep_their_order_and_their_numbers(found):
    candidates = candidates_of(found)
    assert [one.verdict for one in candidates] == ["named", "ambiguous", "ambiguous", "rejected"]
    assert len(candidates[0].numbers) == 2
    assert [one.probability for one in candidates] == [0.995, 0.58, 0.38, 0.04]
    assert [one.scope for one in candidates[1:3]] == ["laboratory", "person"]
    assert candidates[3].words.what.startswith("0.3 kg swing on")
    assert "probability" not in candidates[3].words.what  # it has a column of its own
    assert [len(cause) for cause in causes_of(candidates)] == [1, 2]


def test_an_interval_has_a_sign_where_its_sentence_has_one(found):
    late = found[found["rank"] == 1].assign(
        effect="sync_offset", target="", parameter="delay", unit="s",
        estimate=-0.02, ci_low=-0.021, ci_high=-0.019, is_signed=False,
        what="the forces were recorded 20.0 ms before the markers",
    )  # fmt: skip
    (one,) = candidates_of(late)
    assert one.in_words().endswith("20.0 ms before the markers (95 % interval 19.0 to 21.0 ms)")
    drift = late.assign(effect="plate_drift", parameter="drift", unit="N/s", what="by -0.02 N")
    drift["is_signed"] = True
    assert candidates_of(drift)[0].in_words() == "by −0.02 N (95 % interval −0.0210 to −0.0190 N/s)"


def test_an_error_without_a_name_has_a_label(found):
    unnamed = found[found["rank"] == 2].assign(effect=UNNAMED, parameter="error")
    labels = {
        "fz by load": "vertical force, along with the load",
        "all by time": "all components, along with the time in the trial",
        "fx": "force x",
        "1 fz": "plate 1, vertical force",
    }
    for target, label in labels.items():
        (one,) = candidates_of(unnamed.assign(target=target))
        assert one.label == f"error of unknown cause: {label}"


def test_the_table_says_what_came_near(found):
    *_, grid = nearest(candidates_of(found))
    ((label, *cells),) = [[cell.text for cell in row] for row in grid.cells()]
    assert cells == ["4.0 %", "3.0", "not tested"]
    assert label == candidates_of(found)[-1].label
    (said,) = nearest(candidates_of(found[found["verdict"] == "named"]))
    assert said.text == "No other fault of the catalogue came near."


def test_what_changes_the_forces_most_comes_first(found):
    """But for an error that nothing explains: its change is not known."""
    weak = found.assign(rms_change=found["rms_change"].mask(found["rank"] == 1, 0.1))
    assert [cause[0].class_id for cause in causes_of(candidates_of(weak))] == ["B", ""]
    large = weak.assign(
        effect=weak["effect"].mask(weak["rank"] == 1, UNNAMED),
        target=weak["target"].mask(weak["rank"] == 1, ""),
        parameter=weak["parameter"].mask(weak["rank"] == 1, "error"),
    )
    assert [cause[0].class_id for cause in causes_of(candidates_of(large))] == ["", "B"]


def test_soft_tissue_or_a_bend_of_the_trunk(found):
    """As ``marker_proof`` says it: no forces tell, and the markers do not tell which."""
    remedy = EFFECTS["missing_joint"].remedy
    advice = f"; a second bend and soft tissue look alike here: to distinguish them, {remedy}"
    group = found[found["class_id"] == "B"].assign(
        effect=["missing_joint", SOFT_TISSUE],
        target="upper_torso",
        parameter=["flexion", "size"],
        unit=["1", "m"],
        estimate=[0.35, 0.012],
        ci_low=[0.3, np.nan],
        ci_high=[0.4, np.nan],
        class_id="M1",
        gain_percent=np.nan,
        rms_change=np.nan,
        sentence=["the trunk bends twice" + advice, "soft tissue moves" + advice],
        what=["the trunk bends twice", "soft tissue moves: its markers are 12 mm off"],
        remark=["; this is 40 % of all", ""],
    )
    text = text_of(group, detection(TRIALS))
    assert "(b) soft tissue moves: its markers are 12 mm off, probability 38.0 %." in text
    assert text.count("a second bend and soft tissue") == 0 and text.count(remedy) == 1
    assert EFFECT_WORDS[SOFT_TISSUE].sentence in text


def test_what_an_error_of_unknown_cause_asks_to_check():
    """By what it goes along with, and in which component."""
    assert check_for("fz by load", ["error"]) == (
        "Lay two known weights on each plate in turn, and compare its vertical force with theirs."
    )
    assert "several places of each plate" in check_for("fx by pelvis_y", ["error"])
    assert check_for("all by time", ["error"]).endswith("and compare their forces.")
    assert "empty plates for ten seconds" in check_for("mz", ["amplitude", "frequency"])
    assert "hop three times in view" in check_for("", ["delay"])
    assert check_for("fx", ["nothing known"]) == ""
    channels = ("all", "fx", "fy", "fz", "mx", "my", "mz")
    assert all(check_for(f"{one} by {what}", ["error"]) for one in channels for what in ALONG)


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
        "Too small to see: a delay of the forces under 2.5 ms, a plate's shift under "
        "6.0 mm or a misreading of vertical forces under 1.1 %."
    )
    assert limits_sentence(()) == ""


def test_units_that_people_read():
    assert size_words("yaw", "rad", 0.035) == "2.0°"
    assert size_words("rate_error", "1", 7.5e-5) == "75 ppm"
    assert size_words("coefficient", "1", 0.0262) == "2.6 %"
    assert size_words("mass", "kg", 18.2) == "18 kg"
    assert place_label("plate_crosstalk", "1 fx>fz") == "plate 1, force x into vertical force"
    assert place_label("marker_swap", "A+B") == "markers A and B"
    assert place_label("added_mass", "hand_l") == "left hand"
    assert place_label("sync_offset", "") == ""
    assert place_label("unmeasured_contact", "hand_l+hand_r") == "left hand and right hand"
    assert place_label("plate_gain", "all fz") == "all plates, vertical force"


def test_limits_stand_beside_sizes_that_labs_meet(found):
    nothing = found[found["verdict"] == "rejected"]
    *_, grid = limit_blocks(detection(TRIALS), nothing)
    rows = {row[0].text: [cell.text for cell in row[1:]] for row in grid.cells()}
    assert rows["forces and markers out of step"] == ["2.5 ms", "22 ms", "5 to 20 ms"]
    assert rows["force plate not where the file says"][0] == "4.0 to 6.0 mm"
    assert set(USUAL) <= set(EFFECTS)


def test_what_no_recording_shows_is_not_put_in_figures(found):
    far = detection(TRIALS).assign(effect="joint_centre", parameter="shift_x", unit="m")
    far["limit"] = np.where(far["target"] == "hand_l", 1e5, 0.02)
    *_, grid = limit_blocks(far, found)
    assert grid.cells()[0][1].text == "from 20 mm, or not at all"


def test_what_no_recording_shows_at_all_is_said(found):
    blind = detection(TRIALS)
    blind.loc[blind["effect"] == "plate_gain", "limit"] = np.inf
    said = [one.text for one in limit_blocks(blind, found) if isinstance(one, Paragraph)]
    assert f"at any size that can be true: {EFFECT_WORDS['plate_gain'].title}." in " ".join(said)
    named = pd.concat([found, found[found["rank"] == 1].assign(effect="plate_gain", rank=9)])
    said = [one.text for one in limit_blocks(blind, named) if isinstance(one, Paragraph)]
    assert "at any size" not in " ".join(said)
    usual = limit_blocks(detection(TRIALS), found)
    assert "at any size" not in " ".join(one.text for one in usual if isinstance(one, Paragraph))


# --- gains --------------------------------------------------------------------------------------


def test_gains_lead_with_what_improves():
    text = gain_sentence(gains())
    assert "COP, anterior-posterior 12.00 → 6.00 mm (50 % less, 40 to 60 %)" in text
    worse = gains().assign(component=["cop_ap", "mz"], ci_high=[60.0, -1.0])
    assert gain_sentence(worse).endswith("The error rises in moment, lab Z (up).")
    assert gain_sentence(worse[1:]).endswith(
        "no component follows better. The error rises in moment, lab Z (up)."
    )


def test_the_verdict_tells_gains_where_they_are(found):
    looked = "Recordings analysed: basketball (run 1) and sequence (run 1)."
    told = verdict_of(found, detection(TRIALS), gains()).results
    assert told == (gain_sentence(gains()), looked)
    advice, where = verdict_of(found, detection(TRIALS)).results
    assert "bsip extend" in advice
    assert where == looked


def test_changes_of_the_body_lead_with_the_largest():
    table = changes()
    text = change_sentence(table)
    assert "left thigh +1.20 kg, its centre of mass moves by 15 mm" in text
    assert "right foot" not in text
    assert "next to nothing" in change_sentence(table[table["segment"] == "foot_r"])
    assert change_sentence(table[:0]) == ""


# --- residual and error budget -------------------------------------------------------------------


def test_the_budget_tells_terms_that_look_alike_together_and_adds_up():
    table = error_budget(["sub-01_task-squat_run-1"])
    found = pieces(table, "fz", ())
    assert [one.label for one in found] == [
        "the table's segment parameters",
        "soft tissue or smoothing of the motion",
        "unknown",
        "noise",
    ]
    assert sum(one.share for one in found) == pytest.approx(100.0)
    (first, *_) = budget_sentences(table, ())
    assert first.startswith("What makes RM's error of 20.0 N in force, lab Z (up): the table's")
    assert "change the error by −40 % (−50 to −30 %)" in first


def test_the_one_bar_is_the_mean_over_what_is_asked_first():
    table = error_budget(["sub-01_task-squat_run-1"])
    small = table.assign(rms=table["rms"].mask(table["component"] == "fz", 0.1))
    fz = small["component"].eq("fz") & small["term"].eq("unknown")
    small.loc[fz, "share_percent"] = 99.0  # of an error that is of no interest
    for budget in (table, small):
        found = {one.label: one.share for one in overall_pieces(budget, ())}
        assert sum(found.values()) == pytest.approx(100.0)
        assert found["unknown"] == pytest.approx(20.0)
        assert found["soft tissue or smoothing of the motion"] == pytest.approx(7.0)
    assert overall_pieces(table.assign(rms=0.1), ()) == ()


@pytest.mark.parametrize("share", [25.0, 1.0])
def test_what_was_found_has_its_own_piece_and_makes_as_much_as_it_says(share):
    table = error_budget(["sub-01_task-squat_run-1"])
    term = table["term"].replace("soft_tissue", "fault:plate_rotation")
    shares = table["share_percent"].mask(table["term"] == "soft_tissue", share)
    fault = table.assign(term=term, share_percent=shares, alike="")
    title, found = EFFECT_WORDS["plate_rotation"].title, {"plate_rotation"}
    pieces = {one.label: one.share for one in overall_pieces(fault, found)}
    assert pieces[title] == pytest.approx(share)
    assert found_share(fault, found) == pytest.approx(share)
    others = {one.label: one for one in overall_pieces(fault, ())}
    assert not any(title in label for label in others)
    assert others["unknown"].share == pytest.approx(20.0 + share)
    like = f"{share:.0f} % like {title}, not confirmed" if share > 5 else ""
    assert others["unknown"].perhaps == like and others["unknown"].kinds == ("unknown",)
    assert found_share(fault, {"sync_offset"}) == found_share(table, found) == 0.0


def test_parts_of_the_bar_have_the_numbers_of_their_findings():
    table = error_budget(["sub-01_task-squat_run-1"])
    table = table.assign(alike="", term=table["term"].replace("noise", "fault:plate_gain"))
    shares = table["share_percent"].mask(table["term"] == "smoothing", -10.0)
    found = {2: {"plate_gain"}, 3: {"plate_gain", "sync_offset"}, 5: {"soft_tissue"}}
    labels = [one.label for one in numbered_pieces(table.assign(share_percent=shares), found)]
    gain = EFFECT_WORDS["plate_gain"].title
    assert f"{gain} (findings 2 and 3)" in labels
    assert "soft tissue (finding 5)" in labels  # which has what is usual too
    assert "smoothing of the motion (cancels some)" in labels
    assert "the table's segment parameters" in labels
