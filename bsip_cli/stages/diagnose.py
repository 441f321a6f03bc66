"""diagnose: what the simulation gets wrong in all trials of a person, and in each trial."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any
from zlib import crc32

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table, table_of
from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.diagnosis.error_budget import Line, Yardsticks, budget_of, large_errors
from bsip_cli.diagnosis.error_model import BLOCK_S, error_model, session_of
from bsip_cli.diagnosis.fault_scores import Library, library_of, limits_of
from bsip_cli.diagnosis.fault_search import Found, Verdict, search
from bsip_cli.diagnosis.findings import Finding, findings_of
from bsip_cli.diagnosis.held_out import FOLDS, HeldOut, first_blocks, held_out
from bsip_cli.diagnosis.marker_proof import BEND, bend_of, shaken_finding
from bsip_cli.diagnosis.shared_faults import with_known
from bsip_cli.effects.catalogue import CATALOGUE
from bsip_cli.effects.effect import Number, Words
from bsip_cli.effects.nameless import NAMELESS, UNEXPLAINED
from bsip_cli.report.budget import term_words
from bsip_cli.report.causes import candidates_of, causes_of
from bsip_cli.report.verdict import cause_line, verdict_of
from bsip_cli.running.unit import Unit
from bsip_cli.stages.diagnosed_trials import Diagnosed, diagnosed, weighed
from bsip_cli.stages.frames import person_of
from bsip_cli.stages.known_laboratory import Known, known_laboratory
from bsip_cli.stages.reconstruct import scale_of
from bsip_cli.stages.trial_scene import cause_record

ASKED = (*CATALOGUE, *NAMELESS)


def run(unit: Unit) -> None:
    """Read motion, wrench, person and RM of all trials; write what is wrong, with its evidence."""
    person = person_of(unit)
    of_mass = weighed(unit, person)
    asked = [diagnosed(unit, of_mass.prior, t, s) for t, s in of_mass.scenes]
    trials = [one for one in asked if one is not None]
    findings: tuple[Finding, ...] = of_mass.findings
    facts: dict[str, Any] = {"heavier_by": of_mass.share, "trials": [], "causes": []}
    limits = empty_table("detection")
    free = [one for one in trials if one.held is None]
    rng = np.random.default_rng(crc32(unit.name.encode()))
    if any(one.moves for one in free):
        known = known_laboratory(unit)
        found, library, held = _searched(unit, free, known)
        named_from = unit.config.diagnosis.named_from
        more = findings_of(found, held, named_from, rng)
        named = {(one.effect, one.target) for one in more if one.verdict == "named"}
        if any((one.effect, one.target) in named for one in findings):
            findings = ()  # the movements show which cause of the stated mass's group it is
        findings = (*findings, *more)
        findings = tuple(sorted(findings, key=lambda one: one.verdict == "rejected"))
        facts |= facts_of(found, held, findings)
        limits = detection_rows(found, library, named_from)
        findings = (*_of_markers(free, held, findings, rng), *findings)
        # slips that the forces show too, of one size for all folds: no plate helped to find them
        slips = [(one.trial.stem, slip) for one in free for slip in one.slips]
        facts["causes"][:0] = [
            cause_record(slip.effect.name, slip.target, (stem,), slip.values)
            for number, (stem, slip) in enumerate(slips)
            if held.gain(number).is_real()
        ]
        if known is not None:
            mine = [one.errors for one in free]
            findings = (*known.findings(mine), *findings)
            facts["causes"] = [*known.causes(mine), *facts["causes"]]
            limits = known.limits(limits)
    findings = (*(one.held.finding(one.trial.stem) for one in trials if one.held), *findings)
    budget, large = error_budget(unit, trials, facts["causes"])
    # large errors, less the trials already reported with an error of unknown cause
    unknown = [f for f in findings if f.effect == UNEXPLAINED and f.verdict == "named"]
    reported = {trial for one in unknown for trial in one.trials}
    left = [(one, tuple(t for t in one.trials if t not in reported)) for one in large]
    findings = (*(replace(one, trials=trials) for one, trials in left if trials), *findings)
    if not trials:
        unit.say("no trial has motion with every contact on a plate; no movement can be diagnosed")
    stems = [one.trial.stem for one in trials]
    facts["trials"] = [*dict.fromkeys([*stems, *(t for f in findings for t in f.trials)])]
    diagnosis = rows_of(findings, tuple(facts["trials"]))
    unit.write("overall-error-budget", budget)
    unit.write("overall-diagnosis", diagnosis, facts)
    unit.write("detection", limits)
    said = verdict_of(diagnosis, limits, budget=budget)
    lines = [cause_line(one, facts["trials"]) for one in causes_of(candidates_of(diagnosis))]
    for sentence in filter(None, (*(lines or [said.headline]), said.limits)):
        unit.say(sentence)


def _searched(
    unit: Unit, trials: Sequence[Diagnosed], known: Known | None
) -> tuple[Found, Library, HeldOut]:
    """Faults that the forces show, given what the markers prove and other persons show."""
    options, given = unit.config.diagnosis, [one.errors for one in trials]
    if known is not None:
        of_all = known.coordinates, known.mean, known.root
        given = [with_known(one.errors, not one.moves, *of_all) for one in trials]
    session = session_of(given)
    alone = [t for t, one in enumerate(trials) if one.moves]
    library = library_of(session, ASKED, alone, options.fault_prior_odds)
    slips = [slip.hypothesis(session, t) for t, one in enumerate(trials) for slip in one.slips]
    found = search(library, options.named_from, slips)
    return found, library, held_out(found.fit)


def _of_markers(
    trials: Sequence[Diagnosed],
    held: HeldOut,
    findings: Sequence[Finding],
    rng: np.random.Generator,
) -> Iterator[Finding]:
    """What markers prove; and a bend of the trunk, where the forces have not shown it already."""
    bent = {t for f in findings if f.effect == BEND and f.verdict != "rejected" for t in f.trials}
    number = 0
    for k, one in enumerate(trials, start=1):
        stem, scene = one.trial.stem, one.errors.scene
        for slip in one.slips:
            yield slip.finding(scene, stem, held.gain(number))
            number += 1
        if one.shaken:
            yield shaken_finding(scene, one.shaken, stem)
        if one.moves and stem not in bent:
            yield from bend_of(scene, (*one.slips, *one.shaken), stem, f"M{k}", rng)


# --- the error budget -----------------------------------------------------------------------------

_KIND = "overall-error-budget"
_MORE_THAN_USUAL = 2.0  # times the usual size: what is usual is no cause of a large error
_MOST_PERCENT = 20.0  # of the squared error: less explains nothing
_WHOLE, _PARTS = "each trial from the others", f"each fifth of a trial from the other {FOLDS - 1}"


def error_budget(
    unit: Unit, trials: Sequence[Diagnosed], causes: Sequence[Mapping[str, object]]
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
    budget = table_of(_KIND, rows)
    usual = error_model(errors, 1, adapt=False)
    options, weight_N = unit.config.diagnosis, trials[0].scene.mass_kg * GRAVITY_M_S2
    limits = options.large_cop_error_m, 0.01 * options.large_force_error_percent
    yardsticks = Yardsticks(*limits, options.least_correlation, weight_N)
    asked = [k for k, one in enumerate(trials) if one.held is None]
    return budget, large_errors(usual, grounds, asked, yardsticks, partial(_along, budget))


def _along(budget: pd.DataFrame, trials: Sequence[str], component: str) -> str:
    """What most of an error goes along with that is more than usual: the budget sizes everything
    freely, which is no proof."""
    mine = budget[budget["trial"].isin(trials) & (budget["component"] == component)]
    rows = mine[(mine["target"] == "") & (mine["scale"] > _MORE_THAN_USUAL)]
    shares = rows.groupby("term", sort=False)["share_percent"].mean()
    if shares.empty or not shares.max() > _MOST_PERCENT:
        return "nothing that bsip knows goes along with it"
    return (
        f"{shares.max():.0f} % of it would go along with {term_words(str(shares.idxmax()))}, which "
        "is not sure enough to be named"
    )


def _rows(lines: Sequence[Line], trial: str, data: str) -> Iterator[dict[str, object]]:
    for one in lines:
        factor, unit = scale_of(one.component)
        gain = one.gain
        alike = {k: getattr(one, k) for k in ("term", "target", "component", "scale")}
        known = alike | {"rms": factor * one.rms, "unit": unit, "share_percent": 100 * one.share}
        known |= {"share_low": 100 * one.share_low, "share_high": 100 * one.share_high}
        known |= {"gain_percent": gain.percent, "gain_low": gain.ci_low, "gain_high": gain.ci_high}
        known |= {"data": data if np.isfinite(gain.percent) else "", "trial": trial}
        yield known | {"alike": ", ".join(one.alike)}


# --- of a person's diagnosis, what concerns one trial -------------------------------------------


def run_trial(unit: Unit) -> None:
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
        known = {name: getattr(one, name) for name in of_all} | dict(gain) | vars(one.words)
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


def facts_of(found: Found, held: HeldOut, findings: tuple[Finding, ...]) -> dict[str, object]:
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


def _bounds(found: Found, verdict: Verdict) -> dict[str, float]:
    """Standard deviation of all that a fault reports, by the slope of that."""
    fit, one = found.fit, found.fit.faults[verdict.number]
    slopes = []
    for step in _STEP * np.diag(one.typical):
        ahead, behind = (
            np.array([x for *_, x in one.with_values(v).reported()])
            for v in (one.values + step, one.values - step)
        )
        slopes.append((ahead - behind) / (2 * _STEP))
    slope = np.stack(slopes, axis=1)
    spread = np.sqrt(np.einsum("ij,jk,ik->i", slope, fit.covariance_of(verdict.number), slope))
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
