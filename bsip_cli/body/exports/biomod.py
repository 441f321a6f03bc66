"""bioMod: for biorbd and bioptim."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bsip_cli.body.exports.identified import BALL_AXES, IdentifiedPerson, numbers
from bsip_cli.body.gravity import GRAVITY_M_S2


def biomod_text(body: IdentifiedPerson) -> str:
    """A bioMod file, version 4; errors as of `check_bodies` and `markers`."""
    body.check_bodies()
    lines = ["version 4", *(f"// {line}" for line in body.said("biomod")), ""]
    lines += [f"gravity {numbers([0.0, 0.0, -GRAVITY_M_S2])}", ""]
    lines += ["segment base", "    translations xyz", "    mass 0", "endsegment", ""]
    for i in range(len(body.person.skeleton.segments)):
        lines += [*_segment_lines(body, i), ""]
    for name, segment, place in body.markers():
        parent = body.person.skeleton.segments[segment]
        lines += [f"marker {name}", f"    parent {parent}"]
        lines += [f"    position {numbers(place)}", "endmarker"]
    return "\n".join(lines)


def _segment_lines(body: IdentifiedPerson, i: int) -> Iterator[str]:
    """A hinge takes two: one that turns, and one that leans back to the segment's axes."""
    person = body.person
    skeleton = person.skeleton
    kind, segment = skeleton.joint_types[i], skeleton.segments[i]
    parent = skeleton.segments[skeleton.parents[i]] if i else "base"
    position = person.joint_positions_m()[i]
    parts = [(segment, parent, np.pi / 2 if kind == "free" else 0.0, position, BALL_AXES)]
    if kind == "revolute":
        hinge = skeleton.joints[i]
        parts = [
            (hinge, parent, person.parent_tilt_rad[i], position, "z"),
            (segment, hinge, -person.child_tilt_rad[i], np.zeros(3), ""),
        ]
    for name, above, tilt, place, rotations in parts:
        yield f"segment {name}"
        yield f"    parent {above}"
        yield f"    RT {numbers([tilt, 0, 0])} xyz {numbers(place)}"
        if rotations:
            yield f"    rotations {rotations}"
        if name == segment:
            inertia = body.in_joint(i)
            yield f"    mass {numbers([inertia.mass_kg])}"
            yield "    inertia"
            for row in inertia.tensor_kgm2:
                yield f"        {numbers(row)}"
            yield f"    com {numbers(inertia.com_m)}"
        else:
            yield "    mass 0"
        yield "endsegment"
