"""A case as a study that a lab would hand over."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.blind.second_world.balance import balanced
from tests.blind.second_world.body import Body, draw_body
from tests.blind.second_world.c3d_file import write_c3d
from tests.blind.second_world.effects import Changes, changes_of
from tests.blind.second_world.lab import Lab
from tests.blind.second_world.landmarks import Landmark, place_landmarks
from tests.blind.second_world.movements import moving
from tests.blind.second_world.people import Case
from tests.blind.second_world.skin import Skin

PERSON = "sub-01"
_JOLTING = 0.9
_SCALES_SD_KG = 0.15


def write_study(folder: Path, case: Case) -> None:
    """A study of one person; nothing in it tells what is hidden."""
    equipment = case.equipment
    body, landmarks, lab, rng = drawn(case)
    skin = Skin(landmarks, lab.labels, rng, jolting=_JOLTING if case.jolting else 0.0)
    for task in ("static", "sequence", *case.tasks):
        motion = moving(task, body, lab.fine_hz, rng, wide=equipment.two_plates)
        changes = Changes()
        for hidden in case.hidden:
            if hidden.is_in(task):
                changes = changes.with_others(changes_of(hidden, motion))
        found = balanced(motion, changes.loads)
        if task == "static":
            skin.rest(found.poses)
        run = "" if task == "static" else "_run-1"
        path = folder / PERSON / f"{PERSON}_task-{task}{run}.c3d"
        write_c3d(path, lab.record(found, skin, changes, rng), equipment.plate_type)
    who = case.somebody
    weighed_kg = who.mass_kg + rng.normal(0.0, _SCALES_SD_KG)
    line = f"{PERSON}\t{who.sex}\t{weighed_kg:.1f}\t{who.height_m:.2f}"
    table = f"participant_id\tsex\tmass_kg\theight_m\n{line}\n"
    # last: with it, a study is complete
    (folder / "participants.tsv").write_text(table, encoding="utf-8")


def drawn(case: Case) -> tuple[Body, dict[str, Landmark], Lab, np.random.Generator]:
    """A case's person and lab, and the generator that goes on from there."""
    somebody = case.somebody
    rng = np.random.default_rng(somebody.seed)
    body = draw_body(somebody.sex, somebody.mass_kg, somebody.height_m, rng)
    landmarks = place_landmarks(body, rng)
    return body, landmarks, Lab(case.equipment, rng), rng
