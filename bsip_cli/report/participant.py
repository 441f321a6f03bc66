"""The report of one participant: a first page, and folded sections in the order of questions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite

import numpy as np
import pandas as pd

from bsip_cli.report import budget, errors, records, verdict
from bsip_cli.report.blocks import (
    WORDS,
    Bar,
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
from bsip_cli.report.causes import (
    USUAL,
    Candidate,
    Limit,
    analysed,
    candidates_of,
    effect_title,
    effects_in,
    limits_of,
    parameter_label,
    place_label,
    size_words,
    usual_words,
)
from bsip_cli.report.figures.canvas import middle_of_longest
from bsip_cli.report.figures.charts import Panel, curves, error_bars, marker_bars, segment_masses
from bsip_cli.report.first_page import front
from bsip_cli.report.joints import joint_blocks
from bsip_cli.report.recordings import large_finding, use_said, uses_of
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.report.words import (
    COMPONENTS,
    MISSING,
    ROLES,
    TEXTS,
    capital,
    component_label,
    count,
    listing,
    number,
    percent,
    probability_words,
    segment_label,
    signed,
    with_spread,
)
from bsip_cli.statistics.choice import Difference
from bsip_cli.statistics.methods import METHODS, OM, RM, RM_MASS, SAME_WITHIN

_CAPTIONS: dict[str, str] = TEXTS["captions"]


def participant_document(record: ParticipantRecord) -> Document:
    """The page of one person."""
    cannot = Heading("What cannot be known"), Bullets(tuple(TEXTS["cannot_know"]))
    how_made = records.how_made(records.HowMade.of(record.origins), record.defaults)
    errors_of_forces = (*_over_time(record), *_budget(record), *_errors(record))
    parameters = (*_choice(record), *_masses(record), *_next(record))
    sections = {
        (verdict.ALL_FAULTS, "Is anything wrong, and how sure is that?"): _diagnosis(record),
        ("errors", "How large are the errors, when, and what makes them?"): errors_of_forces,
        ("joints", "What does it change at the joints?"): joint_blocks(record),
        ("parameters", "Which segment parameters come out?"): parameters,
        ("recording", "What was recorded?"): _recording(record),
        ("made", "How was it made, and what can it not know?"): (*cannot, *how_made),
    }
    return Document(
        title=f"{record.id}: do force plates and markers agree?",
        subtitle="",
        front=front(record),
        sections=(*(Section(*name, tuple(of)) for name, of in sections.items()), WORDS),
    )


# --- what is wrong, and how sure that is ----------------------------------------------------------

_NEAREST = 4  # rejected causes that are listed
_BY_PART = ("plate_translation", "plate_rotation", "plate_gain", "missing_joint")
_FAR = 20.0  # times the largest usual size: not seen at all


def _diagnosis(record: ParticipantRecord) -> Iterator[Block]:
    """Causes, advice and what might have gone unseen; or that `diagnose` has not run."""
    if record.diagnosis is None or record.detection is None:
        yield Paragraph(verdict.NOT_RUN, "note")
        return
    tables = (record.diagnosis, record.detection, record.gains, record.changes)
    said = verdict.verdict_of(*tables, before=large_finding(record))
    events = [(t.stem, t.marker_events) for t in record.trials if t.marker_events is not None]
    yield Numbered(said.causes) if said.causes else Paragraph(said.headline)
    yield from map(Paragraph, (*verdict.corrected_sentence(events), *said.results))
    searched = analysed(record.detection, record.diagnosis)
    if left := [trial.label for trial in record.trials if trial.stem not in searched]:
        yield Paragraph(TEXTS["not_analysed"].format(trials=listing(left)))
    yield from [Heading("What to do"), Bullets(said.advice)] if said.advice else []
    yield from nearest(candidates_of(record.diagnosis))
    yield Heading("What might have gone unseen")
    yield from limit_blocks(record.detection, record.diagnosis)
    yield Heading("How this was decided")
    named_from = percent(record.option("diagnosis", "named_from"))
    yield Paragraph(TEXTS["how_decided"].format(named_from=named_from))


def nearest(candidates: Sequence[Candidate]) -> tuple[Block, ...]:
    """The causes that came nearest to being found, each once, and none that was found elsewhere."""
    found = {one.label for one in candidates if one.verdict != "rejected"}
    rejected: dict[str, Candidate] = {}
    for one in candidates:
        if one.label not in found:
            rejected.setdefault(one.label, one)
    if not rejected:
        return (Paragraph("No other fault of the catalogue came near."),)
    rows = []
    for one in list(rejected.values())[:_NEAREST]:
        sure = probability_words(one.probability) or MISSING
        rows.append((one.label, sure, number(one.rms_change, 1), one.removes()))
    head = ("not found, but near", "probability", "changes [N or N m]", "explains [%]")
    return (Grid(head, tuple(rows), _CAPTIONS["nearest"]),)


def limit_blocks(detection: pd.DataFrame, diagnosis: pd.DataFrame) -> tuple[Block, ...]:
    """How small each fault could have been, from the artifacts ``detection`` and ``diagnosis``."""
    together, alone = (limits_of(detection, diagnosis, alone) for alone in (False, True))
    if not together:
        return (Paragraph("The limits of detection are not known.", "note"),)
    rows = []
    for effect, usual in USUAL.items():
        lasting = [x for x in together if x.effect == effect and x.trials > 1]
        single = [x for x in alone if x.effect == effect]
        for unit in dict.fromkeys(x.unit for x in (*lasting, *single)):
            columns = [
                [x for x in limits if x.unit == unit and x.parameter in usual.parameters]
                for limits in (lasting, single)
            ]
            if any(isfinite(x.size) for limits in columns for x in limits):
                usually = usual_words(effect) if usual.unit == unit else MISSING
                cells = (_range(effect, limits) for limits in columns)
                rows.append((effect_title(effect), *cells, usually))
    head = ("fault", "in all recordings", "in one alone", "usual in laboratories")
    never = list(_never_seen(detection, diagnosis))
    said = f"Not to be found here at any size that can be true: {', '.join(never)}."
    grid = Grid(head, tuple(rows), _CAPTIONS["limits"], words=4)
    return (Paragraph(said), grid) if never else (grid,)


def _range(effect: str, limits: Sequence[Limit]) -> str:
    """``5.0 to 12 mm``; what no usual recording would show is not put in figures."""
    if not limits:
        return MISSING
    best, worst = (end(limits, key=lambda x: x.size) for end in (min, max))
    usual = USUAL[effect]
    if not isfinite(best.size):
        return "not at all"
    if not isfinite(worst.size) or (usual.unit == best.unit and worst.size > _FAR * usual.most):
        return f"from {best.in_words()}, or not at all"
    return size_words(best.parameter, best.unit, best.size, worst.size)


def _never_seen(detection: pd.DataFrame, diagnosis: pd.DataFrame) -> Iterator[str]:
    """Causes, or parts of them, that these recordings do not show at all; what was found has no
    limit either."""
    reported = diagnosis.loc[diagnosis["verdict"] != "rejected", "effect"]
    others = detection[~detection["effect"].isin(reported)]
    least = others.groupby(["effect", "target", "parameter"], sort=False)["limit"].min()
    for effect in dict.fromkeys(others["effect"]):
        sizes = least[[effect]]
        hidden = sizes[~np.isfinite(sizes)].index
        if len(hidden) == len(sizes):
            yield effect_title(effect)
        elif len(hidden) and effect in _BY_PART:
            parts = ((place_label(x, at), parameter_label(x, one)) for x, at, one in hidden)
            words = (", ".join(filter(None, part)) for part in parts)
            yield f"{effect_title(effect)} ({'; '.join(words)})"


# --- how large the errors of the forces are, when, and what makes them ----------------------------

_WINDOW_S = 10.0
_PANELS = (  # column, title, to millimetres
    ("fz_N", "vertical force [N]", 1.0),
    ("cop_ap_m", "COP, forward [mm]", 1e3),
    ("cop_ml_m", "COP, to the right [mm]", 1e3),
)
_SHOWN = ("cop_ap", "cop_ml", "grf_vertical")


def _over_time(record: ParticipantRecord) -> Iterator[Block]:
    """Of the trial with most compared frames that OM did not see, if any, up to ten seconds of its
    longest interval."""
    own = record.identification_trials()
    tables = [(one, t) for one in record.moving_trials() if (t := one.reconstruction) is not None]
    compared = [int(records.flags_of(table, "valid").sum()) for _, table in tables]
    if max(compared, default=0) < 2:
        yield Paragraph("No recording has forces that could be compared.", "warning")
        return
    k = max(
        (k for k, n in enumerate(compared) if n > 1),
        key=lambda k: (tables[k][0] not in own, compared[k]),
    )
    trial, table = tables[k]
    clock, valid = records.clock_of(table), records.flags_of(table, "valid")
    window = middle_of_longest(clock, valid, _WINDOW_S)
    clock = clock[window]
    data, panels = {"time_s": clock}, []
    for column, title, scale in _PANELS:
        signals = records.signals_of(table, column)
        shown = {m: scale * np.where(valid, v, np.nan)[window] for m, v in signals.items()}
        panels.append(Panel(title, clock, shown))
        data |= {f"{column}_{m}": v / scale for m, v in shown.items()}
    seen = records.flags_of(table, "used")[window].any()
    fitted = "used to identify, which favours OM" if seen else "not used to identify"
    words = {"start": f"{clock[0]:.1f}", "end": f"{clock[-1]:.1f}", "fitted": fitted}
    numbers = pd.DataFrame(data)
    yield picture("forces", curves(panels, 1), numbers, trial=trial.label, **words)


def _budget(record: ParticipantRecord) -> Iterator[Block]:
    table, found = record.budget, effects_in(record.causes)
    if table is None or table.empty:
        return
    bars = []
    for component in COMPONENTS:
        size, unit = budget.size_of(table, component)
        if size >= budget.LEAST_REPORTED_SIZE:
            name = f"{component_label(component)}, {number(size, 1)} {unit}"
            bars.append(Bar(name, budget.pieces(table, component, found)))
    if bars:
        figure = error_bars(bars, budget.overall_pieces(table, found))
        yield picture("error_budget", figure, table[table["trial"] == ""])


def _errors(record: ParticipantRecord) -> Iterator[Block]:
    """Of every recording, by all methods."""
    fits = [(t, t.fit) for t in record.moving_trials() if t.fit is not None]
    gains = [gain for trial, fit in fits for gain in errors.gains_of(trial.label, fit)]
    by_trial: dict[str, dict[str, errors.Gain]] = {}
    for gain in gains:
        if gain.component in _SHOWN:
            by_trial.setdefault(gain.trial, {})[gain.component] = gain
    if not by_trial:
        yield Paragraph("No recording could be compared with both methods.", "warning")
        return
    if not any(gain.held_out for gain in gains):
        yield Paragraph(TEXTS["nothing_held_out"], "warning")
    rows: list[tuple[str | Cell, ...]] = []
    for trial, gain_of in by_trial.items():
        used = "" if next(iter(gain_of.values())).held_out else " (identified OM)"
        cells = (_error(gain_of.get(c), method) for c in _SHOWN for method in METHODS)
        rows.append((f"{trial}{used}", *cells))
    yield Grid(
        ("recording", *METHODS * len(_SHOWN)),
        tuple(rows),
        _CAPTIONS["errors"].format(percent=percent(SAME_WITHIN)),
        groups=(("", 1), ("COP forward [mm]", 3), ("COP sideways [mm]", 3), ("vertical [% BW]", 3)),
        name="errors",
        data=pd.concat(fit.assign(trial=trial.stem) for trial, fit in fits),
    )


def _error(gain: errors.Gain | None, method: str) -> Cell:
    if gain is None:
        return Cell(MISSING)
    own = gain.of.get(method, np.nan)
    others = [error for name, error in gain.of.items() if name != method]
    return Cell(number(own, 1), "better" if own < min(others) * (1.0 - SAME_WITHIN) else "")


# --- which segment parameters come out, how sure they are, and in which movements to use them -----

_FROM_TABLE = 0.2  # less of the variance than this removed: the number is the table's
_COM = ["com_x_m", "com_y_m", "com_z_m"]
_MOST_STEPS = 3


def _choice(record: ParticipantRecord) -> Iterator[Block]:
    choice = record.choice
    if choice is None or choice.empty:
        return
    yield Paragraph(use_said(record))
    if not choice["trials"].iloc[0]:
        return
    rows = []
    for one in choice.to_dict("records"):
        ratios = []
        for name in ("om", "rm_mass", "om_rm_mass"):
            ratio, error = one[f"ratio_{name}"], one[f"log_error_{name}"]
            low, high = (number(end, 2) for end in Difference.of_ratio(ratio, error).interval())
            ends = f" ({low} to {high})" if low != MISSING else ""
            ratios.append(f"{number(ratio, 2)}{ends}")
        rows.append((one["movement"], one["use"], *ratios, str(one["trials"])))
    head = ("movement", "best", "OM over RM", "RM+mass over RM", "OM over RM+mass", "recordings")
    yield Grid(head, tuple(rows), _CAPTIONS["choice"], words=2)


def _masses(record: ParticipantRecord) -> Iterator[Block]:
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
    rows: list[tuple[str | Cell, ...]] = [
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
    table, own = shown["rm_kg"].sum(), shown["om_kg"].sum()
    change = signed(100.0 * (own / table - 1.0))
    rows.append(("whole body", number(table, 2), number(own, 2), change, "", ""))
    head = ("segment", "RM [kg]", "OM [kg] ± sd", "change [%]", "centre of mass moves [mm]")
    yield Grid(
        (*head, "data decide [%]"),
        tuple(rows),
        "Centres of mass and tensors of inertia with their errors are in the CSV.",
        name="segment_parameters",
        data=record.bsip,
    )


def _next(record: ParticipantRecord) -> Iterator[Block]:
    table = record.excitation
    if table.empty:
        yield Paragraph("How well the movement excites the parameters was not computed.", "note")
        return
    silent = table[(table["quantity"] == "combinations") & (table["value"] == 0)]["name"]
    if len(silent):
        names = listing([*map(segment_label, silent)])
        yield Paragraph(f"These recordings add nothing to the table for {names}.")
    steps = [
        f"{capital(row['text'])}: {number(row['value'])} percentage points more decided by the "
        f"data, most of all for the {segment_label(row['segment'])}."
        for row in table[table["quantity"] == "next"].head(_MOST_STEPS).to_dict("records")
    ]
    yield from [Heading("What to record next time"), Numbered(tuple(steps))] if steps else []


# --- what was recorded: trials, what was repaired or left out, markers ----------------------------

_MOST_FINDINGS = 10
_MOST_EVENTS = 6
_LEVELS = ("excluded", "warning", "corrected")


def _recording(record: ParticipantRecord) -> Iterator[Block]:
    """Trials, refusals, loads, findings and events of markers."""
    yield _trials(record)
    refused = tuple(f"{r.unit or record.id}, {r.stage}: {r.sentence}" for r in record.refusals)
    yield from [Heading("Refused"), Bullets(refused, "warning")] if refused else []
    trials_of: dict[str, list[str]] = {}
    for trial, words in record.loads:
        trials_of.setdefault(words, []).append(trial)
    if trials_of:
        carried = "; ".join(f"{words} in {listing(trials)}" for words, trials in trials_of.items())
        yield Paragraph(TEXTS["loads"].format(carried=carried))
    if lines := _findings(record):
        yield Heading("Repaired, left out, warned of")
        yield first_of(lines, _MOST_FINDINGS, "recording_warnings")
    else:
        yield Paragraph("Nothing was repaired, excluded or warned of.")
    yield from _markers(record)
    known = [(trial.label, t) for trial in record.trials if (t := trial.marker_events) is not None]
    lines = [f"{label}: {sentence}" for label, table in known for sentence in table["sentence"]]
    if lines:
        yield first_of(lines, _MOST_EVENTS, "marker_events")
    elif known:
        yield Paragraph("No marker jumps, slips, bears another's label or sits wrong.")


def _trials(record: ParticipantRecord) -> Grid:
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
        roles = listing([ROLES[one] for one in record.roles_of(trial)], MISSING)
        rows.append((trial.label, roles, uses[trial.stem].in_words(), *numbers))
    head = ("recording", "role", "use", "duration [s]", "forces compared [%]", "pose known [%]")
    return Grid((*head, "markers [mm]"), tuple(rows), _CAPTIONS["trials"], words=3)


def _findings(record: ParticipantRecord) -> list[str]:
    """What ingest repaired, warned of or left out: a line per check, with its recordings."""
    known = [t.quality.assign(label=t.label) for t in record.trials if t.quality is not None]
    if not known:
        return []
    found = pd.concat(known).query("level in @_LEVELS")
    lines = []
    for level in _LEVELS:
        own = found[found["level"] == level]
        for (check, action), rows in own.groupby(["check", "action"], sort=False):
            whats = {*(rows["subject"] + " " + rows["found"]).str.strip()}
            what = whats.pop() if len(whats) == 1 else count(len(whats), "finding")
            place = (
                f"{str(check).replace('_', ' ')}, {level}, in {listing([*rows['label'].unique()])}"
            )
            lines.append(f"{place}: {what}{f' ({action})' if action else ''}")
    return lines


def _markers(record: ParticipantRecord) -> Iterator[Block]:
    frames = [t.residuals for t in record.trials if t.residuals is not None]
    rows = pd.concat(frames) if frames else pd.DataFrame({"marker": [], "residual_m": []})
    squares = rows["residual_m"].astype(float) ** 2
    rms = 1e3 * squares.groupby(rows["marker"]).mean().dropna().pow(0.5)
    if rms.empty:
        yield Paragraph("No marker residuals are known.", "warning")
        return
    limit = errors.MARKER_LIMIT_MM
    far = [f"{name} ({number(rms[name], 0)} mm)" for name in rms.index[rms > limit]]
    yield Heading("Markers")
    yield picture(
        "marker_residuals",
        marker_bars([str(name) for name in rms.index], rms.to_numpy(), limit),
        rms.rename("rms_mm").reset_index(),
        limit=number(limit, 0),
        action=f"look at {listing(far)}" if far else "nothing: none is beyond the limit",
    )
