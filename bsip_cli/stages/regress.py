"""regress: the person's inertial parameters from an anthropometric table (RM)."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.anthropometry import regress, strays_of
from bsip_cli.body.inertia import rod_length_m
from bsip_cli.errors import BadDataError
from bsip_cli.identification.prior import prior_of
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import spread_names
from bsip_cli.stages.frames import bsip_table, person_of
from bsip_cli.stages.identification_problem import spread_from
from bsip_cli.statistics.methods import RM


def run(unit: Unit) -> None:
    """Read the skeleton and the person; write regression."""
    facts = unit.read("person").iloc[0]
    if not np.isfinite(facts["mass_kg"]):
        raise BadDataError(facts["mass_note"], file=unit.name)
    person = person_of(unit)
    skeleton = person.skeleton
    result = regress(person, facts["sex"], facts["mass_kg"], unit.config.regress.table)
    for segment, note in zip(skeleton.body_names, result.notes, strict=True):
        if note:
            unit.say(f"{segment}: {note}")
    rows = [skeleton.table_rows[i] for i in skeleton.bodies]
    strays = strays_of(facts["sex"], facts["mass_kg"], facts["height_m"], rows)
    if strays.outside:
        unit.say(strays.outside)
    com = np.where(np.isnan(strays.com), unit.config.prior.com_sd_percent, strays.com)
    # centres of mass err by the same part as lengths do, after refinement, or of the first guess
    # where a length is not refined [% of the rod's length]
    lengths = unit.read("skeleton").set_index("segment").loc[list(skeleton.body_names)]
    part = (lengths["length_sd_m"] / lengths["length_m"]).fillna(unit.config.scale.length_sd)
    centres = np.array([np.abs(one.com_m) / rod_length_m(one) for one in result.inertias])
    com = np.hypot(com, 100 * part.to_numpy()[:, None] * centres)
    spreads = np.column_stack([strays.mass, com, strays.moments, strays.other])
    prior = prior_of(result.inertias, person, spread_from(unit, spreads))
    values = np.array([inertia.readable() for inertia in prior.inertias])
    table = bsip_table(RM, skeleton.body_names, values, prior.readable_sd, np.zeros_like(values))
    table[list(spread_names())] = spreads
    outside = {"outside": strays.outside}
    unit.write("regression", table.assign(note=list(result.notes)), outside)
