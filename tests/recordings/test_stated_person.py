"""What a C3D file says of mass, height and sex, as programs write it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bsip_cli.recordings.c3d_person import against_table, stated_person, together
from bsip_cli.recordings.model import StatedPerson
from bsip_cli.recordings.read import read_recording

DATA = Path(__file__).parents[3] / "shared" / "data"


def stated(**groups: dict) -> tuple[StatedPerson, list[str]]:
    values = {
        group: {
            name: v if isinstance(v, tuple) else np.array([v], float) for name, v in one.items()
        }
        for group, one in groups.items()
    }
    person, findings = stated_person(values)
    return person, [f"{f.found}; {f.expected}" for f in findings if f.level == "warning"]


@pytest.mark.parametrize(
    ("groups", "expected"),
    [
        ({"PROCESSING": {"BODYMASS": np.float32(32.1), "HEIGHT": 1450}}, (32.1, 1.45, "")),
        ({"PROCESSING": {"Bodymass": 60, "Height": 168}}, (60, 1.68, "")),
        (
            {"SUBJECT": {"WEIGHT": 82.7, "HEIGHT": 1.63, "GENDER": ("f",)}},
            (82.7, 1.63, "F"),
        ),
        ({"SUBJECTS": {"MASS": 70.5, "SEX": ("Männlich",)}}, (70.5, None, "M")),
        ({"SUBJECTS": {"BODY_MASS": ("70,5 kg",), "HEIGHT": ("163 cm",)}}, (70.5, 1.63, "")),
        (
            {"SUBJECT_INFO": {"Weight": 155.4, "Weight_Units": ("lbs",), "Height": 64.2}},
            (70.488, 1.631, ""),
        ),
        ({"PATIENT": {"MASS": 70500, "STATURE": 1630}}, (70.5, 1.63, "")),
        ({"SUBJECT": {"WEIGHT": 600, "HEIGHT": 170}}, (61.183, 1.7, "")),  # N, not lb
        ({"PROCESSING": {"BODYMASS": 0, "HEIGHT": 0}}, (None, None, "")),
        ({"PROCESSING": {"BODYMASS": np.nan}}, (None, None, "")),
        ({"EXPERIMENT": {"WEIGHT": 50, "HEIGHT": 1.6}}, (None, None, "")),  # of a robot's target
        ({"PROCESSING": {"LLEGLENGTH": 850, "RKNEEWIDTH": 100}}, (None, None, "")),
        ({"PROCESSING": {"BODYMASS": 70}, "SUBJECT": {"MASS": 70.1}}, (70, None, "")),
    ],
)
def test_what_programs_write(groups, expected):
    person, warned = stated(**groups)
    mass, height, sex = expected
    about = [v if v is None else pytest.approx(v, abs=1e-3) for v in (mass, height)]
    assert ([person.mass_kg, person.height_m], person.sex, warned) == (about, sex, [])


@pytest.mark.parametrize(
    ("groups", "said"),
    [
        ({"PROCESSING": {"BODYMASS": 70}, "SUBJECT": {"MASS": 80}}, "SUBJECT:MASS = 80"),
        ({"SUBJECT": {"WEIGHT": 182, "HEIGHT": 1.63}}, "82.6 kg (lb)"),
        ({"SUBJECT": {"WEIGHT": 110.9, "HEIGHT": 1630}}, "50.3 kg (lb)"),
        ({"SUBJECT": {"MASS": 500}}, "226.8 kg (lb) or 50.99 kg (N)"),
    ],
)
def test_what_may_be_several_is_said_and_not_used(groups, said):
    person, warned = stated(**groups)
    assert person.mass_kg is None
    assert said in " ".join(warned)


def test_a_mass_that_is_none_leaves_the_height():
    person, _ = stated(SUBJECT={"WEIGHT": 182, "HEIGHT": 1.63})
    assert person == StatedPerson(None, 1.63)


def test_several_files_of_one_person():
    one = StatedPerson(32.1, 1.45, "F")
    assert together({"a": one, "b": StatedPerson(), "c": one}) == (one, ())
    both, (said,) = together({"a": one, "b": StatedPerson(35.0, 1.45)})
    assert both == StatedPerson(None, 1.45, "F")
    assert said == "its files state different masses: 32.1 kg in a, 35 kg in b; none used"


def test_the_table_is_used_and_the_contradiction_said():
    file = StatedPerson(50.3, 1.63)
    (said,) = against_table(file, 110.9, 1.63, 2.0)
    assert said.level == "warning" and "50.3 kg" in said.found and "110.9 kg" in said.expected
    assert against_table(file, 50.0, None, 2.0) == []


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("zoo_children/HC030A-static.c3d", StatedPerson(45.8, 1.48, name="HC030A")),
        ("btk_pig/PiG_Motion-FlatFoot-Hole.c3d", StatedPerson(66.5, 1.79, name="ANTO_M")),
        ("btk_pig/PiG_Calibration-FlatFoot-Hole.c3d", StatedPerson(name="ANTO_M")),  # zeros
        ("golf_french/static.c3d", StatedPerson(name="Golf_025_")),
    ],
)
def test_real_files(name, expected):
    if not (DATA / name).is_file():
        pytest.skip("shared/data is not there")
    assert read_recording(DATA / name).stated == expected
