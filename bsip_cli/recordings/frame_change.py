"""The laboratory's axes against those of the person: mirrored, or turned about the vertical."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from bsip_cli.recordings.opened import Opened
from bsip_cli.recordings.plate_reading import MIRRORED, TURNED

_ODD = -2.3  # of ten frames that are turned one is so by no multiple of 90 degrees
_IN_PART = -2.3  # markers or forces alone are mirrored more rarely than both: one in ten

Moved = Literal["", "all", "markers", "forces"]


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

    def of(self, opened: Opened) -> Opened:
        """The recording corrected."""
        recording, sources = opened.recording, opened.sources
        if self.moves_markers:
            recording = replace(recording, markers_m=recording.markers_m @ self.matrix().T)
        if self.moves_forces:
            sources = tuple(one.moved(self.matrix(), self.corners_only) for one in sources)
        return Opened(recording, sources)

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
