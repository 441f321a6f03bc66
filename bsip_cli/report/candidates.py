"""The causes that a diagnosis analysed, with their numbers as people read them, and how small a cause
might have been and still been seen.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from math import isfinite
from operator import itemgetter
from typing import Any

import numpy as np
import pandas as pd

from bsip_cli.effects.effect import Judged, Number, Words
from bsip_cli.report import effect_words
from bsip_cli.report.words import number, true_minus

NOTHING = "none"
UNNAMED = "unexplained"
_ALIKE = ("effect", "target", "p_value", "probability", "verdict", "class_id", "scope")
_NO_SIZES = ("start", "end", "from_time", "release_time", "frequency", "damping_ratio")


class Candidate(Judged):
    """A cause that was analysed, in words; ``trials`` are stems of recordings."""

    @property
    def label(self) -> str:
        """``force plate turned or tilted: plate 1``."""
        where = effect_words.place_label(self.effect, self.target)
        return effect_words.effect_title(self.effect) + (f": {where}" if where else "")

    @property
    def is_of_all(self) -> bool:
        """The laboratory's, as all its persons together show it."""
        return self.persons > 0

    def which_size(self, short: bool = False) -> str:
        """Of a fault of the laboratory, why its size is the one to correct with, and this person's
        own; empty of all others. ``short``: whose it is, and without the interval of the own."""
        if not self.is_of_all:
            return ""
        said, interval = f"Size of {self.persons} persons together", ""
        if not short:
            said = f"Correct with this size, as {self.persons} persons of the laboratory share it"
            interval = f", 95 % interval {self.own.interval()}" if self.own else ""
        whose = "alone" if short else "this person alone"
        own = f" ({whose}: {self.own.size()}{interval})" if self.own else ""
        return true_minus(f"{said}{own}.")

    def in_words(self, brief: bool = False) -> str:
        """What it is with the interval of its main number, and what the markers alone say;
        ``brief``: in fewest words."""
        main, what = self.main_number(), self.words.what
        what = self.words.short or what if brief else what
        remark = "" if brief else self.words.remark
        interval = main.interval(self.words.is_signed) if main else ""
        if main is None or not interval:
            return what + remark
        name = effect_words.parameter_label(self.effect, main.name)
        name = "" if name in what else name
        interval = f"{name}{': ' if name else ''}95 % interval {true_minus(interval)}"
        return f"{what} ({interval}){remark}"

    def main_number(self) -> Number | None:
        """The number that the effect is about; of several alike, the one that is known best."""
        wanted = effect_words.MAIN_NUMBERS.get(self.effect, ())
        main = [n for n in self.numbers if n.name in wanted]
        sizes = main or [n for n in self.numbers if n.name not in _NO_SIZES]
        return max(sizes or self.numbers, key=Number.certainty, default=None)

    def against_usual(self) -> str:
        """``, a usual size (5 to 20 ms)``; empty where nothing usual is known."""
        size, usual = self.main_number(), effect_words.USUAL.get(self.effect)
        if size is None or usual is None or self.effect in effect_words.OBJECTS:
            return ""  # an object has no usual size
        if (size.name, size.unit) not in {(name, usual.unit) for name in usual.parameters}:
            return ""
        shown = float(f"{abs(size.value):.2g}")  # as it is read
        how = "smaller than usual" if shown < usual.least else "a usual size"
        how = "larger than usual" if shown > usual.most else how
        return f", {how} ({effect_words.usual_words(self.effect)})"

    def removes(self) -> str:
        """``61.1 (-19.6 to 100.0)``, percent of the squared difference in unseen seconds."""
        gain, low, high = self.gain
        if not np.isfinite(gain):
            return "not tested"
        return f"{number(gain)} ({number(low)} to {number(high)})"


def candidates_of(diagnosis: pd.DataFrame) -> tuple[Candidate, ...]:
    """The candidates of a ``diagnosis`` table in their order; the row ``none`` is none."""
    rows = diagnosis[diagnosis["effect"] != NOTHING].sort_values("rank", kind="stable")
    by_rank = groupby(rows.to_dict("records"), itemgetter("rank"))
    return tuple(_candidate(list(group)) for _, group in by_rank)


def _candidate(rows: Sequence[Mapping[Any, Any]]) -> Candidate:
    first = rows[0]
    sizes = itemgetter("parameter", "unit", "estimate", "ci_low", "ci_high")
    own = itemgetter("parameter", "unit", "own_estimate", "own_low", "own_high")
    numbers = tuple(Number(*sizes(row)) for row in rows if row["parameter"])
    alone = (Number(*own(row)) for row in rows if isfinite(row["own_estimate"]))
    texts = first["what"], first["short"], first["against"], first["remark"]
    what, short, against, remark = map(true_minus, texts)
    gain, low, high = (float(first[f"gain_{name}"]) for name in ("percent", "ci_low", "ci_high"))
    return Candidate(
        **{name: first[name] for name in _ALIKE},
        rms_change=first["rms_change"],
        persons=first["persons"],
        trials=tuple(str(first["trials"]).split(", ")),
        numbers=numbers,
        words=Words(what, short, against, remark, bool(first["is_signed"])),
        gain=(gain, low, min(high, 100.0)),  # more than everything cannot go
        own=next(alone, None),
    )


def causes_of(candidates: Sequence[Candidate]) -> tuple[tuple[Candidate, ...], ...]:
    """What was found: a single candidate each, or all candidates of a group; errors that nothing
    explains first, then what changes the forces most."""
    groups: dict[str, list[Candidate]] = {}
    for k, one in enumerate(candidates):
        if one.verdict != "rejected":
            groups.setdefault(one.class_id or f"#{k}", []).append(one)

    def importance(cause: tuple[Candidate, ...]) -> tuple[bool, float]:
        """Of a group, by what is to be expected: each member counts as probable as it is."""
        expected = [np.nan_to_num(one.probability, nan=1.0) * one.rms_change for one in cause]
        return not is_large(cause), -float(np.nansum(expected))

    return tuple(sorted(map(tuple, groups.values()), key=importance))


def effects_in(causes: Iterable[Sequence[Candidate]]) -> frozenset[str]:
    """Names of all effects that were found."""
    return frozenset(one.effect for cause in causes for one in cause)


def is_large(cause: Sequence[Candidate]) -> bool:
    """An error beyond the yardsticks that nothing explains, as ``large_errors`` finds it."""
    first = cause[0]
    named = {one.name for one in first.numbers}
    return first.effect == UNNAMED and not first.target and named == {"error"}


_EXAMPLES = (  # effects whose limits are in the sentence
    ("sync_offset", "", "a delay of the forces"),
    ("plate_translation", "", "a plate's shift"),
    ("plate_gain", "fz", "a misreading of vertical forces"),
)
OF_THE_WEIGHT = "W"  # group of what quiet stance shows


@dataclass(frozen=True)
class Limit:
    """Smallest size of a cause that these recordings would have shown; infinite where they show it
    at no size."""

    effect: str
    target: str
    parameter: str
    unit: str
    size: float
    trials: int

    def in_words(self) -> str:
        return effect_words.size_words(self.parameter, self.unit, self.size)


def limits_of(
    detection: pd.DataFrame, diagnosis: pd.DataFrame, alone: bool = False
) -> tuple[Limit, ...]:
    """Of each cause and place the limit with most recordings together, of what only single ones can
    show that in each; with ``alone`` all of single recordings. Found causes have none."""
    causes = causes_of(candidates_of(diagnosis))
    found = {(one.effect, one.target) for cause in causes for one in cause}
    rows = detection.assign(together=detection["trials"].str.count(",") + 1)
    most = rows.groupby(["effect", "target", "parameter"])["together"].transform("max")
    rows = rows[rows["together"] == (1 if alone else most)]
    return tuple(
        Limit(r["effect"], r["target"], r["parameter"], r["unit"], float(r["limit"]), r["together"])
        for r in rows.to_dict("records")
        if (r["effect"], r["target"]) not in found
    )


def limits_sentence(limits: Sequence[Limit]) -> str:
    """``Too small to see: a delay ... under 2.5 ms or ...``: of plates, axes and recordings
    the worst one; empty without examples."""
    parts = []
    known = [x for x in limits if x.parameter in ("delay", "x", "y", "gain", "mass")]
    for effect, ends, words in _EXAMPLES:
        of_it = [x for x in known if x.effect == effect and x.target.endswith(ends)]
        if of_it:
            worst = max(of_it, key=lambda x: x.size)
            size = f"under {worst.in_words()}" if isfinite(worst.size) else "of any size"
            parts.append(f"{words} {size}")
    if not parts:
        return ""
    text = " or ".join(filter(None, [", ".join(parts[:-1]), parts[-1]]))
    return f"Too small to see: {text}."


def analysed(detection: pd.DataFrame, diagnosis: pd.DataFrame) -> tuple[str, ...]:
    """Stems of the recordings that were diagnosed, those of which something was found before the
    search too."""
    others = diagnosis.loc[diagnosis["class_id"] != OF_THE_WEIGHT, "trials"]
    return tuple(sorted({s for t in (*detection["trials"], *others) for s in str(t).split(", ")}))
