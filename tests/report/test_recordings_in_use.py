"""Which recordings may be used and for what; the findings of the first page, and their numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bsip_cli.commands.show import shown
from bsip_cli.diagnosis.findings import Finding
from bsip_cli.effects.effect import Number, Words
from bsip_cli.report.blocks import Links, Numbered, Scales
from bsip_cli.report.budget import budget_sentences
from bsip_cli.report.causes import candidates_of, causes_of, effect_title
from bsip_cli.report.errors import COP, FORCE, MARKERS
from bsip_cli.report.first_page import _in_brief, budget_bar, front
from bsip_cli.report.joints import all_peaks, moment_change
from bsip_cli.report.recordings import (
    beyond,
    large_finding,
    light_for,
    main_part,
    measured_of,
    must_wait,
    not_yet,
    number_of_main_part,
    om_waits,
    use_lines,
    use_said,
    use_words,
    uses_of,
    worst_of,
)
from bsip_cli.report.records import ParticipantRecord, TrialRecord
from bsip_cli.report.verdict import cause_line, cause_text, consequences
from bsip_cli.stages.diagnose import rows_of
from tests.report.fake_study import Artifacts, diagnosis

STATIC = "sub-01_task-static"
SEQUENCE, BASKETBALL = "sub-01_task-sequence_run-1", "sub-01_task-basketball_run-1"
TRIALS = [SEQUENCE, BASKETBALL]
FOUND = diagnosis(TRIALS)
TURNED = FOUND[FOUND["rank"] == 1]


def fault(effect: str, trials: str, **changes) -> pd.DataFrame:
    """Rows of a diagnosis that names it."""
    return TURNED.assign(effect=effect, trials=trials, **changes)


def with_faults(record: ParticipantRecord, *faults: pd.DataFrame) -> ParticipantRecord:
    nothing = FOUND[FOUND["verdict"] == "rejected"]
    rows = [one.assign(rank=10 + k, rms_change=20.0 - k) for k, one in enumerate(faults)]
    return replace(record, diagnosis=pd.concat([*rows, nothing], ignore_index=True))


def with_error(record: ParticipantRecord, stem: str, **columns) -> ParticipantRecord:
    """With these numbers in the errors of a recording; those of forces where there were any."""

    def changed(trial: TrialRecord) -> TrialRecord:
        kept = {
            name: trial.fit[name].where(trial.fit[name].isna(), x) for name, x in columns.items()
        }
        return replace(trial, fit=trial.fit.assign(**kept)) if trial.stem == stem else trial

    return replace(record, trials=tuple(map(changed, record.trials)))


def with_trial(record: ParticipantRecord, stem: str, **tables) -> ParticipantRecord:
    trials = (replace(t, **tables) if t.stem == stem else t for t in record.trials)
    return replace(record, trials=tuple(trials))


def far_off(record: ParticipantRecord, *faults: pd.DataFrame) -> ParticipantRecord:
    """With these faults, and a large error of the vertical force in the throw."""
    return with_error(with_faults(record, *faults), BASKETBALL, rmse_percent_bw=9.0)


def steps(record: ParticipantRecord) -> tuple[str, ...]:
    """What to do next."""
    return front(record)[-1].items


def lines(record: ParticipantRecord) -> tuple[str, ...]:
    """The findings of the first page."""
    (numbered,) = (block for block in front(record) if isinstance(block, Numbered))
    return numbered.items


def kinds_of(record: ParticipantRecord) -> list[str]:
    return [use.kind for use in uses_of(record).values()]


# --- which may be used --------------------------------------------------------------------------


def test_all_may_be_used_where_nothing_is_wrong(record):
    fine = with_faults(record)
    assert kinds_of(fine) == ["full", "full", "full"]
    assert list(use_lines(fine)) == ["Use (motion, forces, joint moments): all recordings."]


@pytest.mark.parametrize(
    ("effect", "kind"),
    [
        ("sync_offset", "corrected"),
        ("released_object", "corrected"),
        ("marker_shift", "corrected"),
        ("wobbling_mass", "care"),
        ("unexplained", "care"),
    ],
)
def test_a_recording_with_a_fault_waits_for_what_can_be_done(record, effect, kind):
    faulty = with_faults(record, fault(effect, BASKETBALL, target="1 fz"))
    assert kinds_of(faulty) == ["full", "full", kind]
    assert list(use_lines(faulty))[1].endswith(": basketball (finding 1).")


def test_on_a_bad_calibration_all_else_rests(record):
    """It is no recording to leave out: it comes first, with the markers to look at."""
    kinematics = record.trials[0].kinematics.assign(marker_rms_m=0.0235)
    bad = with_trial(with_faults(record), STATIC, kinematics=kinematics)
    assert record.facts["calibration_trial"] == STATIC and kinds_of(bad)[0] == "calibration"
    said = "Bad calibration, on which all else rests: static (marker error 23.5 mm)."
    assert next(use_lines(bad)) == said
    assert steps(bad)[0].startswith("First repeat static, or correct its markers, farthest off ")
    assert must_wait(bad) == use_said(bad, brief=True) == "First repeat or correct the calibration."
    facts = record.facts.copy()
    facts["calibration_trial"] = SEQUENCE
    assert kinds_of(replace(bad, facts=facts))[0] == "out"


def test_a_recording_has_the_role_that_it_played(record):
    """Whatever its task is called."""
    played = [record.roles_of(trial) for trial in record.trials]
    assert played == [("static",), ("sequence",), ("validation",)]
    throw = record.identification.assign(trials=BASKETBALL)
    facts = record.facts.copy()
    facts["calibration_trial"] = BASKETBALL
    other = replace(record, identification=throw, facts=facts)
    played = [other.roles_of(trial) for trial in other.trials]
    assert played == [(), ("validation",), ("static", "sequence")]


def test_what_all_of_a_laboratory_share_concerns_every_recording(record):
    """Also one that was too short to be searched alone."""
    late = fault("sync_offset", SEQUENCE, persons=7)
    assert set(kinds_of(with_faults(record, late))) == {"corrected"}
    (cause,) = causes_of(candidates_of(late))
    assert "2.26°), in the recordings of 7 persons; " in cause_line(cause, [SEQUENCE])


def test_forces_far_off_leave_the_motion_and_markers_far_off_nothing(record):
    far = with_error(with_faults(record), BASKETBALL, rmse_percent_bw=7.25)
    assert kinds_of(far) == ["full", "full", "motion"]
    assert "Joint angles only: basketball (vertical force error 7.2 %)." in list(use_lines(far))
    slipped = with_faults(far, fault("marker_shift", BASKETBALL))
    assert "Joint angles only: basketball (after finding 2)." in list(use_lines(slipped))
    moved = far.trials[2].kinematics.assign(marker_rms_m=0.0235)
    lost = with_trial(far, BASKETBALL, kinematics=moved)
    assert "Leave out: basketball (marker error 23.5 mm)." in list(use_lines(lost))
    gone = with_trial(far, BASKETBALL, kinematics=None)
    assert "Leave out: basketball (no motion was computed)." in list(use_lines(gone))


def test_forces_that_were_not_compared_are_not_vouched_for(record):
    unknown = with_trial(with_faults(record), BASKETBALL, fit=None)
    said = "Joint angles only: basketball (forces could not be compared)."
    assert said in list(use_lines(unknown))


def test_what_quiet_stance_shows_concerns_all(record):
    weight = fault("plate_gain", STATIC, class_id="W", verdict="ambiguous")
    assert kinds_of(with_faults(record, weight)) == ["corrected"] * 3
    said = list(use_lines(with_faults(record, weight)))
    assert said == ["Use after acting on the finding: all recordings (finding 1)."]


def test_without_a_diagnosis_nothing_is_said_of_the_recordings(record):
    bare = replace(record, diagnosis=None, detection=None)
    assert list(use_lines(bare)) == ["Whether the recordings may be used cannot be said."]


def test_runs_are_counted_where_they_are_many(record):
    runs = [
        replace(record.trials[2], stem=f"sub-01_task-walking_run-{k}", task="walking")
        for k in range(1, 6)
    ]
    many = with_faults(
        replace(record, trials=(*record.trials, *runs)), fault("sync_offset", STATIC)
    )
    assert list(use_lines(many)) == [
        "Use (motion, forces, joint moments): sequence, basketball and 5 × walking.",
        "Use after acting on the finding: static (finding 1).",
    ]
    two = replace(many, trials=many.trials[:5])
    assert "basketball, walking run 1 and walking run 2." in next(iter(use_lines(two)))


# --- a large error is a finding -----------------------------------------------------------------


def test_large_alone_is_in_the_title(record):
    far = with_error(with_faults(record), SEQUENCE, rmse_percent_bw=9.0)
    assert light_for(far).title == "Fine: no fault found, no large error except in sequence"
    assert large_finding(far) == ()
    (step,) = steps(replace(far, refusals=()))
    assert step.startswith("In sequence the vertical force error")
    both = with_error(with_faults(record, TURNED), SEQUENCE, rmse_percent_bw=9.0)
    assert light_for(both).title == (
        "1 finding: force plate turned or tilted; no large error except in sequence"
    )


def test_a_large_error_comes_first_and_counts(record):
    far = far_off(record, TURNED)
    (finding,) = large_finding(far)
    assert finding == (
        "Large error with RM: vertical force 9.0 %, most in basketball; other "
        "findings explain part at most."
    )
    assert lines(far)[0] == finding and lines(far)[1].startswith("Force plate turned")
    assert steps(far)[0].startswith("Finding 1: In basketball the vertical")
    assert steps(far)[1].startswith("Finding 2: Check, then correct the")
    assert [one.name for one, _ in beyond(far)] == [FORCE]
    assert worst_of(far, beyond(far)[0][0]).stem == BASKETBALL


def test_a_large_error_is_said_with_the_parameters_of_that_recording(record):
    """In the throw the table's are to be used, and everywhere as long as OM has to wait."""
    far = far_off(record)
    assert use_words(far) == "OM (basketball: RM)"
    assert large_finding(far)[0].startswith("Large error with RM: vertical force 9.0 %, most in ba")
    waits = with_error(far, SEQUENCE, rmse_percent_bw=9.5)
    assert use_words(waits) == "RM" and "Large with RM (table)" in light_for(waits).text
    said = use_said(waits)
    assert use_said(waits, brief=True).startswith("Use RM for now: OM comes from sequence")
    assert "By errors so far, RM for basketball, else OM: " in said and "Use OM" not in said


def test_a_large_error_that_is_unknown_in_part_is_not_of_unknown_cause(record):
    table = replace(far_off(record), choice=record.choice.assign(use="RM"))
    unknown = table.budget["term"] == "inertial_parameters"
    shares = table.budget["share_percent"].mask(unknown, 5.0)
    part = replace(table, budget=table.budget.assign(share_percent=shares))
    assert "of it unknown" in light_for(part).title
    assert "its cause known in part" in " ".join(getattr(x, "text", "") for x in front(part))


def test_parameters_wait_for_the_recordings_that_they_are_from(record):
    """And with a large error for any recording that may be used: here quiet stance may."""
    fine = with_faults(record)
    assert not must_wait(fine)
    assert must_wait(with_faults(record, fault("sync_offset", SEQUENCE))).startswith(
        "Use RM for now: OM comes from sequence, unusable as recorded."
    )
    assert not must_wait(with_faults(record, fault("sync_offset", BASKETBALL)))
    table = replace(fine, choice=record.choice.assign(use="RM"))
    far = table
    for stem in TRIALS:
        far = with_error(far, stem, rmse_percent_bw=9.0)
    assert light_for(far).state == "large" and not must_wait(far)
    nowhere = with_error(far, STATIC, rmse_percent_bw=9.0)
    assert must_wait(nowhere) == "First solve the large error." and not_yet(nowhere)
    om = replace(nowhere, choice=record.choice)  # which comes from one of them
    assert om_waits(om) and must_wait(om) == must_wait(nowhere) and use_words(om) == "RM"


def test_elsewhere_found_is_no_explanation(record):
    far = far_off(record, TURNED.assign(trials=SEQUENCE))
    assert large_finding(far)[0].endswith("most in basketball; cause unknown.")


def test_a_fault_that_makes_the_largest_part_is_named(record):
    term = record.budget["term"].replace("inertial_parameters", "fault:plate_rotation")
    far = far_off(record, TURNED)
    known = replace(far, budget=far.budget.assign(term=term))
    assert number_of_main_part(known) == 2
    assert large_finding(known)[0].endswith("; the largest part is finding 2.")
    table = replace(far, choice=record.choice.assign(use="RM"))  # whose part the light says
    assert "the table's segment parameters" in light_for(table).title
    assert "part" not in large_finding(table)[0]
    assert steps(known)[0].startswith(
        "Finding 2: Check, then correct the"
    )  # no search for the cause
    assert number_of_main_part(far) == 0


def test_what_makes_the_largest_part_in_a_recording_says_what_helps(record):
    """Of the recording's own budget, whatever the others are."""
    far = far_off(record, TURNED)

    def first_to_do(term: str) -> str:
        mine = (far.budget["trial"] == BASKETBALL) & (far.budget["term"] == "inertial_parameters")
        budget = far.budget.assign(term=far.budget["term"].mask(mine, term), alike="")
        return steps(replace(far, budget=budget))[0]

    assert first_to_do("joint_centres") == (
        "Finding 1: In basketball, joint centres may make the largest part of the vertical force "
        "error: check the static pose and the markers at the joints."
    )
    assert "error of unknown cause" not in first_to_do("unknown")
    assert first_to_do("unknown").startswith("Finding 1: In basketball the vertical")
    assert first_to_do("fault:plate_rotation").startswith("Finding 2: Check, then correct the")
    unconfirmed = first_to_do("fault:sync_offset")  # unknown, as nobody can say that it is there
    assert unconfirmed.startswith("Finding 1: In basketball the vertical")


def test_nothing_is_of_unknown_cause_whose_bar_has_no_unknown_part(record):
    """OM errs, and the table's parameters, which it should have corrected, make most."""
    far = far_off(record, TURNED)
    unknown = far.budget["term"] == "unknown"
    assert main_part(far) == (None, True) and large_finding(far)[0].endswith("part at most.")
    bent = far.budget["term"].mask(unknown, "trunk_and_shoulders")
    known = replace(far, budget=far.budget.assign(term=bent))
    assert large_finding(known)[0].endswith(
        "the largest part besides the table's parameters is trunk and shoulders that bend."
    )
    assert "its cause known in part" in " ".join(getattr(x, "text", "") for x in front(known))
    turned = far.budget["term"].mask(unknown, "fault:plate_rotation")
    named = replace(far, budget=far.budget.assign(term=turned))
    assert large_finding(named)[0].endswith("table's parameters is finding 2.")
    assert steps(named)[0].startswith("Finding 1: In basketball the")  # where to look stays


def test_what_looks_like_a_fault_is_part_of_the_unknown_with_its_finding(record):
    unnamed = fault("unexplained", SEQUENCE, target="1 fz")
    some = with_faults(record, unnamed)
    late = some.budget["term"].replace("soft_tissue", "fault:sync_offset")
    late = some.budget.assign(term=late, alike="")
    (bar,) = budget_bar(replace(some, budget=late))
    shares = {piece.label: piece.share for piece in bar.pieces}
    assert shares["unknown (finding 1)"] == pytest.approx(45.0)
    said = " ".join(budget_sentences(late, {"unexplained"}))  # in the fold
    assert "unknown (25 % like forces and markers out of step, not confirmed)" in said


def test_the_parameters_for_now_have_the_full_dot(record):
    """RM while OM waits; where RM's error is large and OM's is not, the light says whose it is."""
    waits = with_faults(record, fault("sync_offset", SEQUENCE))
    assert om_waits(waits) == ["sequence"] and not om_waits(with_faults(record))

    def cop_of(one: ParticipantRecord) -> float:
        (scales,) = (block for block in front(one) if isinstance(block, Scales))
        return scales.scales[0][1]

    fits = {name: measured_of(waits, name) for name in ("RM", "OM")}
    cop = {name: next(iter(sizes.values())) for name, sizes in fits.items()}
    assert cop["RM"] != pytest.approx(cop["OM"], abs=0.1)
    assert cop_of(waits) == pytest.approx(cop["RM"], abs=0.06)
    rm = [
        replace(t, fit=t.fit.assign(rmse=t.fit["rmse"].mask(t.fit["method"] == "RM", 99.0)))
        for t in waits.trials
    ]
    all_om = record.choice.assign(use="OM")[:1]
    far = replace(waits, trials=tuple(rm), choice=all_om)
    assert "Large with RM (table)" in light_for(far).text and "even" not in light_for(far).title


def test_a_large_error_elsewhere_is_a_finding_of_its_own(record):
    """The diagnosis speaks of the recording that is not the worst."""
    error = fault("unexplained", SEQUENCE, target="", parameter="error").assign(
        short="21 N of the vertical force remain unexplained", against="large is 15 N and more"
    )
    far = far_off(record, error)
    assert large_finding(far)[0].endswith("most in basketball; cause unknown.")
    assert [line[:5] for line in lines(far)] == ["Large", "Error"]
    there = with_faults(far, error.assign(trials=", ".join(TRIALS)))
    assert large_finding(there) == ()
    assert steps(there)[0].startswith("Finding 1: In basketball the vertical")


def test_markers_far_off_are_no_matter_of_the_forces(record):
    facts = record.facts.copy()
    facts["marker_rms_m"] = 0.025
    lost = replace(with_faults(record, TURNED), facts=facts)
    assert large_finding(lost)[0].startswith("Large error with RM: markers from model 25")
    assert "explain" not in large_finding(lost)[0] and number_of_main_part(lost) == 0
    assert steps(lost)[0].startswith("Finding 1: Check that marker set and labels are right")


def test_the_terminal_numbers_findings_as_the_page_does(reports, tmp_path):
    person = reports.study.participants[0]
    artifacts = Artifacts(tmp_path, person)
    artifacts.write_all()
    for trial in person.trials[1:]:
        fit = artifacts.fit(trial)
        far = fit.assign(
            rmse_percent_bw=fit["rmse_percent_bw"].where(fit["rmse_percent_bw"].isna(), 9)
        )
        artifacts.write("fit", far, trial)
    replace(reports, out=tmp_path).run("report", person)
    said = " ".join("\n".join(shown(tmp_path)).split())
    assert " 1. Large error with RM: vertical force 9.0 %" in said
    assert " 2. Force plate turned or tilted: plate 1 is turned by +2.0 degrees" in said
    full = " ".join("\n".join(shown(tmp_path, full=True)).split())
    assert " 2. Plate 1 is turned" in full and "Findings 2 and 3: The measured forces" in full
    page = replace(reports, out=tmp_path).html("sub-01")
    assert page.count("Large error with RM: vertical force") == 2  # and in the fold


def test_numbers_of_advice_begin_where_the_findings_do():
    causes = causes_of(candidates_of(FOUND))
    assert consequences(causes)[0].startswith("Findings 1 and 2: ")
    assert consequences(causes, first=2)[0].startswith("Findings 2 and 3: ")
    assert consequences(causes[:1], first=2)[0].startswith("Finding 2: ")


# --- findings in few words ----------------------------------------------------------------------


def test_all_members_of_a_group_are_named():
    group = FOUND[FOUND["class_id"] == "B"]
    more = [
        group[:1].assign(effect=effect, target=target, rank=20 + k, probability=0.01)
        for k, (effect, target) in enumerate(
            [("plate_drift", "1 fz"), ("plate_rotation", "1"), ("plate_rotation", "2")]
        )
    ]
    (cause,) = causes_of(candidates_of(pd.concat([group, *more])))
    line = cause_line(cause, TRIALS)
    assert line.startswith(
        "One of 5 causes that look alike here: constant offset of a plate's channel (channel fz "
        "has an offset of +9.8 N);"
    )
    for effect in ("added_mass", "plate_drift"):
        assert effect_title(effect) in line
    assert f"{effect_title('plate_rotation')} (2 places)" in line
    assert line.endswith("; only in basketball (run 1). Together 99.0 %.")


def test_findings_without_room_are_named_with_their_numbers(record):
    skin = {"class_id": "M1", "verdict": "ambiguous", "probability": 0.5}
    many = with_faults(
        record,
        *(fault(effect, SEQUENCE) for effect in ("sync_offset", "plate_gain", "marker_shift")),
        *(fault(effect, SEQUENCE, **skin) for effect in ("missing_joint", "soft_tissue")),
        *(fault("soft_tissue", stem) for stem in TRIALS),
    )
    links, _ = (block for block in front(many) if isinstance(block, Links))
    assert links.to == (("More below", "#wrong"),)
    assert links.rest == (
        ". 3: plate 1 is turned by +2.0 degrees (sequence); "
        f"4 to 6: {effect_title('soft_tissue')}, or 1 other cause."
    )


def test_a_stated_mass_that_may_be_wrong_is_no_fault_of_a_plate():
    weight = {"class_id": "W", "verdict": "ambiguous", "probability": 0.33}
    weight |= {"against": "the plates read 31.1 kg in quiet stance, 1.0 kg less than stated"}
    (cause,) = causes_of(candidates_of(fault("plate_gain", SEQUENCE, **weight)))
    (said,) = _in_brief({3: cause}, 2, {})
    assert said == f"3: {weight['against']}"


def test_a_fault_says_what_it_changes_at_the_joints(record):
    peaks = all_peaks(record.trials)
    causes = causes_of(candidates_of(TURNED))
    assert moment_change(causes[0], causes, peaks) == (
        "changes the left knee's moment by 9 % of its peak"
    )
    small = peaks.assign(change_percent=0.4)
    assert moment_change(causes[0], causes, small) == ("knee and elbow moments change under 1 %")
    unknown = small.assign(change_Nm=small["change_Nm"].mask(small["joint"] == "elbow_r"))
    assert moment_change(causes[0], causes, unknown) == "knee moments change under 1 %"
    assert moment_change(causes[0], causes, pd.DataFrame()) == ""
    other = causes_of(candidates_of(fault("sync_offset", SEQUENCE)))
    assert moment_change(other[0], other, peaks) == ""


def test_of_two_alike_in_one_recording_no_change_is_known(record):
    both = pd.concat([TURNED, TURNED.assign(target="2", rank=9)])
    causes = causes_of(candidates_of(both))
    assert moment_change(causes[0], causes, all_peaks(record.trials)) == ""
    apart = pd.concat([TURNED.assign(trials=SEQUENCE), TURNED.assign(trials=BASKETBALL, rank=9)])
    causes = causes_of(candidates_of(apart))
    assert "left knee" in moment_change(causes[0], causes, all_peaks(record.trials))


@pytest.mark.parametrize(
    ("own", "short", "full"),
    [
        ({}, ".", "share it."),
        (
            {"own_estimate": 0.006, "own_low": -0.004, "own_high": 0.016},
            " (alone: 6 ms).",
            "share it (this person alone: 6 ms, 95 % interval −4 to 16 ms).",
        ),
    ],
)
def test_of_two_sizes_it_is_said_with_which_to_correct(own, short, full):
    said = "plate 1 is turned; this is known from the laboratory (7 persons), as is said there"
    late = TURNED.assign(sentence=said, parameter="delay", unit="s", persons=7, **own)
    (cause,) = causes_of(candidates_of(late))
    correct = "Correct with this size, as 7 persons of the laboratory "
    assert cause_line(cause, TRIALS).endswith(
        f"probability 99.5 %. Size of 7 persons together{short}"
    )
    assert cause_text(cause, TRIALS).endswith(f"{correct}{full}")
    assert "known from" not in cause_line(cause, TRIALS) + cause_text(cause, TRIALS)


def test_the_own_size_goes_as_a_number_from_the_finding_to_the_candidate():
    sizes = Number("y", "m", 0.001), Number("x", "m", 0.02, 0.019, 0.021)
    own = Number("x", "m", 0.018, 0.01, 0.026)
    said = sizes, Words("plate 1 is shifted"), 0.01, 0.99
    shared = Finding("plate_translation", "1", (SEQUENCE,), *said, persons=7, own=own)
    mine = Finding("plate_translation", "2", (SEQUENCE,), *said)
    first, second = candidates_of(rows_of((shared, mine), (SEQUENCE,)))
    assert first.persons == 7 and vars(first.own) == vars(own)
    assert second.persons == 0 and second.own is None and not second.which_size()


def test_errors_by_other_parameters_stand_beside(record):
    assert {one.name: size for one, size in measured_of(record, "RM").items()}[COP] > 0
    everywhere = replace(record, choice=record.choice.query("movement == 'all'"))  # OM
    for used in (everywhere, record):  # OM, which has to wait
        scales = next(block for block in front(used) if hasattr(block, "scales")).scales
        assert [other is not None for *_, other in scales] == [True, True, False]
    table = replace(record, choice=record.choice.assign(use="RM"))
    scales = next(block for block in front(table) if hasattr(block, "scales")).scales
    assert all(other is None for *_, other in scales)
    assert np.isfinite({one.name: size for one, size in measured_of(record).items()}[MARKERS])
