"""`bsip init`: a study of a folder of recordings, without a hand-written line."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from bsip_cli.commands.init import init_command
from bsip_cli.config import load_config
from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.files.regular import ENDINGS
from bsip_cli.study.study import load_study
from tests.fuzz.fuzz_study import _write_trc_mot

SAMPLE = Path(__file__).parents[2] / "sample_data" / "sub-01"
STATIC, WALK = SAMPLE / "sub-01_task-static.c3d", SAMPLE / "sub-01_task-walking_run-1.c3d"
CUT = WALK.read_bytes()[:5000]
DATA = Path(__file__).parents[3] / "shared" / "data"


@pytest.fixture
def lab(tmp_path) -> Path:
    """What a laboratory's folder holds: strange names, a TRC with its MOT, files of the program."""
    folder = tmp_path / "lab"
    folder.mkdir()
    shutil.copy(STATIC, folder / "Cal 01.c3d")
    shutil.copy(WALK, folder / "Gait_2.C3D")
    _write_trc_mot(WALK, folder / "gait3")
    (folder / "gait3.mot").rename(folder / "gait3-GRF.mot")
    for name in ("a.enf", "b.enf", "film.avi", "subject.vsk"):
        (folder / name).write_text("x")
    return folder


def made(lab: Path, **options) -> tuple[int, Path]:
    out = lab.parent / "study"
    asked = {"given": (lab,), "out": out, "participant": "", "link": False}
    return init_command(**(asked | options)), out


def rows(out: Path, name: str) -> list[list[str]]:
    return [line.split("\t") for line in (out / name).read_text().splitlines()]


def trials(out: Path) -> list[str]:
    config = load_config([out / "study.toml"])
    study, refusals = load_study(out, config.roles.model_dump())
    assert refusals == []
    return [f"{t.stem} {t.role}" for person in study.participants for t in person.trials]


def test_a_folder_of_a_laboratory(lab, capsys):
    before = {path: path.read_bytes() for path in lab.iterdir()}
    code, out = made(lab)
    assert code == 0
    assert {path: path.read_bytes() for path in lab.iterdir()} == before
    assert trials(out) == [
        "sub-01_task-Gait_run-2 validation",
        "sub-01_task-gait_run-3 validation",
        "sub-01_task-static_run-1 static",
    ]
    assert (out / "sub-01" / "sub-01_task-gait_run-3.mot").is_file()
    assert load_config([out / "study.toml"]).marker_set == "hansen2017"
    assert rows(out, "participants.tsv")[1:] == [["sub-01", "n/a", "n/a", "n/a"]]
    came = pd.read_csv(out / "sources.tsv", sep="\t", keep_default_na=False)
    copied = came[came["made"] == "copied"]
    assert [Path(source).name for source in copied["source"]] == [
        "Cal 01.c3d",
        "Gait_2.C3D",
        "gait3.trc",
        "gait3-GRF.mot",
    ]
    assert {out / file for file in copied["file"]} == {*(out / "sub-01").iterdir()}
    said = capsys.readouterr().out.splitlines()
    assert "not used, no recordings: 2 .enf, 1 .avi, 1 .vsk" in said
    assert said[-1] == f"next: bsip run {out} --out {out / 'derivatives' / 'bsip'}"


def test_links(lab):
    _, out = made(lab, link=True)
    link = out / "sub-01" / "sub-01_task-Gait_run-2.c3d"
    assert link.is_symlink() and link.resolve() == (lab / "Gait_2.C3D").resolve()


def test_what_comes_out_is_ingested(bsip, lab):
    out = lab.parent / "study"
    bsip.done("init", lab, "--out", out, "--participant", "P7")
    answer = bsip.done("ingest", out, "--out", out / "derivatives" / "bsip")
    assert answer.summary.startswith("bsip ingest: 4 done")  # three trials, one session


def test_nothing_is_written_over(lab):
    out = lab.parent / "study"
    out.mkdir()
    (out / "mine.txt").write_text("mine")
    with pytest.raises(UsageError, match="nothing is written over"):
        made(lab)
    assert [path.name for path in out.iterdir()] == ["mine.txt"]
    (out / "mine.txt").unlink()
    assert made(lab)[0] == 0  # an empty folder is free


def test_the_study_may_lie_among_its_sources(lab):
    assert made(lab, out=lab / "study")[0] == 0
    assert len(trials(lab / "study")) == 3


def test_a_full_disk_leaves_nothing(lab, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(shutil, "copy2", full)
    with pytest.raises(UsageError, match="No space left"):
        made(lab)
    assert [path.name for path in lab.parent.iterdir()] == ["lab"]


@pytest.mark.parametrize(
    ("given", "options", "said"),
    [
        ("nowhere", {}, "does not exist"),
        ("lab", {"participant": "a b"}, "--participant 'a b'; expected sub- and letters"),
    ],
)
def test_usage(lab, given, options, said):
    with pytest.raises(UsageError, match=said):
        made(lab, given=(lab.parent / given,), **options)


def test_a_folder_without_recordings(lab, capsys):
    for path in lab.glob("*"):
        if path.suffix.lower() in (".c3d", ".trc", *ENDINGS):
            path.unlink()
    with pytest.raises(BadDataError, match="no recording can be used"):
        made(lab)
    assert "2 .enf" in capsys.readouterr().out
    assert not (lab.parent / "study").exists()


def test_a_table_of_people_among_the_files(lab, capsys):
    for name in ("Anna", "Ben"):
        (lab / name).mkdir()
        shutil.copy(STATIC if name == "Anna" else WALK, lab / name / "static.c3d")
    for path in lab.glob("*.[cCtm]*"):
        path.unlink()
    table = "id;sex;weight;height\nAnna;w;60,5;165\nBen;n/a;n/a;1,80\nCleo;w;50;160\n"
    (lab / "participants.csv").write_text(table)
    assert made(lab)[0] == 0
    out = lab.parent / "study"
    assert rows(out, "participants.tsv")[1:] == [
        ["sub-Anna", "F", "60.5", "1.65"],
        ["sub-Ben", "n/a", "n/a", "1.8"],
    ]
    assert "participants.csv\tread\t" in (out / "sources.tsv").read_text()
    assert "height 165 of sub-Anna is taken as cm" in capsys.readouterr().out


def test_a_table_of_other_people_is_said(lab, capsys):
    (lab / "participants.tsv").write_text("participant_id\tsex\tmass_kg\nMeyer, Jo\tM\t70\n")
    assert made(lab)[0] == 0
    said = (
        "participants.tsv names Meyer, Jo, and nobody of these is found: the people here are sub-01"
    )
    assert said in capsys.readouterr().out


# --- what is not used, and why --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "code", "said"),
    [
        (lambda lab: (lab / "run1.c3d.gz").write_bytes(b"x"), 3, "run1.c3d.gz: is packed: unpack"),
        (lambda lab: (lab / "broken.c3d").write_bytes(CUT), 3, "not used: broken.c3d: "),
        (
            lambda lab: shutil.copy(lab / "gait3-GRF.mot", lab / "gait3_forces.mot"),
            3,
            "gait3-GRF.mot and gait3_forces.mot are both forces of gait3.trc",
        ),
        (lambda lab: (lab / "gait3-GRF.mot").write_text("?"), 3, "not used: gait3-GRF.mot: "),
        (lambda lab: shutil.copy(lab / "Gait_2.C3D", lab / "copy.c3d"), 0, "holds the same as"),
        (lambda lab: _write_trc_mot(WALK, lab / "Gait_2"), 0, "Gait_2.C3D, of the same name, is"),
        (lambda lab: (lab / "other.mot").write_text("x"), 0, "no TRC of its name is there"),
        (lambda lab: (lab / "annexed.c3d").symlink_to("gone"), 3, "not used: annexed.c3d"),
    ],
)
def test_what_is_not_used_is_said(lab, capsys, change: Callable[[Path], object], code, said):
    change(lab)
    found, out = made(lab)
    assert found == code
    assert said in capsys.readouterr().out
    assert len(trials(out)) == 3
    assert "not used" in (out / "sources.tsv").read_text()


def test_angles_beside_the_forces_are_no_forces(lab):
    (lab / "gait3.mot").write_text("Coordinates\nnRows=2\nendheader\ntime\tknee\n0\t1\n1\t2\n")
    assert made(lab)[0] == 0
    mot = lab.parent / "study" / "sub-01" / "sub-01_task-gait_run-3.mot"
    assert mot.read_text() == (lab / "gait3-GRF.mot").read_text()


def test_forces_in_another_folder(lab):
    """As OpenCap's laboratory data lie; a table that two trials may mean is nobody's."""
    for folder in ("Markers", "Forces", "Other"):
        (lab / folder).mkdir()
    (lab / "gait3.trc").rename(lab / "Markers" / "gait3.trc")
    (lab / "gait3-GRF.mot").rename(lab / "Forces" / "gait3_forces.mot")
    assert made(lab)[0] == 0
    assert len([*(lab.parent / "study").rglob("*.mot")]) == 1
    text = (lab / "Markers" / "gait3.trc").read_text()
    (lab / "Other" / "gait3.trc").write_text(text.replace("0.1", "0.2"))
    made(lab, out=lab.parent / "second")
    assert [*(lab.parent / "second").rglob("*.mot")] == []
    assert "which is meant is not guessed" in (lab.parent / "second" / "sources.tsv").read_text()


# --- real recordings ------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "people", "n_static", "marker_set"),
    [
        (
            "zoo_children",
            [
                "sub-HC002D\tn/a\t32.1\t1.45",
                "sub-HC030A\tn/a\t45.8\t1.48",
                "sub-HC031A\tn/a\t27.7\t1.33",
                "sub-HC032A\tn/a\t60.3\t1.58",
                "sub-HC033A\tn/a\t51.5\t1.605",
                "sub-HC038A\tn/a\t56.8\t1.74",
                "sub-HC039A\tn/a\t39.7\t1.59",
            ],
            7,
            "plugin_gait",
        ),
        ("golf_french", ["sub-01\tn/a\tn/a\tn/a"], 1, "markers.toml"),
        ("opencap_subject4", ["sub-01\tn/a\tn/a\tn/a"], 1, "opencap_subject4"),
        ("btk_pig", ["sub-01\tn/a\t47.5\t1.505", "sub-02\tn/a\t66.5\t1.79"], 2, "plugin_gait"),
        ("c3dorg_plate_types", None, 1, "auto"),
    ],
)
def test_real_recordings(bsip, tmp_path, name, people, n_static, marker_set):
    if not (DATA / name).is_dir():
        pytest.skip("the real recordings (../shared/data) are missing")
    out = tmp_path / "study"
    bsip.done("init", DATA / name, "--out", out, "--link")
    if people is not None:
        assert (out / "participants.tsv").read_text().splitlines()[1:] == people
    assert sum(trial.endswith(" static") for trial in trials(out)) == n_static
    assert load_config([out / "study.toml"]).marker_set == marker_set
    answer = bsip("ingest", out, "--out", tmp_path / "out", "--jobs", 2)
    assert answer.code == (3 if name == "c3dorg_plate_types" else 0), answer.err
