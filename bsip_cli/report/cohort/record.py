"""All that the cohort's report reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Light
from bsip_cli.report.records import HowMade, Refusal
from bsip_cli.report.shared import Searched
from bsip_cli.report.tables.model import Table
from bsip_cli.report.words import COMPONENTS
from bsip_cli.report.yardsticks import COP, FORCE, MARKERS
from bsip_cli.statistics.methods import METHODS, OM, RIVALS, RM

_OF_TABLE = {"table4": "", "table5": "_rmse"}  # tables of errors, and the ending of their variables

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


def yardsticks_of(read: ReadValues, use: Mapping[str, str]) -> dict[str, dict[str, float]]:
    """By participant, the errors of the method that each is to use: the root mean square over the
    trials with held-out data, or over all where there are none."""
    found: dict[str, dict[str, float]] = {}
    for name, variable in ((COP, "cop_error"), (FORCE, "grf_vertical")):
        rows = read("table4", variable).dropna(subset="value")
        rows = rows[rows["method"] == rows["participant"].map(use)]
        for participant, own in rows.groupby("participant"):
            unseen = own[own["data"] == "held_out"]
            chosen = (unseen if len(unseen) else own)["value"]
            found.setdefault(str(participant), {})[name] = float(np.sqrt((chosen**2).mean()))
    return found


@dataclass(frozen=True)
class Member:
    """One participant of the study; what is shown of person and identification, which parameters
    to use, the errors with them, what a diagnosis found, and the light of the report, if there."""

    id: str
    facts: Mapping[str, Any] | None
    identification: Mapping[str, Any] | None
    has_report: bool
    refusals: tuple[Refusal, ...]
    searched: Searched | None = None
    use: str = ""
    errors: Mapping[str, float] | None = None
    light: Light | None = None

    def yardstick(self, name: str) -> float:
        """In the unit of the yardstick; NaN where it is not known."""
        if name == MARKERS:
            return np.nan if self.facts is None else 1e3 * float(self.facts["marker_rms_m"])
        return (self.errors or {}).get(name, np.nan)

    def link(self) -> str:
        return f"../{self.id}/report.html" if self.has_report else ""


@dataclass(frozen=True, eq=False)
class CohortRecord:
    """Attributes: ``ratios`` of the errors of the methods; ``missing`` sentences on who is in no
    table; ``table_files`` relative to OUT; ``defaults`` every option's shipped value; ``laboratory``
    the table of that kind, if there."""

    members: tuple[Member, ...]
    ratios: Ratios
    tables: tuple[Table, ...]
    table_files: tuple[str, ...]
    missing: tuple[str, ...]
    made: HowMade
    defaults: Mapping[str, Any]
    laboratory: pd.DataFrame | None = None
