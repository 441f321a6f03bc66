"""Sessions as in BIDS: ``sub-01/ses-2/sub-01_ses-2_task-walking_run-1.c3d``."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from bsip_cli.config import load_config
from bsip_cli.pipeline import STAGES
from bsip_cli.report.words import labelled, task_of, trial_label
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import SCHEMAS
from bsip_cli.simulate.study import simulate_study
from bsip_cli.study.study import Trial, load_study
from tests.small_study import Run, small

ROLES = {"static": ("static",), "sequence": ("sequence",)}


def put(root: Path, *names: str) -> None:
    for name in names:
        path = root / "sub-01" / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"")


def trials_of(root: Path) -> tuple[list[Trial], list[str]]:
    study, refusals = load_study(root, ROLES, ["sub-01"])
    return list(study.participants[0].trials), [str(refusal) for refusal in refusals]


def test_trials_know_their_session(empty_study):
    first, second = "ses-2/sub-01_ses-2_task-sequence_run-1", "ses-pre/sub-01_ses-pre_task-w"
    put(empty_study, f"{first}.c3d", f"{second}.trc", f"{second}_grf.mot")
    trials, refusals = trials_of(empty_study)
    assert refusals == []
    assert [(t.session, t.task, t.run, t.role) for t in trials] == [
        ("2", "sequence", 1, "sequence"),
        ("pre", "w", None, "validation"),
        (None, "static", None, "static"),
    ]
    assert trials[1].files[1].name == "sub-01_ses-pre_task-w_grf.mot"


def test_artifacts_of_all_sessions_lie_with_their_participant(empty_study):
    put(empty_study, "ses-2/sub-01_ses-2_task-walking_run-1.c3d")
    study, _ = load_study(empty_study, ROLES)
    person = study.participants[0]
    unit = Unit(STAGES[0], study, Path("out"), load_config([]), person, person.trials[0])
    name = "sub-01_ses-2_task-walking_run-1"
    assert unit.path("markers") == Path("out/sub-01") / f"{name}_markers.parquet"
    assert list(unit.inputs()) == [f"{name}.c3d"]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "ses-2/sub-01_task-walk.c3d",
            "its name says sub-01 and its folder sub-01_ses-2; expected "
            "names like sub-01_ses-2_task-",
        ),
        ("ses-2/sub-01_ses-3_task-walk.c3d", "says sub-01_ses-3 and its folder sub-01_ses-2"),
        ("ses-2/sub-02_ses-2_task-walk.c3d", "says sub-02_ses-2 and its folder sub-01_ses-2"),
        ("ses-2/sub-01_ses-_task-walk.c3d", "its name does not say what it is"),
        ("ses-2/sub-01_ses-2_task-walk.mot", "forces without markers"),
    ],
)
def test_what_cannot_be_used_in_a_session(empty_study, name, said):
    put(empty_study, name)
    trials, (refusal,) = trials_of(empty_study)
    assert [trial.task for trial in trials] == ["static"]
    assert refusal.startswith(str(empty_study / "sub-01" / name))
    assert said in refusal


def test_a_participant_who_has_sessions_only(empty_study):
    (empty_study / "sub-01" / "sub-01_task-static.c3d").unlink()
    put(empty_study, "ses-1/sub-01_ses-1_task-walk.c3d", "ses-2/sub-01_ses-2_task-walk.c3d")
    trials, refusals = trials_of(empty_study)
    assert ([trial.session for trial in trials], refusals) == (["1", "2"], [])


def test_labels_tell_sessions_apart():
    stem = "sub-01_ses-pre_task-walk_run-2"
    assert trial_label(stem) == "walk (session pre, run 2)"
    assert trial_label("sub-01_ses-2_task-walk") == "walk (session 2)"
    assert task_of(stem) == "walk"
    assert labelled(f"in {stem} and sub-1_task-hop") == "in walk (session pre, run 2) and hop"


# --- the same numbers -----------------------------------------------------------------------------


RENAMED = {
    "sub-01_task-sequence_run-1": "sub-01_ses-1_task-sequence_run-1",
    "sub-01_task-static": "sub-01_ses-2_task-static",
}


def performed(run: Run) -> list[Trial]:
    """Ingest and scale; the trials."""
    _, refusals = load_study(run.study, run.config().roles.model_dump())
    assert refusals == []
    trials = run.unit("ingest").study.participants[0].trials
    for stage in STAGES[:3]:
        for stem in [trial.stem for trial in trials] if stage.level == "trial" else [""]:
            outcome = run.perform(stage.name, stem)
            assert outcome.state == "done", outcome
    return list(trials)


@pytest.mark.long
def test_sessions_change_no_number(tmp_path):
    """One body and one skeleton, whichever sessions the recordings are of."""
    root, flat = tmp_path / "study", Run(tmp_path / "study", tmp_path / "flat")
    simulate_study(root, small(static=1.0, sequence=4.0))
    performed(flat)
    for stem, new in RENAMED.items():
        folder = root / "sub-01" / new.split("_")[1]
        folder.mkdir()
        (root / "sub-01" / f"{stem}.c3d").rename(folder / f"{new}.c3d")
    sessions = Run(root, tmp_path / "sessions")
    assert {trial.stem for trial in performed(sessions)} == set(RENAMED.values())
    paths = sorted((flat.out / "sub-01").glob("*.parquet"))
    assert len(paths) == sum(len(s.writes) * (2 if s.level == "trial" else 1) for s in STAGES[:3])
    kinds = {schema.file_name: kind for kind, schema in SCHEMAS.items()}
    for path in paths:
        kind = kinds[path.stem.rpartition("_")[2]]
        stem = path.stem.removesuffix(f"_{SCHEMAS[kind].file_name}")
        other = sessions.read(kind, RENAMED.get(stem, stem))
        if kind == "readings":  # a row for each session
            assert set(other["session"]) == {"1", "2"}
            continue
        expected = flat.read(kind, stem).replace(RENAMED)
        pd.testing.assert_frame_equal(expected, other, check_exact=True)
