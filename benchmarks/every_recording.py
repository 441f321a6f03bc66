"""A table of every recording in a folder: what was read, corrected and refused, and the mass.

    python -m benchmarks.every_recording ../shared/data --write

The standing mass is compared with the sum of the plates as the file's own numbers give it without
any correction: by ezc3d for C3D files, by the vertical columns for TRC with MOT and for CSV.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

import ezc3d
import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from benchmarks.measure import RESULTS, markdown, write_csv
from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.errors import BadDataError
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.mot import read_mot
from bsip_cli.recordings.plate_wrench import plates_at_marker_rate, sample_at_frames
from bsip_cli.recordings.read import read_recording
from tests.real.figaroh_csv import convert

FILE = RESULTS / "real_every_recording.csv"
_PAIRS = {"squat2_pig61/markers.trc": "squat2_pig61/grf.mot"}  # names that do not belong together
_NO_RECORDING = {"q+Forces_sampled_30Hz_filtered.csv": "joint coordinates, no markers"}
_HEAD = (
    "recording",
    "read",
    "corrected, marked, left out",
    "frames weighed",
    "bsip [kg]",
    "alone [kg]",
    "difference",
)
_MOST_FINDINGS = 6


@dataclass(frozen=True)
class Weighed:
    """Mean vertical force of all plates over g in the same frames, by bsip and as written."""

    is_standing: bool
    own_kg: float
    alone_kg: float
    reversed_kg: float  # as written, but for the signs that bsip reversed
    fault: str = ""  # why there is no comparison

    def difference_percent(self) -> float:
        return 100 * (self.own_kg / self.reversed_kg - 1)

    def cells(self) -> tuple[str, str, str, str]:
        frames = "standing" if self.is_standing else "all"
        own = f"{self.own_kg:.2f}"
        if not np.isfinite(self.alone_kg):
            return frames, own, self.fault, ""
        alone = f"{self.alone_kg:.2f}"
        if self.reversed_kg != self.alone_kg:
            alone += f" ({self.reversed_kg:.2f} reversed)"
        return frames, own, alone, f"{self.difference_percent():+.2f} %"


@dataclass(frozen=True)
class Row:
    """One recording."""

    name: str
    read: str
    findings: str
    weighed: Weighed | None = None

    def cells(self) -> tuple[str, ...]:
        weighed = self.weighed.cells() if self.weighed else ("", "", "", "")
        return self.name, self.read, self.findings, *weighed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--write", action="store_true", help=f"into {FILE.name}")
    arguments = parser.parse_args()
    rows = all_rows(arguments.data)
    cells = [row.cells() for row in rows]
    print(f"{summary(rows)}\n\n{markdown(_HEAD, cells)}")
    if arguments.write:
        write_csv(FILE, _HEAD, cells)


def all_rows(data: Path) -> list[Row]:
    """A row for each C3D, TRC and CSV file, in the order of their names."""
    paths = [p for p in sorted(data.rglob("*")) if p.suffix.lower() in (".c3d", ".trc", ".csv")]
    with tempfile.TemporaryDirectory() as scratch:
        return [_row(path, data, Path(scratch)) for path in paths]


def summary(rows: list[Row]) -> str:
    """In a sentence what they come to."""
    refused = sum(row.read == "refused" for row in rows)
    standing = [row.weighed for row in rows if row.weighed and row.weighed.is_standing]
    gaps = [abs(one.difference_percent()) for one in standing if np.isfinite(one.alone_kg)]
    return (
        f"{len(rows)} files, {refused} refused. Quiet standing in {len(standing)}; in "
        f"{sum(gap < 1 for gap in gaps)} of the {len(gaps)} that can be compared bsip's mass is "
        f"within 1 % of the other (largest difference {max(gaps, default=0):.2f} %)."
    )


def _row(path: Path, data: Path, scratch: Path) -> Row:
    name = str(path.relative_to(data))
    if path.name in _NO_RECORDING:
        return Row(name, "no recording", _NO_RECORDING[path.name])
    try:
        recording = read_recording(_prepared(path, name, data, scratch))
    except BadDataError as error:
        said = BadDataError(error.found, expected=error.expected, remedy=error.remedy)
        return Row(name, "refused", str(said))
    return Row(name, _what(recording), _found(recording), _weigh(recording))


def _prepared(path: Path, name: str, data: Path, scratch: Path) -> Path:
    """The file itself, a pair under one name, or a CSV turned into TRC with MOT."""
    if path.suffix.lower() == ".csv":
        stem = scratch / path.stem
        convert(path, stem)
        return stem.with_suffix(".trc")
    if name in _PAIRS:
        shutil.copy(path, scratch / "pair.trc")
        shutil.copy(data / _PAIRS[name], scratch / "pair.mot")
        return scratch / "pair.trc"
    return path


def _still(force_N: np.ndarray, usable: np.ndarray, rate_hz: float) -> np.ndarray:
    """Frames about which the force stays within 3 % of its middle for 0.8 s, (n,) bool."""
    smooth = uniform_filter1d(np.where(usable, force_N, 0.0), max(1, round(0.1 * rate_hz)))
    width = max(1, round(0.8 * rate_hz))
    high, low = maximum_filter1d(smooth, width), minimum_filter1d(smooth, width)
    return usable & (low > 100.0) & (high - low < 0.06 * high)


def _weigh(recording: Recording) -> Weighed | None:
    """Both readings over the frames of quiet standing, else over all usable ones."""
    plates = plates_at_marker_rate(recording)
    usable = np.all([plate.usable for plate in plates], axis=0)
    if not plates or not usable.any():
        return None
    own = np.sum([plate.lift_N for plate in plates], axis=0)
    still = _still(own, usable, recording.marker_rate_hz)
    frames = still if still.any() else usable
    own_kg = float(own[frames].mean()) / GRAVITY_M_S2
    try:
        plates_N, rate_hz = _uncorrected(recording)
    except (OSError, RuntimeError, ValueError) as error:
        fault = f"ezc3d: {str(error).strip()[:60]}"
        return Weighed(bool(still.any()), own_kg, np.nan, np.nan, fault)
    signs = [-1.0 if name in _reversed(recording) else 1.0 for name in plates_N]
    good = np.isfinite(list(plates_N.values())).all(axis=0)
    forces = np.where(good, list(plates_N.values()), 0.0).T
    at_frames, known = sample_at_frames(
        forces, good, rate_hz, recording.marker_rate_hz, recording.n_frames
    )
    at_frames = at_frames[frames & known] / GRAVITY_M_S2
    alone_kg = float(at_frames.sum(axis=1).mean())
    reversed_kg = float((at_frames * signs).sum(axis=1).mean())
    return Weighed(bool(still.any()), own_kg, alone_kg, reversed_kg)


def _reversed(recording: Recording) -> set[str]:
    """Names of the plates whose sign was reversed."""
    return {
        finding.subject
        for finding in recording.findings
        if finding.check == "plate_sign" and finding.level == "corrected"
    }


def _uncorrected(recording: Recording) -> tuple[dict[str, np.ndarray], float]:
    """Vertical force of each plate as written, and its rate."""
    up = recording.rotation_world_lab[2]
    if recording.path.suffix.lower() == ".c3d":
        content = ezc3d.c3d(str(recording.path), extract_forceplat_data=True)
        forces = [up @ plate["force"] for plate in content["data"]["platform"]]
        rate_hz = float(content["parameters"]["ANALOG"]["RATE"]["value"][0])
        if rate_hz <= 0 or content["data"]["points"].shape[2] != recording.n_frames:
            raise ValueError("reads other counts")
    else:
        beside = (recording.path.with_suffix(".mot"), _grf(recording.path))
        mot = read_mot(next(path for path in beside if path.is_file()))
        forces = [force.force_N @ up for force in mot.forces]
        rate_hz = 1 / float(np.median(np.diff(mot.stamps.values)))
    return {str(k + 1): force for k, force in enumerate(forces)}, rate_hz


def _grf(path: Path) -> Path:
    return path.with_name(f"{path.stem}_grf.mot")


def _what(recording: Recording) -> str:
    text = (
        f"{len(recording.labels)} markers, {recording.n_frames} frames at "
        f"{recording.marker_rate_hz:.4g} Hz"
    )
    if not recording.plates:
        return f"{text}; no forces: {recording.forces_note}"
    usable = np.mean([plate.usable.mean() for plate in recording.plates])
    return (
        f"{text}; {len(recording.plates)} plates at {recording.analog_rate_hz:.4g} Hz, "
        f"{100 * usable:.0f} % usable"
    )


def _found(recording: Recording) -> str:
    said: dict[str, list[str]] = {}
    for finding in recording.findings:
        if finding.level != "info":
            words = f"{finding.check.replace('_', ' ')}: {finding.found}; {finding.action}"
            said.setdefault(words, []).append(finding.subject)
    parts = [
        f"{words} (plate {', '.join(subjects)})" if all(s.isdigit() for s in subjects) else words
        for words, subjects in said.items()
    ]
    more = f"; {len(parts) - _MOST_FINDINGS} more" if len(parts) > _MOST_FINDINGS else ""
    return "; ".join(parts[:_MOST_FINDINGS]).replace("|", "/") + more


if __name__ == "__main__":
    main()
