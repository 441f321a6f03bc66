"""Parameters of a C3D file: groups of named texts and arrays of numbers."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bsip_cli.errors import printable

Value = tuple[str, ...] | np.ndarray
Group = Mapping[str, Value]
Parameters = Mapping[str, Group]


def numbers(group: Group, name: str) -> np.ndarray:
    """A numeric parameter with its continuations (SCALE, SCALE2, ...); empty if there is none.

    The last axis counts plates or channels, as the format stores it (first index fastest).
    """
    parts = [part for part in _continued(group, name) if isinstance(part, np.ndarray)]
    if len(parts) == 1:
        return parts[0].astype(float)
    return np.concatenate([np.zeros(0), *(np.ravel(part) for part in parts)])


def whole_numbers(group: Group, name: str) -> np.ndarray:
    """A numeric parameter as integers, also where it is stored as floats; NaN counts as 0."""
    return np.clip(np.nan_to_num(numbers(group, name)), -1e9, 1e9).astype(int)


def texts(group: Group, name: str) -> list[str]:
    """A text parameter with its continuations (LABELS, LABELS2, ...); empty if there is none."""
    parts = [part for part in _continued(group, name) if isinstance(part, tuple)]
    return [printable(text) for part in parts for text in part]


def number(group: Group, name: str) -> float:
    """The first number of a parameter, NaN if there is none."""
    values = np.ravel(numbers(group, name))
    return float(values[0]) if len(values) else float("nan")


def _continued(group: Group, name: str) -> list[Value]:
    parts = [group[name]] if name in group else []
    more = 2
    while parts and f"{name}{more}" in group:
        parts.append(group[f"{name}{more}"])
        more += 1
    return parts
