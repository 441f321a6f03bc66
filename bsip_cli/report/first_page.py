"""The first page of a person's report: who, is anything wrong, how large, what to use and to do."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from bsip_cli.body.markersets import shipped_names
from bsip_cli.report import blocks, errors, recordings, verdict
from bsip_cli.report import budget as budgets
from bsip_cli.report.causes import (
    OF_THE_WEIGHT,
    Cause,
    analysed,
    effect_title,
    effects_in,
    separating_recording,
)
from bsip_cli.report.joints import all_peaks, moment_change
from bsip_cli.report.recordings import large_finding, names_of
from bsip_cli.report.records import HowMade, ParticipantRecord, TrialRecord
from bsip_cli.report.words import (
    TEXTS,
    abbreviations,
    capital,
    component_label,
    count,
    in_a_row,
    listing,
    number,
)
from bsip_cli.statistics.methods import OM, RM

_SEXES = {"M": "man", "F": "woman"}
_MOST_WORDS = 377  # with the title, the ticks of scales and the marks of lists 400
_FINDINGS = ((2, 4), (2, 2), (2, 1), (1, 2), (1, 1))  # in full, and kinds that are named only
_BRIEF_WORDS = 12  # of a finding that is named only; else its title
_FEW = 3  # findings, whose actions are all given
_MOST_TO_DO = 3
_MOST_FILES = 2  # that are named
_WORST = 3  # markers of a bad calibration
_POSES = 8  # among which the one is chosen that is shown


def front(record: ParticipantRecord) -> tuple[blocks.Block, ...]:
    """The blocks of the first page, in the order in which a reader asks; as many findings as there
    is room for."""
    light = recordings.light_for(record)
    says_it = light.state in ("large", "cause") and (record.causes or large_finding(record))
    first = (
        *portrait(record),
        blocks.Terms((*who(record),)),
        blocks.Heading("Is anything wrong?"),
        replace(light, text="") if says_it else light,
    )
    then = (
        *_sizes(record),
        *_sure(record, light),
        blocks.Heading("What may be used?"),
        blocks.Bullets(tuple(recordings.use_lines(record))),
        blocks.Paragraph(recordings.use_said(record, brief=True)),
        blocks.Heading("What to do next"),
    )
    for most, named in _FINDINGS:
        said, shown = to_do(record, light, most), _causes_shown(record, most)
        page = (
            *first,
            *_causes(record, shown, named),
            *then,
            blocks.Bullets(tuple(said[:_MOST_TO_DO])),
        )
        if len(said) > _MOST_TO_DO or len(shown) < len(record.causes):
            steps = (("Steps for all findings", f"#{verdict.ALL_FAULTS}"),)
            page = *page, blocks.Links("", steps)
        if blocks.words_in(page) <= _MOST_WORDS:
            break
    return page


def who(record: ParticipantRecord) -> Iterator[tuple[str, str]]:
    """Names and what is known: the person, the recordings and their files, the parameters, the
    report."""
    facts = record.facts
    mass, plates = float(facts["mass_kg"]), float(facts["plate_mass_kg"])
    sex = f"{_SEXES[facts['sex']]}, " if facts["sex"] in _SEXES else ""
    person = f"{sex}{number(mass, 1)} kg ({facts['mass_source']}"
    if np.isfinite(plates) and number(plates, 1) != number(mass, 1):
        person += f"; plates: {number(plates, 1)} kg"
    yield "Person", f"{record.id}, {person}), {number(facts['height_m'], 2)} m"
    names = [trial.task for trial in record.trials]
    times = {name: names.count(name) for name in names}
    tasks = [name if n == 1 else f"{n} × {name}" for name, n in times.items()]
    short = abbreviations(names)
    yield "Recordings", f"{listing(tasks)}{f' ({short})' if short else ''}; {_recorded(record)}"
    yield "Files", _files(record)
    if assumed := "; ".join(_assumed(record)):
        yield "Assumed", assumed
    used = listing([names_of(record)[t.stem] for t in record.identification_trials()], "nothing")
    yield "Parameters", TEXTS["parameters"].format(trials=used, decided=record.decided_words())
    versions = dict.fromkeys(origin.bsip_version for origin in record.origins)
    yield "Report", f"{record.made_on}, bsip {', '.join(versions)}"
    for name in ("mass", "height"):
        if note := str(record.facts[f"{name}_note"]):
            yield capital(name), f"{capital(note)}."


def _assumed(record: ParticipantRecord) -> Iterator[str]:
    """What nobody has stated or checked, and on which the results rest."""
    if record.facts["sex"] not in _SEXES:
        yield TEXTS["assumed"]["sex"]
    if record.facts["height_source"] == "markers":
        yield TEXTS["assumed"]["height"]
    tables = [trial.quality for trial in record.trials if trial.quality is not None]
    rows = [t[(t["check"] == "marker_set") & (t["level"] == "info")] for t in tables]
    sets = dict.fromkeys(pair for t in rows for pair in zip(t["found"], t["action"], strict=True))
    for name, description in sets:
        if name not in shipped_names():
            yield TEXTS["assumed"]["markers"].format(name=name, description=description)
    if record.outside:
        yield record.outside.partition(":")[0]


def _recorded(record: ParticipantRecord) -> str:
    """When, as the study or else its files say."""
    tables = [trial.quality for trial in record.trials if trial.quality is not None]
    said = [day for t in tables for day in t.loc[t["check"] == "recorded_on", "found"]]
    days = sorted(record.recorded_on or said)
    first_and_last = " to ".join(dict.fromkeys((*days[:1], *days[-1:])))
    return f"recorded {first_and_last}" if days else "date unknown"


def _files(record: ParticipantRecord) -> str:
    """Names of few; of many how many there are, and how they begin and end."""
    stems = tuple(f"{trial.stem}." for trial in record.trials)
    names = sorted(n for n in HowMade.of(record.origins).files if n.startswith(stems))
    kinds = sorted({f".{name.rpartition('.')[2]}" for name in names})
    many = f"{len(names)} ({record.id}_*{listing(kinds)})"
    return many if len(names) > _MOST_FILES else listing(names)


# --- the person ---------------------------------------------------------------------------------


def portrait(record: ParticipantRecord) -> tuple[blocks.Block, ...]:
    """The widest pose of the trials with a measured force; nothing without any pose."""
    from bsip_cli.report.figures.person import poses_of, stick_figure  # heavy

    anterior = record.facts[["anterior_x", "anterior_y"]].to_numpy(dtype=float)
    how = anterior, record.body_weight(), _POSES
    found = [
        (trial, pose)
        for trial in record.trials
        if trial.kinematics is not None
        for pose in poses_of(record.body, trial.kinematics, trial.reconstruction, *how)
    ]
    if not found:
        return ()
    loaded = [one for one in found if one[1].is_loaded()] or found
    trial, pose = max(loaded, key=lambda one: one[1].reach_m())
    shows = f"{trial.label}: left grey, right black, ground force green"
    figure = stick_figure(pose, trial.label)
    return (blocks.Portrait(figure, "person", shows, f"Stick figure. {shows}."),)


# --- is anything wrong --------------------------------------------------------------------------


def _causes(
    record: ParticipantRecord, shown: Sequence[Cause], named: int
) -> Iterator[blocks.Block]:
    """A line per finding, the most important first; of those that have no room what they are.
    ``shown``: in full; ``named``: kinds of findings of which only the name is given."""
    if record.diagnosis is None or record.detection is None:
        return
    everywhere = analysed(record.detection, record.diagnosis)
    peaks = all_peaks(record.trials)
    at_joints = (moment_change(cause, record.causes, peaks) for cause in shown)
    lines = [
        *large_finding(record),
        *(verdict.cause_line(c, everywhere, x) for c, x in zip(shown, at_joints, strict=True)),
    ]
    if lines:
        yield blocks.Numbered(tuple(lines))
    if len(shown) < len(record.causes):
        more = {k: c for k, c in recordings.numbered(record).items() if k > len(lines)}
        rest = f". {'; '.join(_in_brief(more, named, names_of(record)))}."
        yield blocks.Links("", (("More below", f"#{verdict.ALL_FAULTS}"),), rest)


def _in_brief(causes: Mapping[int, Cause], named: int, names: Mapping[str, str]) -> Iterator[str]:
    """``3 and 5: marker not in its place``, one alone as it is; findings of which one may be the
    other count together, by the name that most of them may have."""
    groups: list[tuple[list[int], list[str]]] = []
    for k, cause in causes.items():
        titles = [effect_title(one.effect) for one in cause]
        mine = [group for group in groups if {*group[1]} & {*titles}]
        merged = [k, *(n for numbers, _ in mine for n in numbers)]
        titles = [*(title for _, others in mine for title in others), *titles]
        groups = [group for group in groups if group not in mine]
        groups.append((sorted(merged), titles))
    groups.sort()
    for numbers, titles in groups[:named]:
        own = causes[numbers[0]]
        if own[0].class_id == OF_THE_WEIGHT:  # one of its causes is none of the recordings
            yield f"{in_a_row(numbers)}: {own[0].words.against}"
            continue
        what = own[0].words.short or own[0].words.what
        if len(numbers) == len(own) == 1 and len(what.split()) <= _BRIEF_WORDS:
            where = [names[stem] for stem in own[0].trials if stem in names]
            yield f"{numbers[0]}: {what}{f' ({where[0]})' if len(where) == 1 else ''}"
            continue
        (name, _), *others = Counter(titles).most_common()
        more = f", or {count(len(others), 'other cause')}" if others else ""
        yield f"{in_a_row(numbers)}: {name}{more}"
    if rest := sum(len(numbers) for numbers, _ in groups[named:]):
        yield f"{rest} more"


def _causes_shown(record: ParticipantRecord, most: int) -> tuple[Cause, ...]:
    return record.causes[: most - len(large_finding(record))]


def _sure(record: ParticipantRecord, light: blocks.Light) -> Iterator[blocks.Block]:
    """Of the error, of what was found, of what might have been missed; nothing where no search was
    made."""
    if record.diagnosis is None or record.detection is None:
        return
    said = [verdict.unseen(record.detection, record.diagnosis)]
    if light.state == "large":
        part, is_left = recordings.main_part(record)
        some = is_left if part else "of it unknown" in light.title  # the rest is not
        known = "part" if some else "known" if part else "unknown"
        said = [TEXTS["sure"][known], *(said if known == "known" else [])]
    elif not record.causes:
        said = ["No fault is more probable than not.", *said]
    if text := " ".join(filter(None, said)):
        yield blocks.Heading("How sure is this?")
        yield blocks.Paragraph(text)


# --- how large ----------------------------------------------------------------------------------


def _sizes(record: ParticipantRecord) -> Iterator[blocks.Block]:
    """The yardsticks by the parameters to use, by the table's or OM that has to wait, and what makes
    the errors of the table's."""
    used, later = recordings.use_words(record), recordings.not_yet(record)
    first, other = recordings.measured_of(record), recordings.measured_of(record, RM)
    which = f"? ● {used}{later}, ○ {RM}" if used != RM else f" with {RM}?"
    if recordings.om_waits(record):
        other, which = recordings.measured_of(record, OM), f"? ● {used}{later}, ○ {OM} (not yet)"
    scales = [
        (one, size, None if one.shown(other[one]) == one.shown(size) else other[one])
        for one, size in first.items()
    ]
    yield blocks.Heading(f"How large are the errors{which}")
    yield blocks.Scales(tuple(scales))
    yield blocks.Paragraph(errors.SOURCES, "note")
    yield from budget_bar(record)


def budget_bar(record: ParticipantRecord) -> Iterator[blocks.Block]:
    """What makes the error of the table's parameters, as one bar, and how to read it."""
    if record.budget is None:
        return
    findings = {k: effects_in([cause]) for k, cause in recordings.numbered(record).items()}
    if pieces := budgets.numbered_pieces(record.budget, findings):
        use, own = recordings.use_now(record), budgets.PARAMETERS
        if use == OM and not recordings.beyond(record):
            known = f"{own} (OM corrects these)"
            pieces = tuple(replace(one, label=one.label.replace(own, known)) for one in pieces)
        before = " with RM" if record.use() != RM else ""
        yield blocks.Bar(TEXTS["bar"].format(before=before), pieces)


# --- what to do ---------------------------------------------------------------------------------


def to_do(record: ParticipantRecord, light: blocks.Light, most: int) -> list[str]:
    """The most important first."""
    causes, first = _causes_shown(record, most), 1 + len(large_finding(record))
    few = record.causes if len(record.causes) <= _FEW else causes or record.causes[:1]
    said = [f"{refusal.unit or record.id}: {refusal.sentence}" for refusal in record.refusals[:1]]
    said += _calibration(record)
    said += _look_at(record)
    said += verdict.consequences(few, first, only_actions=True)
    groups = [(k, cause) for k, cause in enumerate(causes, first) if len(cause) > 1]
    for k, cause in groups[:1]:
        members = [(one.effect, one.target) for one in cause]
        on_scale = cause[0].class_id == OF_THE_WEIGHT
        step = "weigh the person on a scale" if on_scale else separating_recording(members, most=1)
        said.append(f"To learn the cause of finding {k}, {step}.")
    if not recordings.beyond(record):
        alone = recordings.large_alone(record)
        looks = (_look_for(record, *recordings.largest_in(record, one)) for one in alone)
        said += filter(None, looks)
        said += [TEXTS["to_do"]["contacts"]] if light.state == "inconclusive" else []
    fine = [TEXTS["usable"]["fine"]] if light.state == "fine" and not said else []
    rows = record.excitation.query("quantity == 'next'")
    if not said and len(rows):
        text = rows["text"].iloc[0]
        fine.append(f"Optional, to know the parameters better, record: {text}.")
    return said + fine


def _calibration(record: ParticipantRecord) -> Iterator[str]:
    """Which markers to look at, where all else rests on a bad calibration."""
    uses = recordings.uses_of(record)
    for trial in (t for t in record.trials if uses[t.stem].kind == "calibration"):
        rows = pd.DataFrame() if trial.residuals is None else trial.residuals.dropna()
        sizes = rows.groupby("marker")["residual_m"].mean() if len(rows) else pd.Series(dtype=float)
        worst = [f"{name} ({1e3 * m:.0f} mm)" for name, m in sizes.nlargest(_WORST).items()]
        yield TEXTS["to_do"]["calibration"].format(trial=trial.label, markers=listing(worst))


def _look_at(record: ParticipantRecord) -> Iterator[str]:
    """Where to look for what makes the largest error, which is the first finding; nothing where
    another finding makes the largest part."""
    if recordings.number_of_main_part(record):
        return
    is_finding = bool(large_finding(record)) or recordings.is_said(record)
    for one, _ in recordings.beyond(record)[:1]:
        worst = recordings.worst_of(record, one)
        text = TEXTS["to_do"]["markers"] if one.name == errors.MARKERS else ""
        text = text or (_look_for(record, worst, one) if worst else "")
        if text:
            yield f"{'Finding 1: ' if is_finding else ''}{text}"


_OF = {errors.COP: ("cop_ap", "cop_ml"), errors.FORCE: ("fz",)}  # components of the error budget
_SIGNALS = {errors.COP: ("cop_ap_m", "cop_ml_m"), errors.FORCE: ("fz_N",)}


def _look_for(record: ParticipantRecord, trial: TrialRecord, error: errors.Yardstick) -> str:
    """What makes the largest part of a recording's error and what helps; empty where that is a
    finding; where it is not known, when the error is largest and what to check first."""
    name, found, texts = names_of(record)[trial.stem], effects_in(record.causes), TEXTS["to_do"]
    budget, of = record.budget, (trial.stem, _OF[error.name])
    if budget is not None and (parts := budgets.overall_pieces(budget, found, *of)):
        main = max(parts, key=lambda one: one.share)
        if {term.partition(":")[2] for term in main.terms} & found:
            return ""
        helps = [texts["helps"].get(kind, "") for kind in main.kinds]
        if all(helps):
            return texts["part"].format(
                trial=name, part=main.label, error=error.in_sentence(), help="; ".join(helps)
            )
    use = recordings.use_now(record, trial.task)
    shape = recordings.shape_of(trial.reconstruction, use, _SIGNALS[error.name])
    if shape is None:
        return ""
    when, check = texts["shapes"][shape.kind]
    direction = component_label(shape.column.removesuffix("_m")).rpartition(", ")[2]
    when = when.format(at=number(shape.worst_s, 2), direction=direction)
    return texts["forces"].format(trial=name, error=error.brief, when=when, check=check)
