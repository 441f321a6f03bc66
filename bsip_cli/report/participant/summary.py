"""Section 1: what came out, in words."""

from __future__ import annotations

import numpy as np

from bsip_cli.report.blocks import Block, Bullets, Cell, Grid, Heading, Paragraph, Section
from bsip_cli.report.gains import (
    Errors,
    Gain,
    PooledGain,
    gains_of,
    one_number_alone,
    pooled_gains,
    relative_change,
)
from bsip_cli.report.participant import choice
from bsip_cli.report.participant.diagnosis import verdict
from bsip_cli.report.records import ParticipantRecord, TrialRecord, messages
from bsip_cli.report.words import (
    component_label,
    count,
    labelled,
    listing,
    number,
    percent,
    signed,
    trial_label,
)
from bsip_cli.statistics.methods import METHODS, OM, RIVALS, RM, RM_MASS, SAME_WITHIN
from bsip_cli.statistics.samples import Z95

_STRONGEST = 6
_SEXES = {"M": "a man", "F": "a woman"}


def section(record: ParticipantRecord) -> Section:
    blocks: list[Block] = [
        *_mass_note(record),
        *choice.blocks(record),
        Heading("Is anything wrong?"),
        *verdict(record),
        Heading("Who and what"),
        Paragraph(_who(record)),
        Paragraph(_trials(record)),
        Paragraph(_markers(record)),
        *_loads(record),
        Heading(
            "Do the identified parameters follow the forces better than the table's, and one number's?"
        ),
        *_gain(record),
        Heading("What to mind first"),
        *_warnings(record),
    ]
    return Section("summary", "Summary", tuple(blocks))


def all_gains(record: ParticipantRecord) -> tuple[Gain, ...]:
    """The gains of all trials of movement, trial by trial; standing still tells no method apart."""
    return tuple(
        gain
        for trial in record.trials
        if trial.fit is not None and trial.role != "static"
        for gain in gains_of(trial.label, trial.fit)
    )


def _mass_note(record: ParticipantRecord) -> list[Block]:
    """A gross disagreement of stated mass and plates comes before everything else."""
    note = str(record.facts["mass_note"])
    return [Bullets((f"{note[:1].upper()}{note[1:]}.",), "warning")] if note else []


def _who(record: ParticipantRecord) -> str:
    facts = record.facts
    mass, plates = float(facts["mass_kg"]), float(facts["plate_mass_kg"])
    who = (
        f"{record.id} is {_SEXES.get(facts['sex'], 'a person')} of {number(mass, 2)} kg "
        f"(from {facts['mass_source']}) and {number(facts['height_m'], 2)} m."
    )
    if not np.isfinite(plates):
        return f"{who} The plates tell no mass for sure to check it against."
    if facts["mass_source"] == "plates":
        return f"{who} What the plates tell of it is used."
    return (
        f"{who} The plates tell {number(plates, 2)} kg "
        f"({signed(100.0 * (plates / mass - 1.0), 1)} %)."
    )


def _trials(record: ParticipantRecord) -> str:
    used = record.identification_trials()
    held_out = [t for t in record.trials if _has_held_out(t)]
    tested = listing([t.label for t in held_out])
    seconds = record.identification["duration_s"].max() if len(record.identification) else np.nan
    calibration = trial_label(str(record.facts["calibration_trial"]))
    sentences = [
        f"The skeleton was calibrated on {calibration}.",
        f"The parameters were identified from {listing([t.label for t in used])}"
        + (f" ({number(seconds, 1)} s of it used)." if np.isfinite(seconds) else "."),
        f"They were tested on data that the identification had not seen in {tested}."
        if tested
        else "There was no other data to test them on.",
    ]
    return " ".join(sentences)


def _has_held_out(trial: TrialRecord) -> bool:
    fit = trial.fit if trial.role != "static" else None
    return fit is not None and bool((fit["data"] == "held_out").any())


def _markers(record: ParticipantRecord) -> str:
    sentence = (
        "In the frames that refined the skeleton the markers lie "
        f"{number(1000.0 * record.facts['marker_rms_m'], 1)} mm (RMS) from the model"
    )
    frames = [t.kinematics for t in record.trials if t.kinematics is not None]
    squares = [float((k["marker_rms_m"] ** 2).mean()) for k in frames if len(k)]
    squares = [s for s in squares if np.isfinite(s)]
    if not squares:
        return f"{sentence}."
    return (
        f"{sentence}; over all trials {number(1000.0 * np.sqrt(np.mean(squares)), 1)} mm. "
        "Skin markers of careful recordings usually stay below 10 mm."
    )


def _loads(record: ParticipantRecord) -> list[Block]:
    """What the person carried as the study says, and what was made of it."""
    if not record.loads:
        return []
    trials_of: dict[str, list[str]] = {}
    for trial, words in record.loads:
        trials_of.setdefault(words, []).append(trial)
    carried = "; ".join(f"{words} in {listing(trials)}" for words, trials in trials_of.items())
    return [
        Paragraph(
            f"Known loads, as study.toml states them: {carried}. They are no part of the masses "
            "above and below: their share of the ground forces was computed as of point masses, "
            "taken off before the identification and added to every simulated force."
        )
    ]


# --- gain -----------------------------------------------------------------------------------


def _gain(record: ParticipantRecord) -> list[Block]:
    gains = all_gains(record)
    held_out = [gain for gain in gains if gain.held_out]
    if not gains:
        return [
            Paragraph(
                "No trial could be compared with both methods: this report cannot say.", "warning"
            )
        ]
    chosen = held_out or list(gains)
    means = pooled_gains(chosen)
    if not means:
        return [
            Paragraph(
                "No trial has a stretch in which the forces could be compared: this "
                "report cannot say.",
                "warning",
            )
        ]
    blocks: list[Block] = []
    if not held_out:
        blocks.append(
            Paragraph(
                "No data were held out: the numbers below are from the very data that identified the "
                "parameters, and favour OM. They do not show that OM is better.",
                "warning",
            )
        )
    blocks += [
        _verdict(means, bool(held_out)),
        *_one_number(record, means),
        _mean_grid(means, bool(held_out)),
    ]
    worse = [gain for gain in chosen if gain.better() in RIVALS]
    if worse:
        blocks += [
            Paragraph("OM does not follow better everywhere. RM or RM+mass is better in:"),
            Bullets(_worse(worse), "warning"),
        ]
    else:
        blocks.append(
            Paragraph(
                "In no trial and component is RM or RM+mass better by more than "
                f"{percent(SAME_WITHIN)} %."
            )
        )
    return blocks


def _verdict(means: tuple[PooledGain, ...], held_out: bool) -> Paragraph:
    by_name = {mean.component: mean for mean in means}
    parts = []
    for component in ("cop_ap", "cop_ml", "grf_vertical"):
        if component in by_name:
            parts.append(f"{component_label(component)}: {_by_method(by_name[component])}")
    where = "On data it had not seen" if held_out else "On the data it was fitted to"
    counted = [m for m in means if m.component != "grf_vertical"]  # the same force as fz
    better = [m for m in counted if m.better() == OM]
    worse = [component_label(m.component) for m in counted if m.better() in RIVALS]
    text = (
        f"{where}, OM has the smaller error in {len(better)} of "
        f"{count(len(counted), 'component')} (the vertical force counts once), RM or RM+mass in "
        f"{listing(worse)}."
    )
    if parts:
        text += f" RMSE over all of its frames — {'; '.join(parts)}."
    return Paragraph(text, "good" if held_out and len(better) > len(counted) / 2 else "warning")


def _by_method(errors: Errors) -> str:
    """``25.2 N with RM, 7.9 N with RM+mass (-69 %), ...``; RM+mass only where it is not RM."""
    parts = [f"{number(errors.of[RM], 2)} {errors.unit} with {RM}"]
    for method in (RM_MASS, OM):
        change = errors.change(method)
        if method == OM or abs(change) > SAME_WITHIN:
            error = f"{number(errors.of[method], 2)} {errors.unit} with {method}"
            parts.append(f"{error} ({signed(100.0 * change)} %)")
    return ", ".join(parts)


def _one_number(record: ParticipantRecord, means: tuple[PooledGain, ...]) -> list[Block]:
    """What the number for the whole mass is, and does without identification."""
    table = record.identification
    rows = table[table["method"] == RM_MASS]
    found = [m for m in means if m.component == "grf_vertical" and RM_MASS in m.of]
    if rows.empty or not found:
        return []
    factor, sd = rows[["mass_factor", "mass_factor_sd"]].iloc[0]
    low, high = factor - Z95 * sd, factor + Z95 * sd
    (mean,) = found
    said = one_number_alone(
        component_label(mean.component),
        mean.change(RM_MASS),
        mean.change(),
        relative_change(mean.of[RM_MASS], mean.of[OM]),
    )
    return [
        Paragraph(
            f"{said} RM+mass is RM times {number(factor, 3)} (95 % interval {number(low, 3)} to "
            f"{number(high, 3)}), fitted to the trials that identified OM; its centre of pressure "
            "is RM's."
        )
    ]


def _mean_grid(means: tuple[PooledGain, ...], held_out: bool) -> Grid:
    data = "held-out data" if held_out else "identification data"
    return Grid(
        ("component", "unit", *METHODS, RM_MASS, OM, "OM better", "RM or RM+mass better", "all"),
        tuple(map(_mean_row, means)),
        f"RMSE over all frames, {data}; ✓ marks the smaller error",
        groups=(("", 2), ("RMSE", 3), ("change from RM [%]", 2), ("number of trials", 3)),
        words=2,
    )


def _mean_row(mean: PooledGain) -> tuple[str | Cell, ...]:
    return (
        component_label(mean.component),
        mean.unit,
        *(_error_cell(mean, method) for method in METHODS),
        signed(100.0 * mean.change(RM_MASS)),
        signed(100.0 * mean.change()),
        str(mean.om_better),
        str(mean.rival_better),
        str(mean.trials),
    )


def _error_cell(errors: Errors, method: str) -> Cell:
    """The error, marked where it is smaller than those of all others."""
    own = errors.of.get(method, np.nan)
    others = [error for name, error in errors.of.items() if name != method]
    return Cell(number(own, 2), "better" if own < min(others) * (1.0 - SAME_WITHIN) else "")


def _worse(gains: list[Gain]) -> tuple[str, ...]:
    """One sentence per trial."""
    by_trial: dict[str, list[str]] = {}
    for gain in gains:
        by_trial.setdefault(gain.trial, []).append(
            f"{component_label(gain.component)} {number(gain.of[gain.rival()], 2)} {gain.unit} with "
            f"{gain.rival()}, {number(gain.of[OM], 2)} with OM "
            f"({signed(100.0 * gain.over_rival())} %)"
        )
    return tuple(f"{trial}: {'; '.join(parts)}" for trial, parts in by_trial.items())


# --- warnings -------------------------------------------------------------------------------


def _warnings(record: ParticipantRecord) -> list[Block]:
    strongest = [
        *_refusals(record),
        *_undecided(record),
        *_quality(record, "excluded"),
        *_quality(record, "warning"),
        *_messages(record),
    ]
    strongest = list(dict.fromkeys(strongest))
    if not strongest:
        return [Paragraph("Nothing was refused, excluded or warned of.")]
    blocks: list[Block] = [Bullets(tuple(strongest[:_STRONGEST]), "warning")]
    if len(strongest) > _STRONGEST:
        more = count(len(strongest) - _STRONGEST, "more warning")
        blocks.append(Paragraph(f"{more} in sections 3 and 8.", "note"))
    return blocks


def _refusals(record: ParticipantRecord) -> list[str]:
    return [
        f"{refusal.unit or record.id}, {refusal.stage} refused: {refusal.sentence}"
        for refusal in record.refusals
    ]


def _undecided(record: ParticipantRecord) -> list[str]:
    om = record.method(OM)
    if om.empty:
        return ["There are no identified parameters (OM): every statement rests on the table."]
    shares = om["mass_data_share"]
    weighted = float((shares * om["mass_kg"]).sum() / om["mass_kg"].sum())
    if shares.isna().all() or weighted > 0.5:
        return []
    return [
        f"Weighted by mass, the data decided only {percent(weighted)} % of the segment masses; "
        "the rest comes from the table (section 6)."
    ]


def _quality(record: ParticipantRecord, level: str) -> list[str]:
    """One sentence per check and what was done, with all trials it concerns."""
    found: dict[tuple[str, str], dict[str, set[str]]] = {}
    for trial in record.trials:
        if trial.quality is not None:
            for _, row in trial.quality[trial.quality["level"] == level].iterrows():
                trials = found.setdefault((row["check"], row["action"]), {})
                what = f"{row['subject']} {row['found']}".strip()
                trials.setdefault(trial.label, set()).add(what)
    return [_finding(check, action, trials) for (check, action), trials in found.items()]


def _finding(check: str, action: str, trials: dict[str, set[str]]) -> str:
    told = set().union(*trials.values())
    what = told.pop() if len(told) == 1 else f"{count(len(told), 'finding')}, see section 3"
    return f"{check.replace('_', ' ')} in {listing(list(trials))}: {what}{f' ({action})' if action else ''}"


def _messages(record: ParticipantRecord) -> list[str]:
    """What later stages warned of; ingest's findings stand for themselves."""
    return [labelled(text) for stage, _, text in messages(record.origins) if stage != "ingest"]
