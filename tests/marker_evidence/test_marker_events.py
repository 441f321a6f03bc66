"""Bad markers put into a recording are named with time and size, and nothing else is."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bsip_cli.motion import marker_evidence
from bsip_cli.motion.marker_events import MarkerEvent, offsets, summaries
from tests.marker_evidence.swinging_markers import (
    MARKERS,
    events_of,
    fitted,
    markers_on,
    recording,
)

START, STOP = 160, 175  # frames: 3.2 to 3.5 s


def moved(seed: int, label: str, size_m: float, frames: slice, direction=(1.0, 1.0, 0.5)):
    """The recording with one marker moved along a direction of its segment."""
    times, clean, turns = recording(seed)
    markers, m = clean.copy(), MARKERS.index(label)
    along = np.array(direction) / np.linalg.norm(direction)
    markers[frames, m] += size_m * turns[frames, m] @ along
    return times, markers


def only(events: tuple[MarkerEvent, ...]) -> MarkerEvent:
    assert len(events) == 1, [one.sentence for one in events]
    return events[0]


@pytest.mark.parametrize("seed", range(6))
def test_skin_that_follows_the_joints_by_15_mm_is_no_event(seed):
    assert events_of(*recording(seed)[:2]) == ()


@pytest.mark.parametrize("label", ["RASIS", "LKNEL", "RMALL", "LELB", "RTEM", "XIPH"])
def test_a_slip_of_15_mm(label):
    event = only(events_of(*moved(1, label, 0.015, slice(START, None))))
    assert (event.kind, event.marker, event.partner) == ("slip", label, "")
    assert event.start_s == pytest.approx(3.2, abs=0.06)
    assert event.end_s == pytest.approx(7.98)
    assert event.size_m == pytest.approx(0.015, abs=0.005)
    assert f"{label} slips" in event.sentence


@pytest.mark.parametrize(("seed", "label"), [(1, "RKNEM"), (2, "RASIS"), (3, "LMALL")])
def test_a_small_slip_is_none(seed, label):
    assert events_of(*moved(seed, label, 0.003, slice(START, None))) == ()


@pytest.mark.parametrize("label", ["RKNEL", "LHAND", "T10"])
def test_a_ghost_of_three_frames(label):
    event = only(events_of(*moved(2, label, 0.06, slice(START, START + 3))))
    assert (event.kind, event.marker) == ("jump", label)
    assert (event.start_s, event.end_s) == pytest.approx((3.20, 3.24))
    assert 0.03 < event.size_m < 0.07


def test_a_ghost_of_a_second_is_a_jump_and_not_two_slips():
    event = only(events_of(*moved(2, "LASIS", 0.04, slice(START, START + 50))))
    assert (event.kind, event.marker) == ("jump", "LASIS")
    assert (event.start_s, event.end_s) == pytest.approx((3.2, 4.2), abs=0.06)


def test_one_of_two_slips_at_the_same_time_that_comes_back(monkeypatch):
    """Other slips of that marker at that time are one, as large as all of them."""
    there, back = np.array([0.03, 0.0, 0.0]), np.array([-0.03, 0.0, 0.0])
    parts = ((STOP, np.array([0.0, 0.03, 0.0])), (STOP + 2, np.array([0.0, 0.0, 0.04])))
    times = ((START, there), *parts, (STOP, back))
    slips = [marker_evidence._Slip(0, frame, vector, 9.0) for frame, vector in times]
    search = SimpleNamespace(
        frames=5,
        left=None,
        changes=lambda: {0: SimpleNamespace(z=9.0)} if slips else {},
        source=lambda *_: (slips.pop(0), None),
        take=lambda *_: None,
        is_shown_by_distances=lambda _: True,
    )
    monkeypatch.setattr(marker_evidence, "_Search", lambda *_: search)
    times_s, markers, _ = recording(2)
    events, _ = marker_evidence.slips(fitted(markers, times_s), np.zeros(0))
    assert [(one.kind, round(one.start_s, 1)) for one in events] == [("jump", 3.2), ("slip", 3.5)]
    assert events[1].size_m == pytest.approx(0.05)


@pytest.mark.parametrize("segment", ["upper_arm_r", "thigh_l", "upper_torso", "lower_torso"])
def test_a_segment_that_moves_in_its_joint_is_no_slip_of_its_markers(segment):
    """Their distances to each other stay."""
    times, clean, turns = recording(4)
    markers = clean.copy()
    for m in (MARKERS.index(label) for label in markers_on(segment)):
        markers[START:, m] += turns[START:, m] @ (0.03, 0.02, 0.03)
    slipped = {one.marker for one in events_of(times, markers) if one.kind == "slip"}
    assert slipped.isdisjoint(markers_on(segment))


def test_a_jump_in_a_filled_gap_says_so_and_a_filled_slip_is_none():
    times, markers = moved(2, "LHAND", 0.05, slice(START, STOP))
    filled = np.zeros(markers.shape[:2], dtype=bool)
    filled[START:STOP, MARKERS.index("LHAND")] = True
    events = [one for one in events_of(times, markers, filled) if one.kind != "jump"]
    assert events == []
    times, markers = moved(2, "LHAND", 0.05, slice(START, START + 4))
    assert "where a gap was filled" in only(events_of(times, markers, filled)).sentence


@pytest.mark.parametrize("label", ["LMALL", "RASIS", "LELB", "IJ"])
def test_an_offset_of_25_mm(label):
    event = only(events_of(*moved(3, label, 0.025, slice(None))))
    assert (event.kind, event.marker) == ("offset", label)
    assert (event.start_s, event.end_s) == pytest.approx((0.0, 7.98))
    assert event.size_m == pytest.approx(0.025, abs=0.006)
    assert event.sentence.endswith("throughout the trial")


def test_a_marker_that_strays_as_far_in_other_trials_sits_in_its_place():
    """A shoulder's skin goes with the arm: nothing is peculiar to this trial."""
    times, markers = moved(3, "LELB", 0.025, slice(None))
    fit = fitted(markers, times)
    assert [one.marker for one in offsets(fit, fit.residual_m)] == ["LELB"]
    fit = replace(fit, strays_m=np.where(np.array(MARKERS) == "LELB", 0.02, 0.0))
    assert offsets(fit, fit.residual_m) == []


def test_an_offset_says_how_rarely_it_is_seen_and_that_it_may_be_another_marker():
    times, markers = moved(3, "RTEM", 0.25, slice(None))
    markers[100:, MARKERS.index("RTEM")] = np.nan
    event = only(events_of(times, markers))
    assert (
        event.kind == "offset" and "the trial (seen in 25 % of it); probably another" in event.what
    )


@pytest.mark.parametrize("label", ["RMT2", "LCAL"])
def test_an_offset_that_the_pose_takes_up(label):
    """Heel and toe alone turn the foot with one of them."""
    event = only(events_of(*moved(3, label, 0.03, slice(None), (0.0, 1.0, 0.0))))
    assert (event.kind, event.marker) == ("offset", label)
    assert event.size_m == pytest.approx(0.03, abs=0.006)


def test_an_offset_that_begins_in_the_trial_is_a_slip():
    times, markers = moved(1, "LMALL", 0.03, slice(START, None))
    fit = fitted(markers, times)
    event = only(tuple(offsets(fit, fit.residual_m)))
    assert (event.kind, event.marker) == ("slip", "LMALL")
    assert event.start_s == pytest.approx(3.2, abs=0.06)


def test_two_events_of_one_trial_are_both_found():
    times, markers = moved(1, "LKNEL", 0.02, slice(START, None))
    other, m = recording(1)[1].copy(), MARKERS.index("RTEM")
    markers[300:303, m] = other[300:303, m] + [0.0, 0.0, 0.05]
    events = events_of(times, markers)
    assert [(one.kind, one.marker) for one in events] == [("slip", "LKNEL"), ("jump", "RTEM")]


def test_missing_markers_and_short_trials_are_borne():
    times, clean, _ = recording(1)
    markers = clean.copy()
    markers[:, MARKERS.index("RFA")] = np.nan
    markers[50:90, MARKERS.index("C7")] = np.nan
    assert events_of(times, markers) == ()
    for frames in (1, 2, 5, 12):
        assert events_of(times[:frames], clean[:frames]) == ()


def test_summaries_gather_the_jumps_of_a_marker_and_count_the_rest():
    def event(kind, marker, start, size):
        return MarkerEvent(kind, marker, "", start, start + 0.1, size, 9.0, f"{marker} {kind}s")

    events = [event("jump", "RCAL", 1.0 + k, 0.01 + 0.001 * k) for k in range(4)]
    events += [event("offset", label, 0.0, 0.03) for label in ("C7", "T10")]
    events += [event("slip", "IJ", 2.0, 0.02)]
    assert summaries(events, 3) == [
        "C7 offsets",
        "T10 offsets",
        "IJ slips",
        "and 1 more, in the report",
    ]
    assert summaries(events, 9)[-1] == "RCAL jumps 4 times, by up to 13 mm, first at 1.00 s"
    assert summaries([], 3) == []
