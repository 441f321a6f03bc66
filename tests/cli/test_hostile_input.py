"""Recordings and tables from somebody who means harm: nothing outside OUT, nothing runs, nothing
is shown as other than text."""

from __future__ import annotations

from pathlib import Path

import ezc3d
import numpy as np
import pytest

from bsip_cli.simulate.study import simulate_study
from tests.small_study import small

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]
SCRIPT = "<script>alert(1)</script>"
TRACKING = "RSCAP"
NAMES = (f"sub-{SCRIPT}", "sub-02\x1b[2J", "sub-../../../elsewhere", "/etc", "sub-04\\input{x}")
LABELS = ("\\input{secret}", "../../elsewhere", "\x1b[2Jgone", "$(touch hacked)")


def give_labels(path: Path) -> None:
    """The marker of the shoulder blade gets a hostile label, and so do copies of the first."""
    c3d = ezc3d.c3d(str(path))
    points, meta = c3d["data"]["points"], c3d["data"]["meta_points"]
    known = [SCRIPT if label == TRACKING else label for label in labels_of(c3d)]
    c3d["parameters"]["POINT"]["LABELS"]["value"] = [*known, *LABELS]
    c3d["parameters"]["POINT"]["DESCRIPTIONS"]["value"] = [*known, *LABELS]
    c3d["data"]["points"] = np.concatenate([points, points[:, : len(LABELS)]], axis=1)
    for name in ("residuals", "camera_masks"):
        meta[name] = np.concatenate([meta[name], meta[name][:, : len(LABELS)]], axis=1)
    c3d.write(str(path))


def labels_of(c3d) -> list[str]:
    return c3d["parameters"]["POINT"]["LABELS"]["value"]


def hostile_marker_set() -> str:
    """Hansen's, in which the shoulder blade's marker is called something else."""
    text = (ROOT / "configs" / "markersets" / "hansen2017.toml").read_text(encoding="utf-8")
    return text.replace(TRACKING, f'"{SCRIPT}"')


@pytest.fixture(scope="module")
def ran(tmp_path_factory, bsip):
    """Everything that bsip makes of such a study, and what lay around it before."""
    folder = tmp_path_factory.mktemp("hostile")
    study = folder / "a" / "study"
    simulate_study(study, small(static=1.0, sequence=6.0))
    for path in study.glob("sub-*/*.c3d"):
        give_labels(path)
    (study / "study.toml").write_text('marker_set = "own.toml"\n')
    (study / "own.toml").write_text(hostile_marker_set())
    (study / "sub-01" / f"sub-01_{SCRIPT.replace('/', '|')}.c3d").write_bytes(b"")
    with (study / "participants.tsv").open("a") as table:
        for name in NAMES:
            table.write(f"{name}\tM\t70\t1.8\n")
    before = files_of(folder)
    answer = bsip("run", study, "--out", folder / "a" / "out")
    return folder, before, answer


def files_of(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_good_data_are_used_all_the_same(ran):
    folder, _, answer = ran
    assert answer.code == 3, answer.err
    assert (folder / "a" / "out" / "sub-01" / "sub-01_bsip.parquet").exists()
    assert (folder / "a" / "out" / "group" / "report.html").exists()


def test_nothing_is_written_outside(ran):
    folder, before, _ = ran
    after = files_of(folder)
    assert {path: content for path, content in after.items() if path in before} == before
    new = [path for path in after if path not in before]
    assert [path for path in new if folder / "a" / "out" not in path.parents] == []


def test_reports_run_no_names(ran):
    folder, _, _ = ran
    pages = list((folder / "a" / "out").glob("*/report.html"))
    assert len(pages) == 2
    for page in pages:
        assert "<script>alert" not in page.read_text(encoding="utf-8")


def test_tables_hold_no_commands(ran):
    folder, _, _ = ran
    for path in (folder / "a" / "out" / "group" / "tables").iterdir():
        assert "\\input" not in path.read_text(encoding="utf-8")


def test_messages_do_not_steer_the_terminal(ran, bsip):
    folder, _, answer = ran
    recording = folder / "a" / "study" / "sub-01" / "sub-01_task-static.c3d"
    listed = bsip("markers", recording)
    assert "[2Jgone" in listed.out
    assert "\x1b" not in answer.err + answer.out + listed.out + listed.err
