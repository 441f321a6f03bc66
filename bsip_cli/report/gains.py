"""How much better the identified parameters follow the forces than the table's, and than the
table's times one number."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.report.words import COMPONENTS, number, signed
from bsip_cli.statistics.methods import METHODS, OM, RIVALS, RM, RM_MASS, SAME_WITHIN


@dataclass(frozen=True)
class Errors:
    """Errors (RMSE) of the methods in one component: of OM, RM, and RM+mass if there."""

    component: str
    unit: str
    of: Mapping[str, float]

    def change(self, method: str = OM) -> float:
        """Relative change of RM's error: -0.4 is 40 % less."""
        return relative_change(self.of[RM], self.of.get(method, np.nan))

    def rival(self) -> str:
        """The better of RM and RM+mass."""
        return min((method for method in RIVALS if method in self.of), key=self.of.__getitem__)

    def over_rival(self) -> float:
        """Relative change by OM of the error of the better of RM and RM+mass."""
        return relative_change(self.of[self.rival()], self.of[OM])

    def better(self) -> str:
        """``OM``, its better rival, or empty where they are the same or not known."""
        change = self.over_rival()
        if not np.isfinite(change) or abs(change) <= SAME_WITHIN:
            return ""
        return OM if change < 0.0 else self.rival()


@dataclass(frozen=True)
class Gain(Errors):
    """Those of one trial. frames : that they rest on. held_out : OM had not seen the data."""

    trial: str
    frames: int
    held_out: bool


@dataclass(frozen=True)
class PooledGain(Errors):
    """Those over all frames of n trials, and in how many of these OM or one of its rivals leads."""

    trials: int
    om_better: int
    rival_better: int


def relative_change(before: float, after: float) -> float:
    return after / before - 1.0 if before > 0.0 else float("nan")


def gains_of(trial: str, fit: pd.DataFrame) -> tuple[Gain, ...]:
    """The gains of one trial, in the order of the components; the vertical force in % BW."""
    rows = {(row["method"], row["component"]): row for _, row in fit.iterrows()}
    gains = []
    for component in COMPONENTS:
        known = {m: rows[m, component] for m in METHODS if (m, component) in rows}
        if not {RM, OM} <= known.keys():
            continue
        column, unit = _measure(component, known[OM])
        gains.append(
            Gain(
                component,
                unit,
                {method: float(row[column]) for method, row in known.items()},
                trial,
                min(int(row["n"]) for row in known.values()),
                known[OM]["data"] == "held_out",
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
    known = [gain for gain in gains if np.isfinite(list(gain.of.values())).all()]
    pooled = []
    for component in COMPONENTS:
        of_it = [gain for gain in known if gain.component == component]
        if of_it:
            leads = [gain.better() for gain in of_it]
            pooled.append(
                PooledGain(
                    component,
                    of_it[0].unit,
                    _pooled(of_it),
                    len(of_it),
                    leads.count(OM),
                    sum(lead in RIVALS for lead in leads),
                )
            )
    return tuple(pooled)


def _pooled(gains: Sequence[Gain]) -> dict[str, float]:
    """Root mean square over all frames, of those of stretches of so many frames."""
    frames = [gain.frames for gain in gains]
    methods = [m for m in METHODS if all(m in gain.of for gain in gains)]
    return {
        method: float(np.sqrt(np.average([g.of[method] ** 2 for g in gains], weights=frames)))
        for method in methods
    }


def one_number_alone(quantity: str, rm_mass: float, om: float, over_rm_mass: float) -> str:
    """What one number for the whole mass does without identification, in a sentence.

    rm_mass, om : relative change of RM's error by these methods; over_rm_mass : of RM+mass's by OM.
    """
    if min(rm_mass, om) >= -SAME_WITHIN:
        gained = "neither is better than the table"
    elif over_rm_mass < -SAME_WITHIN:
        gained = f"OM errs by {number(-100.0 * over_rm_mass, 0)} % less than {RM_MASS}"
    else:
        gained = "identification gains nothing over that number"
    return (
        f"One number for the whole mass alone ({RM_MASS}) changes RM's error in the {quantity} by "
        f"{signed(100.0 * rm_mass)} %, OM by {signed(100.0 * om)} %: {gained}."
    )
