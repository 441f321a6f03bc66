"""Causes that are injected into real recordings, one at a time, and what should be answered."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

# Effects that nothing in these recordings tells from each other (design, section 6).
_VERTICAL = ("plate_gain", "plate_zero", "added_mass")


@dataclass(frozen=True)
class Parameter:
    """The number that is compared: the length of what ``names`` list, times ``factor`` in ``unit``.

    ``spans``: the difference of two times instead.
    """

    names: tuple[str, ...]
    unit: str
    factor: float = 1.0
    spans: bool = False

    def of(self, values: Mapping[str, float]) -> float:
        """Its value, from parameters by name."""
        found = [values[name] for name in self.names]
        if self.spans:
            return self.factor * (found[1] - found[0])
        if len(found) == 1:
            return self.factor * found[0]
        return self.factor * sum(x * x for x in found) ** 0.5


@dataclass(frozen=True)
class Cause:
    """One injected cause.

    target : as ``bsip inject`` wants it; ``{segment}``, ``{marker}``, ``{pair}`` and ``{up}`` (the
        vertical force in the file's axes) are filled in for each recording.
    place : the target as the diagnosis prints it.
    everywhere : in all moving trials, else in one. over_trial : the size is that at its end.
    alike : effects that may share its class, or stand for it where nothing tells them apart.
    """

    words: str
    effect: str
    size: float
    target: str
    place: str
    parameter: Parameter
    everywhere: bool = True
    over_trial: bool = False
    alike: tuple[str, ...] = ()


CAUSES = (
    Cause("delay 10 ms", "sync_offset", 0.010, "-", "", Parameter(("delay",), "ms", 1e3)),
    Cause(
        "plate 1 shifted by 20 mm",
        "plate_translation",
        0.020,
        "x,plate=1",
        "1",
        Parameter(("x",), "mm", 1e3),
    ),
    Cause(
        "plate 1 turned by 3 degrees",
        "plate_rotation",
        0.05236,
        "yaw,plate=1",
        "1",
        Parameter(("yaw",), "degrees", 57.2958),
    ),
    Cause(
        "vertical gain 4 %",
        "plate_gain",
        0.04,
        "{up},plate=1",
        "1 fz",
        Parameter(("gain",), "%", 100.0),
        everywhere=False,
        alike=_VERTICAL,
    ),
    Cause(
        "crosstalk fz to fx 2 %",
        "plate_crosstalk",
        0.02,
        "{up}:fx,plate=1",
        "1 fz>fx",
        Parameter(("coefficient",), "%", 100.0),
        alike=("plate_rotation", "plate_zero"),
    ),
    Cause(
        "vertical zero 15 N",
        "plate_zero",
        15.0,
        "{up},plate=1",
        "1 fz",
        Parameter(("offset",), "N"),
        everywhere=False,
        alike=_VERTICAL,
    ),
    Cause(
        "vertical drift 15 N",
        "plate_drift",
        15.0,
        "{up},plate=1",
        "1 fz",
        Parameter(("drift",), "N/s"),
        everywhere=False,
        over_trial=True,
    ),
    Cause(
        "marker off by 30 mm",
        "marker_shift",
        0.030,
        "{marker}",
        "{marker}",
        Parameter(("shift_x", "shift_y", "shift_z"), "mm", 1e3),
        everywhere=False,
    ),
    Cause(
        "labels exchanged for 2 s",
        "marker_swap",
        2.0,
        "{pair}",
        "{pair}",
        Parameter(("start", "end"), "s", spans=True),
        everywhere=False,
    ),
    Cause(
        "markers smoothed at 3 Hz",
        "over_smoothing",
        3.0,
        "-",
        "",
        Parameter(("cutoff",), "Hz"),
    ),
    Cause(
        "1 kg on a segment",
        "added_mass",
        1.0,
        "{segment}",
        "{segment}",
        Parameter(("mass",), "kg"),
        everywhere=False,
        alike=("plate_gain", "plate_zero"),
    ),
)
