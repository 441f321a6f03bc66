"""All that the cohort's report reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from bsip_cli.report.figures.workflow import Step
from bsip_cli.report.gains import Gain
from bsip_cli.report.records import Origin, Refusal
from bsip_cli.report.tables.model import Table
from bsip_cli.report.words import COMPONENTS, trial_label

_OF_TABLE = {"table4": "", "table5": "_rmse"}  # tables of errors, and the ending of their variables
ERROR_TABLES = (*_OF_TABLE,)
ERROR_VARIABLES = ("cop_error", *(c + ending for c in COMPONENTS for ending in _OF_TABLE.values()))


@dataclass(frozen=True)
class Member:
    """One participant of the study; the first rows of person and identification, if there."""

    id: str
    facts: Mapping[str, Any] | None
    identification: Mapping[str, Any] | None
    has_report: bool
    refusals: tuple[Refusal, ...]


@dataclass(frozen=True)
class CohortRecord:
    """Attributes: ``errors`` the rows of the values that are of `ERROR_TABLES` and
    `ERROR_VARIABLES`; ``missing`` sentences on who is in no table; ``table_files`` relative to
    OUT; ``steps`` the stages in order."""

    members: tuple[Member, ...]
    errors: pd.DataFrame
    tables: tuple[Table, ...]
    table_files: tuple[str, ...]
    missing: tuple[str, ...]
    origins: tuple[Origin, ...]
    steps: tuple[Step, ...]

    def gains(self) -> dict[str, tuple[Gain, ...]]:
        """Participant -> errors of RM and OM in each trial and component."""
        people = self.errors.groupby("participant", sort=True)
        return {str(name): _gains(rows) for name, rows in people}

    def errors_per_task(self, variable: str) -> pd.DataFrame:
        """Rows of one error of table 4: participant, task, data, RM, OM; the mean over the runs."""
        rows = self.errors[self.errors["table"] == "table4"]
        rows = rows[rows["variable"] == variable]
        wide = rows.pivot_table(
            index=["participant", "task", "data"], columns="method", values="value", aggfunc="mean"
        )
        return wide.reindex(columns=["RM", "OM"]).reset_index()


def _gains(rows: pd.DataFrame) -> tuple[Gain, ...]:
    kept = {
        (r["trial"], r["table"], r["variable"], r["method"]): r for r in rows.to_dict("records")
    }
    gains = []
    for trial in dict.fromkeys(rows["trial"]):
        for component in COMPONENTS:
            for table, ending in _OF_TABLE.items():
                rm = kept.get((trial, table, component + ending, "RM"))
                om = kept.get((trial, table, component + ending, "OM"))
                if rm is not None and om is not None:
                    unit = om["unit"].replace("% body weight", "% BW")
                    gains.append(
                        Gain(
                            trial_label(trial),
                            component,
                            unit,
                            float(rm["value"]),
                            float(om["value"]),
                            om["data"] == "held_out",
                        )
                    )
    return tuple(gains)


def ratio_of_means(gains: tuple[Gain, ...], component: str) -> float:
    """Mean error of OM over mean error of RM, NaN where nothing is known."""
    known = [g for g in gains if g.component == component and np.isfinite(g.rm + g.om)]
    rm, om = sum(g.rm for g in known), sum(g.om for g in known)
    return om / rm if rm > 0.0 and om > 0.0 else float("nan")
