"""Real recordings with neither a stated mass nor a static trial: movement against quiet stance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bsip_cli.config import Config, load_config
from bsip_cli.pipeline import STAGES
from bsip_cli.recordings.measured_mass import MeasuredMass, measured_mass
from bsip_cli.recordings.momentum_mass import Interval
from bsip_cli.running.unit import Unit
from bsip_cli.stages import ingest, survey
from bsip_cli.stages.person_mass import person_mass
from bsip_cli.study.study import load_study

pytestmark = [pytest.mark.real, pytest.mark.long]

CHILDREN = ("HC002D", "HC030A", "HC031A", "HC032A", "HC033A", "HC038A", "HC039A")
GAIT = {
    f"zoo_children/{child}-{trial}.c3d": f"zoo_children/{child}-static.c3d"
    for child in CHILDREN
    for trial in ("straight", "turn")
}
MOVING = GAIT | {
    "btk_functional_ll/FunctionalWalk.c3d": "btk_functional_ll/FunctionalStatic.c3d",
    "btk_pig/PiG_Motion-FlatFoot-Full.c3d": "btk_pig/PiG_Calibration-FlatFoot-Full.c3d",
    "btk_pig/PiG_Motion-FlatFoot-Hole.c3d": "btk_pig/PiG_Calibration-FlatFoot-Hole.c3d",
    "opencap_subject4/squats1.trc": "opencap_subject4/static1.trc",
    "hamner_other/run300.trc": "hamner_other/run200.trc",
}
# What they tell is not known: a foot on the edge of the plate, a chair, a sprint of 1.3 s.
NOTHING = (
    "btk_pig/PiG_Motion-FlatFoot-Hole.c3d",
    "opencap_subject4/STS1.trc",
    "sprinter_ja1/JA1Gait35.c3d",
)


def told(data: Path, name: str, folder: Path) -> MeasuredMass:
    """What one recording tells alone."""
    config, unit = ingested(data, name, folder)
    stretches = [Interval.of(record) for record in unit.facts("wrench")["mass_stretches"]]
    return measured_mass({name: stretches}, config.ingest.mass_half_width_percent)


def ingested(data: Path, name: str, folder: Path) -> tuple[Config, Unit]:
    """One recording, of a person of whom nothing is stated."""
    source = data / name
    study = folder / source.stem
    (study / "sub-01").mkdir(parents=True, exist_ok=True)
    row = "participant_id\tsex\tmass_kg\theight_m\nsub-01\tM\tn/a\tn/a\n"
    (study / "participants.tsv").write_text(row)
    for file in source.parent.glob(f"{source.stem}.*"):
        if file.suffix in (".c3d", ".trc", ".mot"):
            (study / "sub-01" / f"sub-01_task-any{file.suffix}").symlink_to(file)
    for file in source.parent.glob(f"{source.stem}_*.mot"):
        (study / "sub-01" / "sub-01_task-any.mot").symlink_to(file)
    config = load_config([])
    found, _ = load_study(study, config.roles.model_dump())
    person = found.participants[0]
    out = folder / f"{source.stem}-out"
    survey.run(Unit(STAGES[0], found, out, config, person))
    unit = Unit(STAGES[1], found, out, config, person, person.trials[0])
    ingest.run(unit)
    return config, unit


@pytest.mark.parametrize("moving", sorted(set(MOVING) - set(NOTHING)))
def test_movement_tells_what_quiet_stance_tells_or_nothing(real_data, moving, tmp_path):
    found, still = (told(real_data, name, tmp_path) for name in (moving, MOVING[moving]))
    assert still.is_known
    if found.is_known:
        allowed = 0.01 * found.half_width_percent * found.mass_kg
        assert abs(found.mass_kg - still.mass_kg) <= allowed


def test_most_gait_tells_it(real_data, tmp_path):
    found = [told(real_data, name, tmp_path) for name in GAIT if "straight" in name]
    assert all(one.is_known and one.half_width_percent < 2.5 for one in found)


@pytest.mark.parametrize("name", NOTHING)
def test_what_is_not_known_is_not_told(real_data, name, tmp_path):
    assert not told(real_data, name, tmp_path).is_known


@pytest.mark.parametrize("gain", [0.5, 1.0])
def test_of_plates_that_contradict_each_other_no_mass_is_taken(real_data, gain, tmp_path):
    (tmp_path / "walk.trc").symlink_to(real_data / "opencap_subject4/walking1.trc")
    lines = (real_data / "opencap_subject4/walking1_grf.mot").read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("time"))
    is_second = [one.startswith("ground_force_2_v") for one in lines[first].split()]
    for k in range(first + 1, len(lines)):
        cells = zip(map(float, lines[k].split()), is_second, strict=True)
        lines[k] = "\t".join(f"{x * gain if own else x:.6f}" for x, own in cells)
    (tmp_path / "walk_grf.mot").write_text("\n".join(lines) + "\n")
    _, unit = ingested(tmp_path, "walk.trc", tmp_path / "study")
    found = person_mass(unit, [unit.own_trial], 1.68)
    assert ("plate 1 contradicts another: its vertical force shows" in found.note) == (gain != 1.0)
    assert np.isnan(found.mass_kg) == (gain != 1.0)
