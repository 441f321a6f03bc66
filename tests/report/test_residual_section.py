"""Section 2's residual: the recording that gains most, before and after, by phase."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bsip_cli.report.blocks import Grid, Picture
from bsip_cli.report.page import render
from bsip_cli.report.participant import residual
from bsip_cli.report.participant.diagnosis import verdict
from bsip_cli.report.participant.document import participant_document
from bsip_cli.report.records import ParticipantRecord, TrialRecord
from bsip_cli.report.words import EXTENDED
from bsip_cli.stages.report import record_of
from tests.report.fake_study import EVIL, marker_events

SIGNALS = ["fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm", "cop_ap_m", "cop_ml_m"]


@pytest.fixture(scope="module")
def record(reports) -> ParticipantRecord:
    return record_of(reports.unit("report", reports.study.participants[0]))


def extended(trial: TrialRecord, left: float) -> TrialRecord:
    """With causes in the model that leave the part ``left`` of OM's residual."""
    frame = trial.reconstruction
    rows = {m: frame[frame["method"] == m].reset_index(drop=True) for m in ("measured", "OM")}
    after = rows["OM"].assign(method=EXTENDED)
    after[SIGNALS] = rows["measured"][SIGNALS] * (1 - left) + rows["OM"][SIGNALS] * left
    return replace(trial, reconstruction=pd.concat([frame, after], ignore_index=True))


def with_causes(record: ParticipantRecord, **left: float) -> ParticipantRecord:
    trials = tuple(extended(t, left[t.task]) if t.task in left else t for t in record.trials)
    return replace(record, trials=trials)


def parts(record: ParticipantRecord) -> tuple[Picture, Picture, Grid]:
    _, curves, _, phases, grid = residual.blocks(record)
    return curves, phases, grid


def test_the_recording_that_gains_most_is_shown(record):
    for gaining, other in (("sequence", "basketball"), ("basketball", "sequence")):
        curves, *_ = parts(with_causes(record, **{gaining: 0.1, other: 0.9}))
        assert curves.caption.startswith(f"{gaining} (run 1): measured less simulated before and")


def test_without_causes_there_is_only_a_before(record):
    curves, _, grid = parts(record)
    assert "measured less simulated with OM, over time" in curves.caption
    assert all("→" not in cell.text for row in grid.cells() for cell in row)


def test_errors_before_and_after_stand_in_every_phase(record):
    _, picture, grid = parts(with_causes(record, sequence=0.5, basketball=0.5))
    assert picture.name == "residual_phases"
    assert grid.head[:2] == ("component", "unit")
    assert {"body going down", "body going up"} < set(grid.head)
    for row in grid.cells():
        for cell in row[2:]:
            before, after = (float(x) for x in cell.text.split(" → "))
            assert after == pytest.approx(before / 2, abs=0.011)


def test_a_motion_that_is_not_known_has_no_phase(record):
    trials = tuple(replace(trial, kinematics=None) for trial in record.trials)
    *_, said = residual.blocks(replace(record, trials=trials))
    assert said.text == "The phases of the movement are not known."


def test_labels_put_right_are_told_on_the_first_screen_and_escaped(record):
    events = marker_events().assign(put_right=True, sentence=f"{EVIL} and B bear labels; corrected")
    told = replace(record, trials=(replace(record.trials[1], marker_events=events),))
    (said,) = [b.text for b in verdict(told) if "Corrected" in getattr(b, "text", "")]
    assert f"in sequence (run 1) {EVIL} and B bear labels." in said
    assert EVIL not in render(participant_document(told))


def test_figures_do_not_change_the_numbers(record):
    curves, *_ = parts(with_causes(record, sequence=0.5))
    frame = with_causes(record, sequence=0.5).trials[1].reconstruction
    residuals = residual.residuals_of(frame, "fx")
    ratio = residuals[EXTENDED] / residuals["OM"]
    np.testing.assert_allclose(ratio[np.isfinite(ratio)], 0.5, rtol=1e-6)
    assert curves.svg.startswith(b"<?xml")
