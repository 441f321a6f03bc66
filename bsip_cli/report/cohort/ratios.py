"""Errors of OM beside those of RM and RM+mass over the cohort, from the rows of ``values``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.report.words import COMPONENTS
from bsip_cli.statistics.methods import METHODS, OM, RIVALS, RM

_OF_TABLE = {"table4": "", "table5": "_rmse"}  # tables of errors, and the ending of their variables
TASK_ERRORS = ("cop_error", "grf_vertical")
"""Errors of table 4 that are shown per movement."""

ReadValues = Callable[[str, str], pd.DataFrame]
"""Table and variable to their rows of ``values``."""


@dataclass(frozen=True, eq=False)
class Ratios:
    """Mean errors of the participants, of whom those of OM and RM are known and not zero.

    of_component : per component of which there is any, a table with a row per participant (the same
    in all) and a column per method; held_out : over held-out data, or, where nobody has any, over
    all.
    """

    of_component: dict[str, pd.DataFrame]
    held_out: bool

    def over_rm(self, component: str, method: str) -> np.ndarray:
        """(p,) of a method over RM's, NaN where not known."""
        errors = self.of_component[component]
        return (errors[method] / errors[RM]).to_numpy()

    def over_rival(self, component: str) -> np.ndarray:
        """(p,) of OM over those of the better of RM and RM+mass."""
        errors = self.of_component[component]
        return (errors[OM] / errors[list(RIVALS)].min(axis="columns")).to_numpy()


def ratios_of(read: ReadValues) -> Ratios:
    """Participants in the order of their ids, each with a ratio in some component."""
    for held_out in (True, False):
        found = {name: _mean_errors(read, name, held_out) for name in COMPONENTS}
        people = sorted(set().union(*(errors.index for errors in found.values())))
        if people:
            known = {name: errors for name, errors in found.items() if len(errors)}
            return Ratios({name: one.reindex(people) for name, one in known.items()}, held_out)
    return Ratios({}, held_out=False)


def _mean_errors(read: ReadValues, component: str, held_out: bool) -> pd.DataFrame:
    """A row per participant with errors of OM and RM: means over the runs with all methods."""
    rows = pd.concat([read(table, component + ending) for table, ending in _OF_TABLE.items()])
    if held_out:
        rows = rows[rows["data"] == "held_out"]
    wide = rows.pivot(index=["participant", "trial"], columns="method", values="value")
    known = [method for method in METHODS if method in wide]
    means = wide[known].dropna().groupby(level="participant").mean().reindex(columns=METHODS)
    return means[(means[[OM, RM]] > 0.0).all(axis="columns")]


def errors_per_task(read: ReadValues, variable: str) -> pd.DataFrame:
    """Rows of one error of table 4: participant, task, data, RM, RM+mass, OM; the mean over the
    runs."""
    wide = read("table4", variable).pivot_table(
        index=["participant", "task", "data"], columns="method", values="value", aggfunc="mean"
    )
    return wide.reindex(columns=METHODS).reset_index()
