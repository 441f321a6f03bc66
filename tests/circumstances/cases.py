"""The recordings of ../shared/cases as users have them, and what its right.md asks of each."""

from __future__ import annotations

import re
import resource
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from tests.circumstances.comparison import compare
from tests.circumstances.judge import GRAVITY, NAMES
from tests.circumstances.sound import Trial
from tests.circumstances.taken import Taken, TakenTrial, ingest

_PLACES = [folder / "shared" / "cases" for folder in Path(__file__).parents[3:]]
CASES = next((place for place in _PLACES if place.is_dir()), _PLACES[0])
MASS_KG = 50.25
PERSON = "sub-01"
LONGEST_S, LARGEST_KB = 30.0, 2_000_000
SUM_WORDS = r"\bsum\b|virtual|combined|twice|cop(y|ies)|same load|counted"


@dataclass(frozen=True, eq=False)
class Case:
    """What bsip made of a case, and the truth by trial."""

    taken: Taken
    truth: dict[str, Trial]
    seconds: float

    def wrong(self) -> dict[str, str]:
        """Quantities whose numbers are wrong, of the trials of which forces are passed on."""
        found: dict[str, str] = {}
        for name, trial in self.taken.trials.items():
            for quantity, text in _compared(trial, self.truth[name]).wrong.items():
                found.setdefault(quantity, f"{name}: {text}")
        return found

    def is_whole(self) -> bool:
        """Markers and forces of every trial are passed on."""
        return bool(self.taken.trials) and all(
            _compared(trial, self.truth[name]).is_whole for name, trial in self.taken.trials.items()
        )

    def says(self, pattern: str) -> bool:
        """A word that is more than information matches."""
        words = [w.text for w in self.taken.words if w.level != "info"]
        return any(re.search(pattern, text, re.I) for text in words)


def _compared(taken: TakenTrial, truth: Trial):
    labels = tuple(sorted(taken.markers_m))
    lost = np.zeros(truth.markers_m.shape[:2], bool)
    return compare(taken, truth, labels, lost, MASS_KG * GRAVITY)


def run(name: str) -> Case:
    """`bsip ingest` of a case."""
    truth = references()
    started = time.monotonic()
    return Case(_ingested(name), truth, time.monotonic() - started)


def _ingested(name: str) -> Taken:
    with tempfile.TemporaryDirectory() as out:
        return ingest(CASES / name / "study", Path(out))[PERSON]


@cache
def references() -> dict[str, Trial]:
    """Trials of the sound recordings, as read; what C3D has is taken from there."""
    text, c3d = _ingested("00-reference-trc-mot"), _ingested("00c-reference-c3d")
    return {name: _as_truth(name, trial) for name, trial in (text.trials | c3d.trials).items()}


def _as_truth(name: str, taken: TakenTrial) -> Trial:
    plates = np.stack(list(taken.plates.values()), axis=1)
    markers = [taken.markers_m[marker] for marker in sorted(taken.markers_m)]
    return Trial(
        name=name,
        time_s=taken.time_s,
        markers_m=np.stack(markers, axis=1),
        analog_s=taken.time_s,
        force_N=plates[..., :3],
        moment_Nm=plates[..., 3:],
        measured_share=float(taken.valid.mean()),
    )


# What right.md asks; each answers with a complaint, or nothing.


def read_right(case: Case) -> str:
    if case.taken.exit_code:
        return f"exit code {case.taken.exit_code}"
    wrong = case.wrong()
    if wrong:
        return "; ".join(wrong.values())
    return "" if case.is_whole() else "not all trials have forces"


def right_and_said(pattern: str) -> Callable[[Case], str]:
    def check(case: Case) -> str:
        complaint = read_right(case)
        return complaint or ("" if case.says(pattern) else f"no word of {pattern}")

    return check


def right_or_said(pattern: str) -> Callable[[Case], str]:
    def check(case: Case) -> str:
        complaint = read_right(case)
        return complaint if complaint and not case.says(pattern) else ""

    return check


def right_and_said_or_refused(pattern: str) -> Callable[[Case], str]:
    """Refused: no force is passed on, and the words say why."""

    def check(case: Case) -> str:
        has_force = any(_has_force(trial) for trial in case.taken.trials.values())
        if not has_force and case.says(pattern):
            return ""
        return right_and_said(pattern)(case)

    return check


def _has_force(trial: TakenTrial) -> bool:
    return bool((trial.valid & (np.abs(trial.wrench[:, 2]) > 50.0)).any())


def no_frame_lost(case: Case) -> str:
    for name, trial in case.taken.trials.items():
        found, expected = trial.valid.mean(), case.truth[name].measured_share
        if found < expected - 0.01:
            return f"{name}: {found:.0%} of the frames valid, {expected:.0%} in the reference"
    return read_right(case)


def at_rate(rate_hz: float, squat_frames: int) -> Callable[[Case], str]:
    def check(case: Case) -> str:
        for name, trial in case.taken.trials.items():
            found = 1.0 / np.median(np.diff(trial.time_s))
            if abs(found / rate_hz - 1.0) > 0.002:
                return f"{name}: {found:.2f} Hz"
        squat = case.taken.trials.get("task-squat_run-1")
        if squat is None:
            return "no squat"
        frames = len(squat.time_s)
        return "" if abs(frames - squat_frames) <= 1 else f"{frames} frames of {squat_frames}"

    return check


def cheap_and_rate_believed(case: Case) -> str:
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    if case.seconds > LONGEST_S or memory > LARGEST_KB:
        return f"{case.seconds:.0f} s, {memory / 1e6:.1f} GB"
    if not case.taken.trials:
        return "" if case.says(NAMES["rate"]) else "refused without a word of the time"
    stated = 1.0 / np.median(np.diff(next(iter(case.taken.trials.values())).time_s))
    return "" if 10.0 < stated < 1000.0 else f"{stated:.3g} Hz"


def no_slip(case: Case) -> str:
    return "said to have slipped" if case.says("slip") else read_right(case)


def pounds_first(case: Case) -> str:
    lines = [w.text for w in case.taken.words if w.level == "printed"]
    if case.says("seat, box, hands"):
        return "told as a contact that the plates miss"
    # The number of the plates is asked for; what the pounds come to in kg is nearly the same.
    named = bool(lines) and "110.9" in lines[0] and re.search(r"plates\D*50\.\d", lines[0])
    return "" if named else f"first line: {lines[:1]}"


def no_pressure_without_point(case: Case) -> str:
    passed = [name for name, trial in case.taken.trials.items() if _has_force(trial)]
    if not case.says(r"(no|without|missing|not|lack).*(point|pressure|moment)"):
        return "no word of the missing points"
    return f"{passed} with forces at no place" if passed else ""


def residuals_named(case: Case) -> str:
    if case.says("none of the marker set's labels"):
        return "no label fits"
    return "" if case.says("residual|invalid") else "no word of the residuals"


CHECKS: dict[str, Callable[[Case], str]] = {
    "00-reference-trc-mot": read_right,
    "00c-reference-c3d": read_right,
    "01-mot-cop-beside-plate-moments": right_and_said_or_refused(r"moment|torque"),
    "02a-adapter-mm-Nmm-cop": read_right,
    "03-mot-nan-cop-when-unloaded": no_frame_lost,
    "05a-type2-Nm-blank-units": right_or_said(r"moment"),
    "07-combined-virtual-plate": right_and_said(SUM_WORDS),
    "09-cortex-unnamed-trajectories": read_right,
    "10a-trc-time-2-decimals-120Hz": at_rate(120.0, 406),
    "10g-trc-time-in-ms-long": cheap_and_rate_believed,
    "10h-trc-time-3-decimals-240Hz": at_rate(240.0, 360),
    "12-missing-as-minus-16512": no_slip,
    "13-left-handed-export": right_or_said(NAMES["handedness"]),
    "14b-trc-inches": right_or_said(r"tall|statur|height"),
    "15g-mass-lb": pounds_first,
    "15i-sex-female": read_right,
    "15l-trailing-empty-lines": read_right,
    "19d-mot-forces-only-person-at-lab-origin": no_pressure_without_point,
    "20f-MOT-uppercase": read_right,
    "23-all-residuals-minus-one": residuals_named,
    "25-origin-is-place-in-lab": right_or_said("ORIGIN"),
    "26b-corners-turned-180": right_and_said(r"turn|corner"),
    "27-underscore-prefix": read_right,
}


def complaint(name: str) -> str:
    """What is not as right.md asks; a bug is right nowhere, whatever else is said."""
    case = run(name)
    return "a bug of bsip" if case.taken.exit_code == 1 else CHECKS[name](case)
