"""Exchanged labels are corrected where that is clear, and never to the worse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.motion.marker_events import summaries
from bsip_cli.motion.marker_exchange import Exchange, Labelling
from tests.marker_evidence.swinging_markers import (
    MARKERS,
    PERSON,
    exchange,
    fitted,
    judged,
    markers_on,
    recording,
)

OF_MANY = [
    name
    for k, name in enumerate(PERSON.skeleton.segments)
    if 4 <= np.sum(PERSON.marker_segments == k) <= 7
]


def misfit_of(markers: np.ndarray, times: np.ndarray) -> float:
    return fitted(markers, times).misfit_m()


@pytest.mark.parametrize(
    ("a", "b"), [("RKNEL", "RKNEM"), ("LWRR", "LWRU"), ("RELB", "LELB"), ("RTEM", "LTEM")]
)
@pytest.mark.parametrize(
    "frames", [slice(160, 175), slice(160, 205), slice(0, 250), slice(160, None)]
)
def test_a_swap_is_found_and_undone(a, b, frames):
    times, clean, _ = recording(4)
    markers, pair = clean.copy(), [MARKERS.index(a), MARKERS.index(b)]
    exchange(markers, a, b, frames)
    found = judged(times, markers)
    (event,) = found.events
    assert event.kind == "swap" and {event.marker, event.partner} == {a, b}
    first, last = times[frames][0], times[frames][-1]
    assert (event.start_s, event.end_s) == pytest.approx((first, last), abs=0.021)
    apart = np.linalg.norm(clean[frames, pair[0]] - clean[frames, pair[1]], axis=1)
    assert event.size_m == pytest.approx(np.median(apart), rel=0.1)
    assert event.statistic > 2
    assert event.put_right and found.any_corrected()
    assert event.sentence.endswith("; corrected")
    assert np.array_equal(found.markers_m, clean)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("segment", OF_MANY)
def test_a_segment_whose_markers_are_in_another_order_is_put_right(segment, seed):
    """The pose follows labels that are exchanged all together: no pair need show it."""
    times, clean, _ = recording(seed, skin_m=0.003)
    mine = [
        k for k, s in enumerate(PERSON.marker_segments) if PERSON.skeleton.segments[s] == segment
    ]
    other = np.random.default_rng(seed).permutation(mine)
    markers = clean.copy()
    markers[:, mine] = clean[:, other]
    found = judged(times, markers)
    assert np.array_equal(found.markers_m, clean)
    assert all(event.put_right for event in found.events if event.kind == "swap")


def test_across_a_joint_at_a_low_rate():
    """The recording was resampled: at both ends of the swap a frame lies between the two places."""
    times, clean, _ = recording(4)
    markers = clean.copy()
    exchange(markers, "LMALL", "LCAL", slice(160, 205))
    for edge, other in ((159, 160), (205, 204)):
        markers[edge] = 0.6 * markers[edge] + 0.4 * markers[other]
    found = judged(times, markers)
    (event,) = (one for one in found.events if one.kind == "swap")
    assert event.put_right
    inside = slice(160, 205)
    assert np.array_equal(found.markers_m[inside], clean[inside])


def test_swaps_of_any_pair_are_undone_and_none_to_the_worse():
    """Twelve pairs of one segment or of mirrored ones, for a tenth of a second or more."""
    rng = np.random.default_rng(8)
    segments = [PERSON.skeleton.segments[k] for k in PERSON.marker_segments]
    pairs = [
        (a, b)
        for i, a in enumerate(MARKERS)
        for j, b in enumerate(MARKERS[:i])
        if segments[i][:-2] == segments[j][:-2] and segments[i] != "upper_torso"
    ]
    restored = 0
    for k in rng.permutation(len(pairs))[:12]:
        times, clean, _ = recording(int(rng.integers(6)))
        start = int(rng.integers(20, 300))
        markers = clean.copy()
        exchange(markers, *pairs[k], slice(start, start + int(rng.integers(5, 90))))
        found = judged(times, markers)
        assert misfit_of(found.markers_m, times) <= misfit_of(markers, times)
        restored += np.array_equal(found.markers_m, clean)
    assert restored >= 11


def test_swaps_at_two_times_are_both_undone():
    times, clean, _ = recording(2)
    markers = clean.copy()
    exchange(markers, "RKNEL", "RKNEM", slice(60, 100))
    exchange(markers, "RKNEL", "RKNEM", slice(250, 300))
    exchange(markers, "LMALL", "LMALM", slice(80, 140))
    found = judged(times, markers)
    assert [(one.kind, one.put_right) for one in found.events] == [("swap", True)] * 3
    assert np.array_equal(found.markers_m, clean)


@pytest.mark.parametrize("seed", range(3))
def test_right_labels_stay(seed):
    times, clean, _ = recording(seed)
    found = judged(times, clean)
    assert not found.any_corrected()
    assert found.markers_m is clean


@pytest.mark.parametrize("kept", ["", "RUA"])
def test_of_an_exchanged_arm_the_marker_that_kept_its_label_keeps_it(kept):
    times, clean, _ = recording(5)
    right = set(markers_on("upper_arm_r", "forearm_r", "hand_r"))
    assert len(right) == 6
    markers = clean.copy()
    for label in right - {kept}:
        exchange(markers, label, f"L{label[1:]}", slice(None))
    found = judged(times, markers)
    done = [one for one in found.events if one.put_right]
    pairs = {(label, f"L{label[1:]}") for label in right - {kept}}
    assert {(one.marker, one.partner) for one in done} == pairs
    assert np.array_equal(found.markers_m, clean)
    (said,) = summaries(done, 5)
    assert "bear each other's labels throughout the trial" in said
    assert kept or len(done) == len(found.events)


def test_filled_frames_go_with_their_marker():
    """A jump in a gap that was filled under the other label is still one of a filled gap."""
    times, clean, turns = recording(4)
    markers, filled = clean.copy(), np.zeros(clean.shape[:2], dtype=bool)
    m, other = MARKERS.index("RKNEL"), MARKERS.index("RKNEM")
    markers[190:194, m] += 0.06 * turns[190:194, m] @ [1.0, 0.0, 0.0]
    exchange(markers, "RKNEL", "RKNEM", slice(160, 250))
    filled[190:194, other] = True
    jumps = [one for one in judged(times, markers, filled).events if one.kind == "jump"]
    assert [one.marker for one in jumps] == ["RKNEL"]
    assert "where a gap was filled" in jumps[0].sentence


# --- what is not clear ------------------------------------------------------------------------


def suspected(farther: str, factor: float):
    """A swap of the right knee's markers, and a fit of it undone that leaves one farther off."""
    times, clean, _ = recording(4)
    markers, frames = clean.copy(), slice(160, 205)
    exchange(markers, "RKNEL", "RKNEM", frames)
    fit, a, b = fitted(markers, times), MARKERS.index("RKNEL"), MARKERS.index("RKNEM")

    def refit(other: np.ndarray, at: np.ndarray):
        again = fitted(other, at)
        if np.array_equal(other[frames], markers[frames]):
            return again
        m = MARKERS.index(farther)
        residual = again.residual_m.copy()
        residual[frames, m] = factor * fit.residual_m[frames, m]
        return replace(again, residual_m=residual)

    one, labelling = [Exchange(a, b, frames, 9.0)], Labelling(fit, refit)
    return labelling.exchanged_back(labelling.refitted(one), one), fit


@pytest.mark.parametrize("label", ["RKNEL", "RKNEM"])
def test_a_swap_that_leaves_one_of_the_two_farther_off_is_only_reported(label):
    labelling, fit = suspected(label, 1.1)
    (event,) = labelling.events
    assert not event.put_right
    assert event.sentence.endswith("; not clear enough to correct, left as recorded")
    assert labelling.fit is fit
    assert np.array_equal(labelling.order, Labelling(fit, fitted).order)


def test_a_swap_that_brings_both_nearer_is_undone():
    labelling, fit = suspected("RKNEL", 0.5)
    assert labelling.events[0].put_right
    assert (labelling.order != Labelling(fit, fitted).order).sum() == 2 * 45


def test_a_swap_after_which_all_markers_fit_worse_is_not_undone():
    times, clean, _ = recording(4)
    fit, one = fitted(clean, times), [Exchange(0, 1, slice(0, 40), 9.0)]
    a_worse_fit = replace(fit, residual_m=fit.residual_m + 0.001)
    near = replace(fit, residual_m=a_worse_fit.residual_m.copy())
    near.residual_m[:40, :2] = 0.0
    near.residual_m[40:] += 0.01
    labelling = Labelling(a_worse_fit, lambda m, t: near).exchanged_back(near, one)
    assert not labelling.events[0].put_right
    assert labelling.fit is a_worse_fit
