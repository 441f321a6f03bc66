"""What is not there gives a sentence, not a crash and not an empty picture."""

from dataclasses import replace

import numpy as np

from bsip_cli.report.blocks import Scales, render
from bsip_cli.report.participant import participant_document
from bsip_cli.report.records import ParticipantRecord, Refusal
from bsip_cli.running.freshness import why_stale
from tests.report.fake_study import EVIL, Artifacts, gains, pictures_of, words_of


def with_trials(record: ParticipantRecord, **tables) -> ParticipantRecord:
    return replace(record, trials=tuple(replace(trial, **tables) for trial in record.trials))


def text_of(record: ParticipantRecord) -> str:
    return words_of(render(participant_document(record)))


def test_no_held_out_data(record):
    trials = tuple(trial for trial in record.trials if trial.role != "validation")
    text = text_of(replace(record, trials=trials))
    assert "No data were held out" in text


def test_no_identified_parameters(record):
    bsip = record.bsip[record.bsip["method"] == "RM"]
    trials = tuple(
        replace(
            t,
            fit=t.fit[t.fit["method"] == "RM"],
            reconstruction=t.reconstruction[t.reconstruction["method"].isin(["measured", "RM"])],
        )
        for t in record.trials
    )
    text = text_of(replace(record, bsip=bsip, trials=trials))
    assert "There are no parameters of OM" in text
    assert "No recording could be compared with both methods" in text


def test_no_trial_served(record):
    names = "quality kinematics residuals reconstruction fit joint_moments joint_peaks"
    gone = dict.fromkeys(names.split())
    document = participant_document(with_trials(record, **gone))
    text = words_of(render(document))
    assert "No recording has forces that could be compared." in text
    assert "No marker residuals are known." in text
    assert "bsip joints" in text
    assert [p.name for p in pictures_of(document)] == ["error_budget", "masses"]


def test_nothing_on_the_plates(record):
    trials = []
    for trial in record.trials:
        frame = trial.reconstruction.copy()
        frame[["cop_ap_m", "cop_ml_m"]] = np.nan
        frame["valid"] = False
        fit = trial.fit.copy()
        fit[["rmse", "rmse_percent_bw", "pearson_r", "schwer_m", "schwer_p", "schwer_c"]] = np.nan
        trials.append(replace(trial, reconstruction=frame, fit=fit))
    document = participant_document(replace(record, trials=tuple(trials)))
    assert "No recording has forces that could be compared." in words_of(render(document))
    assert "forces" not in [p.name for p in pictures_of(document)]
    (scales,) = (block.scales for block in document.front if isinstance(block, Scales))
    assert [one.words(size) for one, size, _ in scales[:2]] == ["not known", "not known"]


def test_empty_tables(record):
    names = ["excitation", "identification", "diagnosis", "detection", "budget", "choice"]
    changed = replace(record, gains=gains()[:0], **{x: getattr(record, x)[:0] for x in names})
    names = ("quality", "residuals", "fit", "reconstruction", "marker_events")
    trials = []
    for trial in record.trials:
        moments = () if trial.joint_moments is None else ("joint_moments", "joint_peaks")
        bare = {name: getattr(trial, name)[:0] for name in (*names, *moments)}
        trials.append(replace(trial, **bare))
    text = text_of(replace(changed, trials=tuple(trials)))
    assert "excites the parameters was not computed" in text
    assert "Inconclusive No recording has motion" in text
    assert "The limits of detection are not known." in text
    assert "nothing was compared" in text


def test_stages_that_have_not_run(record):
    without = replace(record, diagnosis=None, detection=None, gains=None)
    text = text_of(with_trials(without))
    assert text.count("run `bsip diagnose`") == 2  # on the first page and below


def test_frames_without_a_pose(record):
    trials = tuple(
        replace(t, kinematics=t.kinematics.assign(determined=False, marker_rms_m=np.nan))
        for t in record.trials
    )
    document = participant_document(replace(record, trials=trials))
    assert "person" not in [p.name for p in pictures_of(document)]


def test_unknown_shares_spreads_and_masses(record):
    bsip = record.bsip.copy()
    bsip[[c for c in bsip.columns if c.endswith(("_sd", "_share"))]] = np.nan
    bsip.loc[bsip["method"] == "OM", "mass_kg"] *= -1.0  # a bare least-squares fit may do this
    facts = record.facts.copy()
    facts["plate_mass_kg"] = facts["height_m"] = np.nan
    document = participant_document(replace(record, bsip=bsip, facts=facts))
    text = words_of(render(document))
    assert "plates:" not in text
    assert all(picture.svg for picture in pictures_of(document) if picture.name == "masses")


def test_refusals_lead_the_warnings(record):
    refusal = Refusal("walking (run 1)", "ingest", f"no force plates in {EVIL}")
    text = text_of(replace(record, refusals=(refusal,)))
    assert text.count("no force plates") == 2  # on the first page and below


def test_a_report_comes_without_a_diagnosis_and_anew_with_one(reports, tmp_path):
    """What a stage reads where it is there is not missed, and counts once it is."""
    person = reports.study.participants[0]
    made = Artifacts(tmp_path, person).write_all()
    diagnosis = made.path("overall-diagnosis")
    later = diagnosis.rename(tmp_path / "later.parquet")
    own = replace(reports, out=tmp_path)
    own.run("report", person)
    assert "bsip diagnose" in own.html("sub-01")
    assert not why_stale(own.unit("report", person))
    later.rename(diagnosis)
    assert why_stale(own.unit("report", person))
    own.run("report", person)
    assert "Plate 1 is turned" in own.html("sub-01")
