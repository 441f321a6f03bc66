"""Sizes of causes that laboratories meet, to read a limit of detection by."""

from __future__ import annotations

from dataclasses import dataclass

from bsip_cli.effects.readable import readable_unit, with_unit


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
    "implement": Usual(("moment",), "kg m", 0.08, 0.5),  # from a racket to a bat
    "camera_frame": Usual(("angle_x", "angle_y"), "rad", 0.0087266, 0.034907),
    "external_force": Usual(("force_x", "force_y", "force_z"), "N", 20.0, 80.0),
    "object_handled": Usual(("mass",), "kg", 0.3, 2.0),
    "wobbling_mass": Usual(("mass",), "kg", 3.0, 4.5),
    "breathing": Usual(("cosine", "sine"), "kg m", 0.05, 0.3),
    "unmeasured_contact": Usual(("force_x", "force_y", "force_z"), "N", 20.0, 40.0),
    "joint_centre": Usual(("shift_x", "shift_y", "shift_z"), "m", 0.015, 0.04),
    "missing_joint": Usual(("flexion", "lateral", "axial"), "1", 0.2, 0.6),
    "marker_slide": Usual(("x", "y", "z"), "m", 0.01, 0.04),
    "marker_shift": Usual(("x", "y", "z", "shift_x", "shift_y", "shift_z"), "m", 0.02, 0.04),
}


def usual_words(effect: str) -> str:
    """``5 to 20 ms``."""
    usual = USUAL[effect]
    factor, unit = readable_unit(usual.parameters[0], usual.unit)
    return with_unit(f"{factor * usual.least:.3g} to {factor * usual.most:.3g}", unit)
