"""What a reader hands on: a recording in SI units and one Z-up world frame."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.plates import cop_at_height


@dataclass(frozen=True)
class Finding:
    """One line of the quality table: what was met in the data and what was done.

    ``found``, ``expected`` and ``action`` are short clauses with numbers and units.
    """

    check: str
    subject: str
    found: str
    expected: str
    action: str
    level: str  # info, corrected, warning or excluded

    def sentence(self) -> str:
        """As people read it."""
        subject = f" {self.subject}" if self.subject else ""
        expected = f" (expected {self.expected})" if self.expected else ""
        return f"{self.check.replace('_', ' ')}{subject}: {self.found}{expected}; {self.action}"


def refusal(
    path: Path, found: str, expected: str, remedy: str = "export the trial again"
) -> BadDataError:
    """Why a file cannot be used."""
    return BadDataError(found, expected=expected, remedy=remedy, file=path)


@dataclass(frozen=True, eq=False)
class Plate:
    """One force plate's wrench on the body, world frame, at the analog or at the marker rate."""

    name: str
    wrench: np.ndarray  # (n, 6): force [N], standing: z > 0; moment about the world origin [N m]
    corners_m: np.ndarray | None  # (4, 3); None where the file does not say (MOT)
    usable: np.ndarray  # (n,) bool; False for NaN, clipped or stuck samples

    @property
    def force_N(self) -> np.ndarray:
        return self.wrench[:, :3]

    @property
    def moment_Nm(self) -> np.ndarray:
        return self.wrench[:, 3:]

    @property
    def lift_N(self) -> np.ndarray:
        """Vertical force, (n,)."""
        return self.wrench[:, 2]

    def cop_m(self, height_m: float | None = None) -> np.ndarray:
        """Centre of pressure at a height, (n, 2), else on its surface; NaN without load."""
        if height_m is None:
            height_m = 0.0 if self.corners_m is None else float(self.corners_m[:, 2].mean())
        return cop_at_height(self.force_N, self.moment_Nm, height_m)


@dataclass(frozen=True)
class StatedPerson:
    """What a file says of the person; None or empty where it says nothing.

    ``sex`` is M, F or other; ``name`` is the subject's in the recording program: it serves to
    distinguish people and is written nowhere.
    """

    mass_kg: float | None = None
    height_m: float | None = None
    sex: str = ""
    name: str = ""

    def words(self) -> str:
        """For example ``45.8 kg, 1.48 m``; empty where nothing is stated."""
        mass = f"{self.mass_kg:.4g} kg" if self.mass_kg is not None else ""
        height = f"{self.height_m:.4g} m" if self.height_m is not None else ""
        return ", ".join(filter(None, (mass, height, self.sex and f"sex {self.sex}")))


@dataclass(frozen=True, eq=False)
class Recording:
    """Markers and plates of one trial; analog sample 0 and frame 0 are simultaneous."""

    path: Path
    marker_rate_hz: float
    labels: tuple[str, ...]
    markers_m: np.ndarray  # (n_frames, n_markers, 3), NaN = missing
    analog_rate_hz: float
    plates: tuple[Plate, ...]
    findings: tuple[Finding, ...]
    rotation_world_lab: np.ndarray  # (3, 3), applied to turn the lab frame Z-up
    forces_note: str  # "" or why there are no usable forces
    time0_s: float
    stated: StatedPerson = StatedPerson()

    @property
    def n_frames(self) -> int:
        return len(self.markers_m)

    def time_s(self) -> np.ndarray:
        """Marker times, (n_frames,)."""
        return self.time0_s + np.arange(self.n_frames) / self.marker_rate_hz
