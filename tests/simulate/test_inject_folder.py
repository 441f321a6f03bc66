"""Which files of a study `bsip inject` changes, copies and leaves out; none is really changed."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from bsip_cli.errors import UsageError
from bsip_cli.simulate import study as injection
from bsip_cli.simulate.study import inject_command, simulate_command

ASKED = {"effects": ["plate_zero"], "sizes": [12.0], "targets": [], "effect_tasks": []}
RECORDINGS = (
    "sub-01/sub-01_task-static.C3D",
    "sub-01/ses-2/sub-01_ses-2_task-walk_run-1.c3d",
    "sub-02/sub-02_task-walk.trc",
)
OTHERS = (
    "participants.tsv",
    "README",
    "sub-02/sub-02_task-walk_grf.sto",
    "sub-02/sub-01_task-walk.c3d",
    "derivatives/x/sub-01/sub-01_task-walk.c3d",
)


@pytest.fixture
def study(tmp_path) -> Path:
    root = tmp_path / "study"
    for name in (*RECORDINGS, *OTHERS):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(f"content of {name}")
    return root


@pytest.fixture
def changed(monkeypatch) -> list[str]:
    """The recordings that an effect is put into; their copies only say so."""
    names = []

    def inject(source, copy, effects):
        names.append(source.name)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text("changed")
        return {"effects": [effect.name for effect in effects]}

    monkeypatch.setattr(injection, "inject_recording", inject)
    return names


def files_in(root: Path) -> dict[str, str]:
    paths = (path for path in root.rglob("*") if path.is_file() and "truth" not in path.parts)
    return {path.relative_to(root).as_posix(): path.read_text() for path in paths}


def test_names_are_kept_and_sessions_take_part(study, changed, tmp_path):
    assert inject_command(study, tmp_path / "out", [], 1, **ASKED) == 0
    copied = files_in(tmp_path / "out")
    assert {name for name in copied if copied[name] == "changed"} == set(RECORDINGS)
    assert {n: c for n, c in copied.items() if c != "changed"} == {
        name: f"content of {name}" for name in OTHERS
    }
    truth = json.loads((tmp_path / "out" / "truth" / "sub-01_injected.json").read_text())
    assert list(truth["trials"]) == ["sub-01_ses-2_task-walk_run-1", "sub-01_task-static"]


def test_one_recording_tells_sizes_too(study, changed, tmp_path):
    source = study / "sub-01" / "sub-01_task-static.C3D"
    assert inject_command(source, tmp_path / "copy.c3d", [], 1, **ASKED) == 0
    truth = json.loads((tmp_path / "copy_injected.json").read_text())
    assert [one["size"] for one in truth["effects"]] == ASKED["sizes"]


def test_tasks_are_told_in_sessions_too(study, changed, tmp_path):
    asked = {**ASKED, "effect_tasks": ["walk"]}
    assert inject_command(study, tmp_path / "out", ["sub-01"], 1, **asked) == 0
    assert changed == ["sub-01_ses-2_task-walk_run-1.c3d"]


def test_what_cannot_be_copied_is_said(study, changed, tmp_path, capsys):
    folder = study / "sub-01"
    os.mkfifo(folder / "sub-01_task-pipe.c3d")
    (folder / "sub-01_task-lost.c3d").symlink_to("nowhere")
    (folder / "ses-2" / "up").symlink_to("..")
    assert inject_command(study, tmp_path / "out", [], 1, **ASKED) == 3
    said = capsys.readouterr().err
    assert "sub-01_task-pipe.c3d: is a FIFO" in said
    assert "sub-01_task-lost.c3d: is a broken symbolic link to nowhere" in said
    assert "ses-2/up: leads in a circle" in said
    assert set(files_in(tmp_path / "out")) == {*RECORDINGS, *OTHERS}


def test_links_are_copied_as_what_they_lead_to(study, changed, tmp_path):
    """As in a DataLad clone, whose store is hidden and stays behind."""
    store = study / ".git" / "annex" / "objects"
    store.mkdir(parents=True)
    (study / "sub-01" / "sub-01_task-static.C3D").rename(store / "one")
    (study / "sub-01" / "sub-01_task-static.C3D").symlink_to("../.git/annex/objects/one")
    (study / "sub-02").rename(tmp_path / "anna")
    (study / "sub-02").symlink_to(tmp_path / "anna")
    assert inject_command(study, tmp_path / "out", ["sub-02"], 1, **ASKED) == 0
    copied = files_in(tmp_path / "out")
    assert set(copied) == {*RECORDINGS, *OTHERS}
    assert copied[RECORDINGS[0]] == f"content of {RECORDINGS[0]}"
    assert changed == ["sub-02_task-walk.trc"]
    assert not (tmp_path / "out" / "sub-02").is_symlink()


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ("study", "lies in what is to be copied"),
        ("study/derivatives/copy", "lies in what is to be copied"),
        ("link/copy", "lies in what is to be copied"),
        (".", "the folder is not empty"),
        ("study/README/..", "lies in what is to be copied"),
        ("a file", "is a file"),
        ("fifo", "is a FIFO"),
        ("broken", "is a broken symbolic link"),
        ("a file/out", r"cannot be made \(Not a directory\)"),
    ],
)
def test_places_that_no_copy_can_have(study, changed, tmp_path, place, said):
    (tmp_path / "link").symlink_to(study)
    (tmp_path / "a file").write_text("mine")
    (tmp_path / "broken").symlink_to("nowhere")
    os.mkfifo(tmp_path / "fifo")
    before = files_in(tmp_path)
    with pytest.raises(UsageError, match=said):
        inject_command(study, tmp_path / place, [], 1, **ASKED)
    assert files_in(tmp_path) == before


@pytest.mark.parametrize("place", ["a file", "fifo", "broken", "full"])
def test_places_that_no_simulated_study_can_have(tmp_path, place):
    (tmp_path / "a file").write_text("mine")
    (tmp_path / "broken").symlink_to("nowhere")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").write_text("mine")
    os.mkfifo(tmp_path / "fifo")
    with pytest.raises(UsageError):
        simulate_command(tmp_path / place, "sample", 1, 1, None)
    assert files_in(tmp_path) == {"a file": "mine", "full/file": "mine"}
