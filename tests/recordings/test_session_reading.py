"""What a plate's numbers mean is found by the feet, for all trials of a session alike."""

from __future__ import annotations

from dataclasses import asdict, replace
from itertools import combinations

import numpy as np
import pytest

from bsip_cli.config import load_config
from bsip_cli.recordings.body_motion import USUAL
from bsip_cli.recordings.hypothesis import Hypothesis
from bsip_cli.recordings.plate_reading import ONE_ALONE, FrameChange, PlateReading
from bsip_cli.recordings.plates import CHANNELS_OF, LOADED_N, measured, wrench_matrix
from bsip_cli.recordings.plates_of_files import C3dPlate, ForceOnPoint
from bsip_cli.recordings.read import assemble
from bsip_cli.recordings.scene import handedness
from bsip_cli.recordings.session_findings import findings_about
from bsip_cli.recordings.session_reading import SessionReading, Verdict, session_reading
from bsip_cli.recordings.trial_samples import TrialSamples
from bsip_cli.recordings.under_the_feet import BESIDE_M, Feet
from tests.recordings.standing_on_two_plates import (
    LABELS,
    corners,
    free_moment,
    motion,
    of_c3d,
    of_table,
    opened,
)

PLACE_OF_LAB = (0.6, 0.2, -0.04)


def of_other_table(force_order=(0, 1, 2), moment_signs=1.0, **faults) -> list[ForceOnPoint]:
    return [
        replace(one, force_N=one.force_N[:, force_order], moment=one.moment * moment_signs)
        for one in of_table(**faults)
    ]


def of_channels(order=range(6), signs=1.0, **faults) -> list[C3dPlate]:
    """Channels in another order, or of the other sign."""
    return [replace(one, measured=one.measured[:, order] * signs) for one in of_c3d(**faults)]


def of_sensors(one: str = "", other: str = "") -> list[C3dPlate]:
    """Of type 3, with two sensors exchanged; a load goes to the corners as its place has it."""
    sources = []
    for plate in of_c3d(origin_m=(0.0, 0.0, -0.04)):
        stated = replace(plate.description, kind=3, origin_m=np.array([0.12, 0.2, -0.04]))
        channels = plate.measured @ np.linalg.pinv(wrench_matrix(stated)).T
        load, mx, my = plate.measured[:, 2:5].T
        with np.errstate(invalid="ignore", divide="ignore"):
            diagonal = np.nan_to_num(-mx * my / load / (0.12 * 0.2)) / 4
        channels[:, 4:] += np.outer(diagonal, [1, -1, 1, -1])
        order = list(CHANNELS_OF[3])
        if one:
            i, j = order.index(one), order.index(other)
            channels[:, [i, j]] = channels[:, [j, i]]
        sources.append(replace(plate, description=stated, measured=channels))
    return sources


def of_points(
    exchanged: bool = False, point_scale: float = 1.0, torque_scale: float = 1.0
) -> list[C3dPlate]:
    """Of type 1, with the coordinates of the point exchanged, or in other units."""
    sources = []
    for plate in of_c3d(origin_m=(0.0, 0.0, 0.0)):
        force, moment = np.split(plate.measured, 2, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            x, y = (np.nan_to_num(m / force[:, 2]) for m in (-moment[:, 1], moment[:, 0]))
        torque = moment[:, 2] - x * force[:, 1] + y * force[:, 0]
        point = point_scale * np.array([y, x] if exchanged else [x, y])
        stated = replace(plate.description, kind=1)
        channels = measured(np.column_stack([force, *point, torque_scale * torque]), 1)
        sources.append(replace(plate, description=stated, measured=channels))
    return sources


FAULTS = {
    "table, sound": (of_table, {}, ""),
    "points in mm": (of_table, {"point_scale": 1e3}, "mm"),
    "points in cm": (of_table, {"point_scale": 1e2}, "cm"),
    "moments in N mm": (of_table, {"moment_scale": 1e3}, "N mm"),
    "points in mm, moments in N mm": (
        of_table,
        {"point_scale": 1e3, "moment_scale": 1e3},
        "N mm, read the points",
    ),
    "moments about the origin": (of_table, {"about": "origin"}, "laboratory's origin"),
    "moments about each plate's centre": (of_table, {"about": "fixed"}, "about one point"),
    "moments about the centres, Mx reversed": (
        of_other_table,
        {"about": "fixed", "moment_signs": [-1.0, 1.0, 1.0]},
        "about one point of the plate, the points for centres of pressure, reversed Mx",
    ),
    "points in mm, moments about the centres in N mm": (
        of_table,
        {"about": "fixed", "point_scale": 1e3, "moment_scale": 1e3},
        "about one point",
    ),
    "C3D, sound": (of_c3d, {}, ""),
    "turned by 90 degrees": (of_c3d, {"turn": 1}, "90 degrees"),
    "turned by 180 degrees": (of_c3d, {"turn": 2}, "180 degrees"),
    "turned by 270 degrees": (of_c3d, {"turn": 3}, "270 degrees"),
    "N m taken for N mm": (of_c3d, {"moment_scale": 1e-3}, "N m, a thousand times"),
    "N mm taken for N m": (of_c3d, {"moment_scale": 1e3}, "N mm"),
    "N cm taken for N mm": (of_c3d, {"moment_scale": 1e-1}, "10 times what their unit"),
    "ORIGIN is a place in the lab": (
        of_c3d,
        {"origin_m": (0.0, 0.0, -0.04), "stated_origin_m": PLACE_OF_LAB},
        "for a place",
    ),
    "X and Y exchanged": (
        of_channels,
        {"order": [1, 0, 2, 4, 3, 5], "origin_m": (0.0, 0.0, -0.06)},
        "in the other direction round",
    ),
    "Fx and Fy exchanged": (of_channels, {"order": [1, 0, 2, 3, 4, 5]}, "exchanged Fx and Fy"),
    "Mx and My exchanged": (of_channels, {"order": [0, 1, 2, 4, 3, 5]}, "exchanged Mx and My"),
    "Fx and Fy of a table exchanged": (
        of_other_table,
        {"force_order": [1, 0, 2]},
        "exchanged Fx and Fy",
    ),
    "Fx and Fy reversed": (
        of_channels,
        {"signs": [-1.0, -1.0, 1.0, 1.0, 1.0, 1.0]},
        "reversed Fx and Fy",
    ),
    "the action on the plate": (of_c3d, {"sign": -1}, ""),
    "eight sensors, sound": (of_sensors, {}, ""),
    "a point and a torque, sound": (of_points, {}, ""),
    "a torque in N mm": (of_points, {"torque_scale": 1e3}, "N mm"),
    "a point in m, taken for mm": (of_points, {"point_scale": 1e-3}, "points of force in m"),
    "a point in cm, taken for mm": (of_points, {"point_scale": 0.1}, "points of force in cm"),
    "a point and a torque reversed": (
        of_points,
        {"point_scale": -1.0, "torque_scale": -1.0},
        "reversed the moments",
    ),
    "Px and Py exchanged": (of_points, {"exchanged": True}, "exchanged Px and Py"),
} | {
    f"{one} and {other} exchanged": (
        of_sensors,
        {"one": one, "other": other},
        f"exchanged {one} and {other}",
    )
    for one, other in combinations(CHANNELS_OF[3][4:], 2)
}


def _wrench(recording) -> np.ndarray:
    return np.array([plate.wrench for plate in recording.plates])


@pytest.mark.parametrize("name", FAULTS)
def test_the_forces_of_the_person_come_back(name):
    make, faults, words = FAULTS[name]
    _, force, point = motion()
    trial = opened(make(**faults))
    session = session_reading([TrialSamples.of(trial)])
    found = findings_about(session)
    assert all(words in f.action and f.level == "corrected" for f in found)
    assert len(found) == (2 if words else 0)
    wrench = _wrench(assemble(trial, session))
    np.testing.assert_allclose(wrench[..., :3], force, atol=1e-6)
    free = np.zeros_like(force)
    free[..., 2] = 0.002 * force[..., 2]
    np.testing.assert_allclose(wrench[..., 3:], np.cross(point, force) + free, atol=0.3)


def prior_of(one: Hypothesis) -> float:
    likelihoods = sum(fit.log_likelihood for fit in one.fits.values())
    return one.log_posterior - likelihoods - one.balance.log_likelihood(USUAL)


def test_a_fault_of_all_plates_counts_once_beside_one_of_a_single_plate():
    trials = [TrialSamples.of(opened(of_c3d(moment_scale=1e-3)))]
    stated = Hypothesis.as_stated(FrameChange(), trials, USUAL)
    now = max(stated.with_one_more(), key=lambda one: one.log_posterior)
    more = "exchanged Mx and My"
    (one,) = (
        one
        for one in now.with_one_more()
        if [fit.reading.channels for fit in one.fits.values()] == [more, ""]
    )
    (rare,) = PlateReading(channels=more).repairs().values()
    assert prior_of(one) == pytest.approx(prior_of(now) + rare + ONE_ALONE)


def test_a_table_without_moments_shows_no_torque():
    """Though moments about the world's origin leave some by rounding."""
    found = Hypothesis.as_stated(
        FrameChange(), [TrialSamples.of(opened(of_table(moment_scale=0.0)))], USUAL
    )
    torque = [fit.evidence().torque_m for fit in found.fits.values()]
    assert np.isnan(torque).all()


@pytest.mark.parametrize(("side", "axes"), [((0, 0), "X and Y"), ((1, 0), "Y"), ((1, 1), "")])
def test_a_plate_without_side_forces_is_said(side, axes):
    """In the axes of the lab, whatever moments are written beside it."""
    sources = [replace(one, force_N=one.force_N * [*side, 1]) for one in of_table()]
    found = assemble(opened(sources), SessionReading(plates={"1": Verdict(), "2": Verdict()}))
    said = [one.found for one in found.findings if one.check == "plate_force"]
    words = f"no horizontal force along the lab's {axes} whatever it bears"
    assert said == [words] * (2 if axes else 0)


def test_no_reading_is_tried_twice():
    trials = [TrialSamples.of(opened(of_c3d(moment_scale=1e-3)))]
    now = Hypothesis.as_stated(FrameChange(), trials, USUAL)
    for _ in range(2):
        tried = [now, *now.with_one_more()]
        readings = [tuple(fit.reading for fit in one.fits.values()) for one in tried]
        assert len(set(readings)) == len(readings)
        now = max(tried, key=lambda one: one.log_posterior)
    assert now.fits["1"].reading.moment_scale == 1e3


def test_exchanged_plates():
    """And a trial that lacks one of them leaves out what the other one measures."""
    one, two = of_c3d()
    trial = opened([replace(one, measured=two.measured), replace(two, measured=one.measured)])
    session = session_reading([TrialSamples.of(trial)])
    assert [v.reading.place_of for v in session.plates.values()] == ["2", "1"]
    sound = assemble(opened([one, two]), session_of())
    np.testing.assert_allclose(_total(assemble(trial, session)), _total(sound), atol=1e-9)
    alone = assemble(opened([one]), session)
    assert alone.plates == ()
    assert [f.level for f in alone.findings if "lacks the plate" in f.found] == ["excluded"]


def _total(recording) -> np.ndarray:
    return _wrench(recording).sum(axis=0)


def session_of():
    return session_reading([TrialSamples.of(opened(of_c3d()))])


@pytest.mark.parametrize("make", [of_c3d, of_table])
def test_copies_and_sums_count_once(make):
    one, two = make()
    sum_ = replace(one, **_renamed(one, "3", _force(one) + _force(two)))
    copy = replace(two, **_renamed(two, "4", _force(two)))
    session = session_reading([TrialSamples.of(opened([one, two, sum_, copy]))])
    assert {n: v.repeats for n, v in session.plates.items() if v.repeats} == {
        "3": ("1", "2"),
        "4": ("2",),
    }
    assert [p.name for p in assemble(opened([one, two, sum_, copy]), session).plates] == ["1", "2"]


def _force(source) -> np.ndarray:
    return source.force_N if hasattr(source, "force_N") else source.measured[:, :3]


def _renamed(source, name: str, force: np.ndarray) -> dict:
    if hasattr(source, "force_N"):
        return {"name": name, "force_N": force}
    description = replace(source.description, name=name)
    return {"description": description, "measured": np.hstack([force, source.measured[:, 3:]])}


def _with_a_load(place_m: tuple[float, float], weight_N: float) -> list[C3dPlate]:
    """And a third plate, 2 m ahead, on which something stands at a place on it."""
    one, two = of_c3d()
    stated = replace(one.description, name="3", corners_m=corners(0) + np.array([2.0, 0.0, 0.0]))
    axes = stated.rotation_lab_plate()
    force = np.tile([0.0, 0.0, weight_N], (len(one.measured), 1))
    moment = np.cross([*place_m, 0.0], force) + free_moment(force)
    local = force @ axes
    channels = np.hstack([local, moment @ axes - np.cross(local, stated.origin_m)])
    return [one, two, replace(one, description=stated, measured=channels)]


@pytest.mark.parametrize("place_m", [(0.1, 0.05), (-0.25, 0.2)])
@pytest.mark.parametrize("weight_N", [200.0, 550.0])
def test_what_stands_on_another_plate_says_nothing_against_the_persons(place_m, weight_N):
    trial = opened(_with_a_load(place_m, weight_N))
    session = session_reading([TrialSamples.of(trial)])
    assert "beside the feet" in session.plates["3"].refusal
    assert [plate.name for plate in assemble(trial, session).plates] == ["1", "2"]


def test_a_plate_that_the_person_stands_on_is_no_others():
    """Without it the other one bears nobody."""
    one, two = of_c3d()
    far = replace(two.description, corners_m=two.description.corners_m + np.array([1.5, 0.0, 0.0]))
    trial = opened([one, replace(two, description=far)])
    assert assemble(trial, session_reading([TrialSamples.of(trial)])).plates == ()


def test_forces_that_no_reading_brings_under_the_feet_are_refused():
    far = motion()[0] + np.array([3.0, -2.0, 0.0])
    for make in (of_c3d, of_table):
        trial = opened(make(), far)
        session = session_reading([TrialSamples.of(trial)])
        assert [f.level for f in findings_about(session)] == ["excluded"] * 2
        assert assemble(trial, session).plates == ()


@pytest.mark.parametrize("make", [of_c3d, of_table])
def test_a_foot_on_a_step_is_on_its_plate(make):
    """The right foot on a plate of 0.3 m, the left one on the floor."""
    up = np.array([0.0, 0.0, 0.3])
    markers, right, left = motion()[0], *make()
    markers[:, [name.startswith("R") and name[1:] in ("HEE", "TOE", "ANK") for name in LABELS]] += (
        up
    )
    if isinstance(right, C3dPlate):
        stated = replace(right.description, corners_m=right.description.corners_m + up)
        right = replace(right, description=stated)
    else:
        right = replace(right, points=right.points + up, point_height=0.3)
    trial = opened([right, left], markers)
    session = session_reading([TrialSamples.of(trial)])
    assert all(one.reading.repairs() == {} for one in session.plates.values())
    assert [plate.name for plate in assemble(trial, session).plates] == ["1", "2"]


@pytest.mark.parametrize("rise_m", [-1.6, -0.3, 0.2, 1.1])
def test_a_surface_where_no_foot_can_stand_is_refused(rise_m):
    """The soles are at 0.04 m; the feet are found wherever the plates are stated."""
    up = np.array([0.0, 0.0, rise_m])
    of_corners = [
        replace(one, description=replace(one.description, corners_m=corners(k) + up))
        for k, one in enumerate(of_c3d())
    ]
    of_points = [replace(one, point_height=rise_m) for one in of_table()]
    for sources in (of_corners, of_points):
        session = session_reading([TrialSamples.of(opened(sources))])
        for verdict in session.plates.values():
            assert f"its surface lies {abs(0.04 - rise_m):.2f} m" in verdict.refusal
            assert verdict.after.distance_m < BESIDE_M


@pytest.mark.parametrize("rise_m", [-1.6, 1.1])
def test_a_laboratory_may_lie_anywhere_above_the_cameras_origin(rise_m):
    up = np.array([0.0, 0.0, rise_m])
    sources = [
        replace(one, description=replace(one.description, corners_m=corners(k) + up))
        for k, one in enumerate(of_c3d())
    ]
    samples = TrialSamples.of(opened(sources, motion()[0] + up))
    assert len(samples.feet.sides) == 6  # heels, toes and ankles, and no pelvis
    assert session_reading([samples]).refusals() == []


@pytest.mark.parametrize("axis", [0, 1])
def test_a_mirrored_laboratory_is_turned_back(axis):
    mirrored = opened(of_table()).in_frame(FrameChange("all", axis))
    session = session_reading([TrialSamples.of(mirrored)])
    assert session.frame.moved == "all"
    there = assemble(mirrored, session)
    assert handedness(there.labels, there.markers_m).parts["pelvis"] > 0.9
    expected = _wrench(assemble(opened(of_table()), session_of()))
    np.testing.assert_allclose(_wrench(there)[..., 2], expected[..., 2])  # up stays up


@pytest.mark.parametrize(
    ("moved", "back"),
    [
        (FrameChange("markers", 1), FrameChange("markers", 1)),
        (FrameChange("forces", 0), FrameChange("forces", 0)),
        *(
            (FrameChange("forces", turned_deg=turn), FrameChange("forces", turned_deg=360 - turn))
            for turn in (90.0, 180.0, 270.0)
        ),
    ],
)
def test_markers_or_forces_in_other_axes_are_turned_back(moved, back):
    trial = opened(of_table()).in_frame(moved)
    session = session_reading([TrialSamples.of(trial)])
    assert session.frame == back
    there, sound = assemble(trial, session), assemble(opened(of_table()), session_of())
    np.testing.assert_allclose(there.markers_m, motion()[0])
    np.testing.assert_allclose(_wrench(there), _wrench(sound), atol=1e-9)


def _slow_stance() -> list[ForceOnPoint]:
    """Hardly a force but what spread legs push apart, equal and opposite at both feet."""
    sources = of_table()
    inward = (24.0, -24.0)
    return [
        replace(source, force_N=source.force_N * [1.0, 0.0, 1.0] + [0.0, side, 0.0])
        for source, side in zip(sources, inward, strict=True)
    ]


def test_side_forces_that_point_away_from_the_body_are_not_believed():
    """The sum shows nothing of it; alone the lean under each foot does."""
    sound = opened(_slow_stance())
    assert findings_about(session_reading([TrialSamples.of(sound)])) == []
    away = [replace(s, force_N=s.force_N * [1.0, -1.0, 1.0]) for s in _slow_stance()]
    found = findings_about(session_reading([TrialSamples.of(opened(away))] * 2))
    assert [(f.level, "reversed Fy" in f.action) for f in found] == [("excluded", True)] * 2


def test_what_an_odd_turn_leaves_unsure_is_a_warning():
    """Far from the point that they are turned about, forces are off by much."""
    sure = FrameChange("forces", 0, 31.0, 0.1, 0.004)
    for frame, level in ((sure, "corrected"), (replace(sure, unsure_m=0.021), "warning")):
        (found,) = findings_about(SessionReading(frame))
        assert found.level == level and ("21 mm" in found.action) == (level == "warning")


@pytest.mark.parametrize("make", [of_c3d, of_table])
@pytest.mark.parametrize("moved", ["", "all", "forces"])
def test_a_reading_is_a_matrix(make, moved):
    """Every reading's wrench is linear in the source's parts, also in other axes."""
    for source in opened(make()).in_frame(FrameChange(moved, 1)).sources:
        for reading in source.alternatives():
            if reading.about == "fixed":
                reading = ForceOnPoint.with_centre([source], reading)
            read = replace(reading, sign=-1)
            expected = source.plate(read).wrench
            found = source.parts() @ source.matrix(read).T
            np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("corners_only", [False, True])
def test_a_mirrored_c3d_mirrors_its_channels_or_its_corners(corners_only):
    """Mirrored twice is nothing: also the sensor's depth."""
    sources = opened(of_c3d())
    scene = FrameChange("all", 1, corners_only=corners_only)
    twice = sources.in_frame(scene).in_frame(scene)
    sound = [source.plate(PlateReading()).wrench for source in sources.sources]
    again = [source.plate(PlateReading()).wrench for source in twice.sources]
    np.testing.assert_allclose(again, sound, atol=1e-9)
    once = [source.plate(PlateReading()) for source in sources.in_frame(scene).sources]
    mirrored_force = np.array(sound)[..., :3] * [1.0, -1.0, 1.0]
    if not corners_only:
        np.testing.assert_allclose([p.force_N for p in once], mirrored_force, atol=1e-9)


def test_left_and_right_of_one_part_are_said():
    markers = motion()[0]
    order = [1, 0, 3, 2, *range(4, len(LABELS))]
    trial = opened(of_table(), markers[:, order])
    session = session_reading([TrialSamples.of(trial)])
    assert session.frame == FrameChange()
    (said,) = [f for f in assemble(trial, session).findings if f.check == "labels"]
    assert said.subject == "pelvis" and said.level == "warning"


def test_the_limits_are_those_of_the_options():
    options = load_config([]).ingest
    assert asdict(USUAL) == {name: getattr(options, name) for name in asdict(USUAL)}


SQUARE = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]


def test_distance_from_the_feet():
    square = np.array([SQUARE] * 3)
    places = np.array([[0.5, 0.4], [1.5, 0.5], [-3.0, -4.0]])
    together = np.zeros(3, bool)
    found = Feet(square, ("", "", "", "")).distance_m(places, together)
    np.testing.assert_allclose(found, [0.0, 0.5, 5.0], rtol=1e-3)
    two = square[:, :2].copy()
    two[2] = np.nan
    found = Feet(two, ("", "")).distance_m(places, together)
    np.testing.assert_allclose(found, [0.4, 0.5**0.5, np.nan], rtol=1e-3)


def test_feet_on_plates_of_their_own_are_two_areas():
    """Left and right side of a square: its middle is half a metre from either."""
    feet = Feet(np.array([SQUARE] * 2), ("l", "r", "r", "l"))
    found = feet.distance_m(np.full((2, 2), 0.5), np.array([False, True]))
    np.testing.assert_allclose(found, [0.0, 0.5], rtol=1e-3)


def test_feet_on_the_plate_count_before_all_others():
    points = np.array([[[0.6, 0.2], [0.6, 0.8]], [[5.0, 5.0], [6.0, 6.0]]])
    kept = Feet(points, ("r", "l")).on(corners(0)).points_m
    assert np.isfinite(kept[0, 0]).all() and np.isnan(kept[0, 1]).all()
    np.testing.assert_array_equal(kept[1], points[1])


def test_nothing_of_a_table_is_the_whole_force_while_a_plate_left_out_bears():
    """A table has no outlines: no foot tells that a plate is missing from the sum."""
    one, two = of_table()
    steps_on = np.arange(len(two.usable)) < 150
    two = replace(two, force_N=two.force_N * steps_on[:, None])
    trial = opened([one, two])
    left_out = SessionReading(plates={"1": Verdict(), "2": Verdict(refusal="its force is odd")})
    recording = assemble(trial, left_out)
    (plate,) = recording.plates
    load = two.force_N[:, 2] > LOADED_N
    np.testing.assert_array_equal(plate.usable, ~load)
    (said,) = [f for f in recording.findings if f.check == "plate_missing"]
    assert said.subject == "2" and said.level == "excluded"
    seen = assemble(opened(of_c3d()), left_out)  # where the feet tell
    assert seen.plates[0].usable.all()
