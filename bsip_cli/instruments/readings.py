"""What the instruments of a lab deliver for one trial: markers and force plates, in SI units.

Both the simulator and real recordings can be put into this form; what hides in the
instruments (`effects`) works on it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bsip_cli.errors import UsageError

COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass(frozen=True, eq=False)
class SensingPlate:
    """A force plate where the file says it is.

    axes : (3, 3) columns are the plate's x, y, z in the lab.
    centre_m : (3,) middle of its surface, lab.
    sensor_m : (3,) the point that its moments are about, lab.
    """

    axes: np.ndarray
    centre_m: np.ndarray
    sensor_m: np.ndarray

    def lab_wrench(self, reading: np.ndarray, about_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force and moment (N, 3) about a lab point, lab axes, from a reading (N, 6)."""
        force, moment = reading[:, :3] @ self.axes.T, reading[:, 3:] @ self.axes.T
        return force, moment + np.cross(self.sensor_m - about_m, force)

    def reading(self, force: np.ndarray, moment: np.ndarray, about_m: np.ndarray) -> np.ndarray:
        """(N, 6) reading for a force (N, 3) and its moment about a lab point, lab axes."""
        at_sensor = moment - np.cross(self.sensor_m - about_m, force)
        return np.hstack([force @ self.axes, at_sensor @ self.axes])


@dataclass(frozen=True, eq=False)
class Instruments:
    """Markers and force plates of one trial.

    points_m : (F, M, 3) in the lab, NaN where a marker is lost.
    readings : (P, N, 6) N and N m in each plate's axes, about its sensor; N is a whole
        multiple of F.
    up : (3,) vertical direction of the lab, as its files say.
    start_s : when the first frame lies on the clock of the movement (0 if nothing was cut).
    stamps_s : (F,) times of frames that are not evenly spaced; then N is F.
    surfaces_known : whether the plates' places are true (a MOT file has none).
    """

    labels: tuple[str, ...]
    points_m: np.ndarray
    marker_hz: float
    plates: tuple[SensingPlate, ...]
    readings: np.ndarray
    analog_hz: float
    up: np.ndarray
    start_s: float = 0.0
    stamps_s: np.ndarray | None = None
    surfaces_known: bool = True

    @property
    def per_frame(self) -> int:
        """Analog samples per frame."""
        return round(self.analog_hz / self.marker_hz)

    def frame_times_s(self) -> np.ndarray:
        """(F,) from the first frame."""
        even = np.arange(len(self.points_m)) / self.marker_hz
        return even if self.stamps_s is None else self.stamps_s

    def sample_times_s(self) -> np.ndarray:
        """(N,) from the first sample."""
        even = np.arange(self.readings.shape[1]) / self.analog_hz
        return even if self.stamps_s is None else self.stamps_s

    def column(self, label: str) -> int:
        """Where a marker stands among the points."""
        if label not in self.labels:
            raise UsageError(
                f"there is no marker {label!r}", expected=f"one of {', '.join(self.labels)}"
            )
        return self.labels.index(label)

    def frames(self, first: int, last: int) -> Instruments:
        """Only the frames first to last - 1, with their analog samples."""
        ratio = self.per_frame
        return replace(
            self,
            points_m=self.points_m[first:last],
            readings=self.readings[:, first * ratio : last * ratio],
            start_s=self.start_s + first / self.marker_hz,
            stamps_s=None if self.stamps_s is None else self.stamps_s[first:last],
        )

    def first_frame_of(self, cut: Instruments) -> int:
        """At which frame of these ones those of a part of it begin."""
        return round((cut.start_s - self.start_s) * self.marker_hz)

    def said_slower(self, times: float) -> Instruments:
        """The same samples, said to be so many times slower than they are."""
        stamps = None if self.stamps_s is None else times * self.stamps_s
        slower = self.marker_hz / times, self.analog_hz / times
        return replace(self, marker_hz=slower[0], analog_hz=slower[1], stamps_s=stamps)

    def with_forces_from(self, times_s: np.ndarray) -> Instruments:
        """At each sample the reading of another time; frames without such a reading are cut.

        times_s : (N,) rising, on the clock of `sample_times_s`.

        Raises
        ------
        UsageError : nothing is left.
        """
        count = self.readings.shape[1]
        at = self.sample_times_s()
        position = np.interp(times_s, at, np.arange(count), left=-1.0, right=count)
        there = (position > -1e-6) & (position < count - 1 + 1e-6)
        whole = np.flatnonzero(there.reshape(len(self.points_m), self.per_frame).all(axis=1))
        if len(whole) < 2:
            raise UsageError("the plates' clock is so far off that nothing of the trial is left")
        read = np.stack([interpolated(r, position) for r in self.readings])
        return replace(self, readings=read).frames(int(whole[0]), int(whole[-1]) + 1)


def interpolated(values: np.ndarray, position: np.ndarray) -> np.ndarray:
    """(N, C) values at fractional indices (N,), by the cubic through the four nearest samples.

    Local, so that a lost sample spoils its neighbours only; exact at whole indices.
    """
    nearest = np.round(position)
    position = np.where(np.abs(position - nearest) < 1e-6, nearest, position)
    base = np.clip(np.floor(position).astype(int), 1, len(values) - 3)
    s = (position - base)[:, None]
    weights = (
        -s * (s - 1) * (s - 2) / 6,
        (s + 1) * (s - 1) * (s - 2) / 2,
        -(s + 1) * s * (s - 2) / 2,
        (s + 1) * s * (s - 1) / 6,
    )
    result = np.zeros_like(values[base])
    for k, weight in enumerate(weights, start=-1):
        result += np.where(weight == 0.0, 0.0, weight * values[base + k])
    return result
