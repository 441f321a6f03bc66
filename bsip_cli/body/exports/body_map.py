"""Which bodies of an OpenSim model are which segments, as data (configs/opensim)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from bsip_cli.body.skeleton import Skeleton, named_file
from bsip_cli.config import shipped
from bsip_cli.errors import UsageError
from bsip_cli.files.regular import read_toml


@dataclass(frozen=True)
class BodyGroup:
    """Bodies of a model that together are some of our segments.

    Attributes
    ----------
    bodies : they share the mass in the proportions they have in the model; the first one's frame
        is that of the group.
    segments : united in the neutral pose, in the first one's axes.
    joints : pairs (segment, body): the joint between the segment and its parent and the one
        between the body and its parent are the same point.
    """

    bodies: tuple[str, ...]
    segments: tuple[str, ...]
    joints: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class BodyMap:
    name: str
    groups: tuple[BodyGroup, ...]

    def bodies(self) -> set[str]:
        return {body for group in self.groups for body in group.bodies}


def load_body_map(name: str) -> BodyMap:
    """Read a map: the name of a shipped one, or a path that ends in ``.toml``.

    Raises
    ------
    UsageError
        There is no such file, or it is no map.
    """
    file = named_file("opensim", name, "map of bodies")
    data = read_toml(file)
    try:
        groups = tuple(_group(row) for row in data["groups"])
    except (KeyError, TypeError, ValueError) as error:
        raise UsageError(
            f"not a map of bodies ({error})",
            file=file,
            expected="[[groups]] with bodies, segments and joints",
        ) from None
    return BodyMap(file.stem, groups)


def shipped_names() -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in shipped("opensim").glob("*.toml")))


def fitting_map(bodies: Iterable[str]) -> BodyMap | None:
    """The shipped map that fits a model with these bodies and explains most of them."""
    known = set(bodies)
    maps = [load_body_map(name) for name in shipped_names()]
    fitting = [each for each in maps if each.bodies() <= known]
    return max(fitting, key=lambda each: len(each.bodies()), default=None)


def check_segments(body_map: BodyMap, skeleton: Skeleton) -> None:
    """Every segment of the skeleton that has mass goes into exactly one group.

    Raises
    ------
    UsageError
        A segment is missing, stands twice, or is not one with mass of the skeleton.
    """
    named = [segment for group in body_map.groups for segment in group.segments]
    jointed = {segment for group in body_map.groups for segment, _ in group.joints}
    unknown = sorted({*named, *jointed} - set(skeleton.body_names))
    lost = [segment for segment in skeleton.body_names if segment not in named]
    twice = sorted({segment for segment in named if named.count(segment) > 1})
    faults = (("unknown", unknown), ("left out", lost), ("more than once", twice))
    said = [f"{fault}: {', '.join(found)}" for fault, found in faults if found]
    if said:
        raise UsageError(
            f"segments of the skeleton are {'; '.join(said)}",
            file=body_map.name,
            expected="every segment in one group",
        )


def _group(row: dict) -> BodyGroup:
    joints = tuple((str(segment), str(body)) for segment, body in row["joints"])
    group = BodyGroup(_texts(row["bodies"]), _texts(row["segments"]), joints)
    if not (group.bodies and group.segments and group.joints):
        raise ValueError("a group without bodies, segments or joints")
    return group


def _texts(value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(text, str) for text in value):
        raise TypeError(f"{value!r} is no list of names")
    return tuple(value)
