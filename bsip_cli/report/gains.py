"""How much better the identified parameters follow the forces than the table's."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.report.words import COMPONENTS

SAME_WITHIN = 0.01  # errors that differ by less count as equal


@dataclass(frozen=True)
class Gain:
    """Errors (RMSE) of RM and OM in one component of one trial.

    frames : that they rest on. held_out : OM had not seen the data.
    """

    trial: str
    component: str
    unit: str
    rm: float
    om: float
    frames: int
    held_out: bool

    def change(self) -> float:
        """Relative change of the error by OM: -0.4 is 40 % less."""
        return self.om / self.rm - 1.0 if self.rm > 0.0 else float("nan")

    def better(self) -> str:
        """``OM``, ``RM``, or empty where they are the same or not known."""
        change = self.change()
        if not np.isfinite(change) or abs(change) <= SAME_WITHIN:
            return ""
        return "OM" if change < 0.0 else "RM"


@dataclass(frozen=True)
class PooledGain:
    """One component over n trials: errors over all their frames, and in how many trials each method
    leads."""

    component: str
    unit: str
    trials: int
    rm: float
    om: float
    om_better: int
    rm_better: int

    def change(self) -> float:
        return self.om / self.rm - 1.0 if self.rm > 0.0 else float("nan")


def gains_of(trial: str, fit: pd.DataFrame) -> tuple[Gain, ...]:
    """The gains of one trial, in the order of the components; the vertical force in % BW."""
    rows = {(row["method"], row["component"]): row for _, row in fit.iterrows()}
    gains = []
    for component in COMPONENTS:
        rm, om = rows.get(("RM", component)), rows.get(("OM", component))
        if rm is None or om is None:
            continue
        column, unit = _measure(component, om)
        gains.append(
            Gain(
                trial,
                component,
                unit,
                float(rm[column]),
                float(om[column]),
                int(min(rm["n"], om["n"])),
                om["data"] == "held_out",
            )
        )
    return tuple(gains)


def _measure(component: str, row: pd.Series) -> tuple[str, str]:
    if component == "grf_vertical" and np.isfinite(row["rmse_percent_bw"]):
        return "rmse_percent_bw", "% BW"
    return "rmse", str(row["unit"])


def pooled_gains(gains: Iterable[Gain]) -> tuple[PooledGain, ...]:
    """Over all frames of the trials, component by component, so that a stride of 0.2 s counts for
    no more than it is; trials without numbers are left out."""
    known = [gain for gain in gains if np.isfinite(gain.rm) and np.isfinite(gain.om)]
    pooled = []
    for component in COMPONENTS:
        of_it = [gain for gain in known if gain.component == component]
        if of_it:
            pooled.append(
                PooledGain(
                    component,
                    of_it[0].unit,
                    len(of_it),
                    _pooled([gain.rm for gain in of_it], [gain.frames for gain in of_it]),
                    _pooled([gain.om for gain in of_it], [gain.frames for gain in of_it]),
                    sum(gain.better() == "OM" for gain in of_it),
                    sum(gain.better() == "RM" for gain in of_it),
                )
            )
    return tuple(pooled)


def _pooled(errors: Sequence[float], frames: Sequence[int]) -> float:
    """Root mean square over all frames, of those of stretches of so many frames."""
    return float(np.sqrt(np.average(np.square(errors), weights=frames)))
