"""regress: the person's inertial parameters from an anthropometric table (RM)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.artifacts import bsip_names, share_name
from bsip_cli.body.anthropometry import regress
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.identification.prior import Prior, Spread, prior_of
from bsip_cli.stages.frames import person_from
from bsip_cli.unit import Unit


def run(unit: Unit) -> None:
    """Read the skeleton and the person; write regression."""
    skeleton = load_skeleton(unit.config.skeleton)
    facts = unit.read("person").iloc[0]
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    result = regress(person, facts["sex"], facts["mass_kg"], unit.config.regress.table)
    for segment, note in zip(skeleton.segments, result.notes, strict=True):
        if note:
            unit.warn(f"{unit.name}: {segment}: {note}")
    prior = prior_of(result.inertias, person, Spread(**unit.config.prior.model_dump()))
    table = regression_table(skeleton.segments, prior)
    unit.write("regression", table.assign(note=list(result.notes)))


def regression_table(segments: tuple[str, ...], prior: Prior) -> pd.DataFrame:
    """Rows of RM: the table's values, their spread among people, and no share of data."""
    names = bsip_names()
    values = np.array([inertia.readable() for inertia in prior.inertias])
    table = {"method": ["RM"] * len(segments), "segment": list(segments)}
    table |= {name: values[:, k] for k, name in enumerate(names)}
    table |= {f"{name}_sd": prior.readable_sd[:, k] for k, name in enumerate(names)}
    table |= {share_name(name): np.zeros(len(segments)) for name in names}
    return pd.DataFrame(table)
