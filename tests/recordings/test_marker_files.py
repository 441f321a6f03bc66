"""Drawn C3D files with the faults that labels have: cut, doubled, empty, among other points."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.markersets import load_marker_set
from bsip_cli.recordings.labels import LabelMatch, match_labels
from bsip_cli.recordings.marker_guess import guess_marker_set
from bsip_cli.recordings.read import read_recording
from tests.recordings.recording_writers import write_c3d

HANSEN = load_marker_set("hansen2017")
LABELS = [marker.label for marker in HANSEN.markers]


def _matched(path, labels, empty=(), **options) -> tuple[LabelMatch, np.ndarray]:
    """The labels' match, and the column of every found marker in the file, told by its position."""
    places = np.tile(0.1 * (1.0 + np.arange(len(labels)))[:, None], (5, 1, 3))
    places[:, [k for k, label in enumerate(labels) if label in empty]] = np.nan
    recording = read_recording(write_c3d(path, places, labels, **options))
    match = match_labels(
        recording.labels,
        HANSEN.wanted(),
        optional=HANSEN.optional(),
        seen=np.isfinite(recording.markers_m[..., 0]).any(axis=0),
    )
    assert guess_marker_set(recording.labels).name == "hansen2017"
    along = recording.markers_m[0, [match.index[name] for name in match.index], 0]
    return match, np.round(10 * along).astype(int) - 1


def test_cut_labels_with_descriptions_are_all_found(tmp_path):
    cut = [label[:4] for label in LABELS]
    assert len(set(cut)) == 34
    match, columns = _matched(tmp_path / "a.c3d", cut, point_parameters={"DESCRIPTIONS": LABELS})
    assert match.missing == () and match.findings == ()
    np.testing.assert_array_equal(columns, np.arange(38))


def test_cut_labels_without_descriptions_lose_only_what_is_doubled(tmp_path):
    match, _ = _matched(tmp_path / "a.c3d", [label[:4] for label in LABELS])
    doubled = {f"{side}{joint}" for side in "LR" for joint in ("KNEL", "KNEM", "MALL", "MALM")}
    assert set(match.missing) == doubled
    shared = next(f for f in match.findings if f.found == "a label that several columns share")
    assert set(shared.subject.split(", ")) == doubled


def test_model_outputs_unlabelled_and_empty_points_beside_markers(tmp_path):
    extra = [
        "LHipAngles",
        "CentreOfMass",
        "*17",
        "PELO",
        "PELA",
        "PELL",
        "PELP",
        "LGroundReactionForce",
    ]
    match, columns = _matched(tmp_path / "a.c3d", [*extra, *LABELS], empty=("C7",))
    assert match.missing == ("C7",)
    assert {finding.found for finding in match.findings} == {
        "labelled, but seen in no frame",
        "1 of 38 markers not in the file",
    }
    expected = [len(extra) + k for k, label in enumerate(LABELS) if label != "C7"]
    np.testing.assert_array_equal(columns, expected)


def test_a_prefix_is_taken_off(tmp_path):
    match, columns = _matched(tmp_path / "a.c3d", [f"Anna:{label}" for label in LABELS])
    assert match.prefix == "Anna:" and len(columns) == 38
