"""Kistler's correction of the centre of pressure, which a C3D file may hold as FPCOPPOLY."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.plates import LOADED_N, LocalWrench, PlateDescription

_MM = 1e3


def correct_cop(
    wrench: LocalWrench, plate: PlateDescription
) -> tuple[LocalWrench, tuple[Finding, ...]]:
    """The surface wrench with its centre of pressure moved as the maker's polynomial says.

    Kistler, manual of the force plate type 9287C, section 8.4.3: x is lessened by
    (P1 y^4 + P2 y^2 + P3) x^3 + (P4 y^4 + P5 y^2 + P6) x, y likewise with x and y exchanged;
    coefficients per mm. Outside the outline, where nothing was fitted, the shift of the
    nearest point of the rim counts. Force and vertical moment stay.
    """
    if plate.cop_polynomial is None:
        return wrench, ()
    limits = plate.half_size_m()
    x, y = np.clip(np.nan_to_num(wrench.cop()), -limits, limits).T * _MM
    shift_m = np.column_stack(
        [_error(plate.cop_polynomial[0], x, y), _error(plate.cop_polynomial[1], y, x)]
    )
    shift_m /= _MM
    moment = wrench.moment_Nm.copy()
    moment[:, 0] -= shift_m[:, 1] * wrench.force_N[:, 2]
    moment[:, 1] += shift_m[:, 0] * wrench.force_N[:, 2]
    loaded = np.abs(wrench.force_N[:, 2]) > LOADED_N
    largest_mm = _MM * np.max(np.linalg.norm(shift_m[loaded], axis=1), initial=0.0)
    finding = Finding(
        check="plate_cop",
        subject=plate.name,
        found="FPCOPPOLY holds the maker's correction of the centre of pressure",
        expected="",
        action=f"applied it: shifts of up to {largest_mm:.1f} mm under load",
        level="info",
    )
    return replace(wrench, moment_Nm=moment), (finding,)


def _error(p: np.ndarray, along: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Error of one coordinate [mm] at a point [mm], coefficients P1 to P6."""
    cubic = p[0] * across**4 + p[1] * across**2 + p[2]
    linear = p[3] * across**4 + p[4] * across**2 + p[5]
    return cubic * along**3 + linear * along
