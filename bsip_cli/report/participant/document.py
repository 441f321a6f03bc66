"""The report of one participant: a first page, and folded sections in the order of questions; here
those of what is wrong, of the recordings and of the parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf, isfinite
from typing import Any

import numpy as np
import pandas as pd

from bsip_cli.report import effect_words, records, verdict
from bsip_cli.report.blocks import (
    WORDS,
    Block,
    Bullets,
    Cell,
    Document,
    Grid,
    Heading,
    Numbered,
    Paragraph,
    Section,
    first_of,
    picture,
)
from bsip_cli.report.candidates import Candidate, Limit, candidates_of, limits_of
from bsip_cli.report.errors import MARKERS, yardsticks
from bsip_cli.report.figures.charts import marker_bars, segment_masses
from bsip_cli.report.first_page import front
from bsip_cli.report.participant import errors
from bsip_cli.report.recordings import large_finding, uses_of
from bsip_cli.report.words import (
    MISSING,
    ROLES,
    TEXTS,
    capital,
    count,
    listing,
    number,
    percent,
    segment_label,
    signed,
    with_spread,
)
from bsip_cli.statistics.choice import Difference
from bsip_cli.statistics.methods import OM, RM, RM_MASS


def participant_document(record: records.ParticipantRecord) -> Document:
    """The page of one person."""
    made = [Heading("What cannot be known"), Bullets(tuple(TEXTS["cannot_know"]))]
    made += records.how_made(records.HowMade.of(record.origins), record.defaults)
    parameters = (*_choice(record), *_masses(record), *_next(record))
    return Document(
        title=f"{record.id}: do force plates and markers agree?",
        subtitle="",
        front=front(record),
        sections=(
            diagnosis_section(record),
            errors.section(record),
            errors.joints_section(record),
            Section("parameters", "Which segment parameters come out?", parameters),
            recording_section(record),
            Section("made", "How was it made, and what can it not know?", tuple(made)),
            WORDS,
        ),
    )


# --- what was recorded: trials, what was repaired or left out, markers ----------------------------

_MOST_FINDINGS = 10
_MOST_EVENTS = 6
_LEVELS = ("excluded", "warning", "corrected")
_MM = 1000.0


def recording_section(record: records.ParticipantRecord) -> Section:
    """Trials, refusals, loads, findings and events of markers."""
    refused = tuple(f"{r.unit or record.id}, {r.stage}: {r.sentence}" for r in record.refusals)
    blocks: list[Block] = [_trials(record)]
    if refused:
        blocks += [Heading("Refused"), Bullets(refused, "warning")]
    blocks += [*_loads(record), *_findings(record), *_markers(record), *_events(record)]
    return Section("recording", "What was recorded?", tuple(blocks))


def _trials(record: records.ParticipantRecord) -> Grid:
    uses, rows = uses_of(record), []
    for trial in record.trials:
        frame, numbers = trial.kinematics, (MISSING,) * 4
        if frame is not None and not frame.empty:
            compared = np.nan
            if trial.reconstruction is not None and len(records.clock_of(trial.reconstruction)):
                compared = float(records.flags_of(trial.reconstruction, "valid").mean())
            numbers = (
                number(float(frame["time_s"].iloc[-1] - frame["time_s"].iloc[0])),
                percent(compared),
                percent(float(frame["determined"].astype(float).mean())),
                number(trial.markers_mm()),
            )
        rows.append((trial.label, ROLES[trial.role], uses[trial.stem].in_words(), *numbers))
    head = ("recording", "role", "use", "duration [s]", "forces compared [%]", "pose known [%]")
    return Grid((*head, "markers [mm]"), tuple(rows), TEXTS["captions"]["trials"], words=3)


def _loads(record: records.ParticipantRecord) -> Iterator[Block]:
    trials_of: dict[str, list[str]] = {}
    for trial, words in record.loads:
        trials_of.setdefault(words, []).append(trial)
    if trials_of:
        carried = "; ".join(f"{words} in {listing(trials)}" for words, trials in trials_of.items())
        yield Paragraph(TEXTS["loads"].format(carried=carried))


def _findings(record: records.ParticipantRecord) -> Iterator[Block]:
    """What ingest repaired, warned of or left out: one line per check, with its recordings."""
    found: dict[tuple[str, str, str], dict[str, set[str]]] = {}
    known = ((trial.label, t) for trial in record.trials if (t := trial.quality) is not None)
    for label, table in known:
        for row in table[table["level"].isin(_LEVELS)].to_dict("records"):
            key = (row["level"], row["check"], row["action"])
            what = f"{row['subject']} {row['found']}".strip()
            found.setdefault(key, {}).setdefault(label, set()).add(what)
    lines = []
    for level, check, action in sorted(found, key=lambda key: _LEVELS.index(key[0])):
        trials = found[level, check, action]
        findings = set().union(*trials.values())
        what = findings.pop() if len(findings) == 1 else count(len(findings), "finding")
        done = f" ({action})" if action else ""
        place = f"{check.replace('_', ' ')}, {level}, in {listing(list(trials))}"
        lines.append(f"{place}: {what}{done}")
    if not lines:
        yield Paragraph("Nothing was repaired, excluded or warned of.")
        return
    yield Heading("Repaired, left out, warned of")
    yield from first_of(lines, _MOST_FINDINGS, "the recordings' quality artifacts")


# --- markers ------------------------------------------------------------------------------------


def _markers(record: records.ParticipantRecord) -> Iterator[Block]:
    frames = [t.residuals for t in record.trials if t.residuals is not None]
    rows = pd.concat(frames) if frames else pd.DataFrame({"marker": [], "residual_m": []})
    squares = rows["residual_m"].astype(float) ** 2
    rms = _MM * squares.groupby(rows["marker"]).mean().dropna().pow(0.5)
    if rms.empty:
        yield Paragraph("No marker residuals are known.", "warning")
        return
    limit = next(y.limit for y in yardsticks(np.nan, np.nan) if y.name == MARKERS)
    far = [f"{name} ({number(rms[name], 0)} mm)" for name in rms.index[rms > limit]]
    yield Heading("Markers")
    yield picture(
        "marker_residuals",
        marker_bars([str(name) for name in rms.index], rms.to_numpy(), limit),
        rms.rename("rms_mm").reset_index(),
        limit=number(limit, 0),
        action=f"look at {listing(far)}" if far else "nothing: none is beyond the limit",
    )


def _events(record: records.ParticipantRecord) -> Iterator[Block]:
    """What the inverse kinematics says of single markers; nothing where it was not asked."""
    known = [(trial.label, t) for trial in record.trials if (t := trial.marker_events) is not None]
    lines = [f"{label}: {sentence}" for label, table in known for sentence in table["sentence"]]
    if known and not lines:
        yield Paragraph("No marker jumps, slips, bears another's label or sits wrong.")
    elif lines:
        yield from first_of(lines, _MOST_EVENTS, "the trials' marker-events")


# --- which segment parameters come out, how sure they are, and in which movements to use them -----

_FROM_TABLE = 0.2  # less of the variance than this removed: the number is the table's
_COM = ["com_x_m", "com_y_m", "com_z_m"]
_RATIOS = ("om", "rm_mass", "om_rm_mass")
_MOST_STEPS = 3


def _choice(record: records.ParticipantRecord) -> Iterator[Block]:
    choice = record.choice
    if choice is None or choice.empty:
        return
    yield Paragraph(str(choice["sentence"].iloc[0]))
    for row in record.identification[record.identification["rare"].astype(bool)].itertuples():
        why = f"a body like this is rarer than 1 in 100 people, most by {row.farthest}"
        yield Paragraph(f"Do not use {row.method}: {why}.", "warning")
    if choice["trials"].iloc[0]:
        head = ("movement", "use", "OM over RM", "RM+mass over RM", "OM over RM+mass", "recordings")
        rows = tuple(
            (one["movement"], one["use"], *(_ratio(one, x) for x in _RATIOS), str(one["trials"]))
            for one in choice.to_dict("records")
        )
        yield Grid(head, rows, TEXTS["captions"]["choice"], words=2)


def _ratio(row: Mapping[Any, Any], name: str) -> str:
    ratio = row[f"ratio_{name}"]
    low, high = Difference.of_ratio(ratio, row[f"log_error_{name}"]).interval()
    ends = f" ({number(low, 2)} to {number(high, 2)})" if number(low) != MISSING else ""
    return f"{number(ratio, 2)}{ends}"


# --- parameters ---------------------------------------------------------------------------------


def _masses(record: records.ParticipantRecord) -> Iterator[Block]:
    rm, om = record.method(RM), record.method(OM)
    if om.empty or rm.empty:
        missing = f"There are no parameters of {OM if om.empty else RM}"
        yield Paragraph(f"{missing}, so nothing can be compared.", "warning")
        return
    om = om.reindex(rm.index)
    scaled = record.method(RM_MASS)["mass_kg"].reindex(rm.index)
    masses = {"rm_kg": rm["mass_kg"], "rm_mass_kg": scaled, "om_kg": om["mass_kg"]}
    masses |= {"om_sd_kg": om["mass_kg_sd"], "data_share": om["mass_data_share"]}
    shown = pd.DataFrame(masses, dtype=float)
    labelled = shown.rename(index=segment_label)
    numbers = shown.rename_axis("segment").reset_index()
    yield picture("masses", segment_masses(labelled), numbers)
    shift_mm = 1e3 * np.linalg.norm(om[_COM].to_numpy() - rm[_COM].to_numpy(), axis=1)
    rows = [
        (
            str(label),
            number(one["rm_kg"], 2),
            with_spread(one["om_kg"], one["om_sd_kg"], 2),
            signed(100.0 * (one["om_kg"] / one["rm_kg"] - 1.0)),
            number(moved, 0),
            Cell(percent(one["data_share"]), "warning" if one["data_share"] < _FROM_TABLE else ""),
        )
        for (label, one), moved in zip(labelled.iterrows(), shift_mm, strict=True)
    ]
    table, own = shown["rm_kg"], shown["om_kg"]
    total = ("whole body", number(table.sum(), 2), number(own.sum(), 2))
    change = signed(100.0 * (own.sum() / table.sum() - 1.0))
    head = ("segment", "RM [kg]", "OM [kg] ± sd", "change [%]", "centre of mass moves [mm]")
    yield Grid(
        (*head, "data decide [%]"),
        (*rows, (*total, change, "", "")),
        "Centres of mass and tensors of inertia with their errors are in the CSV.",
        name="segment_parameters",
        data=record.bsip,
    )


def _next(record: records.ParticipantRecord) -> Iterator[Block]:
    table = record.excitation
    if table.empty:
        yield Paragraph("How well the movement excites the parameters was not computed.", "note")
        return
    combinations = table[table["quantity"] == "combinations"]
    silent = [segment_label(n) for n in combinations.loc[combinations["value"] == 0, "name"]]
    if silent:
        yield Paragraph(f"These recordings add nothing to the table for {listing(silent)}.")
    steps = [
        f"{capital(row['text'])}: {number(row['value'])} percentage points more decided by the "
        f"data, most of all for the {segment_label(row['segment'])}."
        for row in table[table["quantity"] == "next"].head(_MOST_STEPS).to_dict("records")
    ]
    yield from [Heading("What to record next time"), Numbered(tuple(steps))] if steps else []


# --- what is wrong, and how sure that is: causes, size and effect, what could not be seen ----------

_NEAREST = 4  # rejected causes that are listed
_BY_PART = ("plate_translation", "plate_rotation", "plate_gain", "missing_joint")
_FAR = 20.0  # times the largest usual size: not seen at all


def diagnosis_section(record: records.ParticipantRecord) -> Section:
    """Causes, advice and what might have gone unseen; or that `diagnose` has not run."""
    if record.diagnosis is None or record.detection is None:
        blocks: tuple[Block, ...] = (Paragraph(verdict.NOT_RUN, "note"),)
        return Section(verdict.ALL_FAULTS, "Is anything wrong, and how sure is that?", blocks)
    tables = (record.diagnosis, record.detection, record.gains, record.changes)
    said = verdict.verdict_of(*tables, before=large_finding(record))
    events = [(t.stem, t.marker_events) for t in record.trials if t.marker_events is not None]
    named_from = percent(record.option("diagnosis", "named_from"))
    blocks = (
        *([Numbered(said.causes)] if said.causes else [Paragraph(said.headline)]),
        *(Paragraph(text) for text in (*verdict.corrected_sentence(events), *said.results)),
        *([Heading("What to do"), Bullets(said.advice)] if said.advice else []),
        *nearest(candidates_of(record.diagnosis)),
        Heading("What might have gone unseen"),
        *limit_blocks(record.detection, record.diagnosis),
        Heading("How this was decided"),
        Paragraph(TEXTS["how_decided"].format(named_from=named_from)),
    )
    return Section(verdict.ALL_FAULTS, "Is anything wrong, and how sure is that?", blocks)


# --- causes -------------------------------------------------------------------------------------


def nearest(candidates: Sequence[Candidate]) -> tuple[Block, ...]:
    """The causes that came nearest to being found."""
    rejected = [one for one in candidates if one.verdict == "rejected"][:_NEAREST]
    if not rejected:
        return (Paragraph("No other fault of the catalogue came near."),)
    rows = []
    for one in rejected:
        sure = verdict.probability_words(one.probability) or MISSING
        rows.append((one.label, sure, number(one.rms_change, 1), one.removes()))
    head = ("not found, but near", "probability", "changes [N or N m]", "explains [%]")
    return (Grid(head, tuple(rows), TEXTS["captions"]["nearest"]),)


# --- limits -------------------------------------------------------------------------------------


def limit_blocks(detection: pd.DataFrame, diagnosis: pd.DataFrame) -> tuple[Block, ...]:
    """From the artifacts ``detection`` and ``diagnosis``."""
    together = limits_of(detection, diagnosis)
    alone = limits_of(detection, diagnosis, alone=True)
    if not together:
        return (Paragraph("The limits of detection are not known.", "note"),)
    rows = tuple(
        row for effect in effect_words.USUAL for row in _limit_rows(effect, together, alone)
    )
    head = ("fault", "in all recordings", "in one alone", "usual in laboratories")
    caption = TEXTS["captions"]["limits"]
    return (*_never_seen(detection, diagnosis), Grid(head, rows, caption, words=4))


def _never_seen(detection: pd.DataFrame, diagnosis: pd.DataFrame) -> list[Block]:
    """Causes, or parts of them, that these recordings do not show at all; what was found has no
    limit either."""
    reported = set(diagnosis["effect"][diagnosis["verdict"] != "rejected"])
    least: dict[str, dict[tuple[str, str], float]] = {}
    for r in detection.to_dict("records"):
        if r["effect"] not in reported:
            parts, part = least.setdefault(r["effect"], {}), (r["target"], r["parameter"])
            parts[part] = min(r["limit"], parts.get(part, inf))
    never = []
    for effect, sizes in least.items():
        hidden = [part for part, size in sizes.items() if not isfinite(size)]
        if len(hidden) == len(sizes):
            never.append(effect_words.effect_title(effect))
        elif hidden and effect in _BY_PART:
            words = []
            for at, one in hidden:
                place = effect_words.place_label(effect, at)
                of_it = effect_words.parameter_label(effect, one)
                words.append(", ".join(filter(None, (place, of_it))))
            never.append(f"{effect_words.effect_title(effect)} ({'; '.join(words)})")
    if not never:
        return []
    return [Paragraph(f"Not to be found here at any size that can be true: {', '.join(never)}.")]


def _limit_rows(
    effect: str, together: Sequence[Limit], alone: Sequence[Limit]
) -> Iterator[tuple[str, ...]]:
    lasting = [x for x in together if x.effect == effect and x.trials > 1]
    single = [x for x in alone if x.effect == effect]
    usual = effect_words.USUAL[effect]
    for unit in dict.fromkeys(x.unit for x in (*lasting, *single)):
        columns = [
            [x for x in limits if x.unit == unit and x.parameter in usual.parameters]
            for limits in (lasting, single)
        ]
        if any(isfinite(x.size) for limits in columns for x in limits):
            yield (
                effect_words.effect_title(effect),
                *(_range(effect, limits) for limits in columns),
                effect_words.usual_words(effect) if usual.unit == unit else MISSING,
            )


def _range(effect: str, limits: Sequence[Limit]) -> str:
    """``5.0 to 12 mm``; what no usual recording would show is not put in figures."""
    if not limits:
        return MISSING
    best, worst = (end(limits, key=lambda x: x.size) for end in (min, max))
    usual = effect_words.USUAL[effect]
    if not isfinite(best.size):
        return "not at all"
    if not isfinite(worst.size) or (usual.unit == best.unit and worst.size > _FAR * usual.most):
        return f"from {best.in_words()}, or not at all"
    return effect_words.size_words(best.parameter, best.unit, best.size, worst.size)
