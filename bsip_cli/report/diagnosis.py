"""The diagnosis of one person as the reports tell it: candidates, verdict, limits, in words."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.report.effect_words import (
    EFFECT_WORDS,
    digits_of,
    effect_title,
    place_label,
    readable_unit,
    size_words,
)
from bsip_cli.report.words import component_label, count, listing, number, percent, trial_label

NOTHING = "none"
UNNAMED = "unexplained"
_INTERVAL = re.compile(r" \([^()]*: 95 % interval .*$")  # what follows it the report says itself
_REASON = re.compile(r" \(([^()]*)\)$")  # why a candidate was rejected
_NO_SIZES = ("start", "end", "from_time", "release_time", "frequency", "damping_ratio")
_MOST_GAINS = 3
_EXAMPLES = (  # effects whose limits are told in the sentence
    ("sync_offset", "", "a delay between forces and markers"),
    ("plate_translation", "", "a plate shifted"),
    ("plate_gain", "fz", "a vertical gain wrong"),
    ("added_mass", "hand_l", "a mass on the left hand"),
)
LEAST_TOLD = 1e-3  # p-values below are not told in digits


@dataclass(frozen=True)
class Number:
    """A parameter with its 95 % interval, NaN where there is none."""

    name: str
    unit: str
    value: float
    low: float
    high: float

    def in_words(self) -> str:
        """``yaw 2.01° (95 % interval 1.87 to 2.14)``."""
        factor, unit = readable_unit(self.name, self.unit)
        value, low, high = (factor * x for x in (self.value, self.low, self.high))
        known = np.isfinite(high - low)
        digits = digits_of(high - low if known and high > low else value)
        space = "" if unit == "°" else " "
        text = f"{self.name.replace('_', ' ')} {number(value, digits)}{space}{unit}".strip()
        if not known:
            return text
        return f"{text} (95 % interval {number(low, digits)} to {number(high, digits)})"

    def certainty(self) -> float:
        """Its size over the width of its interval; 0 where none is known."""
        width = self.high - self.low
        return abs(self.value) / max(width, 1e-12) if np.isfinite(width) else 0.0


@dataclass(frozen=True)
class Candidate:
    """A cause that was looked at, with its numbers; ``trials`` are stems of recordings."""

    effect: str
    target: str
    verdict: str
    class_id: str
    p_value: float
    gain: tuple[float, float, float]
    sentence: str
    trials: tuple[str, ...]
    numbers: tuple[Number, ...]

    @property
    def label(self) -> str:
        """``force plate turned or tilted: plate 1``."""
        where = place_label(self.effect, self.target)
        return effect_title(self.effect) + (f": {where}" if where else "")

    def what(self) -> str:
        """Its sentence without interval, advice and reason."""
        text = re.sub(_INTERVAL, "", self.sentence).removeprefix("not so: ")
        text = re.sub(_REASON, "", text) if self.verdict == "rejected" else text
        return f"{text[0].upper()}{text[1:]}"

    def surest(self) -> Number | None:
        """Of the numbers that are a size (if any are), the one that is known best."""
        sizes = [n for n in self.numbers if n.name not in _NO_SIZES]
        return max(sizes or self.numbers, key=Number.certainty, default=None)

    def where(self) -> str:
        """``hops (run 1) and squat (run 1)``."""
        return listing([trial_label(stem) for stem in self.trials])

    def why_not(self) -> str:
        """Why it was rejected; empty if it was not."""
        found = re.search(_REASON, self.sentence) if self.verdict == "rejected" else None
        return found[1] if found else ""


def candidates_of(diagnosis: pd.DataFrame) -> tuple[Candidate, ...]:
    """The candidates of a ``diagnosis`` table in their order; the row ``none`` is none."""
    rows = diagnosis[diagnosis["effect"] != NOTHING]
    found = []
    for _, group in rows.groupby("rank", sort=True):
        first = group.iloc[0]
        numbers = tuple(
            Number(r["parameter"], r["unit"], r["estimate"], r["ci_low"], r["ci_high"])
            for r in group.to_dict("records")
            if r["parameter"]
        )
        found.append(
            Candidate(
                first["effect"],
                first["target"],
                first["verdict"],
                first["class_id"],
                float(first["p_value"]),
                (
                    float(first["gain_percent"]),
                    float(first["gain_ci_low"]),
                    float(first["gain_ci_high"]),
                ),
                first["sentence"],
                tuple(str(first["trials"]).split(", ")),
                numbers,
            )
        )
    return tuple(found)


def causes_of(candidates: Sequence[Candidate]) -> tuple[tuple[Candidate, ...], ...]:
    """What was found: a single candidate each, or all candidates of a class."""
    groups: dict[str, list[Candidate]] = {}
    for k, one in enumerate(candidates):
        if one.verdict != "rejected":
            groups.setdefault(one.class_id or f"#{k}", []).append(one)
    return tuple(tuple(group) for group in groups.values())


# --- the verdict ------------------------------------------------------------------------------


def headline(diagnosis: pd.DataFrame) -> str:
    """One sentence on whether anything is wrong."""
    if diagnosis.empty:
        return "No trial was long enough on the plates to look for errors: nobody can say."
    causes = causes_of(candidates_of(diagnosis))
    if not causes:
        return "Nothing wrong above the noise was found."
    unnamed = sum(c[0].effect == UNNAMED for c in causes)
    classes = sum(len(c) > 1 for c in causes)
    named = len(causes) - unnamed - classes
    parts = [f"{count(named, 'cause')} named"] if named else []
    if classes:
        parts.append(f"{classes} narrowed down to rivals that look alike here")
    if unnamed:
        parts.append(f"{unnamed} that cannot be named")
    return f"Something is wrong: {listing(parts)}."


def cause_sentences(cause: Sequence[Candidate]) -> tuple[str, ...]:
    """A cause, or a class of rivals: what, how large, how sure, and where."""
    first = cause[0]
    if len(cause) > 1:
        what = "One of these, which these recordings cannot tell apart: " + "; or ".join(
            f"{one.what()}{_size(one)}" for one in cause
        )
    elif first.effect == UNNAMED:
        what = f"Something is wrong that cannot be named. {first.what()}{_size(first)}"
    else:
        what = f"{first.what()}{_size(first)}"
    said = [f"{what}.", f"Seen in {first.where()}.", how_sure(first)]
    if len(cause) > 1:
        said.append(f"To tell them apart: {_remedies(cause)}.")
    return tuple(said)


def consequences(causes: Sequence[Sequence[Candidate]]) -> tuple[str, ...]:
    """What the causes mean for the results, each once."""
    effects = [one.effect for cause in causes for one in cause]
    known = (EFFECT_WORDS[name].consequence for name in effects if name in EFFECT_WORDS)
    return tuple(dict.fromkeys(known))


def _named_twice(causes: Sequence[Sequence[Candidate]]) -> str:
    """A warning where one cause was kept more than once; empty where none was."""
    labels = [cause[0].label for cause in causes]
    twice = [label for label in dict.fromkeys(labels) if labels.count(label) > 1]
    if not twice:
        return ""
    return (
        f"Named more than once: {listing(twice)}. Its parts add up, and their single sizes and "
        "intervals, and causes named between them, should not be trusted."
    )


def _size(one: Candidate) -> str:
    surest = one.surest()
    if surest is None or surest.certainty() == 0.0:
        return ""
    return f" — {surest.in_words()}"


def _remedies(cause: Sequence[Candidate]) -> str:
    """What to record, each advice once."""
    known = dict.fromkeys(EFFECTS[one.effect].remedy for one in cause if one.effect in EFFECTS)
    return "; or ".join(known) or "record the movement again"


def how_sure(one: Candidate) -> str:
    """Against chance, and on data that were not used to size it."""
    gain, low, high = one.gain
    chance = percent(one.p_value, 1) if one.p_value >= LEAST_TOLD else "fewer than 0.1"
    text = f"Chance alone would bring as much in {chance} % of cases"
    if not np.isfinite(gain):
        return f"{text}."
    return (
        f"{text}; taken into account, it removes {number(gain, 1)} % (95 % interval "
        f"{number(low, 1)} to {number(high, 1)} %) of the squared difference between measured and "
        "simulated forces in data that it was not fitted to."
    )


def gain_sentence(gains: pd.DataFrame) -> str:
    """What the causes do to the result: the components that improve most, and those that lose.

    ``gains`` is a ``gain`` table; empty text where it has no number. The vertical force, which it
    has twice, counts once.
    """
    whole = gains[np.isfinite(gains["gain_percent"]) & (gains["component"] != "fz")]
    best = whole[whole["gain_percent"] > 0].nlargest(_MOST_GAINS, "gain_percent")
    if best.empty:
        return (
            "" if whole.empty else "With what was found in the model, no component follows better."
        )
    parts = [
        f"{component_label(r['component'])} {number(r['rmse_before'], 2)} → {number(r['rmse_after'], 2)} "
        f"{r['unit']} ({number(r['gain_percent'], 0)} % less, {number(r['ci_low'], 0)} to "
        f"{number(r['ci_high'], 0)} %)"
        for r in best.to_dict("records")
    ]
    worse = [component_label(c) for c in whole.loc[whole["ci_high"] < 0, "component"]]
    rises = f" It rises in {listing(worse)}." if worse else ""
    return (
        "With what was found in the model, the error on data that did not size it falls: "
        f"{'; '.join(parts)}.{rises}"
    )


# --- limits -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Limit:
    """Smallest size of a cause that these recordings would have shown."""

    effect: str
    target: str
    parameter: str
    unit: str
    size: float
    trials: int

    def in_words(self) -> str:
        return size_words(self.parameter, self.unit, self.size)


def limits_of(detection: pd.DataFrame, diagnosis: pd.DataFrame) -> tuple[Limit, ...]:
    """Of each cause and place the limit with most recordings together; found causes have none.

    Of causes that only single recordings can show, the best recording counts.
    """
    found = {
        (one.effect, one.target) for one in candidates_of(diagnosis) if one.verdict != "rejected"
    }
    rows = detection[np.isfinite(detection["limit"])]
    rows = rows.assign(together=rows["trials"].str.count(",") + 1)
    rows = rows.sort_values(["together", "limit"], ascending=[False, True], kind="stable")
    rows = rows.drop_duplicates(["effect", "target", "parameter"]).sort_index()
    return tuple(
        Limit(
            r["effect"],
            r["target"],
            r["parameter"],
            r["unit"],
            float(r["limit"]),
            int(r["together"]),
        )
        for r in rows.to_dict("records")
        if (r["effect"], r["target"]) not in found
    )


def limits_sentence(limits: Sequence[Limit]) -> str:
    """``A delay ... under 2.5 ms or ... could not have been seen.``; empty without examples."""
    parts = []
    for effect, ends, words in _EXAMPLES:
        of_it = [
            x
            for x in limits
            if x.effect == effect
            and x.target.endswith(ends)
            and x.parameter in ("delay", "x", "y", "gain", "mass")
        ]
        if of_it:
            worst = max(of_it, key=lambda x: x.size)
            relation = "by less than" if effect in ("plate_translation", "plate_gain") else "under"
            parts.append(f"{words} {relation} {worst.in_words()}")
    if not parts:
        return ""
    text = " or ".join(filter(None, [", ".join(parts[:-1]), parts[-1]]))
    return f"{text[0].upper()}{text[1:]} could not have been seen in these recordings."


def looked_at(detection: pd.DataFrame) -> tuple[str, ...]:
    """Stems of the recordings that were diagnosed."""
    return tuple(dict.fromkeys(s for t in detection["trials"] for s in str(t).split(", ")))


def verdict_words(
    diagnosis: pd.DataFrame, detection: pd.DataFrame, gains: pd.DataFrame | None
) -> tuple[str, ...]:
    """The whole verdict, a paragraph each: headline, causes, what follows, gains, limits."""
    said = [headline(diagnosis)]
    causes = causes_of(candidates_of(diagnosis))
    said += [" ".join(cause_sentences(cause)) for cause in causes]
    said += [*filter(None, [_named_twice(causes)]), *consequences(causes)]
    if gains is not None and causes:
        said += filter(None, [gain_sentence(gains)])
    if not causes and not diagnosis.empty:
        names = [trial_label(stem) for stem in looked_at(detection)]
        said.append(f"Looked at: {listing(names)}.")
    said += filter(None, [limits_sentence(limits_of(detection, diagnosis))])
    return tuple(said)
