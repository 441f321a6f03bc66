"""The times of a file of forces against those of the markers beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.timebase import MOST_HZ, UNITS_S, Stamps, about_unit

UNEVEN = "the times of the .mot do not increase evenly"
_WHAT = "times of the forces"
_UNIT_NAMES = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "milliseconds": 1e-3}
_UNIT_NAMES |= {"us": 1e-6, "\N{MICRO SIGN}s": 1e-6, "microseconds": 1e-6}


@dataclass(frozen=True)
class MarkerTimes:
    """When the markers were seen."""

    first_s: float
    rate_hz: float
    n: int
    unsure_s: float = 0.0  # by how much the first may be off: the last digit that is printed

    def lasts_s(self) -> float:
        return (self.n - 1) / self.rate_hz

    def span(self) -> str:
        return _span(self.first_s, self.first_s + self.lasts_s())


@dataclass(frozen=True, eq=False)
class ForceTimes:
    """Stamps in seconds of the markers' clock, or why there are none."""

    stamps: Stamps | None
    findings: tuple[Finding, ...] = ()
    note: str = ""
    rates_hz: tuple[float, ...] = ()  # known otherwise than by the stamps
    is_simultaneous: bool = False  # they begin with the markers, whatever the stamps say


def settle_force_times(stamps: Stamps, markers: MarkerTimes) -> ForceTimes:
    """Unit and zero of the forces' times.

    Of seconds, ms and microseconds that one by which forces and markers last alike; stamps that
    count rows have the rate that makes a whole number of rows per frame. Forces that lie outside
    the markers' time but last as long were counted from another zero.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        increase = np.isfinite(stamps.values).all() and stamps.step() > 0
    if len(stamps.values) < 2 or not increase:
        return ForceTimes(None, (), UNEVEN)
    settled = _in_seconds(stamps, markers)
    if settled.stamps is None or settled.is_simultaneous:
        return settled
    return _from_one_zero(settled, markers)


def _in_seconds(stamps: Stamps, markers: MarkerTimes) -> ForceTimes:
    step, n, near_s = stamps.step(), len(stamps.values), 1 / markers.rate_hz
    stated_s = _UNIT_NAMES.get(stamps.unit.strip().lower())
    if stated_s is not None and stated_s != 1.0:
        found = f"in {stamps.unit.strip()}"
        return ForceTimes(stamps.times(stated_s), (about_unit(found, "read them so", _WHAT),))
    if stamps.count():
        ratio = round(n / markers.n)
        if ratio >= 1 and abs(n - ratio * markers.n) <= ratio:
            rate_hz = ratio * markers.rate_hz
            action = f"took the first as the first frame's and {rate_hz:g} Hz"
            own = replace(stamps.times(1 / rate_hz, float(stamps.values[0])), digits=(0.0, 0.0))
            said = about_unit("that count rows", action, _WHAT)
            return ForceTimes(own, (said,), rates_hz=(rate_hz,), is_simultaneous=True)
        if stamps.values[0] < 2 or abs(stamps.values[0] / 1e3 - markers.first_s) > near_s:
            note = f"the times of the .mot count {n} rows, and none of its rates has as many in "
            return ForceTimes(None, (), f"{note}the {markers.n} frames of the markers")
    lasts = abs(float(stamps.values[-1] - stamps.values[0]))
    possible = {
        name: size for name, size in {"s": 1.0, **UNITS_S}.items() if step * size * MOST_HZ >= 1
    }
    if not possible:
        return ForceTimes(None, (), UNEVEN)
    name = min(possible, key=lambda unit: abs(np.log(lasts * possible[unit] / markers.lasts_s())))
    if name == "s":
        return ForceTimes(stamps)
    found = f"in {name}: {step:.4g} from row to row"
    return ForceTimes(
        stamps.times(possible[name]), (about_unit(found, f"read them in {name}", _WHAT),)
    )


def _from_one_zero(settled: ForceTimes, markers: MarkerTimes) -> ForceTimes:
    """Both clocks zeroed alike where nothing else can be; a note where they share no time."""
    assert settled.stamps is not None
    times = settled.stamps.values
    first, last = float(times.min()), float(times.max())
    near = 1 / markers.rate_hz + settled.stamps.step()
    is_as_long = abs((last - first) - markers.lasts_s()) <= near + settled.stamps.digits[1]
    apart_s = abs(first - markers.first_s)
    overlap_s = min(last, markers.first_s + markers.lasts_s()) - max(first, markers.first_s)
    is_together = overlap_s > min(near, 0.5 * (last - first))
    times_are = f"forces at {_span(first, last)} s and markers at {markers.span()} s"
    if is_as_long and (not is_together or apart_s <= markers.unsure_s):
        said: tuple[Finding, ...] = (
            _one_clock(f"{times_are}: as long, and never at once", is_corrected=True),
        )
        if apart_s <= near or (is_together and np.isfinite(markers.unsure_s)):
            said = ()  # within what is printed
        elif is_together:
            said = (_one_clock(f"{times_are}: as long, and those count frames", is_corrected=True),)
        return replace(settled, is_simultaneous=True, findings=(*settled.findings, *said))
    if not is_together:
        return replace(settled, stamps=None, note=times_are)
    if apart_s > near and (is_as_long or not np.isfinite(markers.unsure_s)):
        doubt = _one_clock(f"{times_are}: perhaps from another zero", is_corrected=False)
        return replace(settled, findings=(*settled.findings, doubt))
    return settled


def _one_clock(found: str, is_corrected: bool) -> Finding:
    return Finding(
        check="time",
        subject="",
        found=found,
        expected="one clock",
        action="took their first samples as simultaneous"
        if is_corrected
        else "took both as written; if they were cut alike, give them the same first time",
        level="corrected" if is_corrected else "warning",
    )


def _span(first_s: float, last_s: float) -> str:
    return f"{first_s:.4g} to {last_s:.4g}" if last_s < 1e4 else f"{first_s:.6f} to {last_s:.6f}"
