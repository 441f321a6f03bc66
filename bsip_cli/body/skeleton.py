"""The tree of segments and joints as data: names, parents, joint types, table rows."""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

from bsip_cli.body.names import SEGMENTS, joint_of
from bsip_cli.config import shipped
from bsip_cli.errors import UsageError
from bsip_cli.files.regular import read_toml

JointType = Literal["free", "spherical", "revolute"]

_KEYS = ("name", "parent", "joint", "type", "table")
_HINGES = ("elbow", "knee", "ankle")  # joints whose axis landmarks give
_Q_PARTS = {
    "free": ("tx", "ty", "tz", "qx", "qy", "qz", "qw"),
    "spherical": ("qx", "qy", "qz", "qw"),
    "revolute": ("angle",),
}
_V_PARTS = {
    "free": ("tx", "ty", "tz", "rx", "ry", "rz"),
    "spherical": ("rx", "ry", "rz"),
    "revolute": ("angle",),
}


@dataclass(frozen=True)
class Skeleton:
    """A tree of segments in depth-first order; all tuples run over the segments.

    Attributes
    ----------
    parents : index of the parent segment, -1 for the floating base, which comes first.
    joints : name of the joint to the parent.
    table_rows : row of the anthropometric table that gives the segment's inertia.
    """

    name: str
    segments: tuple[str, ...]
    parents: tuple[int, ...]
    joints: tuple[str, ...]
    joint_types: tuple[JointType, ...]
    table_rows: tuple[str, ...]

    def index(self, segment: str) -> int:
        return self.segments.index(segment)

    def side(self, segment: str) -> str:
        """``l``, ``r`` or an empty string."""
        return segment[-1] if segment.endswith(("_l", "_r")) else ""

    def informed(self, marked: Collection[str]) -> tuple[bool, ...]:
        """Whether each segment is a marked one or has one beyond it."""
        known = [segment in marked for segment in self.segments]
        for i in range(len(known) - 1, 0, -1):
            known[self.parents[i]] |= known[i]
        return tuple(known)

    @cached_property
    def q_names(self) -> tuple[str, ...]:
        """Names of the configuration's entries, in Pinocchio's order."""
        return self._names(_Q_PARTS)

    @cached_property
    def v_names(self) -> tuple[str, ...]:
        """Names of the velocity's entries, in Pinocchio's order."""
        return self._names(_V_PARTS)

    @cached_property
    def q_starts(self) -> tuple[int, ...]:
        """Where each joint's entries begin in q."""
        return _starts(len(_Q_PARTS[kind]) for kind in self.joint_types)

    @cached_property
    def v_starts(self) -> tuple[int, ...]:
        """Where each joint's entries begin in v."""
        return _starts(len(_V_PARTS[kind]) for kind in self.joint_types)

    def _names(self, parts: dict[str, tuple[str, ...]]) -> tuple[str, ...]:
        return tuple(
            f"{joint}_{part}"
            for joint, kind in zip(self.joints, self.joint_types, strict=True)
            for part in parts[kind]
        )


def _starts(sizes) -> tuple[int, ...]:
    starts, total = [], 0
    for size in sizes:
        starts.append(total)
        total += size
    return tuple(starts)


def load_skeleton(name: str) -> Skeleton:
    """Read a skeleton file: the name of a shipped one, or a path.

    Raises
    ------
    UsageError
        There is no such file, or its tree is not one: the first fault is named.
    """
    file = Path(name) if name.endswith(".toml") else shipped("skeletons", f"{name}.toml")
    if not os.path.lexists(file):
        known = ", ".join(sorted(path.stem for path in shipped("skeletons").glob("*.toml")))
        raise UsageError("there is no such skeleton", file=name, expected=known)
    data = read_toml(file)
    try:
        rows = data["segments"]
        odd = next((row for row in rows if not all(isinstance(row[k], str) for k in _KEYS)), None)
        if odd:
            raise TypeError(f"{odd!r} has values that are no text")
        names = tuple(row["name"] for row in rows)
        parents = tuple(names.index(row["parent"]) if row["parent"] else -1 for row in rows)
        skeleton = Skeleton(
            file.stem,
            names,
            parents,
            tuple(row["joint"] for row in rows),
            tuple(row["type"] for row in rows),
            tuple(row["table"] for row in rows),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise UsageError(
            f"not a skeleton ({error})",
            file=file,
            expected="[[segments]] with name, parent, joint, type and table",
        ) from None
    _check(skeleton, file)
    _check_known(skeleton, file)
    return skeleton


def _check(skeleton: Skeleton, file: Path) -> None:
    base_first = skeleton.parents[:1] == (-1,) and skeleton.joint_types[0] == "free"
    ordered = all(0 <= parent < i for i, parent in enumerate(skeleton.parents) if i)
    known = set(skeleton.joint_types[1:]) <= {"spherical", "revolute"}
    once = all(len(set(names)) == len(names) for names in (skeleton.segments, skeleton.joints))
    if not (base_first and ordered and known and once):
        raise UsageError(
            "the segments are not a tree with one free base",
            file=file,
            expected="the free base first, every parent before its children, joints of type "
            "spherical or revolute, and every name once",
        )


def _check_known(skeleton: Skeleton, file: Path) -> None:
    """Exactly the segments whose frames, inertias and tables exist, each on its joint."""
    faults = [f"no {name}" for name in SEGMENTS if name not in skeleton.segments]
    for name, joint, kind in zip(
        skeleton.segments, skeleton.joints, skeleton.joint_types, strict=True
    ):
        if name not in SEGMENTS:
            faults.append(f"{name}, of which neither frame nor mass is known")
        elif joint != joint_of(name):
            faults.append(f"{name} on {joint} instead of {joint_of(name)}")
        elif kind == "revolute" and not joint.startswith(_HINGES):
            faults.append(f"a hinge at {joint}, of which no axis is known")
    if faults:
        raise UsageError(
            f"a skeleton that cannot be built: {', '.join(faults)}",
            file=file,
            expected=f"the segments {', '.join(SEGMENTS)}, each on its joint as in "
            "configs/skeletons/hansen2017.toml; the types of joints may differ",
            remedy="change these lines",
        )
