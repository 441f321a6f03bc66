"""Which trials identify: never one in which something beside the plates bears the body."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

from bsip_cli.stages.identify import _identification_trials
from bsip_cli.study.study import Trial

HAND = "left hand stands still within 1 mm: something beside the plates bears it"


def chosen(contacts: tuple[str, ...], **frames: int) -> tuple[list[str], list[str]]:
    """Tasks that identify, and what is said, of trials with so many measured frames."""
    roles = {"static": "static", "sequence": "sequence"}
    trials = {
        Trial("sub-01", task, f"sub-01_task-{task}", Path(task), roles.get(task, "validation")): n
        for task, n in frames.items()
    }
    said: list[str] = []
    unit = SimpleNamespace(
        name="sub-01",
        say=lambda text: said.append(f"sub-01: {text}"),
        config=SimpleNamespace(identify=SimpleNamespace(hold_out_fraction=0.0)),
    )
    held = {f"sub-01_task-{task}": SimpleNamespace(words=lambda: HAND) for task in contacts}
    return [trial.task for trial in _identification_trials(unit, held, trials)], said


def test_the_role_identifies_and_nothing_is_said():
    assert chosen((), static=9, sequence=5, walking=8) == (["sequence"], [])


def test_a_held_sequence_gives_way_to_the_longest_free_trial():
    tasks, said = chosen(("sequence", "rail"), static=99, sequence=50, rail=30, walking=8, steps=7)
    assert tasks == ["walking"]
    assert said == [
        f"sub-01: sub-01_task-sequence does not identify: {HAND}; sub-01_task-walking identifies "
        "instead"
    ]


def test_standing_still_does_not_stand_in_for_held_trials():
    tasks, said = chosen(("hip", "knee"), static=99, hip=50, knee=30)
    assert tasks == []
    assert len(said) == 2 and all(
        text.endswith("no trial is left to identify from") for text in said
    )


def test_standing_still_identifies_where_nothing_moves():
    assert chosen((), static=99)[0] == ["static"]
