"""What people should know of each cause that the diagnosis may name."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import digits_of, readable_unit, with_unit
from bsip_cli.effects.nameless import ALONG
from bsip_cli.effects.plates import plates_called
from bsip_cli.report.words import TEXTS, listing, number, segment_label
from bsip_cli.segments import SEGMENTS

_FILE = Path(__file__).with_suffix(".toml")
_WORDS = tomllib.loads(_FILE.read_text(encoding="utf-8"))
WEIGHT: tuple[str, str] = tuple(TEXTS["weight"])  # where quiet stance contradicts a stated mass


@dataclass(frozen=True)
class EffectWords:
    """``title``: the cause in general; of all causes of its ``family`` what they do to the results
    (``meaning``), and what to do (``action``)."""

    title: str
    family: str
    meaning: str
    action: str

    @property
    def sentence(self) -> str:
        return f"{self.meaning} {self.action}"


EFFECT_WORDS = {
    name: EffectWords(about["title"], about["follows"], **_WORDS["follows"][about["follows"]])
    for name, about in _WORDS["causes"].items()
}
MAIN_NUMBERS = {
    name: tuple(about["about"]) for name, about in _WORDS["causes"].items() if "about" in about
}
"""Numbers that an effect is about. Where none stands here, all are parts of one size."""

OBJECTS = ("released_object", "implement", "object_handled")
"""What a task may be about: found, and nothing wrong with the recordings."""


def effect_title(effect: str) -> str:
    """As a table or a heading names it; of an unknown one its name in words."""
    words = EFFECT_WORDS.get(effect)
    return words.title if words else effect.replace("_", " ")


_ONE_PLACE = ("breathing", "missing_joint", "soft_tissue")  # where they sit is no news


def place_label(effect: str, target: str) -> str:
    """``plate 1, force x into force y`` or ``left hand`` of an effect's target; empty for none."""
    if effect in _ONE_PLACE:
        return ""
    component, by, quantity = target.partition(" by ")
    if by:  # fz by load
        how = f"along with {ALONG[quantity]}" if quantity in ALONG else "on average"
        return f"{_WORDS['channels'].get(component, 'all components')}, {how}"
    plate, _, channels = target.partition(" ")  # 1 fx>fy, 1 fz or 1
    if effect.startswith("plate_") or plate.isdigit():
        words = " into ".join(_WORDS["channels"].get(one, one) for one in channels.split(">"))
        return f"{plates_called(plate)}, {words}" if words else plates_called(plate)
    if effect.startswith("marker_"):
        first, _, second = target.partition("+")
        return f"markers {first} and {second}" if second else f"marker {target}"
    parts = target.split("+")
    if effect == "joint_centre" or all(part in SEGMENTS for part in parts):
        return " and ".join(segment_label(part) for part in parts)
    return _WORDS["channels"].get(target, target)


_COMPLETE = ("added_mass", "plate_gain", "unexplained")  # their sentence leaves nothing open


def parameter_label(effect: str, parameter: str) -> str:
    """What an interval is of, where the sentence leaves that open; else empty."""
    return "" if effect in _COMPLETE else str(_WORDS["parts"].get(parameter, ""))


def size_words(parameter: str, unit: str, *sizes: float) -> str:
    """``2.5 ms`` or ``2.5 to 12 ms``, with two digits that count."""
    factor, readable = readable_unit(parameter, unit)
    ends = dict.fromkeys(number(x, digits_of(x)) for x in (factor * size for size in sizes))
    return with_unit(" to ".join(ends), readable)


# --- sizes that laboratories meet ----------------------------------------------------------------


@dataclass(frozen=True)
class Usual:
    """From ``least`` to ``most``, in ``unit``, of the parameters named (the same for all)."""

    parameters: tuple[str, ...]
    unit: str
    least: float
    most: float


USUAL = {
    name: Usual(tuple(usual["of"]), usual["unit"], usual["least"], usual["most"])
    for name, about in _WORDS["causes"].items()
    if (usual := about.get("usual"))
}


def usual_words(effect: str) -> str:
    """``5 to 20 ms``; in the words of the file where it is no size of a parameter."""
    if effect not in USUAL:
        return str(_WORDS["causes"][effect]["met"])
    usual = USUAL[effect]
    factor, unit = readable_unit(usual.parameters[0], usual.unit)
    return with_unit(f"{factor * usual.least:.3g} to {factor * usual.most:.3g}", unit)


# --- what to check, and to record, where a cause is unknown or one of several ---------------------


def check_for(target: str, parameters: Sequence[str]) -> str:
    """What tells more of an error of unknown cause: by the quantity that it goes along with, or the
    fault that it acts like; empty where it is like none."""
    channel, _, quantity = target.partition(" by ")
    kind = "frequency" if "frequency" in parameters else quantity.partition("_")[0]
    checks = (one["check"] for one in _WORDS["checks"] if kind in one["of"])
    if check := next(checks, ""):
        return f"{check.format(channel=_WORDS['channels'].get(channel, 'forces'))}."
    like = (name for name, usual in USUAL.items() if {*usual.parameters} & {*parameters})
    if (name := next(like, None)) is None:
        return ""
    where = f" ({place})" if (place := place_label(name, target)) else ""
    title, remedy = effect_title(name), EFFECTS[name].remedy
    return f"{_WORDS['acts_like'].format(title=title, place=where, remedy=remedy)}."


_LOADS = ("added_mass", "released_object", "object_handled", "implement", "wobbling_mass")
_DISTINGUISHED_BY = {pair: one["record"] for one in _WORDS["distinguish"] for pair in one["causes"]}
_DISTINGUISHED_BY["missing_joint soft_tissue"] = EFFECTS["missing_joint"].remedy
_UNKNOWN = "look at plates, cables and everything that touches the person, and record again"


def separating_recording(causes: Sequence[tuple[str, str]], most: int | None = None) -> str:
    """What to record, without a final stop, for causes that look alike, as (effect, target); at most so many steps."""
    effects = list(dict.fromkeys(effect for effect, _ in causes))
    places = {one: {target for effect, target in causes if effect == one} for one in effects}
    advice = [_places(effect, causes) for effect in effects if len(places[effect]) > 1]
    for one, other in combinations(effects, 2):
        known = _DISTINGUISHED_BY.get(f"{one} {other}") or _DISTINGUISHED_BY.get(f"{other} {one}")
        advice += [known] if known else [_own(one), _own(other)]
    each = dict.fromkeys(advice)  # once, and none that another says with more words
    steps = [one for one in each if not any(o != one and o.startswith(one) for o in each)]
    if most is not None:
        steps = [step for step in steps if step != _UNKNOWN][:most]
    return "; ".join(steps) or _UNKNOWN


def _places(effect: str, causes: Sequence[tuple[str, str]]) -> str:
    where = listing([place_label(effect, target) for name, target in causes if name == effect])
    if effect in _LOADS:
        return f"look for what is worn or loose there, or keep still but for one at a time: {where}"
    if effect in ("unmeasured_contact", "external_force"):
        return f"watch, or film, what touches the person: {where}"
    return _own(effect)


def _own(effect: str) -> str:
    return EFFECTS[effect].remedy if effect in EFFECTS else _UNKNOWN
