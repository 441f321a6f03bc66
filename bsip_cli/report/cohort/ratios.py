"""Errors of OM beside those of RM over the cohort, from the rows of ``values``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.report.words import COMPONENTS

_OF_TABLE = {"table4": "", "table5": "_rmse"}  # tables of errors, and the ending of their variables
TASK_ERRORS = ("cop_error", "grf_vertical")
"""Errors of table 4 that are shown per movement."""

ReadValues = Callable[[str, str], pd.DataFrame]
"""Table and variable to their rows of ``values``."""


@dataclass(frozen=True, eq=False)
class Ratios:
    """Mean error of OM over mean error of RM, NaN where one is not known or zero.

    of_component : (p,) over participants, per component of which there is any; held_out : over
    held-out data, or, where nobody has any, over all.
    """

    of_component: dict[str, np.ndarray]
    held_out: bool


def ratios_of(read: ReadValues) -> Ratios:
    """Participants in the order of their ids, each with a ratio in some component."""
    for held_out in (True, False):
        found = {name: _ratio_of_means(_both_methods(read, name, held_out)) for name in COMPONENTS}
        table = pd.DataFrame(found).sort_index().dropna(axis="columns", how="all")
        if not table.empty:
            return Ratios({str(name): table[name].to_numpy() for name in table}, held_out)
    return Ratios({}, held_out=False)


def _both_methods(read: ReadValues, component: str, held_out: bool) -> pd.DataFrame:
    """Columns OM and RM over (participant, trial), where both are known."""
    rows = pd.concat([read(table, component + ending) for table, ending in _OF_TABLE.items()])
    if held_out:
        rows = rows[rows["data"] == "held_out"]
    wide = rows.pivot(index=["participant", "trial"], columns="method", values="value")
    return wide.reindex(columns=["OM", "RM"]).dropna()


def _ratio_of_means(errors: pd.DataFrame) -> pd.Series:
    sums = errors.groupby(level="participant").sum()
    return (sums["OM"] / sums["RM"]).where((sums > 0.0).all(axis="columns"))


def errors_per_task(read: ReadValues, variable: str) -> pd.DataFrame:
    """Rows of one error of table 4: participant, task, data, RM, OM; the mean over the runs."""
    wide = read("table4", variable).pivot_table(
        index=["participant", "task", "data"], columns="method", values="value", aggfunc="mean"
    )
    return wide.reindex(columns=["RM", "OM"]).reset_index()
