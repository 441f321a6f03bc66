"""What an exported file is made of: a person's tree with inertias, and where they come from."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

import numpy as np

from bsip_cli.body.inertia import Inertia, nearest_physical_tensor
from bsip_cli.body.person import Person
from bsip_cli.errors import BadDataError
from bsip_cli.files.regular import read_toml, shipped
from bsip_cli.files.templates import templates_in

if TYPE_CHECKING:
    from jinja2 import Environment


@cache
def export_words() -> dict[str, Any]:
    """Of configs/exports.toml."""
    return read_toml(shipped("exports.toml"))


@dataclass(frozen=True, eq=False)
class BodyOnJoint:
    """A segment and the joint that it hangs on, as the formats write them.

    parent : the segment that carries the joint; empty for the free base.
    place_m : (3,) joint centre as seen from the parent's joint, parent axes.
    parent_tilt_rad, child_tilt_rad : how a hinge leans about X, as of :class:`Person`.
    axis : (3,) of a hinge, in the segment.
    inertia : as seen from the joint centre, segment axes; zeros without mass.
    """

    segment: str
    parent: str
    joint: str
    kind: str
    place_m: np.ndarray
    parent_tilt_rad: float
    child_tilt_rad: float
    axis: np.ndarray
    inertia: Inertia


@dataclass(frozen=True)
class IdentifiedPerson:
    """One person's geometry with the inertial parameters of one method.

    inertias : per segment with mass, in its segment frame.
    made_of : lines that say what the numbers come from; they stand in every file.
    """

    person: Person
    inertias: tuple[Inertia, ...]
    participant: str
    method: str
    made_of: tuple[str, ...]

    @property
    def name(self) -> str:
        return f"{self.participant}_{self.method}"

    @property
    def mass_kg(self) -> float:
        return sum(inertia.mass_kg for inertia in self.inertias)

    def said(self, kind: str) -> tuple[str, ...]:
        """The lines that a file of this format begins with."""
        return (*self.made_of, *export_words()["notes"][kind])

    def in_joint(self, i: int) -> Inertia:
        """Inertia of segment ``i`` seen from its joint centre, segment axes; zeros without mass."""
        bodies = self.person.skeleton.bodies
        if i not in bodies:
            return Inertia(0.0, np.zeros(3), np.zeros((3, 3)))
        return self.inertias[bodies.index(i)].moved(-self.person.origin_in_joint_m[i])

    def tree(self) -> Iterator[BodyOnJoint]:
        """All segments, every parent before its children."""
        person, skeleton = self.person, self.person.skeleton
        parents = [skeleton.segments[i] if i >= 0 else "" for i in skeleton.parents]
        names = (skeleton.segments, parents, skeleton.joints, skeleton.joint_types)
        tilts = (person.parent_tilt_rad, person.child_tilt_rad)
        inertias = map(self.in_joint, range(len(parents)))
        places, axes = person.joint_positions_m(), person.hinge_axes()
        return map(BodyOnJoint, *names, places, *tilts, axes, inertias)

    def check_bodies(self) -> None:
        """Simulators take real bodies only.

        BadDataError: a segment has an inertia that no body can have.
        """
        bodies = zip(self.person.skeleton.body_names, self.inertias, strict=True)
        impossible = [name for name, inertia in bodies if not inertia.is_physical()]
        if impossible:
            raise BadDataError(
                f"{self.method} has an inertia that no body can have at {', '.join(impossible)}",
                file=self.participant,
                expected="positive masses and second moments, as simulators ask for",
                remedy="identify with --estimator consistent, export --method RM, or take the "
                "nearest possible tensors with --repair",
            )

    def repaired(self) -> IdentifiedPerson:
        """With the nearest tensors that bodies can have; ``made_of`` says which were changed."""
        inertias, said = list(self.inertias), []
        for i, (name, old) in enumerate(
            zip(self.person.skeleton.body_names, inertias, strict=True)
        ):
            if old.is_physical() or old.mass_kg <= 0:  # a mass is not corrected
                continue
            tensor = nearest_physical_tensor(old.tensor_kgm2)
            change = np.linalg.norm(tensor - old.tensor_kgm2) / np.linalg.norm(old.tensor_kgm2)
            inertias[i] = replace(old, tensor_kgm2=tensor)
            away = f"{100 * change:.1f} % away"
            said.append(f"{name}: impossible tensor replaced by the nearest, {away}")
        return replace(self, inertias=tuple(inertias), made_of=(*self.made_of, *said))

    def markers(self) -> Iterator[tuple[str, str, np.ndarray]]:
        """Plain name, segment's name and place (3,) in the segment's joint [m] of each.

        BadDataError: two markers would have one name.
        """
        person = self.person
        names, places = plain_names(person.markers), person.markers_in_joint_m()
        segments = [person.skeleton.segments[i] for i in person.marker_segments]
        return zip(names, segments, places, strict=True)

    def height_of_base_m(self) -> float:
        """How high the base joint stands in the neutral pose over the lowest marker or joint."""
        rotations, joints = neutral_pose(self.person)
        at = self.person.marker_segments
        local = self.person.markers_in_joint_m()
        markers = joints[at] + np.einsum("mij,mj->mi", rotations[at], local)
        return -float(min(joints[:, 1].min(), markers[:, 1].min(initial=0.0)))


def neutral_pose(person: Person) -> tuple[np.ndarray, np.ndarray]:
    """Orientation (n, 3, 3) and joint centre (n, 3) [m] of every segment, all angles zero.

    Seen from the base segment's joint, in its axes (Y up).
    """
    turns, steps = person.joint_rotations(), person.joint_positions_m()
    rotations, joints = [np.eye(3)], [np.zeros(3)]
    for i, parent in enumerate(person.skeleton.parents[1:], start=1):
        rotations.append(rotations[parent] @ turns[i])
        joints.append(joints[parent] + rotations[parent] @ steps[i])
    return np.array(rotations), np.array(joints)


# --- files from templates -------------------------------------------------------------------------


def rendered(template: str, **known: Any) -> str:
    """A file by its template in this folder's ``templates``."""
    return _templates().get_template(template).render(known)


@cache
def _templates() -> Environment:
    made = templates_in(Path(__file__).parent / "templates")
    made.filters |= {"numbers": numbers, "comment": xml_comment, "quaternion": _about_x}
    made.filters["xml"] = lambda text: escape(text, {'"': "&quot;"})
    return made


def _about_x(turn_rad: float) -> tuple[float, ...]:
    """Quaternion w, x, y, z."""
    return np.cos(0.5 * turn_rad), np.sin(0.5 * turn_rad), 0.0, 0.0


def numbers(values: float | Iterable[float]) -> str:
    """Numbers separated by blanks, with all their digits."""
    return " ".join(f"{value:.17g}" for value in np.asarray(values, dtype=float).ravel())


def xml_comment(lines: Iterable[str]) -> str:
    """Text for an XML comment, which must hold no two hyphens in a row."""
    text = "\n".join(lines)
    return f"\n{re.sub('-(?=-|$)', '- ', text)}\n"


def plain_names(names: Iterable[str]) -> tuple[str, ...]:
    """Marker names in letters, digits, ``_``, ``.`` and ``-``, as every format takes them.

    BadDataError: two markers would get the same name.
    """
    plain = tuple(re.sub(r"[^A-Za-z0-9_.-]", "_", name) for name in names)
    twice = sorted({name for name in plain if plain.count(name) > 1})
    if twice:
        raise BadDataError(
            f"more than one marker would be called {', '.join(twice)} in the file",
            expected="names that differ in letters and digits",
            remedy="rename them in the marker set",
        )
    return plain
