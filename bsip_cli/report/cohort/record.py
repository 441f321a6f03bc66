"""All that the cohort's report reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from bsip_cli.report.cohort.ratios import Ratios
from bsip_cli.report.figures.workflow import Step
from bsip_cli.report.origins import HowMade
from bsip_cli.report.records import Refusal
from bsip_cli.report.shared import Searched
from bsip_cli.report.tables.model import Table


@dataclass(frozen=True)
class Member:
    """One participant of the study; what is shown of person and identification, and what a
    diagnosis found, if there."""

    id: str
    facts: Mapping[str, Any] | None
    identification: Mapping[str, Any] | None
    has_report: bool
    refusals: tuple[Refusal, ...]
    searched: Searched | None = None


@dataclass(frozen=True, eq=False)
class CohortRecord:
    """Attributes: ``ratios`` of the errors of the methods; ``task_errors`` of an error's name in
    table 4; ``missing`` sentences on who is in no table; ``table_files`` relative to OUT;
    ``steps`` the stages in order; ``laboratory`` the table of that kind, if there."""

    members: tuple[Member, ...]
    ratios: Ratios
    task_errors: Mapping[str, pd.DataFrame]
    tables: tuple[Table, ...]
    table_files: tuple[str, ...]
    missing: tuple[str, ...]
    made: HowMade
    steps: tuple[Step, ...]
    laboratory: pd.DataFrame | None = None
