"""A person's skeleton as a Pinocchio model."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.person import Person


def pinocchio_model(person: Person) -> pin.Model:
    """Tree of the person, in the skeleton's order (joint i + 1 is segment i).

    Joint frames sit in the joint centres with the segment's axes; gravity points along -Z. Segments
    with mass carry 1 kg, which says that there is one: inertial parameters come as ``phi``.
    """
    model = pin.Model()
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY_M_S2])
    skeleton = person.skeleton
    positions, rotations = person.joint_positions_m(), person.joint_rotations()
    axes = person.hinge_axes()
    for i, kind in enumerate(skeleton.joint_types):
        joint = {
            "free": pin.JointModelFreeFlyer,
            "spherical": pin.JointModelSpherical,
        }.get(kind, lambda axis=axes[i]: pin.JointModelRevoluteUnaligned(axis))()
        placement = pin.SE3(rotations[i], positions[i])
        index = model.addJoint(skeleton.parents[i] + 1, joint, placement, skeleton.joints[i])
        assert index == i + 1
        if i in skeleton.bodies:
            model.inertias[index] = pin.Inertia.FromSphere(1.0, 0.1)
    return model


def bodies_of(model: pin.Model) -> list[int]:
    """Joints whose segment has mass: ``phi`` is ten parameters for each of them, in this order."""
    return [j for j in range(1, model.njoints) if model.inertias[j].mass > 0]
