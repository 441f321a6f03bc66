"""The tree of segments and joints as data: names, parents, joint types, table rows."""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from pathlib import Path
from typing import Literal

from bsip_cli.errors import UsageError
from bsip_cli.files.regular import read_toml, shipped
from bsip_cli.segments import LANDMARKS, LINKS, SEGMENTS, joint_of

JointType = Literal["free", "spherical", "revolute"]

_KEYS = ("name", "parent", "joint", "type", "table")
_HINGES = ("elbow", "knee", "ankle")  # joints whose axis landmarks give
_ROWS = ("pelvis", "torso", "head", "arm", "forearm", "hand", "thigh", "shank", "foot")
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

    parents : index of the parent segment, -1 for the floating base, which comes first.
    joints : name of the joint to the parent.
    table_rows : row of the anthropometric table that gives the segment's inertia; empty for links
        without mass.
    landmarks : whose markers ride on the segment, whatever segment the marker set names.
    """

    name: str
    segments: tuple[str, ...]
    parents: tuple[int, ...]
    joints: tuple[str, ...]
    joint_types: tuple[JointType, ...]
    table_rows: tuple[str, ...]
    landmarks: tuple[tuple[str, ...], ...]

    @cached_property
    def bodies(self) -> tuple[int, ...]:
        """Indices of the segments with mass: each has ten parameters, in this order."""
        return tuple(i for i, row in enumerate(self.table_rows) if row)

    @cached_property
    def body_names(self) -> tuple[str, ...]:
        """Names of the segments with mass."""
        return tuple(self.segments[i] for i in self.bodies)

    def carrying(self, segment: str, landmark: str) -> str:
        """The segment that a marker rides on, which its set puts on ``segment``."""
        pairs = zip(self.segments, self.landmarks, strict=True)
        return next((one for one, own in pairs if landmark in own), segment)

    def index(self, segment: str) -> int:
        return self.segments.index(segment)

    def beyond(self, i: int) -> list[int]:
        """A segment and all that hang on it."""
        found = [i]
        for n in range(i + 1, len(self.segments)):
            if self.parents[n] in found:
                found.append(n)
        return found

    def way(self, segment: str) -> list[int]:
        """Segments from one to the base, which is not among them."""
        found, i = [], self.index(segment)
        while i > 0:
            found.append(i)
            i = self.parents[i]
        return found

    def side(self, segment: str) -> str:
        """``l``, ``r`` or an empty string."""
        return segment[-1] if segment.endswith(("_l", "_r")) else ""

    def informed(self, marked: Collection[str]) -> tuple[bool, ...]:
        """Whether each segment is a marked one or has one beyond it."""
        every = (self.beyond(i) for i in range(len(self.segments)))
        return tuple(any(self.segments[k] in marked for k in beyond) for beyond in every)

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
        return self._starts(_Q_PARTS)

    @cached_property
    def v_starts(self) -> tuple[int, ...]:
        """Where each joint's entries begin in v."""
        return self._starts(_V_PARTS)

    def _names(self, parts: dict[str, tuple[str, ...]]) -> tuple[str, ...]:
        return tuple(
            f"{joint}_{part}"
            for joint, kind in zip(self.joints, self.joint_types, strict=True)
            for part in parts[kind]
        )

    def _starts(self, parts: dict[str, tuple[str, ...]]) -> tuple[int, ...]:
        sizes = [len(parts[kind]) for kind in self.joint_types]
        return tuple(accumulate(sizes[:-1], initial=0))


def named_file(folder: str, name: str, what: str) -> Path:
    """The shipped file of this name in a folder of configs, or the one at a path.

    UsageError: there is no such file: the shipped names are listed.
    """
    file = Path(name) if name.endswith(".toml") else shipped(folder, f"{name}.toml")
    if not os.path.lexists(file):
        known = ", ".join(sorted(path.stem for path in shipped(folder).glob("*.toml")))
        raise UsageError(f"there is no such {what}", file=name, expected=known)
    return file


def load_skeleton(name: str) -> Skeleton:
    """Read a skeleton file: the name of a shipped one, or a path.

    UsageError: there is no such file, or its tree is not one: the first fault is named.
    """
    file = named_file("skeletons", name, "skeleton")
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
            tuple(tuple(row.get("landmarks", ())) for row in rows),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise UsageError(
            f"not a skeleton ({error})",
            file=file,
            expected="[[segments]] with name, parent, joint, type and table (empty without mass)",
        ) from None
    _check(skeleton, file)
    return skeleton


def _check(skeleton: Skeleton, file: Path) -> None:
    """A tree of segments whose frames, inertias and tables exist, each on its joint."""
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
    faults = [f"no {name}" for name in SEGMENTS if name not in skeleton.segments]
    fields = ("segments", "joints", "joint_types", "table_rows", "landmarks")
    rows = zip(*(getattr(skeleton, field) for field in fields), strict=True)
    faults += [fault for row in rows if (fault := _fault_of(*row))]
    leaves = set(skeleton.segments) - {skeleton.segments[i] for i in skeleton.parents if i >= 0}
    faults += [f"nothing that hangs on {name}" for name in LINKS if name in leaves]
    if faults:
        raise UsageError(
            f"a skeleton that cannot be built: {', '.join(faults)}",
            file=file,
            expected=f"the segments {', '.join(SEGMENTS)}, with {' and '.join(LINKS)} or without, "
            "each on its joint and with its row as in configs/skeletons; the types of joints may "
            "differ",
            remedy="change these lines",
        )


def _fault_of(name: str, joint: str, kind: JointType, row: str, landmarks: tuple[str, ...]) -> str:
    """What a segment lacks; empty where nothing."""
    if name not in SEGMENTS and name not in LINKS:
        return f"{name}, of which neither frame nor mass is known"
    if joint != joint_of(name):
        return f"{name} on {joint} instead of {joint_of(name)}"
    if kind == "revolute" and not joint.startswith(_HINGES):
        return f"a hinge at {joint}, of which no axis is known"
    if (row not in _ROWS) if name in SEGMENTS else row:
        return f"{name} with the table's row {row!r}"
    strange = [landmark for landmark in landmarks if landmark not in LANDMARKS]
    return f"{name} with the unknown landmark {strange[0]}" if strange else ""
