"""Whose recordings are, what they show and which are static: told from names, places and speed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bsip_cli.study.new_study import Found, Named, name_all
from bsip_cli.study.trials import _TRIAL

FULL = frozenset(f"m{k}" for k in range(40))


def found(
    name: str, subject: str = "", speed: float | None = None, labels: frozenset[str] = FULL
) -> Found:
    """A recording below the given folder; still where its name says static."""
    path = Path("/lab") / name
    still = any(word in name.lower() for word in ("stat", "cal", "kal", "stand", "pose", "_st."))
    speed = (0.02 if still else 0.8) if speed is None else speed
    return Found(path, path.parts[2:-1], subject, labels, speed, speed)


def names(*recordings: Found | str, participant: str = "") -> list[str]:
    files = [found(one) if isinstance(one, str) else one for one in recordings]
    named, _ = name_all(files, participant)
    assert len({one.stem.casefold() for one in named}) == len(files)
    assert all(_TRIAL.fullmatch(one.stem) for one in named)
    of = {one.found.path: one for one in named}
    return [short(of[one.path]) for one in files]


def short(named: Named) -> str:
    return named.stem.removeprefix("sub-").replace("task-", "").replace("run-", "")


# files > names
CASES = """
# one person
static.c3d | swing1.c3d | swing3.c3d > 01_static_1 01_swing_1 01_swing_3
DJ1.trc | DJ2.trc | cal 01.trc > 01_DJ_1 01_DJ_2 01_static_1
T-pose.c3d | Gang 1.c3d | Gang 2.c3d > 01_static_1 01_Gang_1 01_Gang_2
0001.c3d | 0002.c3d | 0003_ST.c3d > 01_trial_1 01_trial_2 01_static_1
walk_left_1.c3d | walk_right_1.c3d > 01_left_1 01_right_1
walk.c3d | walk.trc > 01_walk_1 01_walk_2
Größe_20230101.c3d | 体.c3d > 01_Grosse20230101_1 01_trial_1
Kalibrierung.c3d | StatiqueDebout2.c3d > 01_static_1 01_static_2
# people by folders
P01/static.c3d | P01/walk1.c3d | P02/static.c3d | P02/walk1.c3d >
    P01_static_1 P01_walk_1 P02_static_1 P02_walk_1
Anna/Session 1/walk.c3d | Anna/Session 2/walk.c3d | Ben/Session 1/walk.c3d >
    Anna_ses-1_walk_1 Anna_ses-2_walk_1 Ben_ses-1_walk_1
Trial 1/P1/walk.c3d | Trial 2/P2/walk.c3d | 20230105/P2/hop.c3d > P1_walk_1 P2_walk_1 P2_hop_1
01/Day1/walk.c3d | 02/Day1/walk.c3d | 02/Day2/walk.c3d >
    01_ses-1_walk_1 02_ses-1_walk_1 02_ses-2_walk_1
data/static/S1.c3d | data/walking/S1.c3d | data/static/S2.c3d >
    S1_static_1 S1_walking_1 S2_static_1
MarkerData/walk1.trc | MarkerData/static1.trc > 01_walk_1 01_static_1
# people by the beginnings of names
HC1-static.c3d | HC1-turn.c3d | HC2-static.c3d | HC2-turn.c3d >
    HC1_static_1 HC1_turn_1 HC2_static_1 HC2_turn_1
AB_static.c3d | AB_walk1.c3d | CD_static.c3d | CD_walk1.c3d >
    AB_static_1 AB_walk_1 CD_static_1 CD_walk_1
K01static.c3d | K01walk3.c3d | K02static.c3d > K01_static_1 K01_walk_3 K02_static_1
static_VP3.c3d | walk 2_VP3.c3d | walk 1_VP4.c3d > VP3_static_1 VP3_walk_2 VP4_walk_1
static_1.c3d | static_2.c3d | walk_1.c3d | walk_2.c3d > 01_static_1 01_static_2 01_walk_1 01_walk_2
subj01_walk2.c3d | subj02_walk1.c3d > subj01_walk_2 subj02_walk_1
walk1_left.c3d | walk2_left.c3d | static.c3d > 01_walk1Left_1 01_walk2Left_1 01_static_1
# as in BIDS already
sub-A7_task-squat_run-3.c3d | sub-A7/ses-2/sub-A7_ses-2_task-hop.c3d > A7_squat_3 A7_ses-2_hop_1
"""


@pytest.mark.parametrize("case", re.findall("^[^#\n].*", CASES.replace("\n   ", ""), re.MULTILINE))
def test_names(case):
    files, expected = case.split(" > ")
    assert names(*files.split(" | ")) == expected.split()


@pytest.mark.parametrize(
    ("subjects", "form", "expected"),
    [
        (  # as in btk_pig: names of people are not spread
            {"Full": "Jane Doe", "Hole": "John Doe"},
            "PiG_{1}-{0}.c3d",
            ["01_static_1", "01_MotionFull_1", "02_static_1", "02_MotionHole_1"],
        ),
        (
            {"XY": "XY", "ZA": "ZA"},
            "{0}-{1}.c3d",
            ["XY_static_1", "XY_Motion_1", "ZA_static_1", "ZA_Motion_1"],
        ),
        (
            {"JD": "Jane Doe", "MM": "Max Mustermann"},
            "{0}_{1}.c3d",
            ["JD_static_1", "JD_Motion_1", "MM_static_1", "MM_Motion_1"],
        ),
    ],
)
def test_subjects_that_files_name_tell_people_apart(subjects, form, expected):
    files = [
        found(form.format(short, what), subject)
        for short, subject in subjects.items()
        for what in ("Calibration", "Motion")
    ]
    assert names(*files) == expected


def test_other_markers_are_other_people_and_it_is_said():
    other = frozenset(f"k{k}" for k in range(30))
    few = frozenset([*sorted(FULL)[:20]])
    files = [found("a1.c3d"), found("a2.c3d", labels=few), found("b1.c3d", labels=other)]
    assert names(*files) == ["01_a_1", "01_a_2", "02_b_1"]
    assert "2 people" in " ".join(name_all(files)[1])
    assert names(*files, participant="sub-X") == ["X_a_1", "X_a_2", "X_b_1"]


def test_what_is_called_static_and_moves_is_a_movement():
    files = [found("sit_to_stand.c3d", speed=0.4), found("static.c3d", speed=0.6)]
    assert names(*files) == ["01_sitToStand_1", "01_notstatic_1"]
    assert "sit_to_stand.c3d, static.c3d is called static" in " ".join(name_all(files)[1])


def test_without_a_name_the_stillest_serves_if_somebody_stands_there():
    files = [found("t1.c3d", speed=0.03), found("t2.c3d", speed=0.02), found("t3.c3d", speed=0.9)]
    assert names(*files) == ["01_t_1", "01_static_2", "01_t_3"]
    walks = [found("t1.c3d", speed=0.5), found("t2.c3d", speed=0.4)]
    assert names(*walks) == ["01_t_1", "01_t_2"]
    assert "no static trial: the quietest second" in " ".join(name_all(walks)[1])
