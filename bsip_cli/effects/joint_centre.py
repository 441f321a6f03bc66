"""A joint that truly lies elsewhere in the parent segment than the model has it."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.names import the_joint
from bsip_cli.effects.displaced import displaced
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

MOST_M = 0.05


class JointCentre(Effect):
    """The true centre is the model's plus the shift, in the parent's axes.

    In the static trial the limb lies where its markers are, whichever centre the model has. When
    the joint turns, true and modelled limb come apart by (R_parent - R_child) shift: the limb's
    masses are elsewhere, and its markers drag the pose along. A residual that stays the same may
    be lost where scaling has moved the markers.
    """

    name = "joint_centre"
    of_the_lab = False
    of_the_person = True
    of_the_body = True
    looks = (
        "moments and centre of pressure that err with the angle of one joint; its markers"
        " fit worse as it bends"
    )
    remedy = "record a trial that turns this joint alone, and scale with it"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return scene.person.skeleton.joints[1:]

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"shift_{axis}", "m", -MOST_M, MOST_M, 0.015) for axis in "xyz")

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        i = scene.person.skeleton.joints.index(target)
        return scene.once((self.name, i), lambda: _wrenches(scene, i)) @ values

    def marker_change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        i = scene.person.skeleton.joints.index(target)
        markers = scene.markers_beyond(i)
        apart = (_apart(scene, i) @ values)[:, None, :, None]
        errors = np.broadcast_to(apart, (len(apart), len(markers), 3, 1))
        return scene.pose_response.left(errors, markers)[..., 0]

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """No further than palpated or regressed centres lie off."""
        return bool(np.linalg.norm(values) < MOST_M)

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return (
            f"the centre of {the_joint(target)} lies {1000 * np.linalg.norm(values):.0f} mm from "
            "where the model has it"
        )


def _apart(scene: Scene, i: int) -> np.ndarray:
    """(N, 3, 3) world shift of the limb beyond joint i for a unit shift along each parent axis."""
    parent = scene.motion.rotation[:, scene.person.skeleton.parents[i]]
    neutral = scene.person.joint_rotations()[i]
    return parent - scene.motion.rotation[:, i] @ neutral.T


def _wrenches(scene: Scene, i: int) -> np.ndarray:
    """(N, 6, 3) change of the simulated wrench for a unit shift along each parent axis."""
    apart, markers = _apart(scene, i), scene.markers_beyond(i)
    errors = np.broadcast_to(apart[:, None], (len(apart), len(markers), 3, 3))
    dragged = scene.response.of(scene.pose_response.of(errors, markers))
    return displaced(*scene.mass_beyond(i), apart, scene.rate_hz) - dragged
