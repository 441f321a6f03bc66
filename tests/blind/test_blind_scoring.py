"""Answers that a fake diagnosis writes get the verdicts they deserve."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.blind.blind_cases import SESSION, Case, Hidden
from tests.blind.blind_running import Recorded
from tests.blind.blind_scoring import (
    MISSED,
    PUT_RIGHT,
    RIGHT_CLASS,
    RIGHT_NAME,
    SILENT,
    UNEXPLAINED,
    WRONG_CLASS,
    WRONG_NAME,
    Score,
    score,
    score_of_clean_trial,
)
from tests.blind.blind_tables import (
    accuracy,
    document,
    elsewhere,
    estimates_frame,
    false_positives,
    pairs,
    tables,
)

COLUMNS = (
    *("rank", "effect", "target", "parameter", "estimate", "unit", "ci_low", "ci_high", "p_value"),
    *("gain_percent", "gain_ci_low", "gain_ci_high", "verdict", "class_id", "sentence"),
    "trials",
)
SQUAT, HOPS = "sub-01_task-squat_run-2", "sub-01_task-hops_run-1"
TRIAL = {"recorded_from_s": 0.0, "duration_s": 10.0}
GAIN = {"effect": "plate_gain", "size": 0.04, "unit": "1", "channel": "fz", "plate": 0}
DELAY = {"effect": "sync_offset", "size": 0.01, "unit": "s"}
SHIFT = {"effect": "plate_translation", "size": 0.02, "unit": "m", "plate": 0}
SHIFT["shift_m"] = [0.02, 0, 0]
TETHER = {"effect": "outside_elastic_tether", "size": 100.0, "unit": "N/m"}


def row(effect: str, verdict: str = "named", **fields) -> dict:
    texts = dict.fromkeys(("target", "parameter", "unit", "class_id", "sentence", "trials"), "")
    numbers = dict.fromkeys(COLUMNS, np.nan)
    return {**numbers, **texts, "rank": 1, "effect": effect, "verdict": verdict, **fields}


def diagnosis(folder: Path, stem: str, *rows: dict, causes: Sequence[dict] = ()) -> None:
    place = folder / "sub-01"
    place.mkdir(parents=True, exist_ok=True)
    table = pa.Table.from_pandas(pd.DataFrame(list(rows))[list(COLUMNS)])
    header = json.dumps({"provenance": {"facts": {"causes": list(causes)}}})
    written = table.replace_schema_metadata({**table.schema.metadata, "bsip": header})
    pq.write_table(written, place / f"{stem}_diagnosis.parquet")


def hidden(*records: dict, place: str = "squat", stems: tuple[str, ...] = (SQUAT,)) -> Recorded:
    kind = {0: "null", 1: "single", 2: "double"}[len(records)]
    if any(record["effect"].startswith("outside") for record in records):
        kind = "outside"
    given = tuple(Hidden(record["effect"], record["size"]) for record in records)
    case = Case("case-01", kind, place, given)
    truth = {"effects": list(records), "trials": dict.fromkeys(stems, TRIAL)}
    return Recorded(case, "session-001", "sub-01", stems, truth)


def told(out: Path, *records: dict, **where) -> Score:
    """The one score of what is hidden."""
    return only(score(out, hidden(*records, **where)))


def only(scores: list[Score]) -> Score:
    assert len(scores) == 1
    return scores[0]


def sized(parameter: str, unit: str, estimate: float, low: float, high: float) -> dict:
    numbers = {"estimate": estimate, "ci_low": low, "ci_high": high}
    return {"parameter": parameter, "unit": unit, **numbers}


def test_a_named_effect_at_its_place_is_right(tmp_path):
    size = sized("gain", "1", 0.045, 0.03, 0.05)
    right = row("plate_gain", target="1 fz", gain_percent=40.0, **size)
    rejected = row("sync_offset", "rejected", rank=2, parameter="delay", estimate=0.5)
    diagnosis(tmp_path, SQUAT, right, rejected)
    found = told(tmp_path, GAIN)
    assert (found.verdict, found.says, found.target_right) == (RIGHT_NAME, "plate_gain", True)
    assert not found.wrong and found.gain_percent == 40.0
    estimate = found.estimates[0]
    assert (estimate.parameter, estimate.truth, estimate.estimate) == ("gain", 0.04, 0.045)
    assert (estimate.ci_low, estimate.ci_high) == (0.03, 0.05)


def test_a_named_effect_elsewhere_has_the_wrong_target_and_no_estimate(tmp_path):
    diagnosis(tmp_path, SQUAT, row("plate_gain", target="1 fx", parameter="gain", estimate=0.04))
    found = told(tmp_path, GAIN)
    assert (found.verdict, found.target_right, found.targets) == (RIGHT_NAME, False, ["1 fx"])
    assert not found.estimates and found.gain_percent is None
    table = elsewhere(pd.DataFrame([found]))
    assert table.iloc[0].tolist() == ["plate_gain", "1 fz", "1 fx"]


def test_a_class_with_the_effect_is_right_and_one_without_is_wrong(tmp_path):
    members = [
        row("gravity_tilt", "ambiguous", class_id="A"),
        row("sync_offset", "ambiguous", class_id="A", parameter="delay", estimate=0.011),
    ]
    diagnosis(tmp_path, SQUAT, *members)
    found = told(tmp_path, DELAY)
    assert (found.verdict, found.target_right) == (RIGHT_CLASS, True)
    assert found.estimates[0].estimate == 0.011 and np.isnan(found.estimates[0].ci_low)
    missed = told(tmp_path, SHIFT)
    assert (missed.verdict, missed.says) == (WRONG_CLASS, "gravity_tilt or sync_offset")


@pytest.mark.parametrize(
    ("said", "verdict"),
    [("none", MISSED), ("unexplained", UNEXPLAINED), ("breathing", WRONG_NAME)],
)
def test_what_else_may_be_said_of_an_effect(tmp_path, said, verdict):
    diagnosis(tmp_path, SQUAT, row(said), row("sync_offset", "rejected", rank=2))
    found = told(tmp_path, DELAY)
    assert (found.verdict, found.says, found.target_right) == (verdict, said, None)
    assert bool(found.wrong) == (verdict == WRONG_NAME)


def test_without_an_artifact_there_is_no_answer(tmp_path):
    assert told(tmp_path, DELAY).verdict == SILENT
    assert told(tmp_path, place=SESSION).verdict == SILENT


def test_a_wrong_name_beside_the_right_one_is_kept(tmp_path):
    diagnosis(tmp_path, SQUAT, row("sync_offset"), row("breathing", rank=2))
    found = told(tmp_path, DELAY)
    assert found.verdict == RIGHT_NAME and found.wrong == ["breathing (task-squat_run-2)"]


def test_a_twin_counts_where_nothing_tells_it_apart(tmp_path):
    diagnosis(tmp_path, SQUAT, row("plate_zero", target="1 fz"))
    found = told(tmp_path, GAIN)
    assert (found.verdict, found.says, found.wrong) == (RIGHT_CLASS, "plate_zero", [])
    diagnosis(tmp_path, HOPS, row("plate_zero", target="1 fz"))
    hops = told(tmp_path, GAIN, place="hops", stems=(HOPS,))
    assert (hops.verdict, hops.wrong) == (WRONG_NAME, ["plate_zero (task-hops_run-1)"])


def test_a_twin_is_none_where_another_recording_of_the_session_tells_it_apart(tmp_path):
    whole = hidden(GAIN, place=SESSION, stems=(SQUAT, HOPS))
    diagnosis(tmp_path, SQUAT, row("none"))
    diagnosis(tmp_path, "sub-01", row("plate_zero", target="1 fz"))
    assert only(score(tmp_path, whole)).verdict == WRONG_NAME
    diagnosis(tmp_path, "sub-01", row("none"))
    diagnosis(tmp_path, SQUAT, row("plate_zero", target="1 fz"))
    assert only(score(tmp_path, whole)).verdict == RIGHT_CLASS


def test_a_session_is_found_by_the_person_or_by_any_trial(tmp_path):
    whole = hidden(DELAY, place=SESSION, stems=(SQUAT, HOPS))
    diagnosis(tmp_path, "sub-01", row("none"))
    diagnosis(tmp_path, SQUAT, row("none"))
    diagnosis(tmp_path, HOPS, row("sync_offset", parameter="delay", estimate=0.012))
    found = only(score(tmp_path, whole))
    assert found.verdict == RIGHT_NAME and found.estimates[0].estimate == 0.012
    diagnosis(tmp_path, "sub-01", row("sync_offset", parameter="delay", estimate=0.0101))
    assert only(score(tmp_path, whole)).estimates[0].estimate == 0.0101


def test_what_hangs_on_the_movement_is_that_of_the_longest_recording_told_of(tmp_path):
    """The second bend is hidden in both trials and found in the shorter one only."""
    bend = {"effect": "missing_joint", "size": 0.5, "unit": "rad"}
    whole = hidden(bend, place=SESSION, stems=(SQUAT, HOPS))
    for stem, seconds, bent in ((SQUAT, 10.0, 0.5), (HOPS, 5.0, 0.2)):
        whole.truth["trials"][stem] = {"duration_s": seconds, "missing_joint_range_rad": bent}
    said = {"target": "upper_torso", "parameter": "flexion", "estimate": 0.3}
    for stems, truth in ((HOPS, 0.2), (f"{HOPS}, {SQUAT}", 0.5)):
        diagnosis(tmp_path, "sub-01", row("missing_joint", **said, trials=stems))
        assert only(score(tmp_path, whole)).estimates[0].truth == truth


def test_errors_are_told_in_units_of_the_bound_of_their_recording(tmp_path):
    """That of the cause as kept, which stands with the person."""
    causes = [
        {"effect": name, "target": "", "trials": [SQUAT], "bounds": {"delay": bound}}
        for name, bound in (("clock_drift", 1.0), ("sync_offset", 0.0005))
    ]
    diagnosis(tmp_path, "sub-01", row("none"), causes=causes)
    diagnosis(tmp_path, SQUAT, row("sync_offset", parameter="delay", estimate=0.0101))
    found = told(tmp_path, DELAY)
    assert found.estimates[0].bound == 0.0005
    table = accuracy(estimates_frame(pd.DataFrame([found])))
    assert table["errors / bound"][0] == pytest.approx(0.2 / 0.6745, rel=1e-3)
    diagnosis(tmp_path, "sub-01", row("none"), causes=causes[:1])
    assert told(tmp_path, DELAY).estimates[0].bound is None


def test_the_person_has_no_say_about_an_effect_of_one_trial(tmp_path):
    diagnosis(tmp_path, "sub-01", row("sync_offset"))
    diagnosis(tmp_path, SQUAT, row("none"))
    assert told(tmp_path, DELAY).verdict == MISSED


def test_each_of_two_effects_has_its_own_verdict(tmp_path):
    diagnosis(tmp_path, SQUAT, row("sync_offset"))
    found, missed = score(tmp_path, hidden(DELAY, SHIFT))
    assert (found.verdict, missed.verdict, missed.wrong) == (RIGHT_NAME, MISSED, [])
    table = pairs(pd.DataFrame([found, missed]))
    assert table.iloc[0].tolist() == [1, 0, 1, 0, 0]


def test_outside_the_catalogue_a_name_is_wrong_whatever_stands_beside(tmp_path):
    tether = hidden(TETHER)
    diagnosis(tmp_path, SQUAT, row("unexplained"))
    right = only(score(tmp_path, tether))
    assert (right.verdict, right.says, right.target_right) == (RIGHT_NAME, UNEXPLAINED, None)
    diagnosis(tmp_path, SQUAT, row("unexplained"), row("added_mass", rank=2))
    wrong = only(score(tmp_path, tether))
    assert (wrong.verdict, wrong.says) == (WRONG_NAME, "added_mass")
    diagnosis(tmp_path, SQUAT, row("none"))
    assert only(score(tmp_path, tether)).verdict == MISSED


@pytest.mark.parametrize(
    ("rows", "verdict", "says"),
    [
        ([row("none")], RIGHT_NAME, "none"),
        ([row("none"), row("breathing", "rejected")], RIGHT_NAME, "none"),
        ([row("unexplained")], UNEXPLAINED, "unexplained"),
        ([row("breathing")], WRONG_NAME, "breathing"),
        ([row("breathing", "ambiguous", class_id="1")], WRONG_CLASS, "breathing"),
    ],
)
def test_a_null_is_quiet_or_has_a_false_positive(tmp_path, rows, verdict, says):
    diagnosis(tmp_path, "sub-01", row("none"))
    diagnosis(tmp_path, SQUAT, *rows)
    null = told(tmp_path, place=SESSION)
    clean = score_of_clean_trial(tmp_path, "sub-01", "session-001", SQUAT)
    assert (null.verdict, null.says) == (clean.verdict, clean.says) == (verdict, says)
    assert bool(null.wrong) == (verdict != RIGHT_NAME)
    found = false_positives(pd.DataFrame([null, clean]))
    assert found["false positives"].tolist() == [int(verdict != RIGHT_NAME)] * 2


def test_a_shift_of_a_marker_is_compared_by_its_length(tmp_path):
    slip = {"effect": "marker_shift", "size": 0.03, "unit": "m", "marker": "C7"}
    slipped = {**slip, "from_share": 0.4, "from_s": None}
    shift = row("marker_shift", target="C7", parameter="shift", estimate=0.028, unit="m")
    moment = row("marker_shift", target="C7", **sized("from_time", "s", 4.1, 3.9, 4.2))
    diagnosis(tmp_path, SQUAT, shift, moment)
    frame = estimates_frame(pd.DataFrame([told(tmp_path, slipped)]))
    assert frame["parameter"].tolist() == ["shift", "from_time"]
    np.testing.assert_allclose(frame["estimate"], [0.028, 4.1])
    np.testing.assert_allclose(frame["truth"], [0.03, 4.0])


def test_labels_that_were_put_right_before_are_noted(tmp_path):
    swap = {"effect": "marker_swap", "size": 1.0, "unit": "s", "first": "A", "second": "B"}
    swapped = hidden({**swap, "start_share": 0.5, "start_s": None})
    diagnosis(tmp_path, SQUAT, row("none"))
    assert only(score(tmp_path, swapped)).verdict == MISSED
    event = {"kind": "swap", "marker": "B", "partner": "A", "put_right": True}
    pd.DataFrame([event]).to_parquet(tmp_path / "sub-01" / f"{SQUAT}_marker-events.parquet")
    assert only(score(tmp_path, swapped)).verdict == PUT_RIGHT
    diagnosis(tmp_path, SQUAT, row("marker_swap", target="B+A"))
    assert only(score(tmp_path, swapped)).verdict == RIGHT_NAME


def test_repeated_frames_that_are_gaps_are_noted(tmp_path):
    repeated = {"effect": "outside_repeated_frames", "size": 0.2, "unit": "1"}
    diagnosis(tmp_path, SQUAT, row("none"))
    lines = pd.DataFrame({"check": ["markers", "repeated_frames"]})
    lines[:1].to_parquet(tmp_path / "sub-01" / f"{SQUAT}_quality.parquet")
    assert told(tmp_path, repeated).verdict == MISSED
    lines.to_parquet(tmp_path / "sub-01" / f"{SQUAT}_quality.parquet")
    assert told(tmp_path, repeated).verdict == PUT_RIGHT


def test_the_gain_artifact_beside_the_answer_is_averaged(tmp_path):
    diagnosis(tmp_path, SQUAT, row("sync_offset", gain_percent=30.0))
    gains = pd.DataFrame({"component": ["fx", "fz"], "gain_percent": [10.0, 30.0]})
    gains.to_parquet(tmp_path / "sub-01" / f"{SQUAT}_gain.parquet")
    found = told(tmp_path, DELAY)
    assert (found.gain_percent, found.held_out_gain_percent) == (30.0, 20.0)


def test_all_tables_of_a_mixed_bag(tmp_path):
    size = sized("delay", "s", 0.012, 0.011, 0.013)
    diagnosis(tmp_path, SQUAT, row("sync_offset", gain_percent=12.0, **size))
    cases = [hidden(DELAY), hidden(SHIFT), hidden(), hidden(TETHER), hidden(DELAY, SHIFT)]
    scores = [
        replace(one, case=f"case-{k}") for k, c in enumerate(cases) for one in score(tmp_path, c)
    ]
    frame = pd.DataFrame(scores)
    text, found = document(frame), tables(frame)
    assert "Of 2 effects hidden alone 1 are found (0 of them as a class), 1 get a wrong" in text
    assert "0 of 2 stated 95 % intervals hold the truth (0.0%" in text
    sizes, (accurate,) = found["blind_sizes"].values.tolist(), found["blind_estimates"].values
    assert ["sync_offset", "0.01 to 0.01 s", "1 of 1", "1 of 1"] in sizes
    assert accurate[:4].tolist() == ["sync_offset", "delay", "s", 2]
    assert accurate[4:8].tolist() == pytest.approx([0.01, 0.002, 0.0, 0.002])
    assert np.isnan(accurate[8]) and accurate[9] == "0 of 2"
    assert "one trial" not in text and "100.0% (20.7% to 100.0%)" in text
    assert found["blind_outside"].loc["outside_elastic_tether"].sum() == 1
