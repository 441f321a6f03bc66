"""How the counts of a C3D file's analog channels become numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.recordings.c3d_parameters import Group, number, numbers
from bsip_cli.recordings.c3d_records import TEXT, Record, group_names

_WORD = 0x10000


@dataclass(frozen=True, eq=False)
class Scaling:
    """Of the analog channels: (count - offset) x scale, each (n_channels,)."""

    scales: np.ndarray
    offsets: np.ndarray
    is_unsigned: bool

    def applied(self, counts: np.ndarray, is_float: bool) -> np.ndarray:
        """Counts of the converter (n_channels, n) as the file scales them."""
        if self.is_unsigned and not is_float:
            counts = np.where(counts < 0, counts + _WORD, counts)
        with np.errstate(invalid="ignore", over="ignore"):
            return (counts - self.offsets[:, None]) * self.scales[:, None]


def scaling_of(group: Group, n_channels: int, is_unsigned: bool) -> Scaling:
    """GEN_SCALE times SCALE, one where the file says nothing; OFFSET, zero likewise.

    What the file says may be no number, or zero: a plate of such channels is left out.
    """
    general = number(group, "GEN_SCALE") if np.size(group.get("GEN_SCALE", ())) else 1.0
    scales, offsets = np.ones(n_channels), np.zeros(n_channels)
    for values, name in ((scales, "SCALE"), (offsets, "OFFSET")):
        given = np.ravel(numbers(group, name))[:n_channels]
        values[: len(given)] = given
    with np.errstate(invalid="ignore", over="ignore"):
        scales *= general
    if is_unsigned:
        offsets = np.where(offsets < 0, offsets + _WORD, offsets)
    return Scaling(scales, offsets, is_unsigned)


def says_unsigned(records: Sequence[Record]) -> bool:
    """ANALOG:FORMAT: whether integer samples and offsets have no sign."""
    names = group_names(records)
    formats = [
        record.value
        for record in records
        if record.kind == TEXT and (names.get(record.group), record.name) == ("ANALOG", "FORMAT")
    ]
    return bool(formats) and formats[-1].strip().startswith(b"UNSIGNED")
