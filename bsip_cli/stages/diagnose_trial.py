"""diagnose (trial): of what is wrong in a person's trials, what concerns this one."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table, table_of
from bsip_cli.diagnosis.error_model import BLOCK_S
from bsip_cli.diagnosis.fault_scores import Library, limits_of
from bsip_cli.diagnosis.fault_search import Found, Verdict
from bsip_cli.diagnosis.findings import Finding
from bsip_cli.diagnosis.held_out import FOLDS, HeldOut, first_blocks
from bsip_cli.effects.effect import Number, Words
from bsip_cli.running.unit import Unit


def run(unit: Unit) -> None:
    """Read the person's diagnosis and error budget; write this trial's part of them."""
    stem, overall = unit.own_trial.stem, unit.read("overall-diagnosis")
    budget = unit.read("overall-error-budget")
    unit.write("error-budget", budget[budget["trial"] == stem])
    if stem not in unit.facts("overall-diagnosis").get("trials", []):
        unit.write("diagnosis", empty_table("diagnosis"))
        return
    concerned = np.array([stem in trials.split(", ") for trials in overall["trials"]], dtype=bool)
    classes = set(overall["class_id"][concerned]) - {""}  # those of other trials belong to them
    concerned |= overall["class_id"].isin(classes).to_numpy()
    rows = overall[concerned & (overall["effect"] != "none").to_numpy()]
    if (rows["verdict"] == "rejected").all():
        p_value = float(rows["p_value"].min()) if len(rows) else np.nan
        none = rows_of((nothing(p_value, (stem,)),), (stem,))
        rows = pd.concat([none, rows], ignore_index=True)
        rows["rank"] = [1, *(rows["rank"][1:] + 1)]
    rows["rank"] = rows["rank"].rank(method="dense").astype(int)
    unit.write("diagnosis", rows)


# --- what the artifacts of a person's diagnosis hold: rows of findings and limits, facts ----------

_STEP = 1e-3  # of the typical size


def rows_of(findings: tuple[Finding, ...], trials: tuple[str, ...]) -> pd.DataFrame:
    """One row per parameter; where nothing is named in the trials that were analysed, a first row
    that says so."""
    if trials and all(one.verdict == "rejected" for one in findings):
        least = pd.Series([one.p_value for one in findings], dtype=float).min()
        findings = (nothing(least, trials), *findings)
    of_all = ["effect", "target", "p_value", "verdict", "class_id", "sentence", "probability"]
    of_all += ["scope", "rms_change"]
    rows = []
    for rank, one in enumerate(findings, start=1):
        gain = zip(("gain_percent", "gain_ci_low", "gain_ci_high"), one.gain, strict=True)
        known: dict = {name: getattr(one, name) for name in of_all} | dict(gain) | vars(one.words)
        known |= {"rank": rank, "trials": ", ".join(one.trials)}
        own, known["persons"] = one.own, one.persons
        for x in one.numbers:
            sizes = {"estimate": x.value, "unit": x.unit, "ci_low": x.low, "ci_high": x.high}
            alone = own if own and own.name == x.name else Number(x.name, x.unit, np.nan)
            sizes |= {"own_estimate": alone.value, "own_low": alone.low, "own_high": alone.high}
            rows.append(known | {"parameter": x.name} | sizes)
    return table_of("overall-diagnosis", rows)


def nothing(p_value: float, trials: tuple[str, ...]) -> Finding:
    """That a diagnosis has found nothing."""
    said = (Number("", "", np.nan),), Words("nothing wrong above the noise")
    return Finding("none", "", trials, *said, p_value, 1 - p_value, scope="")


def facts_of(found: Found, held: HeldOut, findings: tuple[Finding, ...]) -> dict:
    """The faults in full: their values from all data and from each fold's training blocks, for
    ``extend``, and the standard deviation of what is reported if the error's model is exact."""
    session = found.fit.session
    said = {(f.effect, f.target, f.trials): f.verdict for f in findings if f.verdict != "rejected"}
    causes = []
    for one in found.verdicts:
        fault = found.fit.faults[one.number]
        trials = tuple(session.trials[t].name for t in fault.trials)
        key = fault.effect.name, fault.target, trials
        if key in said:
            more = held.values(one.number).tolist(), _bounds(found, one)
            causes.append(cause_record(*key, fault.values, *more, said[key]))
    blocks = {
        one.name: {"first": first, "start_s": float(one.times_s[0])}
        for one, first in zip(session.trials, first_blocks(session), strict=True)
    }
    known = {"trials": [*blocks], "causes": causes, "blocks": blocks}
    return known | {"block_s": BLOCK_S, "folds": FOLDS}


def cause_record(
    effect: str,
    target: str,
    trials: tuple[str, ...],
    values: np.ndarray,
    folds: list[list[float]] | None = None,
    bounds: dict[str, float] | None = None,
    verdict: str = "named",
) -> dict:
    """A cause for ``extend``; of the same sizes in every fold where ``folds`` says none."""
    sizes = values.tolist()
    known = {"effect": effect, "target": target, "trials": list(trials), "verdict": verdict}
    return known | {"values": sizes, "folds": folds or [sizes] * FOLDS, "bounds": bounds or {}}


def _bounds(found: Found, verdict: Verdict) -> dict[str, float]:
    """Standard deviation of all that a fault reports, by the slope of that."""
    fit, one = found.fit, found.fit.faults[verdict.number]
    mine = fit.coefficients(verdict.number)
    slopes = []
    for step in _STEP * np.diag(one.typical):
        ahead, behind = (
            np.array([x for *_, x in one.with_values(v).reported()])
            for v in (one.values + step, one.values - step)
        )
        slopes.append((ahead - behind) / (2 * _STEP))
    slope = np.stack(slopes, axis=1)
    spread = np.sqrt(np.einsum("ij,jk,ik->i", slope, fit.covariance[mine, mine], slope))
    names = [name for name, *_ in one.reported()]
    return dict(zip(names, spread.tolist(), strict=True))


def detection_rows(found: Found, library: Library, named_from: float) -> pd.DataFrame:
    """The ``detection`` artifact: the smallest size of every fault that would have been named."""
    rows = []
    for limit in limits_of(library, found.scores, named_from):
        effect, target, numbers = limit.kind
        trials = [library.session.trials[t].name for t in numbers]
        row = {"effect": effect.name, "target": target, "parameter": limit.parameter}
        rows.append(row | {"unit": limit.unit, "limit": limit.size, "trials": ", ".join(trials)})
    return table_of("detection", rows)
