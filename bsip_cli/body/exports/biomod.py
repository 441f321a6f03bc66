"""bioMod: for biorbd and bioptim."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bsip_cli.body.exports.identified import BALL_AXES, BodyOnJoint, IdentifiedPerson, numbers
from bsip_cli.body.gravity import GRAVITY_M_S2


def biomod_text(body: IdentifiedPerson) -> str:
    """A bioMod file, version 4; errors as of `check_bodies` and `markers`."""
    body.check_bodies()
    lines = ["version 4", *(f"// {line}" for line in body.said("biomod")), ""]
    lines += [f"gravity {numbers([0.0, 0.0, -GRAVITY_M_S2])}", ""]
    lines += ["segment base", "    translations xyz", "    mass 0", "endsegment", ""]
    for one in body.tree():
        lines += [*_segment_lines(one), ""]
    for name, segment, place in body.markers():
        lines += [f"marker {name}", f"    parent {segment}"]
        lines += [f"    position {numbers(place)}", "endmarker"]
    return "\n".join(lines)


def _segment_lines(one: BodyOnJoint) -> Iterator[str]:
    """A hinge takes two: one that turns, and one that leans back to the segment's axes."""
    parent, tilt = one.parent or "base", np.pi / 2 if one.kind == "free" else 0.0
    parts = [(one.segment, parent, tilt, one.place_m, BALL_AXES)]
    if one.kind == "revolute":
        parts = [
            (one.joint, parent, one.parent_tilt_rad, one.place_m, "z"),
            (one.segment, one.joint, -one.child_tilt_rad, np.zeros(3), ""),
        ]
    for name, above, tilt, place, rotations in parts:
        yield f"segment {name}"
        yield f"    parent {above}"
        yield f"    RT {numbers([tilt, 0, 0])} xyz {numbers(place)}"
        if rotations:
            yield f"    rotations {rotations}"
        if name == one.segment:
            yield f"    mass {numbers([one.inertia.mass_kg])}"
            yield "    inertia"
            for row in one.inertia.tensor_kgm2:
                yield f"        {numbers(row)}"
            yield f"    com {numbers(one.inertia.com_m)}"
        else:
            yield "    mass 0"
        yield "endsegment"
