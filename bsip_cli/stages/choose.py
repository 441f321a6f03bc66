"""choose: which parameters to use, by the errors in movements that OM never saw."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np
import pandas as pd

from bsip_cli.diagnosis.support import Support
from bsip_cli.report.words import count, listing, number
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import WRENCH
from bsip_cli.statistics import choice
from bsip_cli.statistics.methods import MEASURED, METHODS, OM, RM, RM_MASS
from bsip_cli.study.study import Trial

_SIGNALS = [*WRENCH, "cop_ap_m", "cop_ml_m"]
_COLUMNS = {choice.PAIRS[0]: "om", choice.PAIRS[2]: "rm_mass", choice.PAIRS[1]: "om_rm_mass"}
_UNKNOWN = dict.fromkeys(choice.PAIRS, choice.Difference(np.nan, np.nan))
_ALL = "all"  # movements
_FORCE = ["fx", "fy", "fz"]
_WHERE = {
    "whole_trials": "in {trials} that OM had not seen",
    "held_out": "in seconds held out of the trials that identified OM, which share their constant "
    "errors (no other trial is there)",
}
_DECIDING = {OM: choice.PAIRS[:2], RM_MASS: (choice.PAIRS[2], choice.PAIRS[1]), RM: choice.PAIRS}


@dataclass(frozen=True)
class Judge:
    """A trial that may judge: its mean logarithm of the error, and the RMSE of its ground force, by
    method; what it shows alone."""

    trial: Trial
    log_error: dict[str, float]
    force_N: dict[str, float]
    alone: Callable[[choice.Pair], choice.Difference]


def run(unit: Unit) -> None:
    """A row over all movements, and one per movement."""
    identification = unit.read("identification").set_index("method")
    if identification.empty:
        said = f"Use {RM}: nothing was identified, the table's parameters stand alone."
        unit.write("choice", pd.DataFrame([_row(_ALL, RM, _UNKNOWN, 0, "none", said)]))
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
    found = {_ALL: over_all, **of_each}
    use = {movement: choice.chosen(differences, is_rare) for movement, differences in found.items()}
    rows = []
    for movement, differences in found.items():
        judging, best = by_movement.get(movement, judges), use[movement]
        said = f"{_use(movement, use)}: {_why(best, differences, judging, data, is_rare)}"
        rows.append(_row(movement, best, differences, len(judging), data, said))
    unit.say(rows[0]["sentence"])
    unit.write("choice", pd.DataFrame(rows))


def _row(
    movement: str, use: str, differences: choice.Differences, trials: int, data: str, said: str
) -> dict[str, Any]:
    ratios = {f"ratio_{name}": differences[pair].ratio for pair, name in _COLUMNS.items()}
    errors = {f"log_error_{name}": differences[pair].error for pair, name in _COLUMNS.items()}
    known = {"movement": movement, "use": use, "trials": trials, "data": data, "sentence": said}
    return known | ratios | errors


# --- in words ---------------------------------------------------------------------------------


def _use(movement: str, use: dict[str, str]) -> str:
    """``Use RM+mass (for steps and walking: OM)``; of one movement ``Use OM for steps``."""
    if movement != _ALL:
        return f"Use {use[movement]} for {movement}"
    others = [
        f"for {listing(sorted(name for name in use if use[name] == other))}: {other}"
        for other in sorted(set(use.values()) - {use[_ALL]})
    ]
    return f"Use {use[_ALL]}" + (f" ({'; '.join(others)})" if others else "")


def _why(
    use: str, differences: choice.Differences, judges: list[Judge], data: str, is_rare: bool
) -> str:
    if not judges:
        return "no trial is left to judge by, so the table's parameters stand."
    where = _WHERE[data].format(trials=count(len(judges), "trial"))
    om, mass, table = (
        number(float(np.mean([judge.force_N[name] for judge in judges])), 0)
        for name in (OM, RM_MASS, RM)
    )
    decided = "; ".join(
        f"{first} errs {listing([_compared(b, differences[a, b]) for a, b in pairs])}"
        for first, pairs in groupby(_DECIDING[use], lambda pair: pair[0])
    )
    rare = " OM is not used: fewer than 1 in 100 people have such a body." if is_rare else ""
    return (
        f"{where} the ground force errs by {om} N with the identified parameters (OM), by {mass} N "
        f"with the table's scaled to the measured weight ({RM_MASS}), by {table} N with the "
        f"table's own ({RM}). Over forces, moments and centre of pressure together "
        f"{decided}.{rare}"
    )


def _compared(other: str, one: choice.Difference) -> str:
    """``30 to 41 % less than RM``: one standard error to either side."""
    ends = [100 * (ratio - 1) for ratio in one.interval()]
    if not np.isfinite(ends).all():
        change = 100 * (one.ratio - 1)
        how = f"{number(abs(change), 0)} % {'less' if change < 0 else 'more'} than {other}"
        return f"{how} (too few independent samples for an interval)"
    if max(map(abs, ends)) < 0.5:
        return f"as much as {other}"
    if ends[0] < 0 < ends[1]:
        low, high = (number(abs(end), 0) for end in ends)
        return f"between {low} % less and {high} % more than {other}"
    low, high = (number(size, 0) for size in sorted(map(abs, ends)))
    return f"{low} to {high} % {'less' if ends[1] <= 0 else 'more'} than {other}"


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
            force_N = np.sqrt((errors.reindex(_FORCE) ** 2).sum()).to_dict()
            components = [choice.COMPONENTS.index(name) for name in errors.index]
            alone = partial(_within, unit, trial, components)
            known.append(Judge(trial, np.log(errors).mean().to_dict(), force_N, alone))
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
