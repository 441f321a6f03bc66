"""Three numbers of a recording beside what good laboratories and the literature have."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Scale
from bsip_cli.report.words import number
from bsip_cli.statistics.methods import OM
from bsip_cli.statistics.published.paper import load_paper

COP, FORCE, MARKERS = "cop_mm", "vertical_force_percent_bw", "markers_mm"
COP_LIMIT_M, FORCE_LIMIT_PERCENT = "large_cop_error_m", "large_force_error_percent"
"""Options of the diagnosis: errors that are called large."""

SOURCES = "Sources: Hansen 2017, table 4 (good), Hicks 2015 (large), OpenSim (markers)."
_MARKER_GOOD_MM, _MARKER_LIMIT_MM = 10.0, 20.0
"""RMS of a fitted static pose, and of a movement, in OpenSim's checklist (Simulation with OpenSim,
Best Practices)."""


@dataclass(frozen=True)
class Yardstick:
    """``good`` and ``limit`` in ``unit``: up to the one it is as good as published, beyond the
    other it is large."""

    name: str
    title: str
    unit: str
    good: float
    limit: float

    def words(self, value: float) -> str:
        if not np.isfinite(value):
            return "not known"
        if value > self.limit:
            return "large"
        return "good" if value <= self.good else "ordinary"

    def scale(self, value: float) -> Scale:
        """The number on its way from nothing to a quarter beyond the limit, or beyond itself."""
        end = max(1.25 * self.limit, 1.1 * value) if np.isfinite(value) else 1.25 * self.limit
        return Scale(
            self.title,
            f"{number(value)} {self.unit}",
            self.words(value),
            value / end if np.isfinite(value) else 0.0,
            self.good / end,
            self.limit / end,
            f"good to {self.good:.2g} {self.unit.partition(' ')[0]}",
            f"large from {number(self.limit, 0)} {self.unit.partition(' ')[0]}",
        )


def yardsticks(cop_limit_m: float, force_limit_percent: float) -> tuple[Yardstick, ...]:
    """Of the centre of pressure, the vertical force and the markers."""
    cop = _published("cop_error"), 1e3 * cop_limit_m
    force = _published("grf_vertical"), force_limit_percent
    return (
        Yardstick(COP, "Centre of pressure (COP) error", "mm", *cop),
        Yardstick(FORCE, "Vertical force error", "% of body weight", *force),
        Yardstick(MARKERS, "Markers from model", "mm", _MARKER_GOOD_MM, _MARKER_LIMIT_MM),
    )


@cache
def _published(variable: str) -> float:
    """Median over the movements of the mean errors with identified parameters."""
    rows = [r for r in load_paper("hansen2017").table(4).rows if r.compare.startswith(variable)]
    return float(np.median([row.cells[OM].mean.middle for row in rows if OM in row.cells]))


def errors_of(fits: Iterable[pd.DataFrame], method: str) -> dict[str, float]:
    """Errors of a method over trials, from tables ``fit``: the root mean square of those with
    held-out data, or of all where there are none; NaN where nothing is known."""
    rows = [_error(fit[fit["method"] == method]) for fit in fits]
    known = [row for row in rows if np.isfinite(row[COP]) or np.isfinite(row[FORCE])]
    chosen = [row for row in known if row["held_out"]] or known
    return {name: _rms([row[name] for row in chosen]) for name in (COP, FORCE)}


def _error(fit: pd.DataFrame) -> Mapping[str, float]:
    rows = fit.set_index("component")
    of = rows["rmse"].to_dict()
    cop = np.hypot(of.get("cop_ap", np.nan), of.get("cop_ml", np.nan))
    percent = rows["rmse_percent_bw"].to_dict().get("grf_vertical", np.nan)
    held_out = bool((fit["data"] == "held_out").any())
    return {COP: float(cop), FORCE: float(percent), "held_out": held_out}


def _rms(values: Iterable[float]) -> float:
    known = [v for v in values if np.isfinite(v)]
    return float(np.sqrt(np.mean(np.square(known)))) if known else float("nan")
