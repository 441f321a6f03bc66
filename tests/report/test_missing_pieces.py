"""What is not there gives a sentence, not a crash and not an empty picture."""

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.report.blocks import Bullets, Document, Grid, Paragraph, Picture
from bsip_cli.report.participant.document import participant_document
from bsip_cli.report.records import ParticipantRecord, Refusal
from bsip_cli.running.freshness import why_stale
from bsip_cli.stages.report import record_of
from tests.report.fake_study import EVIL, Artifacts, empty, gains


@pytest.fixture(scope="module")
def record(reports) -> ParticipantRecord:
    return record_of(reports.unit("report", reports.study.participants[0]))


def with_trials(record: ParticipantRecord, **tables) -> ParticipantRecord:
    return replace(record, trials=tuple(replace(trial, **tables) for trial in record.trials))


def words_of(document: Document) -> str:
    parts = []
    for block in (block for section in document.sections for block in section.blocks):
        if isinstance(block, Paragraph):
            parts.append(block.text)
        elif isinstance(block, Bullets):
            parts += block.items
        elif isinstance(block, Picture):
            parts.append(block.caption)
        elif isinstance(block, Grid):
            parts += [cell.text for row in block.cells() for cell in row]
    return "\n".join(parts)


def test_no_held_out_data(record):
    trials = tuple(trial for trial in record.trials if trial.role != "validation")
    text = words_of(participant_document(replace(record, trials=trials)))
    assert "No data were held out" in text
    assert "no validating trial" in text


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
    text = words_of(participant_document(replace(record, bsip=bsip, trials=trials)))
    assert "There are no parameters of OM" in text
    assert "No trial could be compared with both methods" in text


def test_no_trial_served(record):
    gone = dict.fromkeys(
        ("quality", "contacts", "kinematics", "residuals", "reconstruction", "fit", "posturography")
    )
    document = participant_document(with_trials(record, **gone))
    text = words_of(document)
    assert "No trial has a centre of pressure" in text
    assert "no contacts are known" in text
    assert "The pose was not computed in static." in text
    names = [p.name for p in document.pictures()]
    assert names == [
        "error_budget",
        "diagnosis_causes",
        "diagnosis_limits",
        "diagnosis_masses",
        "masses",
        "centres_of_mass",
    ]


def test_nothing_on_the_plates(record):
    trials = []
    for trial in record.trials:
        frame = trial.reconstruction.copy()
        frame[["cop_ap_m", "cop_ml_m"]] = np.nan
        frame["valid"] = False
        fit = trial.fit.copy()
        fit[["rmse", "rmse_percent_bw", "pearson_r", "schwer_m", "schwer_p", "schwer_c"]] = np.nan
        contacts = trial.contacts.copy()
        contacts[contacts.columns[1:]] = False
        trials.append(replace(trial, reconstruction=frame, fit=fit, contacts=contacts))
    document = participant_document(replace(record, trials=tuple(trials)))
    text = words_of(document)
    assert "No trial has a centre of pressure" in text
    assert "no foot touches the ground" in text
    assert "this report cannot say" in text
    assert "the force at 0 of them" in text
    assert not any(p.name.startswith("fig3") for p in document.pictures())


def test_empty_tables(record):
    changed = replace(
        record,
        base_parameters=empty("base-parameters"),
        excitation=empty("excitation"),
        identification=empty("identification"),
        marker_positions=empty("marker-positions"),
    )
    kinds = {
        "quality": "quality",
        "residuals": "marker-residuals",
        "fit": "fit",
        "reconstruction": "reconstruction",
        "posturography": "posturography",
    }
    changed = replace(
        changed,
        diagnosis=empty("overall-diagnosis"),
        detection=empty("detection"),
        budget=empty("overall-error-budget"),
        gains=gains()[:0],
    )
    document = participant_document(with_trials(changed, **{k: empty(v) for k, v in kinds.items()}))
    text = words_of(document)
    assert "No base parameters were written." in text
    assert "The excitation was not computed." in text
    assert "Inconclusive: no recording has motion" in text
    assert "The limits of detection are not known." in text


def test_stages_that_have_not_run(record):
    without = replace(record, diagnosis=None, detection=None, gains=None)
    text = words_of(participant_document(with_trials(without)))
    assert text.count("run `bsip diagnose`") == 2  # in the summary and in section 2


def test_frames_without_a_pose(record):
    trials = tuple(
        replace(t, kinematics=t.kinematics.assign(determined=False, marker_rms_m=np.nan))
        for t in record.trials
    )
    text = words_of(participant_document(replace(record, trials=trials)))
    assert "No frame of static is determined by its markers." in text


def test_unknown_shares_spreads_and_masses(record):
    bsip = record.bsip.copy()
    bsip[[c for c in bsip.columns if c.endswith(("_sd", "_share"))]] = np.nan
    bsip.loc[bsip["method"] == "OM", "mass_kg"] *= -1.0  # a bare least-squares fit may do this
    facts = record.facts.copy()
    facts["plate_mass_kg"] = facts["height_m"] = np.nan
    document = participant_document(replace(record, bsip=bsip, facts=facts))
    text = words_of(document)
    assert "the data share is not known" in text
    assert "The plates tell no mass for sure" in text
    assert all(picture.svg for picture in document.pictures() if picture.name == "masses")


def test_refusals_lead_the_warnings(record):
    refusal = Refusal("walking (run 1)", "ingest", f"no force plates in {EVIL}")
    text = words_of(participant_document(replace(record, refusals=(refusal,))))
    assert text.count("no force plates") == 2  # in the summary and in section 8


def test_a_recording_without_left_and_right(record):
    skeleton = record.skeleton.assign(held=True, joint_type="free")
    one_side = skeleton[~skeleton["segment"].str.endswith("_l")]
    text = words_of(participant_document(replace(record, skeleton=one_side)))
    assert "has no pairs of segments" in text
    assert "held at the neutral pose" in text


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
