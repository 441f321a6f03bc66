"""regress: the person's inertial parameters from an anthropometric table (RM)."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.anthropometry import regress
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.errors import BadDataError
from bsip_cli.identification.prior import Spread, prior_of
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import bsip_table, person_from
from bsip_cli.statistics.methods import RM


def run(unit: Unit) -> None:
    """Read the skeleton and the person; write regression."""
    skeleton = load_skeleton(unit.config.skeleton)
    facts = unit.read("person").iloc[0]
    if not np.isfinite(facts["mass_kg"]):
        raise BadDataError(facts["mass_note"], file=unit.name)
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    result = regress(person, facts["sex"], facts["mass_kg"], unit.config.regress.table)
    for segment, note in zip(skeleton.body_names, result.notes, strict=True):
        if note:
            unit.warn(f"{unit.name}: {segment}: {note}")
    prior = prior_of(result.inertias, person, Spread(**unit.config.prior.model_dump()))
    values = np.array([inertia.readable() for inertia in prior.inertias])
    table = bsip_table(RM, skeleton.body_names, values, prior.readable_sd, np.zeros_like(values))
    unit.write("regression", table.assign(note=list(result.notes)))
