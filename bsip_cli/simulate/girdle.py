"""Shoulders that move against the thorax: clavicles that carry them, and 13 more markers.

A clavicle is raised, drawn back and turned about itself as the arm is raised (means of Ludewig
2009), and moves by itself where a movement asks for it. It has no mass of its own: the thorax
keeps that of the girdle, as every model with massless clavicles has it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bsip_cli.simulate.landmarks import Marker, heel_and_toe_m, skin_markers
from bsip_cli.simulate.options import Richness
from bsip_cli.simulate.rotations import about_x, about_y, about_z

# Of the joint from the notch of the sternum, thorax axes, right side (Holzbaur 2005), in the width
# of the thorax; how far it lies from there in people.
FROM_NOTCH = np.array([0.0063, 0.0069, 0.0255]) / 0.136
OFFSET_M = 0.005
# At an arm raised by 120 degrees (Ludewig 2009, J Bone Joint Surg Am 91): raised, drawn back,
# turned backwards about its own axis.
RHYTHM_RAD = np.deg2rad([10.0, 16.0, 30.0])
RAISED = 1.0 - np.cos(np.deg2rad(120.0))


def with_girdle(
    rng: np.random.Generator,
    joints: dict[str, np.ndarray],
    markers: dict[str, Marker],
    lengths: dict[str, float],
    hinges: dict[str, np.ndarray],
    thorax_width_m: float,
    ankle_height_m: float,
    richness: Richness,
) -> tuple[dict[str, np.ndarray], dict[str, Marker]]:
    """Joints with sternoclavicular_* (thorax axes), and markers with those of the clavicles."""
    joints, markers = dict(joints), dict(markers)
    head = lengths["head"]
    places = {"OCC": ("head", np.array([-0.09, 0.7 * head, 0.0]))}
    for side, sign in (("l", -1.0), ("r", 1.0)):
        offset = richness.joint_centre_offset * OFFSET_M * rng.standard_normal(3)
        mirrored = np.array([1.0, 1.0, sign])
        joint = markers["IJ"].position_m + thorax_width_m * FROM_NOTCH * mirrored + offset
        joints[f"sternoclavicular_{side}"] = joint
        label = f"{side.upper()}AC"
        acromion = markers[label].position_m - joint
        markers[label] = replace(markers[label], body=f"clavicle_{side}", position_m=acromion)
        places |= _more_markers(side, sign, acromion, lengths, hinges, ankle_height_m)
    return joints, markers | skin_markers(places, rng, richness)


def _more_markers(
    side: str,
    sign: float,
    acromion: np.ndarray,
    lengths: dict[str, float],
    hinges: dict[str, np.ndarray],
    ankle_height: float,
) -> dict[str, tuple[str, np.ndarray]]:
    S = side.upper()
    clavicle, arm, thigh, shank, foot = (
        f"{name}_{side}" for name in ("clavicle", "upper_arm", "thigh", "shank", "foot")
    )
    elbow = np.array([0.0, -lengths[arm], 0.0]) - 0.036 * sign * hinges[f"elbow_{side}"]
    _, front = heel_and_toe_m(lengths[foot])
    return {
        f"{S}CLA": (clavicle, 0.5 * acromion + np.array([0.015, 0.008, 0.0])),
        f"{S}AA": (clavicle, acromion + np.array([-0.035, -0.005, -0.01 * sign])),
        f"{S}ELBM": (arm, elbow),
        f"{S}THI": (thigh, np.array([0.02, -0.55 * lengths[thigh], sign * 0.075])),
        f"{S}TIB": (shank, np.array([0.02, -0.5 * lengths[shank], sign * 0.05])),
        f"{S}MT5": (foot, np.array([front - 0.02, 0.02 - ankle_height, sign * 0.04])),
    }


def clavicle_turn(arm_in_thorax: np.ndarray, own_rad: np.ndarray, sign: float) -> np.ndarray:
    """(T, 3, 3) rotation of a clavicle against the thorax, none where the arm hangs.

    arm_in_thorax : (T, 3, 3). own_rad : (T, 2) raised and brought forward beside the arm's rhythm.
    sign : 1 of the right side, -1 of the left one.
    """
    part = (1.0 - arm_in_thorax[:, 1, 1]) / RAISED
    raised, back, turned = (part * angle for angle in RHYTHM_RAD)
    raised = raised + own_rad[:, 0]
    forward = own_rad[:, 1] - back
    return about_y(sign * forward) @ about_x(-sign * raised) @ about_z(turned)
