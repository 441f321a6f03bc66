"""choose: which parameters to use, by the errors in movements that OM never saw."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from bsip_cli.diagnosis.support import Support
from bsip_cli.report.errors import use_sentence
from bsip_cli.report.words import TEXTS
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import WRENCH
from bsip_cli.statistics import choice
from bsip_cli.statistics.methods import MEASURED, METHODS, OM, RM
from bsip_cli.study.study import Trial

_SIGNALS = [*WRENCH, "cop_ap_m", "cop_ml_m"]
_COLUMNS = {choice.PAIRS[0]: "om", choice.PAIRS[2]: "rm_mass", choice.PAIRS[1]: "om_rm_mass"}
_UNKNOWN = dict.fromkeys(choice.PAIRS, choice.Difference(np.nan, np.nan))
_ALL = "all"  # movements


@dataclass(frozen=True)
class Judge:
    """A trial that may judge: its mean logarithm of the error by method; what it shows alone."""

    trial: Trial
    log_error: dict[str, float]
    alone: Callable[[choice.Pair], choice.Difference]


def run(unit: Unit) -> None:
    """A row over all movements, and one per movement."""
    identification = unit.read("identification").set_index("method")
    if identification.empty:
        unit.write("choice", pd.DataFrame([_row(_ALL, RM, _UNKNOWN, 0, "none")]))
        return
    judges, data = _judges(unit)
    is_rare = bool(identification.loc[OM, "rare"])
    movements = dict.fromkeys(judge.trial.task for judge in judges)
    by_movement = {one: [judge for judge in judges if judge.trial.task == one] for one in movements}
    of_each = {
        movement: {pair: _difference(pair, trials) for pair in choice.PAIRS}
        for movement, trials in by_movement.items()
    }
    # every movement counts once; of a single one, as far as its own trials show
    over_all = next(iter(of_each.values()), _UNKNOWN)
    if len(of_each) > 1:
        logs = {pair: [one[pair].log for one in of_each.values()] for pair in choice.PAIRS}
        over_all = {pair: choice.between(each) for pair, each in logs.items()}
    rows = [
        _row(one, choice.chosen(x, is_rare), x, len(by_movement.get(one, judges)), data)
        for one, x in {_ALL: over_all, **of_each}.items()
    ]
    unit.say(use_sentence(pd.DataFrame(rows), identification.reset_index(), TEXTS["so_far"]))
    unit.write("choice", pd.DataFrame(rows))


def _row(
    movement: str, use: str, differences: choice.Differences, trials: int, data: str
) -> dict[str, Any]:
    ratios = {f"ratio_{name}": differences[pair].ratio for pair, name in _COLUMNS.items()}
    errors = {f"log_error_{name}": differences[pair].error for pair, name in _COLUMNS.items()}
    known = {"movement": movement, "use": use, "trials": trials, "data": data}
    return known | ratios | errors


# --- who judges -------------------------------------------------------------------------------


def _judges(unit: Unit) -> tuple[list[Judge], str]:
    """Moving trials that OM never saw; without any, the seconds of its own that were held out. What
    an external contact bears judges nobody."""
    own = set(unit.read("used-blocks")["trial"])
    contacts = unit.facts("identification")["external_contacts"]
    moving = [t for t in unit.trials("fit", "reconstruction") if t.role != "static"]
    known = []
    for trial in moving:
        if trial.stem in contacts:
            found = Support(**contacts[trial.stem]).words()
            unit.say(f"{trial.stem} does not judge: {found}")
            continue
        fit = unit.read("fit", trial)
        held_out = fit[(fit["data"] == "held_out") & fit["method"].isin(METHODS)]
        errors = held_out.pivot(index="component", columns="method", values="rmse")
        errors = errors.reindex(index=choice.COMPONENTS, columns=METHODS).dropna()
        if not errors.empty:  # some held-out frame compares all methods
            components = [choice.COMPONENTS.index(name) for name in errors.index]
            alone = partial(_within, unit, trial, components)
            known.append(Judge(trial, np.log(errors).mean().to_dict(), alone))
    unseen = [judge for judge in known if judge.trial.stem not in own]
    return (unseen, "whole_trials") if unseen else (known, "held_out" if known else "none")


def _within(
    unit: Unit, trial: Trial, components: list[int], pair: choice.Pair
) -> choice.Difference:
    rows = unit.read("reconstruction", trial)
    measured = rows[rows["method"] == MEASURED]
    judged = measured["valid"].to_numpy() & ~measured["used"].to_numpy()
    signals = [rows.loc[rows["method"] == name, _SIGNALS].to_numpy() for name in METHODS]
    residuals = np.array(signals)[..., components] - measured[_SIGNALS].to_numpy()[:, components]
    known = np.isfinite(residuals).all(axis=0) & judged[:, None]
    residuals[:, ~known] = np.nan  # over the same frames, as in fit
    first, second = (residuals[METHODS.index(name)] for name in pair)
    return choice.within(first, second)


def _difference(pair: choice.Pair, judges: list[Judge]) -> choice.Difference:
    if len(judges) == 1:
        return judges[0].alone(pair)
    return choice.between([one.log_error[pair[0]] - one.log_error[pair[1]] for one in judges])
