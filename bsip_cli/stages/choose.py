"""choose: which parameters to use, by the errors in movements that OM never saw.

Reads identification, used-blocks, and the fit and reconstruction of all trials; writes choice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.dynamics.lowpass import stretches
from bsip_cli.report.choice import ALL, reason_of
from bsip_cli.running.unit import Unit
from bsip_cli.statistics.choice import (
    COMPONENTS,
    PAIRS,
    Difference,
    Differences,
    Pair,
    between,
    chosen,
    within,
)
from bsip_cli.statistics.methods import MEASURED, METHODS, OM, RM
from bsip_cli.study.study import Trial

_SIGNALS = ["fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm", "cop_ap_m", "cop_ml_m"]
_COLUMNS = {PAIRS[0]: "om", PAIRS[2]: "rm_mass", PAIRS[1]: "om_rm_mass"}
_UNKNOWN = dict.fromkeys(PAIRS, Difference(np.nan, np.nan))


@dataclass(frozen=True)
class Judge:
    """A trial that may judge: its mean logarithm of the error by method; what it tells alone."""

    trial: Trial
    log_error: dict[str, float]
    alone: Callable[[Pair], Difference]


def run(unit: Unit) -> None:
    """A row over all movements, and one per movement."""
    identification = unit.read("identification").set_index("method")
    if identification.empty:
        why = "nothing was identified: the table's parameters stand alone"
        unit.write("choice", pd.DataFrame([_row(ALL, RM, _UNKNOWN, 0, "none", why)]))
        return
    judges, data = _judges(unit)
    is_rare = bool(identification.loc[OM, "rare"])
    by_movement: dict[str, list[Judge]] = {}
    for judge in judges:
        by_movement.setdefault(judge.trial.task, []).append(judge)
    of_each = {movement: _differences(trials) for movement, trials in by_movement.items()}
    counts = {movement: len(trials) for movement, trials in by_movement.items()}
    found = {ALL: _over_all(of_each), **of_each}
    rows = []
    for movement, differences in found.items():
        use, n = chosen(differences, is_rare), counts.get(movement, len(judges))
        why = reason_of(differences, is_rare, n, data)
        rows.append(_row(movement, use, differences, n, data, why))
    unit.warn(f"{unit.name}: use {rows[0]['use']}: {rows[0]['reason']}")
    unit.write("choice", pd.DataFrame(rows))


def _row(
    movement: str, use: str, differences: Differences, trials: int, data: str, why: str
) -> dict:
    ratios = {f"ratio_{name}": differences[pair].ratio for pair, name in _COLUMNS.items()}
    errors = {f"log_error_{name}": differences[pair].error for pair, name in _COLUMNS.items()}
    known = {"movement": movement, "use": use, "trials": trials, "data": data, "reason": why}
    return known | ratios | errors


# --- who judges -------------------------------------------------------------------------------


def _judges(unit: Unit) -> tuple[list[Judge], str]:
    """Moving trials that OM never saw; without any, the seconds of its own that were held out.

    Forces that an external contact bears judge nobody.
    """
    own = set(unit.read("used-blocks")["trial"])
    contacts = unit.facts("identification").get("external_contacts", {})
    moving = [t for t in unit.trials("fit", "reconstruction") if t.role != "static"]
    for trial in moving:
        if trial.stem in contacts:
            unit.warn(f"{unit.name}: {trial.stem} does not judge: {contacts[trial.stem]}")
    judges = [_judge(unit, trial) for trial in moving if trial.stem not in contacts]
    known = [judge for judge in judges if judge is not None]
    unseen = [judge for judge in known if judge.trial.stem not in own]
    return (unseen, "whole_trials") if unseen else (known, "held_out" if known else "none")


def _judge(unit: Unit, trial: Trial) -> Judge | None:
    """None where no held-out frame of a trial compares all methods."""
    fit = unit.read("fit", trial)
    held_out = fit[(fit["data"] == "held_out") & fit["method"].isin(METHODS)]
    errors = held_out.pivot(index="component", columns="method", values="rmse")
    errors = errors.reindex(index=COMPONENTS, columns=METHODS).dropna()
    if errors.empty:
        return None
    logs = np.log(errors).mean()
    components = [COMPONENTS.index(name) for name in errors.index]
    return Judge(trial, logs.to_dict(), lambda pair: _within(unit, trial, pair, components))


def _within(unit: Unit, trial: Trial, pair: Pair, components: list[int]) -> Difference:
    rows = unit.read("reconstruction", trial)
    measured = rows[rows["method"] == MEASURED]
    judged = measured["valid"].to_numpy() & ~measured["used"].to_numpy()
    signals = [rows.loc[rows["method"] == name, _SIGNALS].to_numpy() for name in METHODS]
    residuals = np.array(signals)[..., components] - measured[_SIGNALS].to_numpy()[:, components]
    residuals[:, ~np.isfinite(residuals).all(axis=0)] = np.nan  # over the same frames, as in fit
    first, second = (residuals[METHODS.index(name)] for name in pair)
    return within(first, second, stretches(judged))


# --- differences ------------------------------------------------------------------------------


def _differences(judges: list[Judge]) -> Differences:
    """In one movement."""
    if len(judges) == 1:
        return {pair: judges[0].alone(pair) for pair in PAIRS}
    return {
        (a, b): between([judge.log_error[a] - judge.log_error[b] for judge in judges])
        for a, b in PAIRS
    }


def _over_all(of_each: dict[str, Differences]) -> Differences:
    """Every movement counts once; of a single one, as far as its own trials tell."""
    if not of_each:
        return _UNKNOWN
    if len(of_each) == 1:
        return next(iter(of_each.values()))
    return {pair: between([one[pair].log for one in of_each.values()]) for pair in PAIRS}
