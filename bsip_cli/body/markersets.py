"""Marker sets: which label sits on which segment, and which bony landmark it is."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import asdict, dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

from bsip_cli.errors import UsageError, did_you_mean
from bsip_cli.files.regular import read_toml, shipped
from bsip_cli.segments import JOINT_CENTRES, LANDMARKS, SEGMENTS

_TABLES = {"description", "also_called", "segments", "weights", "aliases", "optional"}


@dataclass(frozen=True)
class Marker:
    """One marker: its label, its segment, the landmark it marks (or empty), its weight."""

    label: str
    segment: str
    landmark: str
    weight: float
    optional: bool
    aliases: tuple[str, ...]

    @property
    def is_joint_centre(self) -> bool:
        """A keypoint inside the body, not a marker on its skin."""
        return self.landmark in JOINT_CENTRES

    def also(self, label: str) -> Marker:
        """The same marker, also under another label."""
        if label in (self.label, *self.aliases):
            return self
        return replace(self, aliases=(*self.aliases, label))


@dataclass(frozen=True)
class MarkerSet:
    """The markers that a person may wear, by the labels that files give them."""

    name: str
    description: str
    markers: tuple[Marker, ...]

    def wanted(self) -> dict[str, tuple[str, ...]]:
        """Label and its aliases, for matching a file's labels."""
        return {marker.label: marker.aliases for marker in self.markers}

    def optional(self) -> frozenset[str]:
        """Labels that a recording may lack without a word."""
        return frozenset(marker.label for marker in self.markers if marker.optional)

    def on(self, segment: str) -> str:
        """The labels on a segment, as a list in words."""
        return ", ".join(marker.label for marker in self.markers if marker.segment == segment)

    def as_data(self) -> dict[str, Any]:
        """As JSON can hold it: what :meth:`from_data` reads."""
        return asdict(self)

    @staticmethod
    def from_data(data: dict[str, Any]) -> MarkerSet:
        """The set that was written as data."""
        rows = [row | {"aliases": tuple(row["aliases"])} for row in data["markers"]]
        markers = tuple(Marker(**row) for row in rows)
        return MarkerSet(data["name"], data["description"], markers)


def load_marker_set(name: str) -> MarkerSet:
    """Read a marker set: the name of a shipped one, now or formerly, or a path to a TOML file.

    UsageError: there is no such file, or it names unknown segments or landmarks: all faults at
        once.
    """
    file = Path(name) if name.endswith(".toml") else shipped("markersets", f"{name}.toml")
    if not (name.endswith(".toml") or file.exists()):
        others = shipped("markersets").glob("*.toml")
        also = (other for other in others if name in read_toml(other).get("also_called", ()))
        file = next(also, file)
    if not os.path.lexists(file):
        known = ", ".join(["auto", *shipped_names()])
        raise UsageError(
            "there is no such marker set", file=name, expected=f"{known}, or a path to a .toml"
        )
    data = read_toml(file)
    faults = _faults(data)
    if faults:
        raise UsageError("; ".join(faults), file=file, remedy="configs/markersets has examples")
    weights, aliases = data.get("weights", {}), data.get("aliases", {})
    optional, markers = data.get("optional", {}).get("markers", []), []
    for segment, members in data["segments"].items():
        for label, landmark in members.items():
            weight, names = float(weights.get(label, 1.0)), tuple(aliases.get(label, ()))
            markers.append(Marker(label, segment, landmark, weight, label in optional, names))
    return MarkerSet(file.stem, str(data.get("description", file.stem)), tuple(markers))


def shipped_names() -> tuple[str, ...]:
    """Names of the marker sets that ship with bsip."""
    return tuple(sorted(path.stem for path in shipped("markersets").glob("*.toml")))


def _faults(data: dict[str, Any]) -> list[str]:
    segments = data.get("segments")
    if not isinstance(segments, dict) or not segments:
        return ['no [segments]: expected lines like head = { RTEM = "temple_r" }']
    faults = [
        f"unknown table {key}{did_you_mean(key, _TABLES)}" for key in sorted(set(data) - _TABLES)
    ]
    labels: list[str] = []
    for segment, members in segments.items():
        if segment not in SEGMENTS:
            faults.append(f"unknown segment {segment}{did_you_mean(segment, SEGMENTS)}")
        if not isinstance(members, dict):
            faults.append(f'{segment}: expected {{ LABEL = "landmark", ... }}')
            continue
        for label, landmark in members.items():
            labels.append(label)
            if not isinstance(landmark, str):
                faults.append(f'{label}: expected the name of a landmark or ""')
            elif landmark and landmark not in LANDMARKS:
                faults.append(
                    f"{label}: unknown landmark {landmark}{did_you_mean(landmark, LANDMARKS)}"
                )
    faults += [f"{label} stands twice" for label, n in sorted(Counter(labels).items()) if n > 1]
    return faults + _option_faults(data, labels)


def _option_faults(data: dict[str, Any], labels: list[str]) -> list[str]:
    weights, aliases = data.get("weights", {}), data.get("aliases", {})
    optional = data.get("optional", {})
    if not _are_words(data.get("also_called", [])):
        return ['also_called: expected a list like ["other_name"]']
    tables = {"weights": weights, "aliases": aliases, "optional": optional}
    faults = [f"{k}: expected a table" for k, v in tables.items() if not isinstance(v, dict)]
    if faults:
        return faults
    for label, weight in weights.items():
        if not (isinstance(weight, int | float) and 0 <= weight < inf):
            faults.append(f"{label}: expected a weight of 0 or more")
    odd = [label for label, names in aliases.items() if not _are_words(names)]
    faults += [f'{label}: expected aliases like ["NAME"]' for label in odd]
    markers = optional.get("markers", [])
    if not _are_words(markers):
        return [*faults, 'optional markers: expected a list like ["RTHI"]']
    named = {*weights, *aliases, *markers}
    return faults + [f"{label} has options but no segment" for label in sorted(named - set(labels))]


def _are_words(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(word, str) for word in value)
