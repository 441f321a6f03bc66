"""A flat table of the segments in the manner of Visual3D: z axial, x to the right."""

from __future__ import annotations

import csv
import io
from typing import Any

import numpy as np

from bsip_cli.body.exports.identified import IdentifiedPerson
from bsip_cli.body.inertia import Inertia

# Visual3D's default names of segments; what it lacks stays empty.
_LIMBS = {"upper_arm": "AR", "forearm": "FA", "hand": "HA"}
_LIMBS |= {"thigh": "TH", "shank": "SK", "foot": "FT"}
VISUAL3D_SEGMENTS = {"lower_torso": "RPV", "upper_torso": "RTA", "head": "RHE"} | {
    f"{name}_{side}": side.upper() + code for name, code in _LIMBS.items() for side in "lr"
}

# Rows are x, y and z of the table in the segment's axes (X anterior, Y up, Z right).
_UPRIGHT = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
# The foot lies: its axial direction points back to the ankle.
_LYING = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def visual3d_csv_text(body: IdentifiedPerson) -> str:
    """One row per segment with mass; lines that begin with ``#`` say what made it, and its axes."""
    text = io.StringIO()
    for line in body.said("csv"):
        text.write(f"# {line}\n")
    rows = [
        _row(body, *one) for one in zip(body.person.skeleton.bodies, body.inertias, strict=True)
    ]
    table = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()


def _row(body: IdentifiedPerson, i: int, inertia: Inertia) -> dict[str, Any]:
    skeleton, length = body.person.skeleton, body.person.lengths_m[i]
    lies = skeleton.table_rows[i] == "foot"
    turn = _LYING if lies else _UPRIGHT
    cg, moments = turn @ inertia.com_m, turn @ inertia.tensor_kgm2 @ turn.T
    along = cg[2] if skeleton.table_rows[i] == "head" else -cg[2]
    values = {
        "mass_kg": inertia.mass_kg,
        "mass_percent": 100 * inertia.mass_kg / body.mass_kg,
        "length_m": length,
        "cg_axial_fraction": along / length,
        "cg_axial_m": along,
        **{f"cg_{axis}_m": cg[k] for k, axis in enumerate("xyz")},
        **{f"i{axis}{axis}_kgm2": moments[k, k] for k, axis in enumerate("xyz")},
        "ixy_kgm2": moments[0, 1],
        "ixz_kgm2": moments[0, 2],
        "iyz_kgm2": moments[1, 2],
    }
    segment = skeleton.segments[i]
    return {
        "segment": segment,
        "visual3d_segment": VISUAL3D_SEGMENTS.get(segment, ""),
        "axes": "x right, y up, z backward" if lies else "x right, y anterior, z up",
        **{name: f"{value:.17g}" for name, value in values.items()},
    }
