"""What people should know of each cause that the diagnosis may name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from bsip_cli.body.names import SEGMENTS
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.plates import plates_called
from bsip_cli.effects.readable import digits_of, readable_unit, with_unit
from bsip_cli.report.words import listing, number, segment_label

_FORCES = (
    "The measured forces are not the true ones, and everything identified from them inherits the "
    "error.",
    "Correct the forces in the lab, or write corrected files (bsip export), and run again.",
)
_CLOCKS = (
    "Forces and markers are not of the same moments, and everything identified from them inherits "
    "the error. A filter that only the forces have gone through delays them too.",
    "Correct the clock in the lab, or write corrected files (bsip export), and run again.",
)
_MOTION = (
    "The motion is not the true one, and the simulated forces with it.",
    "Correct the markers, and run again.",
)
_FRAME = (
    "Motion and forces do not share their axes, and everything identified from them inherits the "
    "error.",
    "Calibrate the cameras again, or turn the markers back, and run again.",
)
_SKIN = (
    "The pose of the trunk, and the simulated forces with it, is only as good as markers on soft "
    "tissue can be.",
    "Put markers over bone, and record again.",
)
_PERSON = (
    "The recordings need not be wrong: the model lacks something that this person has, and "
    "squeezes it into the inertial parameters of some segment.",
    "Use the forces as they are, and do not read the parameters near that place as this person's.",
)
_LOAD = (
    "A load that is not stated ends up in the masses of the body where its recording identifies "
    "them, and in the errors of the forces where it judges them.",
    "Weigh it, state its mass (tutorial: loads) and run again.",
)
WEIGHT = (
    "Either the stated mass is wrong or what the plates measure. Only if a scale confirms the stated "
    "mass are the plates at fault, or something that is carried.",
    "Weigh the person on a scale first.",
)
_CONTACT = (
    "The plates do not carry all of the ground force.",
    "Leave out the frames with the contact, or record without anything in reach.",
)
_UNNAMED = (
    "Neither the forces nor the identified parameters should be trusted further than the report says.",
    "Look at the recordings where the error comes and goes (report, under errors).",
)


@dataclass(frozen=True)
class EffectWords:
    """``title``: the cause in general; ``meaning``: what it does to the results; ``action``: what to
    do."""

    title: str
    meaning: str
    action: str

    @property
    def consequence(self) -> str:
        return f"{self.meaning} {self.action}"


EFFECT_WORDS = {
    "sync_offset": EffectWords("forces and markers out of step", *_CLOCKS),
    "clock_drift": EffectWords("clocks of forces and markers run apart", *_CLOCKS),
    "plate_translation": EffectWords("force plate not where the file says", *_FORCES),
    "plate_rotation": EffectWords("force plate turned or tilted", *_FORCES),
    "plate_gain": EffectWords("wrong gain of a plate's channel", *_FORCES),
    "plate_crosstalk": EffectWords("one channel of a plate leaks into another", *_FORCES),
    "plate_zero": EffectWords("constant offset of a plate's channel", *_FORCES),
    "plate_drift": EffectWords("drift of a plate's channel", *_FORCES),
    "gravity_tilt": EffectWords("the lab's vertical is not vertical", *_FORCES),
    "added_mass": EffectWords("mass that the model does not know", *_LOAD),
    "released_object": EffectWords("object held and let go", *_LOAD),
    "wobbling_mass": EffectWords("soft tissue that swings", *_PERSON),
    "breathing": EffectWords("breathing", *_PERSON),
    "unmeasured_contact": EffectWords("contact beside the plates", *_CONTACT),
    "joint_centre": EffectWords("joint centre in the wrong place", *_PERSON),
    "missing_joint": EffectWords("trunk bends where the model is stiff", *_PERSON),
    "soft_tissue": EffectWords("soft tissue that moves with the trunk's posture", *_SKIN),
    "marker_shift": EffectWords("marker not in its place", *_MOTION),
    "marker_slide": EffectWords("marker that slides", *_MOTION),
    "marker_swap": EffectWords("two markers exchanged", *_MOTION),
    "over_smoothing": EffectWords("markers smoothed too much", *_MOTION),
    "segment_inertia": EffectWords("other inertial parameters of a segment", *_PERSON),
    "implement": EffectWords("club, racket or stick in the hand", *_LOAD),
    "camera_frame": EffectWords("cameras turned against plates and gravity", *_FRAME),
    "external_force": EffectWords("constant force beside the plates", *_CONTACT),
    "object_handled": EffectWords("object picked up and put down", *_LOAD),
    "unexplained": EffectWords("error of unknown cause", *_UNNAMED),
}


OBJECTS = ("released_object", "implement", "object_handled")
"""What a task may be about: found, and nothing wrong with the recordings."""


def effect_title(effect: str) -> str:
    words = EFFECT_WORDS.get(effect)
    return words.title if words else effect.replace("_", " ")


_CHANNELS = {
    "fx": "force x",
    "fy": "force y",
    "fz": "vertical force",
    "mx": "moment x",
    "my": "moment y",
    "mz": "moment about the vertical",
}
_ONE_PLACE = ("breathing", "missing_joint", "soft_tissue")  # where they sit is no news


def place_label(effect: str, target: str) -> str:
    """``plate 1, force x into force y`` or ``left hand`` of an effect's target; empty for none."""
    if effect in _ONE_PLACE:
        return ""
    if effect.startswith("plate_"):  # 1 fx>fy, 1 fz or 1
        plate, _, channels = target.partition(" ")
        words = " into ".join(_CHANNELS.get(one, one) for one in channels.split(">"))
        return f"{plates_called(plate)}, {words}" if words else plates_called(plate)
    if effect.startswith("marker_"):
        first, _, second = target.partition("+")
        return f"markers {first} and {second}" if second else f"marker {target}"
    if effect == "joint_centre" or target in SEGMENTS:
        return segment_label(target)
    if effect == "unmeasured_contact":
        return " and ".join(segment_label(name) for name in target.split("+"))
    return _CHANNELS.get(target, target)


_REGULARITIES = {  # first number of a regularity without a name: what it is
    "amplitude": "swing",
    "curvature": "square of the load",
    "error": "play or friction",
    "lacking": "channel at its limit",
    "nonlinearity": "not in proportion to the load",
    "stiffness": "pull on the pelvis",
}


def unnamed_label(number_name: str, where: str) -> str:
    """``swing, force x``; of a pull, ``y by z`` is the force's axis and the place's."""
    kind = _REGULARITIES.get(number_name)
    if kind is None:
        return where
    force, by, place = where.partition(" by ")
    return (
        f"{kind} along {force.upper()}, growing along {place.upper()}" if by else f"{kind}, {where}"
    )


# Numbers that an effect is about. Where none stands here, all are parts of one size.
MAIN_NUMBERS = {
    "added_mass": ("mass",),
    "released_object": ("mass",),
    "implement": ("mass",),
    "object_handled": ("mass",),
    "camera_frame": ("angle",),
    "external_force": ("force",),
    "wobbling_mass": ("mass",),
    "breathing": ("amplitude",),
    "gravity_tilt": ("angle",),
    "unmeasured_contact": ("force",),
    "marker_shift": ("shift",),
    "marker_slide": ("way",),
    "soft_tissue": ("size",),
    "unexplained": ("amplitude", "stiffness", "curvature", "error", "nonlinearity", "lacking"),
}
_PARTS = {  # of a size with several parts: which one the interval is of
    "x": "along the lab's X axis",
    "y": "along the lab's Y axis",
    "z": "height",
    "shift_x": "along the segment's x axis",
    "shift_y": "along the segment's y axis",
    "shift_z": "along the segment's z axis",
    "yaw": "about the vertical",
    "tilt_x": "tilt about the lab's X axis",
    "tilt_y": "tilt about the lab's Y axis",
    "flexion": "bending forwards there",
    "lateral": "bending sideways there",
    "axial": "turning there",
    "force": "force",
    "mass": "mass",
    "amplitude": "mass times amplitude",
}
_TOLD = ("added_mass", "plate_gain", "unexplained")  # their sentence leaves nothing open


def parameter_label(effect: str, parameter: str) -> str:
    """What an interval is of, where the sentence leaves that open; else empty."""
    return "" if effect in _TOLD else _PARTS.get(parameter, "")


def size_words(parameter: str, unit: str, size: float) -> str:
    """``2.5 ms`` with two digits that count."""
    factor, readable = readable_unit(parameter, unit)
    value = factor * size
    return with_unit(number(value, digits_of(value)), readable)


# --- sizes that laboratories meet ----------------------------------------------------------------


@dataclass(frozen=True)
class Usual:
    """From ``least`` to ``most``, in ``unit``, of the parameters named (the same for all)."""

    parameters: tuple[str, ...]
    unit: str
    least: float
    most: float


USUAL: dict[str, Usual] = {
    "sync_offset": Usual(("delay",), "s", 0.005, 0.02),
    "clock_drift": Usual(("rate_error",), "1", 2e-4, 5e-4),
    "plate_translation": Usual(("x", "y"), "m", 0.01, 0.03),
    "plate_rotation": Usual(
        ("tilt_x", "tilt_y", "yaw"), "rad", 0.017453, 0.069813
    ),  # 1 to 4 degrees
    "plate_gain": Usual(("gain",), "1", 0.02, 0.05),
    "plate_crosstalk": Usual(("coefficient",), "1", 0.01, 0.03),
    "plate_zero": Usual(("offset",), "N", 8.0, 25.0),
    "plate_drift": Usual(("drift",), "N/s", 0.3, 2.0),  # 10 to 20 N over 10 to 30 s
    "gravity_tilt": Usual(("angle_x", "angle_y"), "rad", 0.0087266, 0.034907),
    "added_mass": Usual(("mass",), "kg", 0.5, 1.5),
    "released_object": Usual(("mass",), "kg", 0.3, 0.7),
    "wobbling_mass": Usual(("mass",), "kg", 3.0, 4.5),
    "breathing": Usual(("cosine", "sine"), "kg m", 0.05, 0.3),
    "unmeasured_contact": Usual(("force_x", "force_y", "force_z"), "N", 20.0, 40.0),
    "joint_centre": Usual(("shift_x", "shift_y", "shift_z"), "m", 0.015, 0.04),
    "missing_joint": Usual(("flexion", "lateral", "axial"), "1", 0.2, 0.6),
    "marker_shift": Usual(("x", "y", "z", "shift_x", "shift_y", "shift_z"), "m", 0.02, 0.04),
    "implement": Usual(("moment",), "kg m", 0.08, 0.5),  # from a racket to a bat
    "camera_frame": Usual(("angle_x", "angle_y"), "rad", 0.0087266, 0.034907),
    "external_force": Usual(("force_x", "force_y", "force_z"), "N", 20.0, 80.0),
    "object_handled": Usual(("mass",), "kg", 0.3, 2.0),
    "marker_slide": Usual(("x", "y", "z"), "m", 0.01, 0.04),
}


def usual_words(effect: str) -> str:
    """``5 to 20 ms``."""
    usual = USUAL[effect]
    factor, unit = readable_unit(usual.parameters[0], usual.unit)
    return with_unit(f"{factor * usual.least:.3g} to {factor * usual.most:.3g}", unit)


# --- recordings that separate causes --------------------------------------------------------------

_LOADS = ("added_mass", "released_object", "object_handled", "implement", "wobbling_mass")
_STEP_OFF = "step off the plate for five seconds: an offset stays when nobody stands there"
_HOP = (
    "hop three times: a fault of the plate grows with the force on it, a tilted vertical does not"
)
_PULLED = (
    "stand still for ten seconds at three places of the plate with nothing attached to the "
    "person: a tilt or an offset stays, whatever pulls is gone"
)
_APART = {
    "plate_gain plate_zero": _STEP_OFF,
    "plate_zero plate_crosstalk": _STEP_OFF,
    "plate_zero added_mass": _STEP_OFF,
    "plate_zero gravity_tilt": _STEP_OFF,
    "plate_gain added_mass": "weigh the person as recorded on a scale, and lay a known weight on "
    "the plate",
    "gravity_tilt plate_rotation": _HOP,
    "gravity_tilt plate_crosstalk": _HOP,
    "plate_rotation plate_crosstalk": "stand on the plate and push forwards and sideways, and lay a "
    "known weight at several places: a tilted plate changes every force, a leaking channel only one",
    "gravity_tilt unexplained": _PULLED,
    "plate_zero unexplained": _PULLED,
    "sync_offset clock_drift": "hop three times at the beginning and at the end of a long recording",
    "missing_joint soft_tissue": EFFECTS["missing_joint"].remedy,
    "breathing unexplained": "stand still for thirty seconds, the breath held in the last ten",
}
_UNKNOWN = "look at plates, cables and everything that touches the person, and record again"


def separating_recording(rivals: Sequence[tuple[str, str]], most: int | None = None) -> str:
    """What to record, without a final stop, for rivals as (effect, target); at most so many steps."""
    effects = list(dict.fromkeys(effect for effect, _ in rivals))
    places = {one: {target for effect, target in rivals if effect == one} for one in effects}
    advice = [_places(effect, rivals) for effect in effects if len(places[effect]) > 1]
    for one, other in combinations(effects, 2):
        known = _APART.get(f"{one} {other}") or _APART.get(f"{other} {one}")
        advice += [known] if known else [_own(one), _own(other)]
    each = dict.fromkeys(advice)  # once, and none that another says with more words
    steps = [one for one in each if not any(o != one and o.startswith(one) for o in each)]
    if most is not None:
        steps = [step for step in steps if step != _UNKNOWN][:most]
    return "; ".join(steps) or _UNKNOWN


def _places(effect: str, rivals: Sequence[tuple[str, str]]) -> str:
    """The same effect at several places: they have to move, or be loaded, one at a time."""
    where = listing([place_label(effect, target) for name, target in rivals if name == effect])
    if effect in _LOADS:
        return f"look for what is worn or loose there, or keep still but for one at a time: {where}"
    if effect in ("unmeasured_contact", "external_force"):
        return f"watch, or film, what touches the person: {where}"
    return _own(effect)


def _own(effect: str) -> str:
    return EFFECTS[effect].remedy if effect in EFFECTS else _UNKNOWN
