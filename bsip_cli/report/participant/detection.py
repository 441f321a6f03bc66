"""What these very recordings could not have shown: in words, as figures and as a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf, isfinite

import numpy as np
import pandas as pd

from bsip_cli.body.names import SEGMENTS
from bsip_cli.report.blocks import Block, Grid, Paragraph, Picture
from bsip_cli.report.effect_words import (
    effect_title,
    parameter_label,
    place_label,
    size_words,
)
from bsip_cli.report.figures.detection_limits import DetectionLimits, detection_limits
from bsip_cli.report.figures.mass_limits import MassLimits, mass_limits
from bsip_cli.report.limits import Limit, limits_of, limits_sentence
from bsip_cli.report.usual_sizes import USUAL, usual_words
from bsip_cli.report.words import MISSING, segment_label

_TOLD_BY_PART = ("plate_translation", "plate_rotation", "plate_gain", "missing_joint")
_FAR = 20.0  # times the largest usual size: not seen at all


def blocks(detection: pd.DataFrame, diagnosis: pd.DataFrame, named_from: str) -> list[Block]:
    """From the artifacts ``detection`` and ``diagnosis``; named_from [%]: probability from which on
    one name is said."""
    together = limits_of(detection, diagnosis)
    alone = limits_of(detection, diagnosis, alone=True)
    if not together:
        return [Paragraph("The limits of detection are not known.", "note")]
    sentence = limits_sentence(together)
    said: list[Block] = [Paragraph(sentence)] if sentence else []
    said.append(
        Paragraph(
            "Each limit is the size that would be named in 95 of 100 recordings like these: the "
            f"evidence for it outweighs the prior odds up to a probability of {named_from} %, while "
            "the ordinary errors and the cause's other numbers stay free. Of moments, windows and "
            "frequencies the median counts: a cause at half of them must be larger. "
            "Smaller errors may be there. Causes that were found have no limit, and none is given "
            "for exchanged labels and smoothed markers.",
            "note",
        )
    )
    said += [
        *_never_seen(detection, diagnosis),
        *_usual_figure(together),
        *_mass_figure(alone),
    ]
    rows = tuple(row for effect in USUAL for row in _rows(effect, together, alone))
    head = ("cause", "in all recordings", "in one alone", "shows best at", "usual in labs")
    caption = (
        "Least size that would be named, from the best place, direction and recording to the worst"
    )
    return [*said, Grid(head, rows, caption, words=5)]


def _never_seen(detection: pd.DataFrame, diagnosis: pd.DataFrame) -> list[Block]:
    """Causes, or parts of them, that these recordings do not show at all; what was found has no
    limit either."""
    told = set(diagnosis["effect"][diagnosis["verdict"] != "rejected"])
    least: dict[str, dict[tuple[str, str], float]] = {}
    for r in detection.to_dict("records"):
        if r["effect"] not in told:
            parts, part = least.setdefault(r["effect"], {}), (r["target"], r["parameter"])
            parts[part] = min(r["limit"], parts.get(part, inf))
    never = []
    for effect, sizes in least.items():
        hidden = [part for part, size in sizes.items() if not isfinite(size)]
        if len(hidden) == len(sizes):
            never.append(effect_title(effect))
        elif hidden and effect in _TOLD_BY_PART:
            words = "; ".join(_part(effect, *part) for part in hidden)
            never.append(f"{effect_title(effect)} ({words})")
    if not never:
        return []
    return [Paragraph(f"Not to be found here at any size that can be true: {', '.join(never)}.")]


def _part(effect: str, target: str, parameter: str) -> str:
    """``plate 1, height``."""
    return ", ".join(
        filter(None, [place_label(effect, target), parameter_label(effect, parameter)])
    )


# --- figures ------------------------------------------------------------------------------------


def _usual_figure(limits: Sequence[Limit]) -> list[Block]:
    """Every cause's limits over the sizes that labs meet."""
    shown = {effect: _usual(effect, limits) for effect in USUAL}
    shown = {effect: sizes for effect, sizes in shown.items() if sizes}
    if not shown:
        return []
    usual = [USUAL[effect] for effect in shown]
    least = np.array([one.least for one in usual])
    figure = detection_limits(
        DetectionLimits(
            tuple(effect_title(effect) for effect in shown),
            tuple(_range(effect, sizes) for effect, sizes in shown.items()),
            np.array([min(x.size for x in sizes) for sizes in shown.values()]) / least,
            np.array([max(x.size for x in sizes) for sizes in shown.values()]) / least,
            np.array([one.most for one in usual]) / least,
        )
    )
    caption = (
        "How small each cause might have been and still been named in these recordings. Dot: at the "
        "place, in the direction and recording that show it best; bar: up to the worst; to the "
        "right the same in figures. Grey: sizes that laboratories meet. Left of the black line every usual size "
        "would have been named, right of the grey none."
    )
    return [Picture(figure, caption, "Bars: limits over usual sizes.", "diagnosis_limits")]


def _mass_figure(alone: Sequence[Limit]) -> list[Block]:
    masses = _least_masses(alone)
    shown = [segment for segment in SEGMENTS if segment in masses]
    if not shown:
        return []
    least = np.array([masses[segment] for segment in shown])
    figure = mass_limits(MassLimits(tuple(segment_label(s) for s in shown), least))
    caption = (
        "How heavy something unknown on a segment must be, wherever on it, in the recording that "
        "shows it best. What is worn in all recordings is not told from the person's own parameters."
    )
    return [Picture(figure, caption, "Dots: least mass.", "diagnosis_masses")]


def _least_masses(limits: Sequence[Limit]) -> dict[str, float]:
    """[kg] on each segment, of the recording that shows it best; none where no mass is seen."""
    masses: dict[str, float] = {}
    for one in limits:
        if one.effect == "added_mass" and one.parameter == "mass" and isfinite(one.size):
            masses[one.target] = min(one.size, masses.get(one.target, inf))
    return masses


# --- table --------------------------------------------------------------------------------------


def _rows(
    effect: str, together: Sequence[Limit], alone: Sequence[Limit]
) -> Iterator[tuple[str, ...]]:
    """A row per unit: the range over all places and directions."""
    lasting = [x for x in together if x.effect == effect and x.trials > 1]
    single = [x for x in alone if x.effect == effect]
    usual = USUAL[effect]
    for unit in dict.fromkeys(x.unit for x in (*lasting, *single)):
        columns = [
            [x for x in limits if x.unit == unit and _counts(x)] for limits in (lasting, single)
        ]
        if not any(columns):
            continue
        ends = [min(limits, key=lambda x: x.size) for limits in columns if limits]
        best = next((x for x in ends if isfinite(x.size)), None)
        if best is None:
            continue
        yield (
            effect_title(effect),
            *(_range(effect, limits) for limits in columns),
            place_label(effect, best.target) or MISSING,
            usual_words(effect) if usual.unit == unit else MISSING,
        )


def _usual(effect: str, limits: Sequence[Limit]) -> list[Limit]:
    """An effect's limits that can be compared with its usual sizes; none where all are infinite."""
    usual = USUAL[effect]
    counting = [x for x in limits if x.effect == effect and _counts(x) and x.unit == usual.unit]
    return counting if any(isfinite(x.size) for x in counting) else []


def _counts(limit: Limit) -> bool:
    """Not a number that only goes with the effect's size."""
    return limit.parameter in USUAL[limit.effect].parameters


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
    return _between(best.parameter, best.unit, best.size, worst.size)


def _between(parameter: str, unit: str, low: float, high: float) -> str:
    """``5.0 to 12 mm``, or one size where both are the same."""
    words = [size_words(parameter, unit, size) for size in (low, high)]
    if words[0] == words[1]:
        return words[0]
    first = words[0].removesuffix("°") if words[0].endswith("°") else words[0].partition(" ")[0]
    return f"{first} to {words[1]}"
