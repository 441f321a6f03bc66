"""The error budget of a person's trials, and errors too large to be passed over, as tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.diagnosis.error_budget import Line, Yardsticks, budget_of, large_errors
from bsip_cli.diagnosis.error_model import TrialErrors, error_model
from bsip_cli.diagnosis.findings import Finding
from bsip_cli.diagnosis.held_out import FOLDS
from bsip_cli.report.budget import term_words
from bsip_cli.running.unit import Unit
from bsip_cli.stages.diagnosed_trials import Diagnosed
from bsip_cli.stages.reconstruct import scale_of

_KIND = "overall-error-budget"
_MORE_THAN_USUAL = 2.0  # times the usual size: what is usual is no cause of a large error
_MOST_PERCENT = 20.0  # of the squared error: less explains nothing
_WHOLE, _PARTS = "each trial from the others", f"each fifth of a trial from the other {FOLDS - 1}"


def error_budget(
    unit: Unit, trials: Sequence[Diagnosed], causes: Sequence[Mapping]
) -> tuple[pd.DataFrame, tuple[Finding, ...]]:
    """The ``overall-error-budget``, and what is too large for all that is named or usual.

    causes : as in the facts of ``overall-diagnosis``; they are part of the model. What hands bear
    that hold on to something is a term, and no large error.
    """
    if not trials:
        return empty_table(_KIND), ()
    whole = sum(one.moves for one in trials) > 1
    errors, grounds = [one.with_causes(causes) for one in trials], [one.ground for one in trials]
    model = error_model(errors, 1 if whole else FOLDS)
    rng = np.random.default_rng(0)
    every = range(len(trials))
    data = _WHOLE if whole else _PARTS
    rows = [*_rows(budget_of(model, grounds, every, rng), "", data)]
    for k in every:
        rows += _rows(budget_of(model, grounds, (k,), rng), errors[k].name, data)
    budget = pd.DataFrame(rows)
    return budget, _large(unit, trials, errors, partial(_along, budget))


def _along(budget: pd.DataFrame, trials: Sequence[str], component: str) -> str:
    """What most of an error goes along with that is more than usual: the budget sizes everything
    freely, which is no proof."""
    rows = budget[
        budget["trial"].isin(trials)
        & (budget["component"] == component)
        & (budget["target"] == "")
        & (budget["scale"] > _MORE_THAN_USUAL)
    ]
    shares = rows.groupby("term", sort=False)["share_percent"].mean()
    if shares.empty or not shares.max() > _MOST_PERCENT:
        return "it goes along with nothing that bsip knows"
    return (
        f"{shares.max():.0f} % of it would go along with {term_words(str(shares.idxmax()))}, which "
        "is not sure enough to be named"
    )


def _large(
    unit: Unit,
    trials: Sequence[Diagnosed],
    errors: Sequence[TrialErrors],
    along: Callable[[Sequence[str], str], str],
) -> tuple[Finding, ...]:
    usual = error_model(errors, 1, adapt=False)
    options = unit.config.diagnosis
    yardsticks = Yardsticks(
        options.large_cop_error_m,
        0.01 * options.large_force_error_percent,
        options.least_correlation,
        trials[0].scene.mass_kg * GRAVITY_M_S2,
    )
    asked = [k for k, one in enumerate(trials) if one.held is None]
    return large_errors(usual, [one.ground for one in trials], asked, yardsticks, along)


def _rows(lines: Sequence[Line], trial: str, data: str) -> Iterator[dict]:
    for one in lines:
        factor, unit = scale_of(one.component)
        yield {
            "term": one.term,
            "target": one.target,
            "component": one.component,
            "rms": factor * one.rms,
            "unit": unit,
            "share_percent": 100 * one.share,
            "share_low": 100 * one.share_low,
            "share_high": 100 * one.share_high,
            "gain_percent": one.gain.percent,
            "gain_low": one.gain.ci_low,
            "gain_high": one.gain.ci_high,
            "data": data if np.isfinite(one.gain.percent) else "",
            "trial": trial,
            "scale": one.scale,
            "alike": ", ".join(one.alike),
        }
