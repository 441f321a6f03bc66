"""What a movement prescribes (joint angles, feet, support, what the body carries), its sketch, and
the poses of all bodies that follow from it.

Walkway frame: X ahead, Y up, Z right, origin on the ground; moments are about it. A plan leaves the
pelvis' horizontal path (and in flight its whole pose) to `balance`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from bsip_cli.simulate.numerics import (
    about_axis,
    about_x,
    about_y,
    about_z,
    euler_zxy,
    frame_of,
    rotate,
    second_derivative,
    slow_drift,
    step,
    transpose,
)
from bsip_cli.simulate.people import SIDE_SIGN, SIDES, Person

STEP_S = 0.001
GRAVITY = np.array([0.0, -9.81, 0.0])
G = -GRAVITY[1]


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of all bodies in one world frame.

    rotation : (T, 3, 3) by body. origin_m : (T, 3) by body.
    excess_reach_m : (T,) how far the feet were out of the legs' reach (0 = reachable).
    """

    rotation: dict[str, np.ndarray]
    origin_m: dict[str, np.ndarray]
    excess_reach_m: np.ndarray

    def point(self, body: str, position_m: np.ndarray) -> np.ndarray:
        """(T, 3) world path of a point (3,) of a body."""
        return self.origin_m[body] + rotate(self.rotation[body], position_m)

    def part(self, samples: slice) -> Poses:
        """The same poses at some of the samples."""
        rotation = {name: R[samples] for name, R in self.rotation.items()}
        origin = {name: p[samples] for name, p in self.origin_m.items()}
        return Poses(rotation, origin, self.excess_reach_m[samples])


@dataclass(frozen=True, eq=False)
class Load:
    """Something at a point of a body that it has to move, to hold, or may lean on.

    position_m : (3,) in the body's frame.
    """

    body: str
    position_m: np.ndarray

    def force(self, path_m: np.ndarray, step_s: float) -> np.ndarray:
        """(T, 3) force that the body exerts on it, while the point takes a path (T, 3)."""
        raise NotImplementedError

    def wrench(self, poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Force (T, 3) that the body exerts on it, and that force's moment (T, 3)."""
        r = poses.point(self.body, self.position_m)
        force = self.force(r, step_s)
        return force, np.cross(r, force)


@dataclass(frozen=True, eq=False)
class Ball(Load):
    """A ball, or any small object, in a hand; a point mass.

    hold : (T,) 1 while held, falling smoothly to 0 at the release.
    release_s : when half the load has left the hand, on the recording's clock.
    """

    mass_kg: float
    hold: np.ndarray
    release_s: float

    def force(self, path_m: np.ndarray, step_s: float) -> np.ndarray:
        """What moves and holds it."""
        acceleration = second_derivative(path_m, step_s)
        return self.hold[:, None] * self.mass_kg * (acceleration - GRAVITY)


def total_load(loads: Iterable[Load], poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Force (T, 3) and moment (T, 3) of the body on all its loads."""
    force, moment = np.zeros((2, *poses.origin_m[next(iter(poses.origin_m))].shape))
    for load in loads:
        one_force, one_moment = load.wrench(poses, step_s)
        force += one_force
        moment += one_moment
    return force, moment


@dataclass(frozen=True, eq=False)
class Foot:
    """One foot over time.

    position_m : (T, 3) ankle joint centre. rotation : (T, 3, 3) foot frame in the walkway frame.
    share : (T,) part of the ground force that this foot carries (0 when it is in the air).
    cop_m : (T, 2) centre of pressure under this foot, X and Z.
    on_plate : (T,) whether its contact (if any) is on the plate.
    """

    position_m: np.ndarray
    rotation: np.ndarray
    share: np.ndarray
    cop_m: np.ndarray
    on_plate: np.ndarray


@dataclass(frozen=True, eq=False)
class Plan:
    """A movement before balance. All arrays share one time axis.

    angles_rad : waist, neck (T, 3): flexion about Z, about X, about Y;
        spine (T, 3), if given: the same, of the thorax on the abdomen;
        girdle_* (T, 2), if given: clavicle raised and brought forward on top of what the arm's
        rhythm does; shoulder_* (T, 3): flexion, abduction, internal rotation; elbow_* (T,):
        flexion; wrist_* (T, 3): flexion, radial deviation, pronation.
    pelvis_angles_rad : (T, 3) about Z, X, Y in the walkway frame; (nominal in flight).
    pelvis_m : (T, 3) nominal path of the lumbar joint centre.
    feet : by side, "l" and "r".
    com_height_m : (T,) prescribed height of the centre of mass, or None: then the
        pelvis keeps its nominal height.
    flights : (first, last) sample of each phase without contact.
    speed_m_s : mean forward speed.
    sway_share : part of the unbalanced motion's COP excursion that is left standing.
    longest_reach : of a leg, as part of thigh plus shank; keeps knees from locking.
    keep : the part of the samples that is recorded.
    ball : a ball in a hand. loads : what else the body carries or leans on.
    plate_centre_m : X and Z of the first plate's centre, walkway frame.
    """

    step_s: float
    angles_rad: dict[str, np.ndarray]
    pelvis_angles_rad: np.ndarray
    pelvis_m: np.ndarray
    feet: dict[str, Foot]
    keep: slice
    com_height_m: np.ndarray | None = None
    flights: tuple[tuple[int, int], ...] = ()
    speed_m_s: float = 0.0
    sway_share: float = 0.0
    longest_reach: float = 0.9985
    ball: Ball | None = None
    loads: tuple[Load, ...] = ()
    plate_centre_m: tuple[float, float] = (0.0, 0.0)
    notes: dict[str, object] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.pelvis_m)

    def cop_m(self) -> np.ndarray:
        """(T, 2) planned centre of pressure of both feet together."""
        left, right = self.feet["l"], self.feet["r"]
        return left.share[:, None] * left.cop_m + right.share[:, None] * right.cop_m

    def all_loads(self) -> tuple[Load, ...]:
        """The ball and everything else that the body has to move or to lean on."""
        return self.loads if self.ball is None else (self.ball, *self.loads)

    def with_load(self, load: Load) -> Plan:
        return replace(self, loads=(*self.loads, load))

    def recorded_times_s(self) -> np.ndarray:
        """(T,) times of the samples on the recording's clock."""
        return (np.arange(len(self)) - self.keep.start) * self.step_s

    def recorded_length_s(self) -> float:
        return (self.keep.stop - self.keep.start) * self.step_s

    def thinned(self, factor: int) -> Plan:
        """Every `factor`-th sample, of all arrays that are as long as the plan."""

        def thin(part: Any) -> Any:
            if isinstance(part, dict):
                return {name: thin(one) for name, one in part.items()}
            if isinstance(part, tuple):
                return tuple(map(thin, part))
            if isinstance(part, Plan | Foot | Load):
                return replace(part, **{f.name: thin(getattr(part, f.name)) for f in fields(part)})
            over_time = isinstance(part, np.ndarray) and len(part) == len(self)
            return part[::factor] if over_time else part

        keep = slice(self.keep.start // factor, -(-self.keep.stop // factor))
        return replace(thin(self), step_s=self.step_s * factor, keep=keep)


# --- the poses that follow from a plan, wherever the pelvis is ------------------------------------


DOWN = np.array([0.0, -1.0, 0.0])
# Of a clavicle at an arm raised by 120 degrees (Ludewig 2009, J Bone Joint Surg Am 91): raised,
# drawn back, turned backwards about its own axis.
RHYTHM_RAD = np.deg2rad([10.0, 16.0, 30.0])
RAISED = 1.0 - np.cos(np.deg2rad(120.0))
Turns = dict[str, np.ndarray]
"""Rotations (T, 3, 3) of bodies against the body they hang on; of the pelvis in the walkway frame,
nominal in flight. None of the thorax where the trunk is stiff."""


def clavicle_turn(arm_in_thorax: np.ndarray, own_rad: np.ndarray, sign: float) -> np.ndarray:
    """(T, 3, 3) rotation of a clavicle against the thorax, none where the arm hangs.

    arm_in_thorax : (T, 3, 3). own_rad : (T, 2) raised and brought forward on top of the arm's
    rhythm.
    sign : 1 of the right side, -1 of the left one.
    """
    part = (1.0 - arm_in_thorax[:, 1, 1]) / RAISED
    raised, back, turned = (part * angle for angle in RHYTHM_RAD)
    raised, forward = raised + own_rad[:, 0], own_rad[:, 1] - back
    return about_y(sign * forward) @ about_x(-sign * raised) @ about_z(turned)


def turns_of(person: Person, plan: Plan) -> Turns:
    """What the plan prescribes above the hips, wherever the pelvis is."""
    angles = plan.angles_rad
    turns = {
        "lower_torso": euler_zxy(plan.pelvis_angles_rad),
        "abdomen": euler_zxy(angles["waist"]),
        "head": euler_zxy(angles["neck"]),
    }
    if "spine" in angles:
        turns["thorax"] = euler_zxy(angles["spine"])
    for side, sign in SIDE_SIGN.items():
        flexion, deviation, pronation = angles[f"wrist_{side}"].T
        arm = euler_zxy(np.array([1.0, -sign, sign]) * angles[f"shoulder_{side}"])
        turns[f"upper_arm_{side}"] = arm
        if f"sternoclavicular_{side}" in person.joints_m:
            own = angles.get(f"girdle_{side}", np.zeros((len(plan), 2)))
            turns[f"clavicle_{side}"] = clavicle_turn(arm, own, sign)
        elbow = angles[f"elbow_{side}"]
        turns[f"forearm_{side}"] = about_axis(person.hinges[f"elbow_{side}"], elbow)
        wrist = about_y(sign * pronation) @ about_z(flexion) @ about_x(-sign * deviation)
        turns[f"hand_{side}"] = wrist
    return turns


def poses_of(
    person: Person, plan: Plan, turns: Turns, pelvis_m: np.ndarray, pelvis_rotation: np.ndarray
) -> Poses:
    """All bodies' poses for the pelvis' path (T, 3) and rotation (T, 3, 3), and ``turns_of`` the
    plan."""
    joints = person.joints_m
    poses = Poses({"lower_torso": pelvis_rotation}, {"lower_torso": pelvis_m}, np.zeros(len(plan)))
    rotation, origin = poses.rotation, poses.origin_m

    def hang(body: str, parent: str, place_m: np.ndarray) -> None:
        origin[body] = poses.point(parent, place_m)
        rotation[body] = rotation[parent] @ turns[body]

    hang("abdomen", "lower_torso", np.zeros(3))
    thorax = rotation["abdomen"] @ turns["thorax"] if "thorax" in turns else rotation["abdomen"]
    origin["thorax"] = poses.point("abdomen", joints["tjc"]) + rotate(thorax, joints["cjc"])
    rotation["thorax"] = thorax
    origin["head"], rotation["head"] = origin["thorax"], thorax @ turns["head"]
    for side in SIDES:
        upper, lower, clavicle = (f"{b}_{side}" for b in ("upper_arm", "forearm", "clavicle"))
        shoulder = joints[f"shoulder_{side}"]
        hang(upper, "thorax", shoulder)
        if clavicle in turns:
            joint = joints[f"sternoclavicular_{side}"]
            hang(clavicle, "thorax", joint)
            origin[upper] = poses.point(clavicle, shoulder - joint)
        hang(lower, upper, joints[f"elbow_{side}"])
        hang(f"hand_{side}", lower, joints[f"wrist_{side}"])
        excess = _leg(person, plan, side, poses)
        np.maximum(poses.excess_reach_m, excess, out=poses.excess_reach_m)
    return poses


def _leg(person: Person, plan: Plan, side: str, poses: Poses) -> np.ndarray:
    """Thigh and shank between the hip and the planned ankle; returns the excess reach.

    The knee angle follows from the distance (law of cosines, exact for a tilted hinge);
    the free turn about the line from hip to ankle brings the hinge between the lateral
    axes of the pelvis and of the foot.
    """
    planned, hinge = plan.feet[side], person.hinges[f"knee_{side}"]
    thigh, shank, foot = (f"{name}_{side}" for name in ("thigh", "shank", "foot"))
    hip = poses.point("lower_torso", person.joints_m[f"hip_{side}"])
    line = planned.position_m - hip
    distance = np.linalg.norm(line, axis=1)
    upper, lower = person.lengths_m[thigh], person.lengths_m[shank]
    longest = plan.longest_reach * (upper + lower)
    reach = np.minimum(distance, longest)

    along = float(hinge @ DOWN)
    cosine = (reach**2 - upper**2 - lower**2) / (2.0 * upper * lower)
    cosine = (cosine - along**2) / (1.0 - along**2)
    bend = about_axis(hinge, -np.arccos(np.clip(cosine, -1.0, 1.0)))
    ankle_in_thigh = upper * DOWN + lower * rotate(bend, DOWN)
    lateral = poses.rotation["lower_torso"][:, :, 2] + planned.rotation[:, :, 2]
    in_thigh = frame_of(ankle_in_thigh, np.broadcast_to(hinge, ankle_in_thigh.shape))
    poses.origin_m[thigh] = hip
    poses.rotation[thigh] = frame_of(line, lateral) @ transpose(in_thigh)
    poses.origin_m[shank] = poses.point(thigh, upper * DOWN)
    poses.rotation[shank] = poses.rotation[thigh] @ bend
    poses.origin_m[foot], poses.rotation[foot] = planned.position_m, planned.rotation
    return np.maximum(distance - longest, 0.0)


# --- a movement under construction: arrays that the movements add to, then a plan -----------------


MARGIN_S = 0.1  # simulated before and after what is recorded
STANDING_REACH = 0.9925  # leg length in quiet stance, of the straight leg
TOE_OUT_RAD = np.deg2rad(8.0)
HEEL_SHARE, TOE_SHARE = -0.27, 0.73  # of a flat foot: heel, metatarsal heads ahead of the ankle
SWAY_M = (0.004, 0.003)  # ahead, aside


@dataclass(eq=False)
class FootSketch:
    """How one foot moves. Times (T,); the foot is flat on the ground when all is zero.

    ahead_m, aside_m : (T,) ankle over the ground, foot flat; raised_m : (T, 3) added.
    toe_roll_rad : heel up about the metatarsal heads; heel_roll_rad : toes up about the heel.
    tilt_rad : (T, 3) turn about the ankle (Z, X, Y), for a foot in the air.
    cop_ahead_m : centre of pressure ahead of the ankle along the foot.
    """

    ahead_m: np.ndarray
    aside_m: np.ndarray
    raised_m: np.ndarray
    toe_roll_rad: np.ndarray
    heel_roll_rad: np.ndarray
    tilt_rad: np.ndarray
    share: np.ndarray
    cop_ahead_m: np.ndarray
    on_plate: np.ndarray


@dataclass(eq=False)
class Sketch:
    """The joint angles and feet of a person, first in natural stance for all times t_s."""

    person: Person
    t_s: np.ndarray
    recorded_s: tuple[float, float]
    angles: dict[str, np.ndarray] = field(init=False)
    pelvis_angles: np.ndarray = field(init=False)
    pelvis_m: np.ndarray = field(init=False)
    feet: dict[str, FootSketch] = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.t_s)
        self.pelvis_angles = np.zeros((n, 3))
        self.angles = {"waist": np.zeros((n, 3)), "neck": np.zeros((n, 3))}
        self.feet, heights, person = {}, [], self.person
        for side in SIDES:
            # the lumbar joint is as high as the lower hip allows with nearly straight legs
            leg = person.lengths_m[f"thigh_{side}"] + person.lengths_m[f"shank_{side}"]
            hip, ankle_m = person.joints_m[f"hip_{side}"], SIDE_SIGN[side] * self.half_stance_m()
            reach = np.sqrt((STANDING_REACH * leg) ** 2 - (hip[2] - ankle_m) ** 2)
            heights.append(person.ankle_height_m + reach - hip[1])
            self.angles[f"shoulder_{side}"] = np.zeros((n, 3)) + np.deg2rad([2.0, 12.0, 10.0])
            self.angles[f"elbow_{side}"] = np.zeros(n) + np.deg2rad(16.0)
            self.angles[f"wrist_{side}"] = np.zeros((n, 3)) + np.deg2rad([3.0, 0.0, 70.0])
            raised, tilt = np.zeros((2, n, 3))
            still = (np.zeros(n), np.full(n, ankle_m), raised, np.zeros(n), np.zeros(n), tilt)
            loaded = (np.full(n, 0.5), np.full(n, self.mid_foot_m()), np.ones(n, dtype=bool))
            self.feet[side] = FootSketch(*still, *loaded)
        self.pelvis_m = np.tile([0.035, min(heights), 0.0], (n, 1))

    def half_stance_m(self) -> float:
        """Half the distance of the ankles in natural stance."""
        return 0.062 * self.person.stature_m

    def mid_foot_m(self) -> float:
        """Middle of the base of support ahead of the ankle."""
        return 0.25 * self.person.lengths_m["foot_r"]

    def bend(self, name: str, angle_rad: np.ndarray | float) -> None:
        """Add to an angle by its name and column, as "waist 0", "elbow_r" or "pelvis 2"."""
        joint, _, column = name.strip().partition(" ")
        angle = self.pelvis_angles if joint == "pelvis" else self.angles[joint]
        angle = angle[:, int(column)] if column else angle
        angle += angle_rad

    def bend_both(self, name: str, angle_rad: np.ndarray | float) -> None:
        """Add to an angle of either side, as "shoulder_* 1"."""
        for side in SIDES:
            self.bend(name.replace("*", side), angle_rad)

    def shift_load(self, side: str, part: np.ndarray) -> None:
        """Move a part (T,) of the body's weight from one foot to the other one."""
        self.feet[side].share -= part
        self.feet[other_side(side)].share += part

    def sample_of(self, time_s: float) -> int:
        return round((time_s - self.t_s[0]) / STEP_S)

    def plan(self, **options: Any) -> Plan:
        """Freeze the sketch; `options` are further fields of `Plan`."""
        feet = {}
        for side, foot in self.feet.items():  # as the path of its ankle, and its frame
            length = self.person.lengths_m[f"foot_{side}"]
            toe_turn, heel_turn = about_z(-foot.toe_roll_rad), about_z(foot.heel_roll_rad)
            ankle = np.broadcast_to([0.0, self.person.ankle_height_m, 0.0], foot.raised_m.shape)
            for share, turn in ((TOE_SHARE, toe_turn), (HEEL_SHARE, heel_turn)):
                pivot = np.array([share * length, 0.0, 0.0])
                ankle = pivot + rotate(turn, ankle - pivot)
            yaw = about_y(np.full(1, -SIDE_SIGN[side] * TOE_OUT_RAD))[0]
            base = np.stack([foot.ahead_m, np.zeros_like(foot.ahead_m), foot.aside_m], axis=1)
            feet[side] = Foot(
                position_m=base + foot.raised_m + rotate(yaw, ankle),
                rotation=yaw @ heel_turn @ toe_turn @ euler_zxy(foot.tilt_rad),
                share=foot.share,
                cop_m=base[:, [0, 2]] + yaw[[0, 2], 0] * foot.cop_ahead_m[:, None],
                on_plate=foot.on_plate,
            )
        start = self.sample_of(self.recorded_s[0])
        samples = round((self.recorded_s[1] - self.recorded_s[0]) / STEP_S)
        return Plan(
            step_s=STEP_S,
            angles_rad=self.angles,
            pelvis_angles_rad=self.pelvis_angles,
            pelvis_m=self.pelvis_m,
            feet=feet,
            keep=slice(start, start + samples),
            **options,
        )


def sketch_for(person: Person, duration_s: float) -> Sketch:
    """An empty sketch recorded from 0 to duration_s, with margins around it."""
    samples = round((duration_s + 2.0 * MARGIN_S) / STEP_S) + 1
    return Sketch(person, np.arange(samples) * STEP_S - MARGIN_S, (0.0, duration_s))


def other_side(side: str) -> str:
    """The left side of the right one, and the other way round."""
    return "l" if side == "r" else "r"


def moved_a_little(
    sketch: Sketch, rng: np.random.Generator, breath_deg: float, sway: float = 1.0
) -> None:
    """Add a breath of motion, and a slow drift of the COP along the feet and, while both carry
    load, between them: nobody stands quite still."""
    add_breath_of_motion(sketch, rng, np.deg2rad(breath_deg))
    ahead, aside = (slow_drift(sketch.t_s, rng, sway * size, 0.15, 0.8) for size in SWAY_M)
    aside = aside / (2.0 * sketch.half_stance_m())
    aside *= 4.0 * sketch.feet["r"].share * sketch.feet["l"].share
    for side, sign in SIDE_SIGN.items():
        sketch.feet[side].cop_ahead_m += ahead
        sketch.feet[side].share += sign * aside


def plate_under(sketch: Sketch, rng: np.random.Generator) -> tuple[float, float]:
    """A plate centre near the middle of natural stance."""
    return (sketch.mid_foot_m() + rng.normal(0.0, 0.02), rng.normal(0.0, 0.03))


def add_breath_of_motion(sketch: Sketch, rng: np.random.Generator, size_rad: float) -> None:
    """Tiny drift of all joint angles of the upper body, and of the pelvis."""
    for angle in [*sketch.angles.values(), sketch.pelvis_angles]:
        for column in np.atleast_2d(angle.T):
            column += slow_drift(sketch.t_s, rng, size_rad, 0.15, 0.7)


def add_squat(sketch: Sketch, down: np.ndarray, depth_m: float) -> None:
    """Lower the pelvis by depth_m times `down` (T,), and lean the trunk with it."""
    sketch.pelvis_m[:, 1] -= depth_m * down
    lean = np.deg2rad(60.0) * depth_m * down
    sketch.pelvis_angles[:, 0] -= 1.6 * lean
    sketch.angles["waist"][:, 0] -= 1.5 * lean
    sketch.angles["neck"][:, 0] += 1.5 * lean


def held_ball(
    sketch: Sketch, rng: np.random.Generator, side: str, release_s: float, mass_kg: float
) -> Ball:
    """A ball in front of the palm, let go over about 10 ms around release_s."""
    hold = 1.0 - step(sketch.t_s, release_s - 0.006, release_s + 0.006)
    place = np.array([0.035, -0.95 * sketch.person.lengths_m[f"hand_{side}"], 0.0])
    place = place + 0.004 * rng.standard_normal(3)
    return Ball(f"hand_{side}", place, mass_kg, hold, release_s)
