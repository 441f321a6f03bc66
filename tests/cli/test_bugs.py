"""A bug is told as one, with its trace, and stops only what it concerns."""

from __future__ import annotations

import pytest

from bsip_cli.artifacts import held_alone, read_header
from bsip_cli.config import load_config
from bsip_cli.errors import UsageError
from bsip_cli.pipeline import Stage
from bsip_cli.running import session
from bsip_cli.running.processes import EndedError
from bsip_cli.running.runner import run_stages
from bsip_cli.study.study import load_study

STAGES = {
    "faulty": 'def run(unit):\n    if unit.name in ("sub-01", "group"):\n'
    '        raise ValueError("boom")\n    unit.warn(f"{unit.name}: went well")\n',
    "harmless": 'def run(unit):\n    unit.warn(f"{unit.name}: went well")\n',
    "deadly": 'import os\ndef run(unit):\n    if unit.name == "sub-01":\n'
    "        os.kill(os.getpid(), 9)\n",
    "numeric": "from bsip_cli.errors import NumericalError\ndef run(unit):\n"
    '    raise NumericalError("no optimum", file=unit.name)\n',
    "converting": "import os, signal\ndef run(unit):\n    try:\n"
    "        os.kill(os.getpid(), signal.SIGTERM)\n    except BaseException:\n"
    '        raise ValueError("what the signal raised was caught") from None\n',
    "swallowing": "import os, signal\ndef run(unit):\n    try:\n"
    "        os.kill(os.getpid(), signal.SIGTERM)\n    except BaseException:\n        pass\n",
    "doubtful": "from bsip_cli.errors import BadDataError\ndef run(unit):\n"
    '    unit.warn(f"{unit.name}: the labels look exchanged")\n'
    '    raise BadDataError("no pose", file=unit.name)\n',
}


@pytest.fixture
def stage(tmp_path, monkeypatch):
    """A stage made of a module with this text; the processes that run it find it too."""
    monkeypatch.syspath_prepend(tmp_path)

    def make(name: str, level: str) -> Stage:
        (tmp_path / f"stage_{name}.py").write_text(STAGES[name])
        return Stage(name, level, "", reads=(), writes=(), module=f"stage_{name}")

    return make


@pytest.fixture
def outcomes(empty_study, tmp_path):
    def of(*stages: Stage):
        study, _ = load_study(empty_study, {"static": ("static",), "sequence": ()})
        out = tmp_path / "out"
        running = run_stages(stages, study, out, load_config([]), jobs=1, force=True)
        return [(o.stage, o.unit, o.state, o.exit_code, o.sentences) for o in running]

    return of


def test_bug_of_one_participant(stage, outcomes):
    first, second = outcomes(stage("faulty", "participant"))
    assert first[:4] == ("faulty", "sub-01", "bug", 1)
    assert second == ("faulty", "sub-02", "done", 0, ("sub-02: went well",))
    (sentence,) = first[4]
    assert sentence.startswith("sub-01: a bug in bsip: ValueError: boom\nTraceback")
    assert sentence.count("Traceback") == 1
    assert "stage_faulty.py" in sentence


def test_bug_of_a_cohort_stage_is_told_as_one_of_a_participant(stage, outcomes):
    first, second = outcomes(stage("faulty", "cohort"), stage("harmless", "cohort"))
    assert first[:4] == ("faulty", "group", "bug", 1)
    assert first[4][0].startswith("group: a bug in bsip: ValueError: boom\nTraceback")
    assert second == ("harmless", "group", "done", 0, ("group: went well",))


def test_cohort_goes_on_after_a_participants_bug(stage, outcomes):
    found = outcomes(stage("faulty", "participant"), stage("harmless", "cohort"))
    assert [each[2] for each in found] == ["bug", "done", "done"]


def test_killed_process_is_not_called_a_bug(stage, outcomes):
    """As by a machine short of memory; the cohort still has its turn."""
    found = outcomes(stage("deadly", "participant"), stage("harmless", "cohort"))
    assert found[0][1:4] == ("sub-01", "bug", 1)
    assert "killed" in found[0][4][0]
    assert "a bug in bsip" not in found[0][4][0]
    assert found[-1][:3] == ("harmless", "group", "done")


@pytest.mark.parametrize("name", ["converting", "swallowing"])
def test_a_signal_that_other_code_catches_ends_the_run_all_the_same(
    stage, outcomes, tmp_path, name
):
    with pytest.raises(EndedError, match="ended by SIGTERM"):
        outcomes(stage(name, "participant"))
    assert not list(tmp_path.rglob("*_refusal-*"))


@pytest.fixture
def exit_code(stage, empty_study, tmp_path, monkeypatch):
    """Runs stages of these names on the participants, as `bsip run` does."""

    def of(*names: str) -> int:
        stages = tuple(stage(name, "participant") for name in names)
        monkeypatch.setattr(session, "stages_named", lambda name: stages)
        out = tmp_path / "out"
        return session.run_session("run", empty_study, out, (), None, jobs=1, force=True)

    return of


def test_exit_code_and_words_of_a_session(exit_code, capsys):
    """The bug is graver than the other's numerical failure."""
    code = exit_code("faulty", "numeric")
    told = capsys.readouterr()
    assert code == 1
    assert told.out == ""
    assert told.err.count("Traceback") == 1
    assert told.err.count("a bug in bsip: ValueError: boom") == 1
    assert told.err.splitlines()[-1].startswith("bsip run: 1 done, 2 refused, 1 failed by a bug; ")


def test_numerical_failure_is_code_4(exit_code, capsys):
    assert exit_code("numeric") == 4
    assert "numeric: sub-01: no optimum." in capsys.readouterr().err


def test_warnings_of_a_refused_unit_are_told_before_the_refusal_and_kept_with_it(
    exit_code, tmp_path, capsys
):
    assert exit_code("doubtful") == 3
    assert capsys.readouterr().err.splitlines()[:2] == [
        "doubtful: sub-01: the labels look exchanged",
        "doubtful: sub-01: no pose.",
    ]
    path = tmp_path / "out" / "sub-01" / "sub-01_refusal-doubtful.parquet"
    refusal = read_header(path, "refusal")
    assert refusal["provenance"]["messages"] == ["sub-01: the labels look exchanged"]


# --- who may write into a folder ------------------------------------------------------------------


def test_an_error_of_the_work_itself_stays_what_it_is(tmp_path):
    with pytest.raises(FileNotFoundError, match="a bug"), held_alone(tmp_path / "sub-01"):
        raise FileNotFoundError("a bug")


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot be written"), held_alone(tmp_path / "file" / "x"):
        pass
