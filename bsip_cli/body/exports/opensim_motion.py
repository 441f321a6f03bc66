"""OpenSim: a motion in the exported model's coordinates, the forces under the feet, and the set-up
of InverseDynamicsTool for both (.mot and .xml of OpenSim 4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.body.exports.identified import rendered
from bsip_cli.body.skeleton import Skeleton

COORDINATES = {
    "free": ("rz", "rx", "ry", "tx", "ty", "tz"),
    "spherical": ("rz", "rx", "ry"),
    "revolute": ("angle",),
}
"""Of each type of joint, in the order of the joint coordinate system: turns about Z of the parent
(flexion), X after that turn, and Y of the segment."""

LOADED_N = 20.0
"""A point of application is a quotient by the vertical force: below this the last one stays."""
_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # from Z up to Y up
_FORCE, _POINT, _TORQUE = "{}_force_v", "{}_force_p", "{}_torque_"


def coordinates(skeleton: Skeleton, q: np.ndarray) -> dict[str, np.ndarray]:
    """Name and trajectory (N,) [rad, m] of every coordinate of the exported model, from q (N, nq).

    Angles run on without jumps of a turn, and through the pose where the middle one is 90 degrees.
    """
    found: dict[str, np.ndarray] = {}
    for name, kind, start in zip(
        skeleton.joints, skeleton.joint_types, skeleton.q_starts, strict=True
    ):
        if kind == "revolute":
            found[f"{name}_angle"] = np.unwrap(q[:, start])
            continue
        ways, turn = np.empty((3, 0)), Rotation.from_quat(q[:, start : start + 4])
        if kind == "free":
            ways = _UP @ q[:, start : start + 3].T
            turn = Rotation.from_matrix(_UP) * Rotation.from_quat(q[:, start + 3 : start + 7])
        parts = zip(COORDINATES[kind], [*_angles(turn).T, *ways], strict=False)
        found |= {f"{name}_{part}": trajectory for part, trajectory in parts}
    return found


def _angles(turn: Rotation) -> np.ndarray:
    """(N, 3) about Z, X and Y, each frame's as near to the last one's as they can be."""
    one = turn.as_euler("ZXY", suppress_warnings=True)
    other = np.stack([one[:, 0] + np.pi, np.pi - one[:, 1], one[:, 2] + np.pi], axis=1)
    found = one.copy()
    for k in range(1, len(found)):
        both = np.stack([one[k], other[k]])
        both -= 2 * np.pi * np.round((both - found[k - 1]) / (2 * np.pi))
        found[k] = both[np.argmin(np.abs(both - found[k - 1]).sum(axis=1))]
    return found


def loads(wrenches: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns of external loads from the wrench (N, 6) on each segment about the world's origin,
    Z up. Ground's Y is up, and what the force leaves of the moment at its point is the torque.
    Frames without a known wrench have to be left out: OpenSim reads NaN as some number."""
    found: dict[str, np.ndarray] = {}
    for name, wrench in wrenches.items():
        force, moment = wrench[:, :3] @ _UP.T, wrench[:, 3:] @ _UP.T
        loaded = force[:, 1] > LOADED_N
        last = np.maximum.accumulate(np.where(loaded, np.arange(len(force)), -1))
        under = np.where(loaded, force[:, 1], 1.0)
        point = np.stack([moment[:, 2], 0.0 * under, -moment[:, 0]], axis=1) / under[:, None]
        point = np.where(last[:, None] < 0, 0.0, point[last])
        torque = moment - np.cross(point, force)
        for label, values in ((_FORCE, force), (_POINT, point), (_TORQUE, torque)):
            found |= {label.format(name) + a: values[:, k] for k, a in enumerate("xyz")}
    return found


def mot_text(
    name: str, times_s: np.ndarray, columns: Mapping[str, np.ndarray], said: Sequence[str]
) -> str:
    """A table of OpenSim (.mot), angles in rad."""
    values = np.column_stack([times_s, *columns.values()])
    head = [name, "version=1", f"nRows={len(values)}", f"nColumns={values.shape[1]}"]
    head += ["inDegrees=no", *said, "endheader", "\t".join(["time", *columns])]
    rows = ["\t".join(f"{x:.12g}" for x in row) for row in values]
    return "\n".join([*head, *rows, ""])


def loads_xml(segments: Sequence[str], data_file: str, said: Sequence[str]) -> str:
    """``ExternalLoads`` on the segments from the columns of `loads`."""
    columns = {"force": _FORCE, "point": _POINT, "torque": _TORQUE}
    known = {"segments": segments, "data_file": data_file, "said": said}
    return rendered("loads.xml.j2", **known, **columns)


def setup_xml(
    name: str, files: Mapping[str, str], from_s: float, to_s: float, said: Sequence[str]
) -> str:
    """Set-up of InverseDynamicsTool; files : ``model_file``, ``coordinates_file`` and
    ``external_loads_file``, next to it. The motion is smooth: no further filter."""
    known = {"name": name, "files": files, "from_s": from_s, "to_s": to_s, "said": said}
    return rendered("setup.xml.j2", **known)
