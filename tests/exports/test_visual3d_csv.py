"""The flat table: every row says the same body in Visual3D's axes."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.body.exports.visual3d_csv import VISUAL3D_SEGMENTS, visual3d_csv_text
from bsip_cli.body.inertia import Inertia
from bsip_cli.segments import SEGMENTS

# What a row's axes point to, in bsip's axes X anterior, Y up, Z right.
DIRECTIONS = {
    "right": (0, 0, 1),
    "anterior": (1, 0, 0),
    "up": (0, 1, 0),
    "backward": (-1, 0, 0),
}


def rows_of(text: str) -> dict[str, dict[str, str]]:
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return {row["segment"]: row for row in csv.DictReader(lines)}


def numbers(row: dict[str, str], names: str) -> np.ndarray:
    return np.array([float(row[name]) for name in names.split()])


def test_rows_hold_the_inertias_in_the_axes_they_name(identified):
    rows = rows_of(visual3d_csv_text(identified))
    assert set(rows) == set(SEGMENTS) == set(VISUAL3D_SEGMENTS)
    names = identified.person.skeleton.body_names
    for segment, inertia in zip(names, identified.inertias, strict=True):
        row = rows[segment]
        words = [part.split() for part in row["axes"].split(", ")]
        assert [axis for axis, _ in words] == ["x", "y", "z"]
        turn = np.array([DIRECTIONS[where] for _, where in words], dtype=float)
        assert np.linalg.det(turn) == pytest.approx(1.0)
        xx, yy, zz, xy, xz, yz = numbers(
            row, "ixx_kgm2 iyy_kgm2 izz_kgm2 ixy_kgm2 ixz_kgm2 iyz_kgm2"
        )
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        assert turn.T @ tensor @ turn == pytest.approx(inertia.tensor_kgm2, abs=1e-15)
        assert turn.T @ numbers(row, "cg_x_m cg_y_m cg_z_m") == pytest.approx(inertia.com_m)
        assert float(row["mass_kg"]) == pytest.approx(inertia.mass_kg, rel=1e-15)
    assert sum(float(row["mass_percent"]) for row in rows.values()) == pytest.approx(100)


def test_known_thigh_head_and_foot(identified):
    """By hand: the axial axis is the segment's own, and the fraction counts from its origin."""
    skeleton = identified.person.skeleton
    inertias, lengths = list(identified.inertias), np.full(len(skeleton.segments), 0.5)
    for name, com in (
        ("thigh_r", (0.01, -0.2, 0.03)),
        ("head", (0.01, 0.1, 0.0)),
        ("foot_r", (0.06, -0.02, 0.005)),
    ):
        inertias[skeleton.body_names.index(name)] = Inertia(
            2.0, np.array(com), np.diag([0.3, 0.1, 0.25])
        )
    person = replace(identified.person, lengths_m=lengths)
    rows = rows_of(visual3d_csv_text(replace(identified, person=person, inertias=tuple(inertias))))
    columns = "cg_x_m cg_y_m cg_z_m cg_axial_m cg_axial_fraction ixx_kgm2 iyy_kgm2 izz_kgm2"
    assert rows["thigh_r"]["visual3d_segment"] == "RTH"
    assert numbers(rows["thigh_r"], columns) == pytest.approx(
        [0.03, 0.01, -0.2, 0.2, 0.4, 0.25, 0.3, 0.1]
    )
    assert numbers(rows["head"], columns) == pytest.approx(
        [0.0, 0.01, 0.1, 0.1, 0.2, 0.25, 0.3, 0.1]
    )
    assert numbers(rows["foot_r"], columns) == pytest.approx(
        [0.005, -0.02, -0.06, 0.06, 0.12, 0.25, 0.1, 0.3]
    )
