"""What TRC and MOT files share: lines read within limits, cells, how numbers are spelt, and time
stamps brought onto an even grid."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice
from math import isfinite, isnan, nan
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from bsip_cli.files.regular import check_regular
from bsip_cli.recordings.model import Finding, refusal

# A C3D file counts its points in 16 bits and names them with at most 255 letters.
MOST_NAMES, _LONGEST_NAME = 0xFFFF, 255
ROWS_LOOKED_AT = 20  # to see how the table is written
_LARGEST_TEXT = 2**30  # bytes
_LONGEST_NUMBER = 25  # characters, with what parts it from the next: -1.2345678901234567e-100
_LONGEST_LINE = _LONGEST_NUMBER * (2 + 3 * MOST_NAMES)
_MOST_HEADER_LINES = 1000  # a TRC file has 3, MOT files with notes some 20
_LONGEST_FACT = 1000  # characters of a header's line that are kept
_MISSING = re.compile(r"[-+]?(?:nan\b.*|#?n/?a|none|null|1\.#.*|inf|infinity|-|\.)?", re.IGNORECASE)
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?")
_SEPARATORS = ("\t", ";", ",", None)  # None: blanks


def text_lines(path: Path) -> Iterator[str]:
    """A text file's lines one after the other.

    Raises
    ------
    BadDataError
        It cannot be opened or read, is empty, too large, or no text.
    """
    check_regular(path)
    try:
        size = path.stat().st_size
        if size > _LARGEST_TEXT:
            found, most = f"a text of {size / 1e9:.1f} GB", f"at most {_LARGEST_TEXT / 1e9:.1f} GB"
            raise refusal(path, found, most, "cut the trial into shorter ones")
        if not size:
            remedy = "copy or export the trial again"
            raise refusal(path, "the file is empty", "a text file", remedy)
        with path.open(encoding="utf-8-sig", errors="replace") as file:
            while line := file.readline(_LONGEST_LINE + 1):
                if "\0" in line:
                    remedy = "save it as text in UTF-8, not in UTF-16"
                    raise refusal(path, "bytes that are no text", "lines of text", remedy)
                if len(line) > _LONGEST_LINE:
                    found = f"a line of more than {_LONGEST_LINE / 1e6:.1f} million characters"
                    raise refusal(path, found, "lines of text")
                yield line
    except OSError as error:
        found = f"cannot be read ({error.strerror or error})"
        raise refusal(path, found, "a readable text file", "check the file") from error


def head_of(lines: Iterator[str], is_end: Callable[[str], object]) -> tuple[list[str], str | None]:
    """The header's lines, and the one that ends it; None where no line does."""
    above: list[str] = []
    for line in islice(lines, _MOST_HEADER_LINES):
        if is_end(line):
            return above, line
        above.append(line[:_LONGEST_FACT])
    return above, None


def check_names(names: Sequence[str], what: str, path: Path) -> None:
    """Refuse more names, or longer ones, than a C3D file could hold."""
    longest = max(map(len, names), default=0)
    if len(names) > MOST_NAMES:
        raise refusal(path, f"{len(names)} {what}", f"at most {MOST_NAMES}")
    if longest > _LONGEST_NAME:
        raise refusal(path, f"one of the {what} has {longest} letters", f"at most {_LONGEST_NAME}")


def row_counts(what: str, stated: float, found: int) -> list[Finding]:
    """A warning where a header counts other rows or columns than the file has."""
    if not np.isfinite(stated) or stated == found:
        return []
    counts = f"the header counts {stated:g} {what}, the file has {found}"
    return [Finding("layout", "", counts, "one count", f"read {found}", "warning")]


# --- cells ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Dialect:
    """How a table is written."""

    separator: str | None  # None: blanks, any number of them
    comma: str = ","  # what a comma within a number means: "." or "" between thousands

    def cells(self, line: str) -> list[str]:
        """The cells of a row, empty ones at its end too."""
        return parted(line.replace(",", self.comma), self.separator)

    def about_commas(self) -> list[Finding]:
        """What is said of commas within numbers."""
        if self.separator == "," or self.comma == ",":
            return []
        found = "decimal commas" if self.comma else "commas between thousands"
        return [Finding("layout", "", found, "decimal points", "read them so", "corrected")]


def dialect_of(separator: str | None, rows: Sequence[str]) -> Dialect:
    """The dialect of rows: commas in all numbers above 999 only are between thousands."""
    if separator == "," or not any("," in row for row in rows):
        return Dialect(separator)
    cells = [cell for row in rows for cell in parted(row, separator) if "," in cell]
    return Dialect(separator, "" if all(map(_THOUSANDS.fullmatch, cells)) else ".")


def parted(line: str, separator: str | None) -> list[str]:
    """Words or cells of a line, without the blanks around them."""
    if separator is None:
        return line.split()
    return [cell.strip() for cell in line.strip("\r\n").split(separator)]


def separator_of(line: str) -> str | None:
    """What parts the words of a heading: tabs before semicolons before commas before blanks."""
    return next((mark for mark in _SEPARATORS if mark is None or mark in line), None)


def agreeing(heading: str, rows: Sequence[str]) -> Iterator[tuple[list[str], Dialect]]:
    """The heading's names and the rows' dialect, wherever the first row has as many cells."""
    for own in _SEPARATORS:
        cells = without_end(parted(rows[0], own))
        for mark in (own, *_SEPARATORS):
            names = without_end(parted(heading, mark))
            if len(names) == len(cells) > 1:
                yield names, dialect_of(own, rows)


def without_end(cells: list[str]) -> list[str]:
    """The cells without empty ones at the end."""
    n = len(cells)
    while n and not cells[n - 1]:
        n -= 1
    return cells[:n]


def number(cell: str) -> float:
    """A cell's number, NaN if it is none or infinite."""
    try:
        value = float(cell) if cell else nan
    except ValueError:
        return nan
    return value if isfinite(value) else nan


def values_of(cells: list[str]) -> tuple[list[float], list[str]]:
    """The numbers of cells, NaN or infinite where one is missing, and those that are words."""
    try:
        return list(map(float, cells)), []
    except ValueError:
        values = list(map(number, cells))
    pairs = zip(cells, values, strict=True)
    return values, [cell for cell, x in pairs if isnan(x) and not _MISSING.fullmatch(cell)]


class LastDigit:
    """The sizes of the last digit of a column: as printed, and without zeros at the end."""

    def __init__(self) -> None:
        self._printed, self._used = 0, 0

    def add(self, cell: str) -> None:
        mantissa, _, exponent = cell.lower().partition("e")
        digits = mantissa.partition(".")[2]
        shift = int(exponent) if exponent.lstrip("+-").isdigit() else 0
        self._printed = max(self._printed, len(digits) - shift)
        self._used = max(self._used, len(digits.rstrip("0")) - shift)

    def sizes(self, values: np.ndarray) -> tuple[float, float]:
        """In the column's unit; numbers that all have single precision are no finer than that."""
        printed, used = (10.0 ** -min(digits, 300) for digits in (self._printed, self._used))
        with np.errstate(over="ignore", invalid="ignore"):
            single = values.astype(np.float32)
            if (np.abs(single - values) <= 0.5 * printed).all():
                used = max(used, float(np.spacing(np.abs(single).max(initial=0))))
        return printed, used


# --- time stamps ----------------------------------------------------------------------------------


_JITTER = 0.05  # of the sample interval: below it the stamps count as even
_JUMP = 2.5  # sample intervals: above it the recording is torn
MOST_HZ = 1e5  # no camera and no plate is faster
_LONGEST_STEP_S = 1.0  # nobody records movement more slowly
_SAME = 0.02  # of the sample interval: stamps that all lie on the grid
_EXACT = 1e-3  # of the sample interval: a stamp that lies on the grid among others that do not
_ROOM = 1.01  # of the last digit: rates are stated with six digits
_AGREE = 0.05  # of the sample interval: steps in another unit that give the stated rate
_NEAR = 0.01  # of a stated rate: the stamps' own is the same
FRAMES = "frames"  # the unit of stamps that count them: their clock's zero is not known
UNITS_S = {"ms": 1e-3, "microseconds": 1e-6}


@dataclass(frozen=True, eq=False)
class Stamps:
    """Times as a file prints them."""

    values: np.ndarray  # (n,)
    digits: tuple[float, float] = (0.0, 0.0)  # size of the last digit: printed, and used at all
    unit: str = ""  # as the file says, "" if it does not

    def times(self, size_s: float, first: float = 0.0) -> Stamps:
        """The same in seconds, of a unit of ``size_s``, counted from ``first``."""
        printed, used = (size_s * digit for digit in self.digits)
        return Stamps((self.values - first) * size_s, (printed, used), "s")

    def faster(self, times: float) -> Stamps:
        """As if printed by a clock that runs so many times as fast."""
        digits = (self.digits[0] / times, self.digits[1] / times)
        return self if times == 1.0 else Stamps(self.values / times, digits, self.unit)

    def step(self) -> float:
        """Usual difference between stamps; NaN if there is none.

        Of stamps with a coarse digit some are alike, others a digit apart: their mean.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            steps = np.diff(self.values)
        if not len(steps) or not np.isfinite(steps).all():
            return float("nan")
        median = float(np.median(steps))
        if self.digits[1] < median:
            return median
        return float(np.mean(steps[np.abs(steps - median) <= 1.5 * self.digits[1]]))

    def count(self) -> bool:
        """Whether they are whole numbers, each one more than the last."""
        return bool((np.diff(self.values) == 1).all() and (self.values % 1 == 0).all())


@dataclass(frozen=True, eq=False)
class Grid:
    """Even times, and where on them the samples lie that were written."""

    time_s: np.ndarray  # (n,), even
    rate_hz: float
    samples: slice  # those that were kept
    samples_s: np.ndarray  # (n_kept,), their times
    findings: tuple[Finding, ...]

    def from_time(self, first_s: float) -> Grid:
        """The same, beginning at another time."""
        shift_s = first_s - self.time_s[0]
        return replace(self, time_s=self.time_s + shift_s, samples_s=self.samples_s + shift_s)


def in_seconds(stamps: Stamps, rates_hz: Sequence[float], findings: list[Finding]) -> Stamps | None:
    """Stamps in seconds, where they are written in ms, microseconds or as numbers of frames.

    ``rates_hz`` are the rates that the file states, the likeliest first. What gives a stated rate
    is taken; else seconds, unless they were more than any recording's steps. None: they count
    frames, and no rate is stated. What is done is added to ``findings``.
    """
    step = stamps.step()
    stated = [rate for rate in rates_hz if np.isfinite(rate) and rate > 0]
    sizes = {"s": 1.0, **UNITS_S}
    are_whole = bool((stamps.values % 1 == 0).all())
    counts = {rate: 1 / rate for rate in stated} if are_whole else {}
    for name, size in (sizes | counts).items() if stated else ():
        room_s = max(_AGREE / stated[0], stamps.digits[1] * size / 2)
        if abs(step * size - 1 / stated[0]) <= room_s:
            return _as_unit(stamps, name, size, findings)
    if not step >= _LONGEST_STEP_S:
        return stamps
    if stamps.count():
        return _as_unit(stamps, stated[0], 1 / stated[0], findings) if stated else None
    name = next((name for name, size in UNITS_S.items() if step * size < _LONGEST_STEP_S), "s")
    return _as_unit(stamps, name, UNITS_S.get(name, 1.0), findings)


def counted(stamps: Stamps, rates_hz: Sequence[float], findings: list[Finding]) -> Stamps:
    """Times from the first stated rate, where all stamps (n,) are alike, and that is said."""
    rate_hz = next((rate for rate in rates_hz if np.isfinite(rate) and rate > 0), 0.0)
    if not rate_hz or len(stamps.values) < 2 or (stamps.values != stamps.values[0]).any():
        return stamps
    found = f"all {len(stamps.values)} time stamps are {stamps.values[0]:g}"
    action = f"took {rate_hz:g} Hz, as the header says, and its number of frames"
    findings.append(Finding("time", "", found, "increasing times", action, "warning"))
    return Stamps(np.arange(len(stamps.values)) / rate_hz)


def _as_unit(stamps: Stamps, name: str | float, size_s: float, findings: list[Finding]) -> Stamps:
    """In seconds, and what was done; a rate as name: they count frames."""
    if name == "s":
        return stamps
    if isinstance(name, str):
        findings.append(about_unit(f"in {name}", f"read them in {name}"))
        return stamps.times(size_s)
    first = float(stamps.values[0] >= 1)  # frames counted from 1 begin at 0 s
    action = f"took frame {first:g} as 0 s and {name:g} Hz"
    findings.append(about_unit("that count frames", action))
    return replace(stamps.times(size_s, first), digits=(0.0, 0.0), unit=FRAMES)


def about_unit(found: str, action: str, what: str = "time stamps") -> Finding:
    """That times, or ``what`` else, are not in seconds, and the ``action`` that corrects it."""
    return Finding("time", "", f"{what} {found}", "times in s", action, "corrected")


def even_grid(
    stamps: Stamps, rates_hz: Sequence[float] = (), base_hz: float = float("nan")
) -> Grid | None:
    """The even grid of stamps in seconds (n,); torn stamps give their longest stretch.

    Stamps that lie within half of their last digit of even times are even: at the first rate that
    is stated, if it does, else at their own. ``rates_hz`` as for `in_seconds`; their own is likely
    a multiple of ``base_hz``. None if the stamps do not increase, are faster than ``MOST_HZ``, or
    so uneven that the grid would have more times than their largest steps allow.
    """
    step_s = stamps.step()
    if not step_s > 0 or 1 / step_s > MOST_HZ:
        return None
    stated_hz = next((rate for rate in rates_hz if np.isfinite(rate) and rate > 0), float("nan"))
    steps = np.diff(stamps.values)
    start, stop = _longest_stretch(steps, step_s, stamps.digits[1])
    if stop - start < 2:
        return None
    findings: list[Finding] = []
    if stop - start < len(stamps.values):
        found = f"time stamps with a step of {steps.max():.3g} s (least {steps.min():.3g} s)"
        expected = f"even steps of {np.median(steps):.4g} s"
        action = f"kept the longest stretch, samples {start + 1} to {stop} of {len(steps) + 1}"
        findings.append(Finding("time", "", found, expected, action, "warning"))
    kept = replace(stamps, values=stamps.values[start:stop])
    samples_s = kept.values
    if (printed := _printed_rate(kept, rates_hz, base_hz)) is not None:
        rate_hz, first_s = printed
        time_s = samples_s = first_s + np.arange(stop - start) / rate_hz
    elif not np.median(np.diff(samples_s)) > 0:
        return None
    else:
        rate_hz, time_s = _uneven_times(samples_s, stated_hz, findings)
    if len(time_s) > _JUMP * len(samples_s) + 1 or rate_hz > MOST_HZ:
        return None
    if np.isfinite(stated_hz) and abs(rate_hz / stated_hz - 1) > _AGREE * _NEAR:
        found = f"the header says {stated_hz:g} Hz, the time stamps {rate_hz:.4g} Hz"
        action = "took the time stamps"
        findings.append(Finding("rate", "points", found, "one rate", action, "warning"))
    return Grid(time_s, rate_hz, slice(start, stop), samples_s, tuple(findings))


def onto_grid(grid: Grid, values: np.ndarray, time_s: np.ndarray | None = None) -> np.ndarray:
    """Values (n, ...) at the grid's times, or at other even ones of its rate.

    They are copied where they lie on these times, else interpolated. Times outside the stamps and
    beside a NaN become NaN.
    """
    values, stamps_s = values[grid.samples], grid.samples_s
    time_s = grid.time_s if time_s is None else time_s
    nearest = np.clip(np.searchsorted(stamps_s, time_s), 1, len(stamps_s) - 1)
    left_is_nearer = time_s - stamps_s[nearest - 1] < stamps_s[nearest] - time_s
    nearest = nearest - left_is_nearer
    off = np.abs(stamps_s[nearest] - time_s) * grid.rate_hz
    if off.max() <= _SAME:
        is_all = np.array_equal(nearest, np.arange(len(values)))
        return values if is_all else values[nearest]
    flat = values.reshape(len(values), -1)
    lines = [np.interp(time_s, stamps_s, column, np.nan, np.nan) for column in flat.T]
    result = np.column_stack(lines)
    exact = off <= _EXACT
    result[exact] = flat[nearest[exact]]
    return result.reshape(len(time_s), *values.shape[1:])


def _printed_rate(
    stamps: Stamps, rates_hz: Sequence[float], base_hz: float
) -> tuple[float, float] | None:
    """Rate and first time of even times that are printed as the stamps; None if there are none.

    With all digits that are printed first, then with those that are used.
    """
    stamps_s = stamps.values
    for digit in stamps.digits:
        room = _ROOM * digit + 4 * np.spacing(np.abs(stamps_s).max())
        if 2 * room > stamps_s[-1] - stamps_s[0]:
            continue  # hardly a step in all of it
        for rate_hz in chain(rates_hz, _simple_rates(stamps_s, room, base_hz)):
            if rate_hz > 0 and _spread(stamps_s, 1 / rate_hz) <= room:
                own = stamps_s - np.arange(len(stamps_s)) / rate_hz
                # The first stamp, unless half a digit of the others forbids.
                low, high = own.max() - room / 2, own.min() + room / 2
                first = np.clip(stamps_s[0], low, high) if low <= high else own.mean()
                return float(rate_hz), float(first)
    return None


def _spread(stamps_s: np.ndarray, period_s: float) -> float:
    """By how much the stamps leave even times of this period."""
    return float(np.ptp(stamps_s - np.arange(len(stamps_s)) * period_s))


def _simple_rates(stamps_s: np.ndarray, room_s: float, base_hz: float) -> Iterator[float]:
    """Rates of the stamps, the likeliest first: multiples of a known one, whole Hz, NTSC, any."""
    n = len(stamps_s) - 1
    own_s = float(stamps_s[-1] - stamps_s[0]) / n
    bounds = (max(own_s - room_s / n, 0.5 * own_s), own_s + room_s / n)
    found = minimize_scalar(
        lambda period: _spread(stamps_s, period), bounds=bounds, options={"xatol": 1e-9 * own_s}
    )
    rate_hz = 1 / float(found.x)
    if base_hz > 0:
        yield base_hz * round(rate_hz / base_hz)
    yield float(round(rate_hz))
    yield round(1.001 * rate_hz) / 1.001
    if round(1000 / rate_hz):
        yield 1000 / round(1000 / rate_hz)
    yield round(rate_hz, 1)
    yield rate_hz


def _uneven_times(
    stamps_s: np.ndarray, stated_hz: float, findings: list[Finding]
) -> tuple[float, np.ndarray]:
    """Rate and even times of stamps with jitter, and what is said of it.

    The stated rate if the stamps agree within 1 %, else their own.
    """
    steps = np.diff(stamps_s)
    rate_hz = 1 / float(np.median(steps))
    if stated_hz > 0 and abs(rate_hz / stated_hz - 1) < _NEAR:
        rate_hz = stated_hz
    else:
        if np.ptp(steps) < np.median(steps):
            rate_hz = 1 / float(np.mean(steps))
        if abs(rate_hz - round(rate_hz)) < 1e-4 * rate_hz:
            rate_hz = float(round(rate_hz))
    jitter = np.abs(stamps_s - stamps_s[0] - np.arange(len(stamps_s)) / rate_hz).max() * rate_hz
    if jitter > _JITTER:
        rate_hz = float(1 / np.median(steps))
        most_ms, least_ms = 1e3 * steps.max(), 1e3 * steps.min()
        found = f"uneven time stamps, steps of {least_ms:.3g} to {most_ms:.3g} ms"
        action = f"interpolated at {rate_hz:.4g} Hz"
        findings.append(Finding("time", "", found, "even steps", action, "corrected"))
    n = int(np.floor((stamps_s[-1] - stamps_s[0]) * rate_hz + _SAME)) + 1
    most = int(_JUMP * len(stamps_s)) + 2  # one more than `even_grid` allows
    return rate_hz, stamps_s[0] + np.arange(min(n, most)) / rate_hz


def _longest_stretch(steps: np.ndarray, step_s: float, digit_s: float) -> tuple[int, int]:
    """Start and stop (exclusive) of the longest stretch without a jump or a step back.

    Stamps with a digit coarser than the step may be alike.
    """
    alike = steps < 0 if digit_s >= 0.5 * step_s else steps <= 0
    torn = np.flatnonzero((steps > _JUMP * step_s + digit_s) | alike)
    edges = np.concatenate([[0], torn + 1, [len(steps) + 1]])
    longest = int(np.argmax(np.diff(edges)))
    return int(edges[longest]), int(edges[longest + 1])
