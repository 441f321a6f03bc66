"""What cannot be understood: code 2 and one sentence. What cannot be used: code 3, and go on."""

from __future__ import annotations

import pytest

from bsip_cli.artifacts import read_artifact


def assert_usage_error(answer, *said: str) -> None:
    assert answer.code == 2
    assert "Traceback" not in answer.err
    assert answer.out == ""
    for words in said:
        assert words in answer.err


def one_sentence(answer) -> str:
    """The only line, of the form `bsip: ...`."""
    (line,) = answer.err.splitlines()
    assert line.startswith("bsip: ")
    assert line.endswith(".")
    return line


# --- usage --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run", ".", "--out", "o", "--bogus"], "No such option"),
        (["injest", ".", "--out", "o"], "No such command 'injest'"),
        (["run", "."], "Missing option '--out'"),
        (["run", "--out", "o"], "Missing argument 'STUDY'"),
        (["run", ".", "--out", "o", "--jobs", "0"], "0 is not in the range x>=1"),
        (["run", ".", "--out", "o", "--jobs", "two"], "'two' is not a valid integer"),
    ],
)
def test_command_line_that_cannot_be_understood(bsip, arguments, said):
    answer = bsip(*arguments)
    assert_usage_error(answer, said)
    assert answer.err.splitlines()[-1].startswith("Error: ")


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("run {0}/nowhere --out {0}/out", "{0}/nowhere: there is no such folder. To correct it: "),
        (
            "run {0}/study --out {0}/out --participant sub-07 --participant sub-01 "
            "--participant sub-9",
            "no participant sub-07, sub-9; expected one of sub-01, sub-02",
        ),
        (
            "run {0}/study --out {0}/out --participant sub-01 --group",
            "--group is about all participants",
        ),
        ("run {0}/study --out {0}/file", "{0}/file: is no folder to write to"),
        ("show {0}", "run `bsip run` first, or name the folder"),
        ("show {0}/file", "`bsip info`"),
        ("run {0}/study --out {0}/out --config {0}/no.toml", "{0}/no.toml: there is no such file"),
    ],
)
def test_what_is_not_there_is_said_in_a_sentence(bsip, empty_study, tmp_path, command, said):
    (tmp_path / "file").write_text("mine")
    answer = bsip(*command.format(tmp_path).split())
    assert_usage_error(answer)
    assert said.format(tmp_path) in one_sentence(answer)
    assert not (tmp_path / "out").exists() and (tmp_path / "file").read_text() == "mine"


# --- configuration ------------------------------------------------------------------------------


@pytest.fixture
def refusal(bsip, empty_study, tmp_path):
    """The sentence by which a run refuses such a study.toml, before any recording is read."""

    def of(text: str, *options: object) -> str:
        (empty_study / "study.toml").write_text(text)
        answer = bsip("run", empty_study, "--out", tmp_path / "out", *options)
        assert_usage_error(answer)
        return one_sentence(answer)

    return of


def test_all_faults_of_the_configuration_at_once(refusal, empty_study):
    sentence = refusal(
        'marker_sett = "auto"\n[ingest]\nmax_gap = 0.1\n[stats]\nalpha = 2.0\n'
        '[smoothing]\nmethod = "kalman"\n'
    )
    assert str(empty_study / "study.toml") in sentence
    assert "unknown option marker_sett (did you mean marker_set?)" in sentence
    assert "unknown option ingest.max_gap (did you mean max_gap_s?)" in sentence
    assert "stats.alpha = 2.0: Input should be less than 1" in sentence
    assert "smoothing.method = 'kalman'" in sentence
    assert "configs/default.toml" in sentence


def test_faults_of_two_files_are_named_with_both(refusal, tmp_path):
    own = tmp_path / "own.toml"
    own.write_text("[stats]\nalpha = 0.0\n")
    sentence = refusal("[ik]\niterations = 0\n", "--config", own)
    for named in ("ik.iterations", "stats.alpha", str(own), "study.toml"):
        assert named in sentence


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("alpha = ", "not valid TOML"),
        ('marker_set = "hansen2071"\n', "hansen2071: there is no such marker set; expected auto, "),
        ('marker_set = "lost.toml"\n', "lost.toml: there is no such marker set"),
        ('skeleton = "robot"\n', "robot: there is no such skeleton; expected hansen2017"),
        ("stats = 3\n", "stats = 3: "),
    ],
)
def test_configuration_that_cannot_be_used(refusal, text, said):
    assert said in refusal(text)


def test_own_marker_set_with_faults(refusal, tmp_path):
    own = tmp_path / "own.toml"
    own.write_text('[segments]\nhed = { TOP = "vertex" }\nhead = { TOP = "vertexx" }\n')
    sentence = refusal(f'marker_set = "{own}"\n')
    assert "unknown segment hed (did you mean head?)" in sentence
    assert "TOP stands twice" in sentence


def test_stage_before_its_turn_names_the_one_to_run_first(bsip, empty_study, tmp_path):
    answer = bsip("scale", empty_study, "--out", tmp_path / "out")
    assert_usage_error(answer, "sub-01: scale has no markers, wrench to read; run `bsip ingest`")
    assert "2 without input" in answer.summary


# --- data ---------------------------------------------------------------------------------------


def test_study_without_table_of_participants(bsip, tmp_path):
    answer = bsip("run", tmp_path, "--out", tmp_path / "out")
    assert answer.code == 3
    assert "participants.tsv: cannot be read" in one_sentence(answer)


@pytest.mark.parametrize("content", [b"not a recording", bytes(range(256)) * 8])
def test_corrupt_recording_is_refused_in_one_sentence(bsip, empty_study, tmp_path, content):
    recording = empty_study / "sub-02" / "sub-02_task-static.c3d"
    recording.write_bytes(content)
    out = tmp_path / "out"
    answer = bsip("ingest", empty_study, "--out", out, "--participant", "sub-02")
    assert answer.code == 3
    sentence, summary = answer.err.splitlines()
    assert sentence.startswith("ingest: ")
    assert str(recording) in sentence
    assert "; expected " in sentence
    assert ". To correct it: " in sentence
    assert summary == f"bsip ingest: 1 done, 1 refused; results in {out}"
    written = out / "sub-02" / "sub-02_task-static_refusal-ingest.parquet"
    assert {path.name for path in (out / "sub-02").iterdir()} == {
        ".fingerprints.json",
        ".lock",
        "sub-02_readings.parquet",
        written.name,
    }
    assert read_artifact(out / "sub-02" / "sub-02_readings.parquet", "readings").empty
    row = read_artifact(written, "refusal").iloc[0]
    assert (row["stage"], row["kind"]) == ("ingest", "bad data")
    assert row["sentence"] in sentence


def test_everybody_refused(bsip, empty_study, tmp_path):
    """No stage after the refusal fails; done is only the look at each person's recordings."""
    answer = bsip("run", empty_study, "--out", tmp_path / "out", "--jobs", 2)
    assert answer.code == 3
    assert "Traceback" not in answer.err
    assert answer.summary.startswith("bsip run: 2 done, 2 refused, 32 without input;")
    done = {path.name for path in (tmp_path / "out").glob("*/*.parquet")}
    assert {name for name in done if "_refusal-" not in name} == {
        "sub-01_readings.parquet",
        "sub-02_readings.parquet",
    }
    lines = [line for line in answer.err.splitlines() if "left out of" in line]
    assert [line.split(":")[0] for line in lines] == ["sub-01, sub-02", "group"]
    assert "left out of scale, ik, regress, " in lines[0] and "an input was refused" in lines[0]
