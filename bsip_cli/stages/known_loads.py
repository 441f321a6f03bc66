"""The known loads of a trial, as parameters for science and in words for people."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.loads import PointMass, load_parameters
from bsip_cli.body.person import Person
from bsip_cli.report.words import listing, segment_label
from bsip_cli.running.unit import Unit
from bsip_cli.study.study import Trial


def load_phi(unit: Unit, person: Person, trial: Trial | None = None) -> np.ndarray:
    """(10 n,) parameters of a trial's loads about the joint centres; the unit's own by default."""
    loads = unit.loads(trial)
    points = (PointMass(x.segment, x.mass_kg, np.array(x.position_m)) for x in loads)
    return load_parameters(points, person)


def load_words(unit: Unit, trial: Trial | None = None) -> str:
    """``1 kg on the right shank and 2 kg on the upper torso``; empty without loads."""
    loads = unit.loads(trial)
    return listing([f"{x.mass_kg:g} kg on the {segment_label(x.segment)}" for x in loads], "")


def loads_record(unit: Unit, trial: Trial | None = None) -> list[dict]:
    """Segment, mass and position of each, for an artifact's facts."""
    kept = {"segment", "mass_kg", "position_m"}
    return [x.model_dump(mode="json", include=kept) for x in unit.loads(trial)]
