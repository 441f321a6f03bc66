"""The weight of something that a person did not carry, added to measured forces.

It rides on markers; its weight and its acceleration act on the plates that carry the
person at that moment, shared as they share the person's weight. What it would have done to
the movement is left out.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt

from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.instruments.readings import Instruments
from bsip_cli.simulate.effects.segment_markers import markers_of

CUTOFF_HZ = 10.0
LOADED_N = 40.0
GRAVITY_M_S2 = 9.81


def with_mass_at(
    instruments: Instruments, where: str, mass_kg: float, hold: np.ndarray | None = None
) -> Instruments:
    """Plates as they would read with a point mass in the middle of some markers.

    where : a segment, or labels joined by "+". hold : (N,) 1 while it is carried.

    Raises
    ------
    UsageError : no such marker.
    BadDataError : the markers are lost for more than half of the trial.
    """
    path = _smooth_path(instruments, where)
    times, samples = instruments.frame_times_s(), instruments.sample_times_s()
    spline = make_interp_spline(times, path, k=5)
    place = spline(np.minimum(samples, times[-1]))
    acceleration = spline.derivative(2)(np.minimum(samples, times[-1]))
    force = mass_kg * (acceleration + GRAVITY_M_S2 * instruments.up)
    force = force if hold is None else hold[:, None] * force
    shares, sign = _shares(instruments)
    readings = instruments.readings.copy()
    for index, plate in enumerate(instruments.plates):
        part = sign * shares[index][:, None] * force
        about = plate.sensor_m
        readings[index] += plate.reading(part, np.cross(place - about, part), about)
    return instruments.with_readings(readings)


def _smooth_path(instruments: Instruments, where: str) -> np.ndarray:
    """(F, 3) middle of the markers, gaps bridged, low-passed."""
    labels = markers_of(where, instruments.labels)
    if not labels:
        raise UsageError(
            f"no marker of {where!r} is in the recording",
            expected=f"labels joined by '+', of {', '.join(instruments.labels)}",
        )
    middle = instruments.points_m[:, [instruments.column(label) for label in labels]].mean(axis=1)
    times, seen = instruments.frame_times_s(), np.isfinite(middle).all(axis=1)
    if seen.mean() < 0.5 or len(times) < 30:
        raise BadDataError(
            f"the markers {', '.join(labels)} are all seen in {seen.sum()} of {len(seen)} frames",
            expected="more than half of them, and at least 30 frames",
        )
    path = np.stack([np.interp(times, times[seen], column[seen]) for column in middle.T], axis=1)
    cutoff = min(CUTOFF_HZ, 0.4 * instruments.marker_hz)
    filters = butter(2, cutoff, fs=instruments.marker_hz, output="sos")
    return sosfiltfilt(filters, path, axis=0)


def _shares(instruments: Instruments) -> tuple[np.ndarray, float]:
    """(P, N) part of the load that each plate carries, and the sign of the readings.

    The sign is 1 where the readings are the force on the person, -1 where on the plate.
    """
    vertical = np.stack(
        [
            reading[:, :3] @ plate.axes.T @ instruments.up
            for reading, plate in zip(instruments.readings, instruments.plates, strict=True)
        ]
    )
    sign = 1.0 if np.nansum(vertical) > 0.0 else -1.0
    load = np.nan_to_num(sign * vertical)
    load = np.where(load > LOADED_N, load, 0.0)
    return load / np.maximum(load.sum(axis=0), LOADED_N), sign
