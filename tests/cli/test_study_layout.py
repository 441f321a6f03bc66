"""Participants and recordings as they lie in a study folder."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from bsip_cli.config import load_config
from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.pipeline import STAGES
from bsip_cli.running.unit import Unit
from bsip_cli.study.study import load_study

ROLES = {"static": ("static",), "sequence": ("sequence", "dance")}
HEADER = "participant_id\tsex\tmass_kg\theight_m\n"


def write_table(root: Path, *lines: str) -> None:
    (root / "participants.tsv").write_text(HEADER + "\n".join(lines) + "\n")


def load(root: Path):
    study, refusals = load_study(root, ROLES)
    return study, [str(refusal) for refusal in refusals]


def test_roles_by_task(empty_study):
    folder = empty_study / "sub-01"
    for task in ("dance_run-1", "throwing_run-2", "throwing_run-10"):
        (folder / f"sub-01_task-{task}.c3d").write_bytes(b"")
    (folder / "notes.txt").write_text("no recording")
    study, refusals = load(empty_study)
    assert refusals == []
    found = {trial.stem.split("task-")[1]: trial.role for trial in study.participants[0].trials}
    assert found == {
        "static": "static",
        "dance_run-1": "sequence",
        "throwing_run-2": "validation",
        "throwing_run-10": "validation",
    }


def test_facts_of_the_participants(empty_study):
    first, second = load(empty_study)[0].participants
    assert (first.sex, first.mass_kg, first.height_m) == ("M", 70.0, 1.8)
    assert (second.sex, second.mass_kg, second.height_m) == ("F", 60.0, None)


def test_only_who_is_chosen_is_looked_at(empty_study):
    write_table(empty_study, "sub-01\tM\t70\t1.8", "sub-02\tX\t60\tn/a", "sub-03\tF\t60\tn/a")
    study, refusals = load_study(empty_study, ROLES, ["sub-01"])
    assert ([p.id for p in study.participants], refusals) == (["sub-01"], [])
    study, refusals = load_study(empty_study, ROLES, ["sub-02"])
    assert study.participants == ()
    assert "sex 'X' of sub-02" in str(refusals[0])


def test_many_participants_are_not_listed_in_a_message(empty_study):
    write_table(empty_study, *(f"sub-{k:03d}\tM\t70\t1.8" for k in range(200)))
    with pytest.raises(UsageError) as error:
        load_study(empty_study, ROLES, ["sub-0123"])
    assert "expected one of sub-123" in str(error.value)
    assert len(str(error.value)) < 300


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("sub-02\tX\t60\t1.7", "sex 'X' of sub-02; expected M, F, other or n/a"),
        ("sub-02\tF\t-60\t1.7", "mass_kg '-60' of sub-02"),
        ("sub-02\tF\tsixty\t1.7", "mass_kg 'sixty' of sub-02"),
        ("sub-02\tF\tnan\t1.7", "mass_kg 'nan' of sub-02"),
        ("sub-02\tF\t60\t17", "height_m '17' of sub-02; expected a number between 0.5 and 2.6"),
        ("sub-03\tF\t60\t1.7", "there is no folder sub-03"),
        ("../sub-02\tF\t60\t1.7", "participant_id '../sub-02'"),
        ("\tF\t60\t1.7", "participant_id ''"),
        ("sub-02", "the line of 'sub-02' has 1 cells; expected 4"),
        ("sub-02\tF\t60\t1.7\t5", "the line of 'sub-02' has 5 cells; expected 4"),
        ("sub-01\tM\t71\t1.81", "sub-01 stands twice"),
        ("SUB-01\tM\t71\t1.81", "participant_id 'SUB-01'"),
        ("sub-02\0\tM\t71\t1.81", "participant_id 'sub-02\\x00'"),
        ('"sub\n-02"\tM\t71\t1.81', "participant_id 'sub\\n-02'"),
        ("sub-" + "0" * 300 + "\tM\t71\t1.81", "there is no folder sub-000"),
        ("sub-02\tF\t60\t1.7" + "\tx" * 100_000, "has 100004 cells"),
    ],
)
def test_bad_line_is_refused_and_the_others_stay(empty_study, line, said):
    write_table(empty_study, "sub-01\tM\t70\t1.80", line)
    study, refusals = load(empty_study)
    assert [(person.id, person.mass_kg) for person in study.participants] == [("sub-01", 70.0)]
    assert len(refusals) == 1
    assert said in refusals[0]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "names no participant"),
        (HEADER.encode(), "names no participant"),
        (b"name\tage\nsub-01\t70\n", "has no column participant_id, sex, mass_kg"),
        (HEADER.encode("utf-16"), "names no participant"),
        (HEADER.encode("utf-16")[:-1], "is not a text table"),
        (HEADER.encode() + b"\xff\x01\x02\n", "is not a text table"),
        (
            b"patricipant_id\tgender\tMass [stamps]\nsub-01\tM\t70\n",
            "column 'Mass .stamps.', whose unit is not known; "
            "has a column 'patricipant_id' and no participant_id;",
        ),
        (b"id\tsex\tmass\tweight lb\nsub-01\tM\t70\t154\n", "2 columns of one meaning"),
        (HEADER.encode() + b"sub-01\t" + b"M" * 200_000, "is not a text table .field larger"),
        (b"\0" * 5000, "names no participant"),
        (HEADER.encode()[:-1] + b"\tx" * 1_000_000 + b"\nsub-01\n", "has 1000004 columns"),
    ],
)
def test_table_that_cannot_be_read(empty_study, content, said):
    (empty_study / "participants.tsv").write_bytes(content)
    with pytest.raises(BadDataError, match=said):
        load(empty_study)


def test_recording_whose_name_says_nothing(empty_study):
    """Refused by name; the participant's other recordings are used."""
    odd = empty_study / "sub-01" / "Trial 01.c3d"
    odd.write_bytes(b"")
    study, refusals = load(empty_study)
    assert [trial.task for trial in study.participants[0].trials] == ["static"]
    assert len(refusals) == 1
    assert refusals[0].startswith(f"{odd}: its name does not say what it is")


def test_a_folder_whose_only_recording_is_misnamed_names_it(empty_study):
    folder = empty_study / "sub-01"
    (folder / "sub-01_task-static.c3d").rename(folder / "sub-01_task-my-static.c3d")
    study, (misnamed, nobody) = load(empty_study)
    assert [person.id for person in study.participants] == ["sub-02"]
    assert "sub-01_task-my-static.c3d: its name does not say what it is" in misnamed
    assert nobody.startswith(f"{folder}: none of its recordings can be used")


def test_all_faults_of_a_row_are_said_at_once(empty_study):
    write_table(empty_study, "sub-01	2	seventy	17", "sub-02	F	60	1.7")
    study, (refusal,) = load(empty_study)
    assert [person.id for person in study.participants] == ["sub-02"]
    for found in ("sex '2' of sub-01", "mass_kg 'seventy' of sub-01", "height_m '17' of sub-01"):
        assert found in refusal


def test_two_recordings_of_one_name(empty_study):
    (empty_study / "sub-01" / "sub-01_task-static.trc").write_bytes(b"")
    study, refusals = load(empty_study)
    assert [person.id for person in study.participants] == ["sub-02"]
    assert "of one name, but for capitals and the ending: sub-01_task-static.c3d, " in refusals[0]


@pytest.mark.parametrize("ending", ["trc", "TRC"])
def test_forces_beside_a_trc_belong_to_its_inputs(empty_study, ending):
    """A changed .mot must count as a changed recording."""
    folder = empty_study / "sub-01"
    for name in (f"sub-01_task-walk.{ending}", "sub-01_task-walk.mot", "sub-01_task-static.mot"):
        (folder / name).write_bytes(b"")
    study, _ = load(empty_study)
    participant = study.participants[0]
    static, walk = sorted(participant.trials, key=lambda trial: trial.task)
    names = [
        sorted(Unit(STAGES[0], study, Path("out"), load_config([]), participant, t).inputs())
        for t in (static, walk)
    ]
    assert names[0] == ["sub-01_task-static.c3d"]
    assert names[1] == sorted(["sub-01_task-walk.mot", f"sub-01_task-walk.{ending}"])


def test_trials_keep_one_order(empty_study):
    """Whatever the file system says: results must not depend on it."""
    for run in (3, 1, 2):
        (empty_study / "sub-01" / f"sub-01_task-walk_run-{run}.c3d").write_bytes(b"")
    stems = [trial.stem for trial in load(empty_study)[0].participants[0].trials]
    assert all(a < b for a, b in pairwise(stems))
