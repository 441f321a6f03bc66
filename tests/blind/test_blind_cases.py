"""Cases are what the suite promises, and nothing about them reaches the pipeline."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from bsip_cli.effects.catalogue import EFFECTS
from tests.blind import blind_long
from tests.blind.blind_cases import (
    CATALOGUE,
    OUTSIDE,
    SESSION,
    Case,
    Hidden,
    Session,
    long_suite,
    short_suite,
)
from tests.blind.blind_long import Batch
from tests.blind.blind_running import record_study
from tests.blind.blind_scoring import RIGHT_NAME, Score, score


def cases_of(sessions: list[Session]) -> list[Case]:
    return [case for session in sessions for case in session.cases]


def test_the_long_suite_holds_enough_of_everything():
    sessions = long_suite(10, 40, 20, 2, 5)
    cases = cases_of(sessions)
    effects = Counter(case.hidden[0].effect for case in cases if case.kind == "single")
    assert effects == dict.fromkeys(EFFECTS, 10)
    kinds = Counter(case.kind for case in cases)
    assert kinds == {"single": 260, "null": 40, "double": 20, "outside": 32}  # two of each
    assert {c.hidden[0].effect for c in cases if c.kind == "outside"} == set(OUTSIDE)
    assert all(len(case.hidden) == 2 for case in cases if case.kind == "double")
    assert len({case.name for case in cases}) == len(cases)
    assert len({session.seed for session in sessions}) == len(sessions)


def test_the_short_suite_holds_one_of_everything():
    cases = cases_of(short_suite(5))
    effects = Counter(case.hidden[0].effect for case in cases if case.kind == "single")
    assert effects == dict.fromkeys(EFFECTS, 1)
    kinds = Counter(case.kind for case in cases)
    assert (kinds["null"], kinds["double"], kinds["outside"]) == (3, 2, 2)


def test_sizes_fill_their_range_and_both_signs():
    cases = [c for c in cases_of(long_suite(10, 0, 0, 0, 5)) if c.kind == "single"]
    for effect, allowed in CATALOGUE.items():
        sizes = np.array([c.hidden[0].size for c in cases if c.hidden[0].effect == effect])
        assert (len(set(np.sign(sizes))) == 2) == allowed.signed, effect
        share = (np.sort(np.abs(sizes)) - allowed.least) / (allowed.most - allowed.least)
        np.testing.assert_allclose(share, (np.arange(10) + 0.5) / 10, atol=0.051, err_msg=effect)


def test_a_session_holds_one_case_or_several_trials():
    for session in long_suite(10, 40, 20, 2, 5):
        places = {case.place for case in session.cases}
        assert SESSION not in places or len(session.cases) == 1
    assert long_suite(3, 2, 2, 1, 5) == long_suite(3, 2, 2, 1, 5) != long_suite(3, 2, 2, 1, 6)


def test_half_of_the_labs_have_a_plate_per_foot():
    sessions = long_suite(10, 40, 20, 2, 5)
    apart = [session for session in sessions if session.plate_per_foot]
    assert len(apart) == len(sessions) // 2
    faults = [
        one for case in cases_of(apart) for one in case.hidden if one.effect.startswith("plate_")
    ]
    plates = Counter(one.target.split(",")[-1] for one in faults)
    assert set(plates) == {"plate=1", "plate=2"} and min(plates.values()) >= 10
    whole = [session for session in sessions if not session.plate_per_foot]
    assert not any("plate=" in one.target for case in cases_of(whole) for one in case.hidden)


@pytest.mark.long
def test_recordings_tell_nothing_of_what_they_hide(tmp_path):
    delayed = Case("delay", "single", "squat", (Hidden("sync_offset", 0.1),))
    carried = Case("ball", "single", "squat", (Hidden("added_mass", 2.0, "hand_l"),))
    session = Session("session-001", 11, 5.0, (delayed, carried))
    recorded = record_study([session], tmp_path, 1)
    assert [one.stems for one in recorded] == [(f"sub-01_task-squat_run-{k}",) for k in (2, 3)]
    files = sorted(p for p in tmp_path.rglob("*") if p.is_file())
    assert [p.name for p in files] == [
        "participants.tsv",
        "study.toml",
        "sub-01_task-sequence_run-1.c3d",
        *(f"sub-01_task-squat_run-{k}.c3d" for k in (1, 2, 3)),
        "sub-01_task-static.c3d",
    ]
    for path in files:
        content = path.read_bytes().lower()
        assert not any(name.encode() in content for name in (*EFFECTS, *OUTSIDE)), path
    assert [one.truth["effects"][0]["effect"] for one in recorded] == ["sync_offset", "added_mass"]
    assert score(tmp_path / "out", recorded[0])[0].case == "delay"
    lengths = [one.truth["trials"][one.stems[0]]["duration_s"] for one in recorded]
    assert lengths == pytest.approx([9.9, 10.0])  # a delayed clock cuts the beginning


class FakeBatches:
    """Answers "none" to every case, and is interrupted after some batches."""

    def __init__(self, most: int) -> None:
        self.most, self.sessions = most, []

    def __call__(self, sessions, folder, stages, jobs) -> Batch:
        if len(self.sessions) == self.most:
            raise KeyboardInterrupt
        self.sessions.append(len(sessions))
        folder.mkdir(parents=True)
        scores = [
            Score(case.name, "null", case.place, "session-001", RIGHT_NAME, "none")
            for case in cases_of(sessions)
        ]
        return Batch(tuple(scores), (), (1.0, 2.0))


def test_an_interrupted_suite_goes_on_and_writes_its_tables(tmp_path, monkeypatch):
    tables, results = tmp_path / "tables", tmp_path / "results"
    arguments = ["--results", str(results), "--tables", str(tables), "--draws", "1"]
    arguments += ["--nulls", "4", "--pairs", "2", "--outside", "1"]
    monkeypatch.setattr(blind_long, "run_batch", FakeBatches(1))
    with pytest.raises(KeyboardInterrupt):
        blind_long.main(arguments)
    assert not tables.exists()
    kept = {path: path.stat().st_mtime_ns for path in results.rglob("*.json")}
    rest = FakeBatches(100)
    monkeypatch.setattr(blind_long, "run_batch", rest)
    blind_long.main(arguments)
    sessions = long_suite(1, 4, 2, 1, 2027)
    assert sum(rest.sessions) == len(sessions) - blind_long.BATCH
    after = {path: path.stat().st_mtime_ns for path in results.rglob("*.json")}
    assert kept.items() <= after.items()
    assert len(after) == 1 + len(cases_of(sessions))  # and the settings
    assert "\na whole session,48,0," in (tables / "blind_false_positives.csv").read_text()
    with pytest.raises(SystemExit, match="another --results"):
        blind_long.main([*arguments[:-1], "3"])
