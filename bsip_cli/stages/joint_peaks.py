"""The ``joint-peaks`` of a trial's ``joint-moments``: how large, how sure, what changes them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from bsip_cli.statistics.methods import OM, RM, is_extended


def peaks_of(moments: pd.DataFrame, mass_kg: float, left_out: Mapping[str, str]) -> pd.DataFrame:
    """One row per method, joint and axis; ``left_out`` in words, by joint."""
    keys = ["method", "joint", "axis"]
    groups = moments.groupby(keys, sort=False, observed=True)
    courses = {tuple(map(str, key)): part for key, part in groups}
    methods = list(dict.fromkeys(method for method, *_ in courses))
    by_joint = [moments["method"], moments["joint"]]
    largest = moments["moment_Nm"].abs().groupby(by_joint, observed=True).max()
    rows = []
    for (method, joint, axis), course in courses.items():
        other = _compared_with(method, methods)
        before = courses[other, joint, axis]["moment_Nm"].to_numpy() if other else None
        scale = float(largest[other, joint]) if other else np.nan
        rows.append(
            {"method": method, "joint": joint, "axis": axis}
            | _peak(course, mass_kg)
            | {"compared_with": other, **_change(course["moment_Nm"].to_numpy(), before, scale)}
            | {"left_out": left_out[joint]}
        )
    return pd.DataFrame(rows)


def _compared_with(method: str, methods: list[str]) -> str:
    """RM; of an extended model the one with a cause less."""
    if method == RM:
        return ""
    if not is_extended(method):
        return RM
    before = [m for m in methods[: methods.index(method)] if is_extended(m)]
    return before[-1] if before else OM


def _peak(course: pd.DataFrame, mass_kg: float) -> dict:
    moment = course["moment_Nm"].to_numpy()
    known = np.isfinite(moment)
    if not known.any():
        nothing = ("peak_Nm", "peak_sd_Nm", "peak_Nm_kg", "peak_at_s")
        return dict.fromkeys(nothing, np.nan) | {"frames": 0}
    at = int(np.nanargmax(np.abs(moment)))
    return {
        "peak_Nm": moment[at],
        "peak_sd_Nm": course["moment_sd_Nm"].to_numpy()[at],
        "peak_Nm_kg": moment[at] / mass_kg,
        "peak_at_s": course["time_s"].to_numpy()[at],
        "frames": int(known.sum()),
    }


def _change(moment: np.ndarray, before: np.ndarray | None, scale_Nm: float) -> dict[str, float]:
    names = ("change_Nm", "change_rms_Nm", "change_percent")
    if before is None:
        return dict.fromkeys(names, np.nan)
    difference = (moment - before)[np.isfinite(moment) & np.isfinite(before)]
    if not len(difference):
        return dict.fromkeys(names, np.nan)
    most = difference[np.abs(difference).argmax()]
    rms = float(np.sqrt((difference**2).mean()))
    return dict(zip(names, (float(most), rms, float(100 * abs(most) / scale_Nm)), strict=True))
