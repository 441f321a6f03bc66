"""How a file is understood, as it says or as proves true: the numbers of one plate, and the
laboratory's axes against those of the person."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
from scipy.linalg import block_diag

from bsip_cli.recordings.plates import CHANNELS, CHANNELS_OF

Reference = Literal["stated", "reversed", "centred", "origin", "fixed"]
Moved = Literal["", "all", "markers", "forces"]

# Natural logarithms of how often a laboratory's files need a repair, beside being as they say. Only
# their order of magnitude counts: one in thirty for units, which exporters confuse most, one in a
# hundred for a reference point or a turned plate, one in five hundred for corners the other way
# round (none of 157 plates of 20 laboratories).
_SCALED, _OTHER_POINT, TURNED, MIRRORED = -3.4, -4.6, -4.6, -6.2
# Without the forces, or these without the moments, or one channel; two that are exchanged.
_MOMENTS_REVERSED = -6.2
_BOTH_REVERSED = -float(np.log(2))  # rather than one of them
_TWO_OF_SENSORS = -float(np.log(28))  # which of eight, nothing says beforehand
REVERSED = -2.3  # the action on the plate: one in ten
EXCHANGED = -5.3  # two plates
ONE_ALONE = -0.7  # one plate of several: what goes wrong, goes wrong for all more often

_ODD = -2.3  # of ten frames that are turned one is so by no multiple of 90 degrees
_IN_PART = -2.3  # markers or forces alone are mirrored more rarely than both: one in ten


@dataclass(frozen=True)
class PlateReading:
    """What is done to a plate's numbers; the defaults take them as the file says.

    Attributes
    ----------
    moment_scale, point_scale : what moments and points are multiplied with; of a plate of type 1
        the first counts for the vertical moment, its sign for the points too.
    about : what moments are about. "stated": what the file says, in a MOT the point; "reversed" and
        "centred": ORIGIN the other way or without its part along the surface; "origin": the lab's
        origin; "fixed": one point, ``centre_m``, for all samples.
    turn : the corners are moved on by so many places (each 90 degrees).
    mirrored : the corners are taken in the other direction round.
    sign : -1 where the numbers are the action on the plate.
    place_of : the plate whose place (C3D), or points (MOT), belong to this one's force and moment.
    channels : what is wrong with single channels, as written: "reversed" and one name or two,
        "exchanged" and two; "" if nothing. Names are CHANNELS, or a plate's own where they differ.
    half_size_m : half the outline's sides where the stated outline is too small.
    """

    moment_scale: float = 1.0
    point_scale: float = 1.0
    about: Reference = "stated"
    centre_m: tuple[float, float, float] | None = None
    turn: int = 0
    mirrored: bool = False
    sign: int = 1
    place_of: str = ""
    channels: str = ""
    half_size_m: tuple[float, float] | None = None

    def repairs(self) -> dict[tuple, float]:
        """Each, by what it is, and how rare it is, natural logarithm."""
        both = self.channels.startswith("reversed") and " and " in self.channels
        sensors = any(name in CHANNELS_OF[3] for name in self.channels.split())
        of_channels = _MOMENTS_REVERSED + _BOTH_REVERSED * both + _TWO_OF_SENSORS * sensors
        each = {
            ("moments", abs(self.moment_scale)): _SCALED * (abs(self.moment_scale) != 1.0),
            ("points", self.point_scale): _SCALED * (self.point_scale != 1.0),
            ("signs", self.moment_scale < 0): _MOMENTS_REVERSED * (self.moment_scale < 0),
            ("channels", self.channels): of_channels * bool(self.channels),
            ("about", self.about): _OTHER_POINT * (self.about != "stated"),
            ("corners", self.turn, self.mirrored): (
                MIRRORED if self.mirrored else TURNED * (self.turn != 0)
            ),
        }
        return {what: rare for what, rare in each.items() if rare}

    def channel_matrix(self, names: Sequence[str] = CHANNELS) -> np.ndarray:
        """To what the channels of these names are from what is written as such, (k, k)."""
        right = np.eye(len(names))
        named = [k for k, name in enumerate(names) if name in self.channels.split()]
        is_sign = self.channels.startswith("reversed")
        right[named] = -right[named] if is_sign else right[named[::-1]]
        return right

    def measured_matrix(self, kind: int) -> np.ndarray:
        """The same of what a plate of a C3D has measured (`plates.measured`), (k, k), where its own
        channels are no forces and moments of the whole plate."""
        if kind == 1:
            points = np.sign(self.moment_scale) * self.point_scale * self.channel_matrix(POINT)
            return np.asarray(block_diag(np.eye(3), np.kron(points, np.eye(3)), self.moment_scale))
        own = CHANNELS_OF[kind]
        return np.eye(len(own)) if own == CHANNELS else self.channel_matrix(own)

    def words(self) -> str:
        """What was done about units, reference and axes, as one clause; empty if nothing."""
        done = [
            _MOMENT_SCALES.get(abs(self.moment_scale), ""),
            "reversed the moments against the forces" * (self.moment_scale < 0),
            _POINT_SCALES.get(self.point_scale, ""),
            _ABOUT[self.about],
        ]
        done.append(self.channels)
        if self.place_of:
            done.append(f"exchanged its place with that of {self.place_of}")
        if self.mirrored:
            done.append("took the corners in the other direction round")
        if self.turn:
            done.append(f"turned the plate's axes by {90 * self.turn} degrees")
        return ", ".join(filter(None, done))


AS_STATED = PlateReading()
POINT = ("Px", "Py")
ALIKE = dict.fromkeys((2, 4), (CHANNELS[:3], CHANNELS[3:])) | {
    1: (CHANNELS[:3], CHANNELS[3:], POINT),
    3: (CHANNELS[:2], CHANNELS[3:5], CHANNELS_OF[3]),
}


def faults_of_channels(alike: Sequence[Sequence[str]]) -> list[str]:
    """One of CHANNELS reversed, or both level forces; any two that are alike exchanged."""
    pairs = (pair for names in alike for pair in combinations(names, 2))
    level = alike[0][:2]
    return [
        f"reversed {level[0]} and {level[1]}",
        *(f"reversed {name}" for name in CHANNELS),
        *(f"exchanged {one} and {other}" for one, other in pairs),
    ]


_MOMENT_SCALES = {
    1e-3: "read the moments in N mm",
    1e3: "read the moments in N m, a thousand times what their unit says",
}
_POINT_SCALES = {
    1e-3: "read the points of force in mm",
    1e-2: "read the points of force in cm",
    1e1: "read the points of force in cm",
    1e3: "read the points of force in m",
}
_ABOUT = {
    "stated": "",
    "reversed": "reversed ORIGIN",
    "centred": "took ORIGIN for a place in the laboratory and the moments about the plate's centre",
    "origin": "took the moments about the laboratory's origin, the points for centres of pressure",
    "fixed": "took the moments about one point of the plate, the points for centres of pressure",
}


# --- axes -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FrameChange:
    """What of a session is written in other axes than it should be, and how these are changed: a
    horizontal ``axis`` reversed or, where ``turned_deg`` is not 0, a turn about the vertical, of
    which the standard deviation is ``turned_sd_deg``; by it a centre of pressure may be off by
    ``unsure_m``, in 19 of 20.

    corners_only : of a C3D the channels were not mirrored with the plates' corners.
    """

    moved: Moved = ""
    axis: int = 0
    turned_deg: float = 0.0
    turned_sd_deg: float = 0.0
    unsure_m: float = 0.0
    corners_only: bool = False

    @property
    def moves_markers(self) -> bool:
        return self.moved in ("all", "markers")

    @property
    def moves_forces(self) -> bool:
        return self.moved in ("all", "forces")

    def matrix(self) -> np.ndarray:
        """From the axes as written to those of the person, (3, 3)."""
        if self.turned_deg:
            c, s = np.cos(np.deg2rad(self.turned_deg)), np.sin(np.deg2rad(self.turned_deg))
            return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return np.diag([-1.0 if k == self.axis else 1.0 for k in range(3)])

    def of_markers(self) -> tuple[bool, int]:
        """What is done to the markers."""
        return self.moves_markers, self.axis * self.moves_markers

    def log_prior(self) -> float:
        if self.moved == "forces":
            turned = TURNED + _ODD * (self.turned_sd_deg > 0)
            return turned if self.turned_deg else MIRRORED
        return _IN_PART if self.moved == "markers" else 0.0

    def words(self) -> str:
        """What is done, as a clause; empty if nothing."""
        if not self.moved:
            return ""
        what = {"all": "markers and forces", "markers": "the markers", "forces": "the forces"}
        if self.turned_deg:
            sd = f" +- {self.turned_sd_deg:.2g}" if self.turned_sd_deg else ""
            return (
                f"turned {what[self.moved]} by {self.turned_deg:.4g}{sd} degrees about the vertical"
            )
        return f"reversed the {'XY'[self.axis]} axis of {what[self.moved]}"


MIRRORS = (
    FrameChange("all"),
    FrameChange("all", corners_only=True),
    FrameChange("markers", 0),
    FrameChange("markers", 1),
)
FORCES_MOVED = (
    *(FrameChange("forces", axis) for axis in (0, 1)),
    *(FrameChange("forces", turned_deg=turn) for turn in (90.0, 180.0, 270.0)),
)
