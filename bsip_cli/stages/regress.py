"""regress: the person's inertial parameters from an anthropometric table (RM)."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.anthropometry import regress
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.body.strays import strays_of
from bsip_cli.errors import BadDataError
from bsip_cli.identification.prior import prior_of
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import spread_names
from bsip_cli.stages.frames import bsip_table, person_from
from bsip_cli.stages.identification_problem import spread_from
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
    rows = [skeleton.table_rows[i] for i in skeleton.bodies]
    strays = strays_of(facts["sex"], facts["mass_kg"], facts["height_m"], rows)
    if strays.outside:
        unit.warn(f"{unit.name}: {strays.outside}")
    com = np.where(np.isnan(strays.com), unit.config.prior.com_sd_percent, strays.com)
    spreads = np.column_stack([strays.mass, com, strays.moments])
    prior = prior_of(result.inertias, person, spread_from(unit, spreads))
    values = np.array([inertia.readable() for inertia in prior.inertias])
    table = bsip_table(RM, skeleton.body_names, values, prior.readable_sd, np.zeros_like(values))
    table[list(spread_names())] = spreads
    unit.write("regression", table.assign(note=list(result.notes)))
