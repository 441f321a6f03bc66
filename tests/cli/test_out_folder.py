"""Where results may lie, and whose description of the dataset is written."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from bsip_cli import __version__
from bsip_cli.errors import UsageError
from bsip_cli.study.study import DESCRIPTION, describe_dataset, make_out

OWN = {"Name": "old", "GeneratedBy": [{"Name": "bsip", "Version": "0.0.1"}]}


@pytest.fixture
def study(empty_study) -> Path:
    """With a session, and with a participant whose folder lies elsewhere."""
    (empty_study / "sub-01" / "ses-2").mkdir()
    (empty_study / "derivatives").mkdir()
    (empty_study.parent / "anna").mkdir()
    (empty_study / "sub-03").symlink_to(empty_study.parent / "anna")
    (empty_study.parent / "link").symlink_to(empty_study)
    return empty_study


@pytest.mark.parametrize(
    "place",
    ["derivatives/bsip", "derivatives", "a/b/c", "../out", "sub-01_results", "../study-2"],
)
def test_results_lie_apart(study, place):
    make_out(study / place, study)
    assert (study / place).is_dir()
    make_out(study / place, study)


@pytest.mark.parametrize(
    ("place", "said"),
    [
        (".", "is the study"),
        ("sub-01/..", "is the study"),
        ("../link", "is the study"),
        ("..", "holds the study"),
        ("../link/..", "holds the study"),
        ("/", "holds the study"),
        ("sub-01", "is the folder of sub-01 or lies in it"),
        ("sub-01/out", "is the folder of sub-01 or lies in it"),
        ("sub-01/ses-2/out", "is the folder of sub-01 or lies in it"),
        ("../link/sub-02", "is the folder of sub-02 or lies in it"),
        ("../anna/out", "is the folder of sub-03 or lies in it"),
        ("sub-99", "is the folder of sub-99 or lies in it"),
        ("sub-99/out", "is the folder of sub-99 or lies in it"),
        ("participants.tsv", "is no folder to write to: it is a file"),
        ("fifo", "is no folder to write to: it is a FIFO"),
        ("broken", "is no folder to write to: it is a broken symbolic link to nowhere"),
        ("circle", "is no folder to write to: it cannot be looked at"),
        ("participants.tsv/out", r"is no folder to write to \(Not a directory\)"),
        ("o\udcffut", "bytes that are no UTF-8"),
        ("n" * 300, r"is no folder to write to \(File name too long\)"),
    ],
)
def test_results_do_not_lie_among_recordings(study, place, said):
    os.mkfifo(study / "fifo")
    (study / "broken").symlink_to("nowhere")
    (study / "circle").symlink_to("circle")
    before = sorted(study.parent.rglob("*"))
    with pytest.raises(UsageError, match=said):
        make_out(study / place, study)
    assert sorted(study.parent.rglob("*")) == before


def test_the_command_says_where_results_may_lie(bsip, study):
    answer = bsip("run", study, "--out", study / "sub-01")
    assert answer.code == 2
    (line,) = answer.err.splitlines()
    assert line.endswith(f"like {study}/derivatives/bsip.")


# --- dataset_description.json ---------------------------------------------------------------------


def test_the_description_is_kept_up_to_date(study, tmp_path):
    (tmp_path / DESCRIPTION).write_text(json.dumps(OWN))
    assert describe_dataset(tmp_path, study) == ""
    description = json.loads((tmp_path / DESCRIPTION).read_text())
    assert description["Name"] == "bsip results of study"
    assert description["DatasetType"] == "derivative"
    assert description["GeneratedBy"][0] == {
        "Name": "bsip",
        "Version": __version__,
        "Description": "body segment inertial parameters from motion and ground forces",
    }
    written = (tmp_path / DESCRIPTION).stat().st_mtime_ns
    assert describe_dataset(tmp_path, study) == ""
    assert (tmp_path / DESCRIPTION).stat().st_mtime_ns == written


@pytest.mark.parametrize(
    "content",
    [
        json.dumps({"Name": "mine", "GeneratedBy": [{"Name": "fMRIPrep"}]}),
        json.dumps({"Name": "mine"}),
        json.dumps({"GeneratedBy": 3}),
        json.dumps(["bsip"]),
        "null",
        "not JSON",
        "[" * 100_000,
        "\udcff",
        "",
    ],
)
def test_a_foreign_description_stays(study, tmp_path, content):
    file = tmp_path / DESCRIPTION
    file.write_bytes(content.encode(errors="surrogateescape"))
    before = file.read_bytes()
    assert describe_dataset(tmp_path, study) == f"{file}: is not of bsip, and stays as it is"
    assert file.read_bytes() == before


def test_what_is_no_file_of_its_own_stays(study, tmp_path):
    """A link may lead to another dataset's, a FIFO would never answer."""
    other = tmp_path / "other.json"
    other.write_text(json.dumps(OWN))
    for k, made in enumerate((lambda p: p.symlink_to(other), lambda p: p.symlink_to("nowhere"))):
        out = tmp_path / f"link{k}"
        out.mkdir()
        made(out / DESCRIPTION)
        assert describe_dataset(out, study).endswith("stays as it is")
        assert (out / DESCRIPTION).is_symlink()
    for k, made in enumerate((os.mkfifo, Path.mkdir)):
        out = tmp_path / f"none{k}"
        out.mkdir()
        made(out / DESCRIPTION)
        assert describe_dataset(out, study).endswith("stays as it is")
    assert json.loads(other.read_text()) == OWN


def test_the_study_s_own_description_is_not_touched(bsip, study):
    (study / DESCRIPTION).write_text(json.dumps({"Name": "raw", "BIDSVersion": "1.10.0"}))
    out = study / "derivatives" / "bsip"
    out.mkdir()
    (out / DESCRIPTION).write_text("mine")
    answer = bsip("scale", study, "--out", out)
    assert answer.err.count("stays as it is") == 1
    assert json.loads((study / DESCRIPTION).read_text())["Name"] == "raw"
    assert (out / DESCRIPTION).read_text() == "mine"
