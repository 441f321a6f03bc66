"""The second simulated world: its files hold what physics and its own truth demand."""

from __future__ import annotations

import ast
from pathlib import Path

import ezc3d
import numpy as np
import pytest

from tests.blind.second_world.balance import GRAVITY, Balanced, balanced
from tests.blind.second_world.body import SEGMENTS, Body, draw_body
from tests.blind.second_world.c3d_file import TYPES, write_c3d
from tests.blind.second_world.effects import Changes, Hidden, changes_of, wobble
from tests.blind.second_world.lab import Equipment, Lab, Recorded
from tests.blind.second_world.landmarks import place_landmarks
from tests.blind.second_world.movements import moving
from tests.blind.second_world.people import CASES, Case, drawn_cases
from tests.blind.second_world.skin import Skin

LENGTH_S, SEED = 3.0, 11
_TWO_CAUSES = (("drift", 15.0), ("gain", 0.1))
FOLDER = Path(__file__).parent / "second_world"


@pytest.fixture(scope="module")
def body() -> Body:
    return draw_body("F", 62.0, 1.68, np.random.default_rng(SEED))


@pytest.fixture(scope="module")
def found(body: Body) -> Balanced:
    """Three seconds of sway on two plates."""
    return balanced(moving("sway", body, 500.0, np.random.default_rng(SEED), True, LENGTH_S))


def lab_of(plate_type: int = 2) -> Lab:
    return Lab(Equipment("hansen2017", 100, plate_type, True), np.random.default_rng(SEED))


def recorded(body: Body, found: Balanced, lab: Lab, changes: Changes) -> Recorded:
    """The same noise and skin every time."""
    rng = np.random.default_rng(SEED)
    skin = Skin(place_landmarks(body, rng), lab.labels, rng)
    skin.rest(found.poses)
    return lab.record(found, skin, changes, rng)


def total_in_file(path: Path, lab: Lab) -> tuple[np.ndarray, np.ndarray]:
    """Force [N] and moment [N m] about the feet's middle, (N, 3) each, as ezc3d has them."""
    platforms = ezc3d.c3d(str(path), extract_forceplat_data=True)["data"]["platform"]
    force = sum(plate["force"].T for plate in platforms)
    moment = np.zeros_like(force)
    for plate in platforms:
        centre = plate["corners"].mean(axis=1) / 1000.0 - lab.feet_m
        moment += plate["moment"].T / 1000.0 + np.cross(centre, plate["force"].T)
    return force, moment


def test_the_body_weighs_what_it_should(body):
    assert sum(part.mass for part in body.parts.values()) == pytest.approx(62.0)
    for segment in SEGMENTS:
        moments = np.linalg.eigvalsh(body.parts[segment].inertia)
        assert moments[0] > 0.0 and moments[0] + moments[1] > 0.95 * moments[2]


def test_weight_is_carried(body, found):
    assert found.force_n[:, 2].mean() == pytest.approx(body.mass_kg * GRAVITY[2], rel=0.005)


def test_the_centre_of_pressure_stays_within_the_feet(body, found):
    middle = np.mean(list(found.centres_m.values()), axis=0)
    half_foot = 0.5 * body.lengths_m["foot"]
    assert np.abs(found.cop_m - middle)[:, 0].max() < half_foot
    assert found.cop_m[:, 1].min() > found.centres_m["r"][:, 1].min()
    assert found.cop_m[:, 1].max() < found.centres_m["l"][:, 1].max()


@pytest.mark.parametrize("plate_type", TYPES)
def test_a_file_holds_the_wrench_that_the_motion_needs(tmp_path, body, found, plate_type):
    """But for the lab's usual errors: noise, offsets, plates a millimetre beside their place."""
    lab, path = lab_of(plate_type), tmp_path / "null.c3d"
    write_c3d(path, recorded(body, found, lab, Changes()), plate_type)
    force, moment = total_in_file(path, lab)
    times = np.arange(len(force)) / lab.analog_hz
    true = np.hstack([found.force_n, found.moment_nm])
    true = np.column_stack([np.interp(times, found.motion.t, column) for column in true.T])
    off = np.hstack([force, moment]) - true
    weight = body.mass_kg * GRAVITY[2]
    assert force[:, 2].mean() == pytest.approx(weight, rel=0.005)
    assert np.abs(off.mean(axis=0)).max() < 4.0
    assert off[:, :3].std(axis=0).max() < 3.0
    assert off[:, 3:].std(axis=0).max() < 1.0


def test_markers_come_back_from_the_file(tmp_path, body, found):
    lab, path = lab_of(), tmp_path / "null.c3d"
    made = recorded(body, found, lab, Changes())
    write_c3d(path, made, 2)
    points = ezc3d.c3d(str(path))["data"]["points"]
    courses = np.stack(list(made.markers_m.values())).transpose(2, 0, 1)
    assert points.shape[2] == LENGTH_S * lab.rate_hz
    np.testing.assert_allclose(points[:3] / 1000.0, courses, atol=1e-6)


def test_a_turned_plate_changes_its_corners_alone(body, found):
    hidden = changes_of(Hidden("yaw", 3.0), found.motion)
    null, turned = (recorded(body, found, lab_of(), one) for one in (Changes(), hidden))
    for label, course in null.markers_m.items():
        np.testing.assert_array_equal(turned.markers_m[label], course)
    for k, corners in enumerate(null.corners_m):
        np.testing.assert_array_equal(turned.wrenches[k], null.wrenches[k])
        edge, after = corners[0] - corners[1], turned.corners_m[k][0] - turned.corners_m[k][1]
        angle = np.arctan2(np.cross(edge, after)[2], edge @ after)
        assert np.degrees(angle) == pytest.approx(3.0)
        np.testing.assert_allclose(turned.corners_m[k].mean(axis=0), corners.mean(axis=0))


def test_a_carried_mass_weighs_on_the_ground(body):
    motion = moving("sway", body, 500.0, np.random.default_rng(SEED), True, LENGTH_S)
    changes = changes_of(Hidden("worn", 1.5, ("shank_r", (0.0, 0.0, -0.2))), motion)
    force = balanced(motion, changes.loads).force_n
    assert force[:, 2].mean() == pytest.approx((body.mass_kg + 1.5) * GRAVITY[2], rel=0.005)


def test_what_wobbles_swings_on_and_weighs_nothing_more(body):
    """A third of a second after a jolt the ground still feels it, by less and less."""
    times = np.arange(0.0, 3.0, 0.002)
    velocity = np.outer(np.where(times > 1.0, -0.5, 0.0), [0.0, 0.0, 1.0])
    force = wobble(4.0)(times, velocity)[:, 2]
    early, later = (np.abs(force[(times > a) & (times < a + 0.25)]).max() for a in (1.05, 1.3))
    assert 5.0 < later < 0.3 * early
    assert np.abs(force[times > 2.8]).max() < 0.5


def test_a_bent_spine_moves_the_trunk_less_below(body):
    motion = moving("squat", body, 500.0, np.random.default_rng(SEED), False, LENGTH_S)
    straight = balanced(motion, rounds=2).poses
    changes_of(Hidden("bend", 0.5), motion)
    bent = balanced(motion, rounds=2).poses
    for poses, same in ((straight, True), (bent, False)):
        apart = np.abs(poses.rotations["torso"] - poses.rotations["abdomen"]).max()
        assert bool(apart < 1e-12) is same
        spine = body.joints_m["spine"]
        above, below = (poses.points_m(s, spine) for s in ("torso", "abdomen"))
        np.testing.assert_allclose(above, below, atol=1e-12)


def test_a_fast_clock_is_later_and_later(body, found):
    fast = changes_of(Hidden("clock", 3000), found.motion)
    null, early = (recorded(body, found, lab_of(), one) for one in (Changes(), fast))
    lab = lab_of()
    force, other = (one.wrenches[0][:, 2] for one in (null, early))
    times = np.arange(len(force)) / lab.analog_hz
    again = np.interp(times * (1.0 - 0.003), times, force)
    inner = slice(200, -200)
    assert np.std((other - again)[inner]) < 0.6 * np.std((other - force)[inner])


def test_two_causes_are_hidden_at_once(body, found):
    motion = found.motion
    drift, gain = (changes_of(Hidden(name, size), motion) for name, size in _TWO_CAUSES)
    both = recorded(body, found, lab_of(), drift.with_others(gain)).wrenches[0][:, 2]
    one, other, null = (
        recorded(body, found, lab_of(), changes).wrenches[0][:, 2]
        for changes in (drift, gain, Changes())
    )
    np.testing.assert_allclose(both - null, (one - null) * 1.1 + (other - null), atol=1.0)
    assert np.abs(one - null).max() > 10.0 and np.abs(other - null).max() > 10.0


@pytest.mark.parametrize("cases", [CASES, drawn_cases(3)], ids=["known", "drawn"])
def test_cases_have_names_and_seeds_of_their_own(cases: tuple[Case, ...]):
    names = {case.name for case in cases}
    assert len(names) == len({case.somebody.seed for case in cases}) == len(cases)


def test_a_seed_draws_people_whom_no_other_draws():
    """And what is hidden is in a recording that they make."""
    one, other = drawn_cases(3), drawn_cases(4)
    assert one == drawn_cases(3) and not {c.somebody for c in one} & {c.somebody for c in other}
    for case in one:
        assert {hidden.task for hidden in case.hidden} <= {None, *case.tasks}


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.py")), ids=lambda file: file.stem)
def test_imports_nothing_of_bsip(file):
    """Or an error that simulator and diagnosis have in common would not show."""
    nodes = list(ast.walk(ast.parse(file.read_text(encoding="utf-8"))))
    names = [alias.name for n in nodes if isinstance(n, ast.Import) for alias in n.names]
    names += [str(node.module) for node in nodes if isinstance(node, ast.ImportFrom)]
    ours = [name for name in names if name.startswith(("bsip_cli", "benchmarks", "tests"))]
    assert all(name.startswith("tests.blind.second_world") for name in ours)
