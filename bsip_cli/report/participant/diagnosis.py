"""What is wrong, and how sure that is: causes, their size and effect, and what could not be seen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf, isfinite

import pandas as pd

from bsip_cli.report import verdict
from bsip_cli.report.blocks import Block, Grid, Heading, Numbered, Paragraph, Section
from bsip_cli.report.candidates import Candidate, Limit, candidates_of, limits_of
from bsip_cli.report.effect_words import (
    USUAL,
    effect_title,
    parameter_label,
    place_label,
    size_words,
    usual_words,
)
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.report.words import MISSING, number, percent

_NEAREST = 4  # rejected causes that are listed
_BY_PART = ("plate_translation", "plate_rotation", "plate_gain", "missing_joint")
_FAR = 20.0  # times the largest usual size: not seen at all


def section(record: ParticipantRecord) -> Section:
    if record.diagnosis is None or record.detection is None:
        blocks: tuple[Block, ...] = (Paragraph(verdict.NOT_RUN, "note"),)
        return Section(verdict.ALL_FAULTS, "Is anything wrong, and how sure is that?", blocks)
    tables = (record.diagnosis, record.detection, record.gains, record.changes)
    said = verdict.verdict_of(*tables)
    events = [(t.stem, t.marker_events) for t in record.trials if t.marker_events is not None]
    named_from = percent(record.option("diagnosis", "named_from"))
    blocks = (
        *([Numbered(said.causes)] if said.causes else [Paragraph(said.headline)]),
        *(Paragraph(text) for text in (*verdict.corrected_sentence(events), *said.results)),
        *nearest(candidates_of(record.diagnosis)),
        Heading("What might have gone unseen"),
        *limit_blocks(record.detection, record.diagnosis),
        Heading("How this was decided"),
        Paragraph(
            "One statistical model explains the difference between measured and simulated forces by "
            "noise, by ordinary errors of ordinary size (parameters, joint centres, markers, "
            "smoothing) and by faults of a catalogue, which join one after the other while one more "
            f"is more probable than none. A single name is said from {named_from} % on, else the "
            "smallest group that holds as much."
        ),
    )
    return Section(verdict.ALL_FAULTS, "Is anything wrong, and how sure is that?", blocks)


# --- causes -------------------------------------------------------------------------------------


def nearest(candidates: Sequence[Candidate]) -> tuple[Block, ...]:
    """The causes that came nearest to being found."""
    rejected = [one for one in candidates if one.verdict == "rejected"][:_NEAREST]
    if not rejected:
        return (Paragraph("No other fault of the catalogue came near."),)
    rows = tuple(
        (
            one.label,
            verdict.probability_words(one.probability) or MISSING,
            number(one.rms_change, 1),
            one.removes(),
        )
        for one in rejected
    )
    head = ("not found, but near", "probability", "changes [N or N m]", "explains [%]")
    caption = (
        "Changes: root mean square in the force or moment that changes most. Explains: of the "
        "squared difference in seconds that did not size it, with 95 % interval."
    )
    return (Grid(head, rows, caption),)


# --- limits -------------------------------------------------------------------------------------


def limit_blocks(detection: pd.DataFrame, diagnosis: pd.DataFrame) -> tuple[Block, ...]:
    """From the artifacts ``detection`` and ``diagnosis``."""
    together = limits_of(detection, diagnosis)
    alone = limits_of(detection, diagnosis, alone=True)
    if not together:
        return (Paragraph("The limits of detection are not known.", "note"),)
    rows = tuple(row for effect in USUAL for row in _limit_rows(effect, together, alone))
    head = ("fault", "in all recordings", "in one alone", "usual in laboratories")
    caption = (
        "Least size that would be named in 95 of 100 such recordings, from the best place and "
        "recording to the worst. Good: below what is usual. Above: a usual fault may be there."
    )
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
            never.append(effect_title(effect))
        elif hidden and effect in _BY_PART:
            places = ((place_label(effect, at), parameter_label(effect, one)) for at, one in hidden)
            words = "; ".join(", ".join(filter(None, part)) for part in places)
            never.append(f"{effect_title(effect)} ({words})")
    if not never:
        return []
    return [Paragraph(f"Not to be found here at any size that can be true: {', '.join(never)}.")]


def _limit_rows(
    effect: str, together: Sequence[Limit], alone: Sequence[Limit]
) -> Iterator[tuple[str, ...]]:
    """A row per unit: the range over all places and directions."""
    lasting = [x for x in together if x.effect == effect and x.trials > 1]
    single = [x for x in alone if x.effect == effect]
    usual = USUAL[effect]
    for unit in dict.fromkeys(x.unit for x in (*lasting, *single)):
        columns = [
            [x for x in limits if x.unit == unit and x.parameter in usual.parameters]
            for limits in (lasting, single)
        ]
        if any(isfinite(x.size) for limits in columns for x in limits):
            yield (
                effect_title(effect),
                *(_range(effect, limits) for limits in columns),
                usual_words(effect) if usual.unit == unit else MISSING,
            )


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
    words = [size_words(best.parameter, best.unit, size) for size in (best.size, worst.size)]
    if words[0] == words[1]:
        return words[0]
    first = words[0].removesuffix("°") if words[0].endswith("°") else words[0].partition(" ")[0]
    return f"{first} to {words[1]}"
