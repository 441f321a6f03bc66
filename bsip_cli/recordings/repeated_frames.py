"""Frames that the camera system lost and filled with the one before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bsip_cli.recordings.analog import runs
from bsip_cli.recordings.held_markers import held_markers
from bsip_cli.recordings.model import Finding, Recording

_NEARLY_ALL = 0.9  # of the markers seen in both frames
_LEAST_MARKERS = 4
_CLEARLY_M = 1e-4  # median step of the markers beside the repeats: still ones may be quantised
_SPANS_TOLD = 5


def repeated_frames(markers_m: np.ndarray) -> np.ndarray:
    """Which markers (n_frames, n_markers, 3) repeat their last position to the bit, bool.

    Only in frames in which nearly all do so at once, and only where nearly all moved clearly from
    the frame before the repeats and into the one after: quantised markers of a person who stands
    still repeat themselves too. At the ends of a trial one side is enough.
    """
    same = np.zeros(markers_m.shape[:2], bool)
    if len(markers_m) < 3:
        return same
    seen = np.isfinite(markers_m).all(axis=-1)
    both = seen[1:] & seen[:-1]
    same[1:] = (markers_m[1:] == markers_m[:-1]).all(axis=-1) & both
    n_both = both.sum(axis=1)
    enough = n_both >= _LEAST_MARKERS
    frozen = np.concatenate([[False], enough & (same[1:].sum(axis=1) >= _NEARLY_ALL * n_both)])
    moving = np.concatenate([[False], _moving(markers_m, both, enough)])
    lost = np.zeros(len(markers_m), bool)
    for start, stop in runs(frozen):
        beside = [moving[frame] for frame in (start - 1, stop) if 0 < frame < len(moving)]
        lost[start:stop] = bool(beside) and all(beside)
    return same & lost[:, None]


def without_repeats(recording: Recording) -> tuple[Recording, list[Finding]]:
    """The recording with repeated positions as gaps, and lines that say how many and when.

    Of all markers at once, and of single ones that are held while others move.
    """
    markers, findings = recording.markers_m, []
    repeated = repeated_frames(markers)
    if repeated.any():
        findings.append(_about_frames(recording, np.any(repeated, axis=1)))
        markers = np.where(repeated[..., None], np.nan, markers)
    held = held_markers(markers)
    if held.any():
        findings.append(_about_markers(recording, held))
        markers = np.where(held[..., None], np.nan, markers)
    return (replace(recording, markers_m=markers) if findings else recording), findings


def _about_frames(recording: Recording, frames: np.ndarray) -> Finding:
    return Finding(
        check="repeated_frames",
        subject="",
        found=f"{frames.sum()} of {len(frames)} frames repeat the one before to the last digit, "
        f"at {_spans(recording, frames)}",
        expected="a new picture in every frame of a person who moves",
        action="took them for gaps",
        level="corrected",
    )


def _about_markers(recording: Recording, held: np.ndarray) -> Finding:
    own = np.flatnonzero(held.any(axis=0))
    told = [f"{recording.labels[k]} at {_spans(recording, held[:, k])}" for k in own[:_SPANS_TOLD]]
    more = f" and {len(own) - _SPANS_TOLD} more markers" if len(own) > _SPANS_TOLD else ""
    return Finding(
        check="held_markers",
        subject=", ".join(recording.labels[k] for k in own),
        found=f"{held.sum()} positions repeat the last one to the last digit while the markers "
        f"around move: {'; '.join(told)}{more}",
        expected="gaps where a marker was not seen",
        action="took them for gaps",
        level="corrected",
    )


def _spans(recording: Recording, frames: np.ndarray) -> str:
    """When the frames are, in seconds."""
    spans, times = runs(frames), recording.time_s()
    told = [_span(times[start], times[stop - 1]) for start, stop in spans[:_SPANS_TOLD]]
    more = f" and {len(spans) - _SPANS_TOLD} more times" if len(spans) > _SPANS_TOLD else ""
    return f"{', '.join(told)} s{more}"


def _moving(markers_m: np.ndarray, both: np.ndarray, enough: np.ndarray) -> np.ndarray:
    """Steps between frames (n_frames - 1,) in which nearly all markers move clearly, bool."""
    step = np.where(both, np.linalg.norm(np.diff(markers_m, axis=0), axis=-1), np.nan)
    moving = np.zeros(len(step), bool)
    changed = (step > 0).sum(axis=1) >= _NEARLY_ALL * both.sum(axis=1)
    moving[enough] = changed[enough] & (np.nanmedian(step[enough], axis=1) > _CLEARLY_M)
    return moving


def _span(first_s: float, last_s: float) -> str:
    return f"{first_s:.2f}" if first_s == last_s else f"{first_s:.2f} to {last_s:.2f}"
