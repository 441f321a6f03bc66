"""Which recording would tell causes apart that look alike in those that are there."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.report.effect_words import place_label
from bsip_cli.report.words import listing

_LOADS = ("added_mass", "released_object", "object_handled", "implement", "wobbling_mass")
_APART: dict[frozenset[str], str] = {
    frozenset(pair): words
    for pairs, words in (
        (
            [("plate_gain", "plate_zero"), ("plate_zero", "plate_crosstalk")],
            "step off the plate for five seconds: an offset stays when nobody stands there",
        ),
        (
            [("plate_zero", "added_mass"), ("plate_zero", "gravity_tilt")],
            "step off the plate for five seconds: an offset stays when nobody stands there",
        ),
        (
            [("plate_gain", "added_mass")],
            "weigh the person as recorded on a scale, and lay a known weight on the plate",
        ),
        (
            [("gravity_tilt", "plate_rotation"), ("gravity_tilt", "plate_crosstalk")],
            "hop three times: a fault of the plate grows with the force on it, a tilted vertical "
            "does not",
        ),
        (
            [("plate_rotation", "plate_crosstalk")],
            "stand on the plate and push forwards and sideways, and lay a known weight at several "
            "places: a tilted plate changes every force, a leaking channel only one",
        ),
        (
            [("gravity_tilt", "unexplained"), ("plate_zero", "unexplained")],
            "stand still for ten seconds at three places of the plate with nothing attached to the "
            "person: a tilt or an offset stays, whatever pulls is gone",
        ),
        (
            [("sync_offset", "clock_drift")],
            "hop three times at the beginning and at the end of a long recording",
        ),
        ([("missing_joint", "soft_tissue")], EFFECTS["missing_joint"].remedy),
        (
            [("breathing", "unexplained")],
            "stand still for thirty seconds, the breath held in the last ten",
        ),
    )
    for pair in pairs
}
_UNKNOWN = "look at plates, cables and everything that touches the person, and record again"


def separating_recording(rivals: Sequence[tuple[str, str]]) -> str:
    """What to record, without a final stop, for rivals as (effect, target)."""
    effects = list(dict.fromkeys(effect for effect, _ in rivals))
    advice = [_places(effect, rivals) for effect in effects if _count(effect, rivals) > 1]
    for pair in combinations(effects, 2):
        known = _APART.get(frozenset(pair))
        advice += [known] if known else [_own(effect) for effect in pair]
    return "; ".join(_without_beginnings(advice)) or _UNKNOWN


def _without_beginnings(advice: list[str]) -> list[str]:
    """Each once, and none that another says with more words."""
    each = list(dict.fromkeys(advice))
    return [one for one in each if not any(o != one and o.startswith(one) for o in each)]


def _count(effect: str, rivals: Sequence[tuple[str, str]]) -> int:
    return len({target for name, target in rivals if name == effect})


def _places(effect: str, rivals: Sequence[tuple[str, str]]) -> str:
    """The same effect at several places: they have to move, or be loaded, one at a time."""
    where = [place_label(effect, target) for name, target in rivals if name == effect]
    if effect in _LOADS:
        return (
            "look for what is worn or loose there, or keep still but for one at a time: "
            f"{listing(where)}"
        )
    if effect in ("unmeasured_contact", "external_force"):
        return f"watch, or film, what touches the person: {listing(where)}"
    return _own(effect)


def _own(effect: str) -> str:
    return EFFECTS[effect].remedy if effect in EFFECTS else _UNKNOWN
