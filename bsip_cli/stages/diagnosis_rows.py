"""Findings as the rows of the diagnosis artifact."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.diagnosis.findings import Finding, Number

NOTHING = "none"
_KIND = "overall-diagnosis"


def rows_of(findings: tuple[Finding, ...], trials: tuple[str, ...]) -> pd.DataFrame:
    """One row per parameter; where nothing is named in the trials that were looked at, a first row
    that says so."""
    rows = []
    if trials and all(one.verdict == "rejected" for one in findings):
        rows.append(
            nothing(pd.Series([one.p_value for one in findings], dtype=float).min(), trials)
        )
    first = len(rows) + 1
    for rank, one in enumerate(findings, start=first):
        rows += [_row(rank, one, number) for number in one.numbers]
    return pd.DataFrame(rows) if rows else empty_table(_KIND)


def nothing(p_value: float, trials: tuple[str, ...]) -> dict:
    """The row of a diagnosis that has found nothing."""
    return {
        "rank": 1,
        "effect": NOTHING,
        "target": "",
        "parameter": "",
        "estimate": np.nan,
        "unit": "",
        "ci_low": np.nan,
        "ci_high": np.nan,
        "p_value": p_value,
        "gain_percent": np.nan,
        "gain_ci_low": np.nan,
        "gain_ci_high": np.nan,
        "verdict": "named",
        "class_id": "",
        "sentence": "nothing wrong above the noise",
        "trials": ", ".join(trials),
        "probability": 1 - p_value,
        "scope": "",
        "rms_change": np.nan,
    }


def _row(rank: int, one: Finding, number: Number) -> dict:
    gain, low, high = one.gain
    return {
        "rank": rank,
        "effect": one.effect,
        "target": one.target,
        "parameter": number.name,
        "estimate": number.value,
        "unit": number.unit,
        "ci_low": number.low,
        "ci_high": number.high,
        "p_value": one.p_value,
        "gain_percent": gain,
        "gain_ci_low": low,
        "gain_ci_high": high,
        "verdict": one.verdict,
        "class_id": one.class_id,
        "sentence": one.sentence,
        "trials": ", ".join(one.trials),
        "probability": one.probability,
        "scope": one.scope,
        "rms_change": one.rms_change,
    }
