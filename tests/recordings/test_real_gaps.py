"""Gaps cut into real recordings are filled near to what was measured there."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.body.markersets import load_marker_set
from bsip_cli.recordings.gaps import fill_gaps
from bsip_cli.recordings.labels import match_labels
from bsip_cli.recordings.read import read_recording

pytestmark = pytest.mark.real


def _worst_mm(path, length_s: float, by_segment: bool) -> float:
    """Median over 40 gaps of the largest error within each."""
    recording, marker_set = read_recording(path), load_marker_set("opencap_subject4")
    match = match_labels(recording.labels, marker_set.wanted())
    members = [m for m in marker_set.markers if m.label in match.index]
    truth = recording.markers_m[:, [match.index[m.label] for m in members]]
    groups = [
        [k for k, m in enumerate(members) if m.segment == segment]
        for segment in dict.fromkeys(m.segment for m in members)
    ]
    mated = [k for group in groups if len(group) > 3 for k in group]
    rng, frames = np.random.default_rng(3), round(length_s * recording.marker_rate_hz)
    errors = []
    for _ in range(40):
        k, start = rng.choice(mated), rng.integers(20, len(truth) - frames - 20)
        part = slice(start, start + frames)
        holed = truth.copy()
        holed[part, k] = np.nan
        limits = (0.0, 1.0) if by_segment else (1.0, 0.0)
        filled = fill_gaps(holed, recording.marker_rate_hz, groups, *limits)
        if filled.filled[part, k].all():
            errors.append(1000 * np.linalg.norm(filled.markers_m - truth, axis=-1)[part, k].max())
    assert len(errors) > 10
    return float(np.median(errors))


def test_short_gaps_by_spline(real_data):
    assert _worst_mm(real_data / "opencap_subject4/squats1.trc", 0.1, by_segment=False) < 2


def test_longer_gaps_by_the_segment(real_data):
    assert _worst_mm(real_data / "opencap_subject4/squats1.trc", 0.5, by_segment=True) < 5


def test_why_the_spline_ends_early(real_data):
    """Half a second of a drop jump is beyond a spline, not beyond the segment."""
    path = real_data / "opencap_subject4/DJ1.trc"
    assert _worst_mm(path, 0.5, by_segment=False) > 20
    assert _worst_mm(path, 0.5, by_segment=True) < 8
