"""The causes that a diagnosis may name, in words: what people should know of each, which ones were
analysed and found, and how small one might have been and still been seen."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, groupby
from math import isfinite
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import Judged, Number, Words, digits_of, readable_unit, with_unit
from bsip_cli.effects.nameless import ALONG
from bsip_cli.effects.plates import plates_called
from bsip_cli.report.words import listing, number, say, segment_label, true_minus
from bsip_cli.segments import SEGMENTS

_WORDS = tomllib.loads(Path(__file__).with_name("effect_words.toml").read_text(encoding="utf-8"))
_CHANNELS: dict[str, str] = _WORDS["channels"]


class Usual(NamedTuple):
    """Sizes that laboratories meet: ``unit`` and ends are of the parameters named (the same for
    all)."""

    parameters: Sequence[str]
    unit: str
    least: float
    most: float


@dataclass(frozen=True)
class EffectWords:
    """``title``: the cause in general; of all causes of its ``family`` what they do to the results
    (``meaning``), and what to do (``action``). ``about``: the numbers that it is about; where none
    stand here, all are parts of one size. ``met``: usual sizes that are none of a parameter."""

    title: str
    family: str
    meaning: str
    action: str
    about: Sequence[str] = ()
    usual: Usual | None = None
    met: str = ""

    @property
    def sentence(self) -> str:
        return f"{self.meaning} {self.action}"


USUAL = {name: Usual(**x["usual"]) for name, x in _WORDS["causes"].items() if "usual" in x}
EFFECT_WORDS = {
    name: EffectWords(**about | _WORDS["families"][about["family"]] | {"usual": USUAL.get(name)})
    for name, about in _WORDS["causes"].items()
}


def effect_title(effect: str) -> str:
    """As a table or a heading names it; of an unknown one its name in words."""
    words = EFFECT_WORDS.get(effect)
    return words.title if words else effect.replace("_", " ")


def place_label(effect: str, target: str) -> str:
    """``plate 1, force x into force y`` or ``left hand`` of an effect's target; empty for none."""
    if effect in ("breathing", "missing_joint", "soft_tissue"):  # where they sit is no news
        return ""
    component, by, quantity = target.partition(" by ")
    if by:  # fz by load
        how = f"along with {ALONG[quantity]}" if quantity in ALONG else "on average"
        return f"{_CHANNELS.get(component, 'all components')}, {how}"
    plate, _, channels = target.partition(" ")  # 1 fx>fy, 1 fz or 1
    if effect.startswith("plate_") or plate.isdigit():
        words = " into ".join(_CHANNELS.get(one, one) for one in channels.split(">"))
        return f"{plates_called(plate)}, {words}" if words else plates_called(plate)
    if effect.startswith("marker_"):
        first, _, second = target.partition("+")
        return f"markers {first} and {second}" if second else f"marker {target}"
    parts = target.split("+")
    if effect == "joint_centre" or all(part in SEGMENTS for part in parts):
        return " and ".join(segment_label(part) for part in parts)
    return _CHANNELS.get(target, target)


def parameter_label(effect: str, parameter: str) -> str:
    """What an interval is of, where the sentence leaves that open; else empty."""
    is_complete = effect in ("added_mass", "plate_gain", "unexplained")
    return "" if is_complete else str(_WORDS["parts"].get(parameter, ""))


def size_words(parameter: str, unit: str, *sizes: float) -> str:
    """``2.5 ms`` or ``2.5 to 12 ms``, with two digits that count."""
    factor, readable = readable_unit(parameter, unit)
    ends = dict.fromkeys(number(x, digits_of(x)) for x in (factor * size for size in sizes))
    return with_unit(" to ".join(ends), readable)


def usual_words(effect: str) -> str:
    """``5 to 20 ms``; in the words of the file where it is no size of a parameter."""
    if (usual := USUAL.get(effect)) is None:
        return EFFECT_WORDS[effect].met
    factor, unit = readable_unit(usual.parameters[0], usual.unit)
    return with_unit(f"{factor * usual.least:.3g} to {factor * usual.most:.3g}", unit)


# --- what to check, and to record, where a cause is unknown or one of several ---------------------


def check_for(target: str, parameters: Sequence[str]) -> str:
    """What tells more of an error of unknown cause: by the quantity that it goes along with, or the
    fault that it acts like; empty where it is like none."""
    channel, _, quantity = target.partition(" by ")
    kind = "frequency" if "frequency" in parameters else quantity.partition("_")[0]
    for one in _WORDS["checks"]:
        if kind in one["of"]:
            return f"{one['check'].format(channel=_CHANNELS.get(channel, 'forces'))}."
    for name, usual in USUAL.items():
        if {*usual.parameters} & {*parameters}:
            where = f" ({place})" if (place := place_label(name, target)) else ""
            like = {"title": effect_title(name), "place": where, "remedy": EFFECTS[name].remedy}
            return f"{_WORDS['acts_like'].format(**like)}."
    return ""


_LOADS = ("added_mass", "released_object", "object_handled", "implement", "wobbling_mass")
_DISTINGUISHED_BY = {pair: one["record"] for one in _WORDS["distinguish"] for pair in one["causes"]}
_DISTINGUISHED_BY["missing_joint soft_tissue"] = EFFECTS["missing_joint"].remedy
_UNKNOWN = "look at plates, cables and everything that touches the person, and record again"


def separating_recording(causes: Sequence[tuple[str, str]], most: int | None = None) -> str:
    """What to record, without a final stop, for causes that look alike, as (effect, target); at
    most so many steps."""
    places: dict[str, dict[str, str]] = {}
    for effect, target in causes:
        places.setdefault(effect, {})[target] = place_label(effect, target)
    own = {one: EFFECTS[one].remedy if one in EFFECTS else _UNKNOWN for one in places}
    advice = []
    for effect, of in places.items():
        where = listing([place_label(effect, target) for one, target in causes if one == effect])
        if len(of) > 1 and effect in _LOADS:
            look = "look for what is worn or loose there, or keep still but for one at a time"
            advice.append(f"{look}: {where}")
        elif len(of) > 1 and effect in ("unmeasured_contact", "external_force"):
            advice.append(f"watch, or film, what touches the person: {where}")
        elif len(of) > 1:
            advice.append(own[effect])
    for one, other in combinations(places, 2):
        known = _DISTINGUISHED_BY.get(f"{one} {other}") or _DISTINGUISHED_BY.get(f"{other} {one}")
        advice += [known] if known else [own[one], own[other]]
    each = dict.fromkeys(advice)  # once, and none that another says with more words
    steps = [one for one in each if not any(o != one and o.startswith(one) for o in each)]
    if most is not None:
        steps = [step for step in steps if step != _UNKNOWN][:most]
    return "; ".join(steps) or _UNKNOWN


# --- the causes that a diagnosis analysed, with their numbers as people read them -----------------

NOTHING = "none"
UNNAMED = "unexplained"
OF_THE_WEIGHT = "W"  # group of what quiet stance shows
_OBJECTS = ("released_object", "implement", "object_handled")  # have no usual size
_ALIKE = ["effect", "target", "p_value", "probability", "verdict", "class_id", "scope"]
_ALIKE += ["rms_change", "persons"]
_NO_SIZES = ("start", "end", "from_time", "release_time", "frequency", "damping_ratio")


class Candidate(Judged):
    """A cause that was analysed, in words; ``trials`` are stems of recordings."""

    @property
    def label(self) -> str:
        """``force plate turned or tilted: plate 1``."""
        where = place_label(self.effect, self.target)
        return effect_title(self.effect) + (f": {where}" if where else "")

    @property
    def is_of_all(self) -> bool:
        """The laboratory's, as all its persons together show it."""
        return self.persons > 0

    def which_size(self, short: bool = False) -> str:
        """Of a fault of the laboratory, why its size is the one to correct with, and this person's
        own; empty of all others. ``short``: whose it is, and without the interval of the own."""
        if not self.is_of_all:
            return ""
        return true_minus(say("which_size", short=short, persons=self.persons, own=self.own))

    def in_words(self, brief: bool = False) -> str:
        """What it is with the interval of its main number, and what the markers alone say;
        ``brief``: in fewest words."""
        main, what = self.main_number(), self.words.what
        what = self.words.short or what if brief else what
        remark = "" if brief else self.words.remark
        interval = main.interval(self.words.is_signed) if main else ""
        if main is None or not interval:
            return what + remark
        name = parameter_label(self.effect, main.name)
        name = "" if name in what else f"{name}: "
        return f"{what} ({name}95 % interval {true_minus(interval)}){remark}"

    def main_number(self) -> Number | None:
        """The number that the effect is about; of several alike, the one that is known best."""
        words = EFFECT_WORDS.get(self.effect)
        main = [n for n in self.numbers if words and n.name in words.about]
        sizes = main or [n for n in self.numbers if n.name not in _NO_SIZES]
        return max(sizes or self.numbers, key=Number.certainty, default=None)

    def against_usual(self) -> str:
        """``, a usual size (5 to 20 ms)``; empty where nothing usual is known."""
        size, usual = self.main_number(), USUAL.get(self.effect)
        if size is None or usual is None or self.effect in _OBJECTS:
            return ""
        if size.name not in usual.parameters or size.unit != usual.unit:
            return ""
        shown = float(f"{abs(size.value):.2g}")  # as it is read
        how = "smaller than usual" if shown < usual.least else "a usual size"
        how = "larger than usual" if shown > usual.most else how
        return f", {how} ({usual_words(self.effect)})"

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
    alone = (Number(*own(row)) for row in rows if isfinite(row["own_estimate"]))
    texts = {name: true_minus(first[name]) for name in ("what", "short", "against", "remark")}
    gain, low, high = (float(first[f"gain_{name}"]) for name in ("percent", "ci_low", "ci_high"))
    return Candidate(
        **{name: first[name] for name in _ALIKE},
        trials=tuple(str(first["trials"]).split(", ")),
        numbers=tuple(Number(*sizes(row)) for row in rows if row["parameter"]),
        words=Words(**texts, is_signed=bool(first["is_signed"])),
        gain=(gain, low, min(high, 100.0)),  # more than everything cannot go
        own=next(alone, None),
    )


Cause = tuple[Candidate, ...]  # a single candidate, or all of a group of which one is there


def causes_of(candidates: Sequence[Candidate]) -> tuple[Cause, ...]:
    """What was found; errors that nothing explains first, then what changes the forces most."""
    groups: dict[str, list[Candidate]] = {}
    for k, one in enumerate(candidates):
        if one.verdict != "rejected":
            groups.setdefault(one.class_id or f"#{k}", []).append(one)

    def importance(cause: Cause) -> tuple[bool, float]:
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


def analysed(detection: pd.DataFrame, diagnosis: pd.DataFrame) -> tuple[str, ...]:
    """Stems of the recordings that were diagnosed, those of which something was found before the
    search too."""
    others = diagnosis.loc[diagnosis["class_id"] != OF_THE_WEIGHT, "trials"]
    return tuple(sorted({s for t in (*detection["trials"], *others) for s in str(t).split(", ")}))


# --- how small ------------------------------------------------------------------------------------


class Limit(NamedTuple):
    """Smallest size of a cause that these recordings would have shown; infinite where they show it
    at no size."""

    effect: str
    target: str
    parameter: str
    unit: str
    size: float
    trials: int

    def in_words(self) -> str:
        return size_words(self.parameter, self.unit, self.size)


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
    columns = rows[["effect", "target", "parameter", "unit", "limit", "together"]]
    every = map(Limit._make, columns.itertuples(index=False))
    return tuple(one for one in every if one[:2] not in found)


_EXAMPLES = (  # effects whose limits are in the sentence
    ("sync_offset", "", "a delay of the forces"),
    ("plate_translation", "", "a plate's shift"),
    ("plate_gain", "fz", "a misreading of vertical forces"),
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
    text = " or ".join(filter(None, [", ".join(parts[:-1]), *parts[-1:]]))
    return f"Too small to see: {text}." if text else ""
