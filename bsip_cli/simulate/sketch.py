"""A movement under construction: arrays that the movements add to, then a `Plan`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bsip_cli.simulate.curves import step
from bsip_cli.simulate.landmarks import heel_and_toe_m
from bsip_cli.simulate.loads import Ball
from bsip_cli.simulate.people import SIDE_SIGN, SIDES, Person
from bsip_cli.simulate.plan import STEP_S, Foot, Plan
from bsip_cli.simulate.rotations import about_y, about_z, euler_zxy, rotate

MARGIN_S = 0.1  # simulated before and after what is recorded
STANDING_REACH = 0.9925  # leg length in quiet stance, of the straight leg
TOE_OUT_RAD = np.deg2rad(8.0)


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
    angles: dict[str, np.ndarray] = field(default_factory=dict)
    pelvis_angles: np.ndarray = field(init=False)
    pelvis_m: np.ndarray = field(init=False)
    feet: dict[str, FootSketch] = field(default_factory=dict)

    def __post_init__(self) -> None:
        zero = np.zeros_like(self.t_s)
        triple = np.zeros((len(self.t_s), 3))
        self.pelvis_angles = triple.copy()
        self.angles = {"waist": triple.copy(), "neck": triple.copy()}
        for side in SIDES:
            self.angles[f"shoulder_{side}"] = triple + np.deg2rad([2.0, 12.0, 10.0])
            self.angles[f"elbow_{side}"] = zero + np.deg2rad(16.0)
            self.angles[f"wrist_{side}"] = triple + np.deg2rad([3.0, 0.0, 70.0])
            self.feet[side] = self._standing_foot(side)
        self.pelvis_m = triple + np.array([0.035, self.standing_height_m(), 0.0])

    def _standing_foot(self, side: str) -> FootSketch:
        zero = np.zeros_like(self.t_s)
        triple = np.zeros((len(self.t_s), 3))
        return FootSketch(
            ahead_m=zero.copy(),
            aside_m=zero + SIDE_SIGN[side] * self.half_stance_m(),
            raised_m=triple.copy(),
            toe_roll_rad=zero.copy(),
            heel_roll_rad=zero.copy(),
            tilt_rad=triple.copy(),
            share=zero + 0.5,
            cop_ahead_m=zero + self.mid_foot_m(),
            on_plate=np.ones(len(self.t_s), dtype=bool),
        )

    def half_stance_m(self) -> float:
        """Half the distance of the ankles in natural stance."""
        return 0.062 * self.person.stature_m

    def mid_foot_m(self) -> float:
        """Middle of the base of support ahead of the ankle."""
        return 0.25 * self.person.lengths_m["foot_r"]

    def standing_height_m(self) -> float:
        """Height of the lumbar joint centre with nearly straight legs."""
        person, heights = self.person, []
        for side, sign in SIDE_SIGN.items():
            leg = person.lengths_m[f"thigh_{side}"] + person.lengths_m[f"shank_{side}"]
            hip = person.joints_m[f"hip_{side}"]
            aside = hip[2] - sign * self.half_stance_m()
            reach = np.sqrt((STANDING_REACH * leg) ** 2 - aside**2)
            heights.append(person.ankle_height_m + reach - hip[1])
        return float(min(heights))

    def plan(self, **options: Any) -> Plan:
        """Freeze the sketch; `options` are further fields of `Plan`."""
        start = round((self.recorded_s[0] - self.t_s[0]) / STEP_S)
        samples = round((self.recorded_s[1] - self.recorded_s[0]) / STEP_S)
        return Plan(
            step_s=STEP_S,
            angles_rad=self.angles,
            pelvis_angles_rad=self.pelvis_angles,
            pelvis_m=self.pelvis_m,
            feet={side: self._foot(side) for side in SIDES},
            keep=slice(start, start + samples),
            **options,
        )

    def _foot(self, side: str) -> Foot:
        """The sketched foot as a path of its ankle and frame."""
        foot, height = self.feet[side], self.person.ankle_height_m
        heel, toe = heel_and_toe_m(self.person.lengths_m[f"foot_{side}"])
        ankle = np.broadcast_to([0.0, height, 0.0], foot.raised_m.shape)
        toe_turn, heel_turn = about_z(-foot.toe_roll_rad), about_z(foot.heel_roll_rad)
        pivot = np.array([toe, 0.0, 0.0])
        ankle = pivot + rotate(toe_turn, ankle - pivot)
        pivot = np.array([heel, 0.0, 0.0])
        ankle = pivot + rotate(heel_turn, ankle - pivot)
        yaw = about_y(np.full(1, -SIDE_SIGN[side] * TOE_OUT_RAD))[0]
        base = np.stack([foot.ahead_m, np.zeros_like(foot.ahead_m), foot.aside_m], axis=1)
        cop = yaw[[0, 2], 0] * foot.cop_ahead_m[:, None]
        return Foot(
            position_m=base + foot.raised_m + rotate(yaw, ankle),
            rotation=yaw @ heel_turn @ toe_turn @ euler_zxy(foot.tilt_rad),
            share=foot.share,
            cop_m=base[:, [0, 2]] + cop,
            on_plate=foot.on_plate,
        )


def sketch_for(person: Person, duration_s: float, margin_s: float = MARGIN_S) -> Sketch:
    """An empty sketch recorded from 0 to duration_s, with margins around it."""
    samples = round((duration_s + 2.0 * margin_s) / STEP_S) + 1
    t = np.arange(samples) * STEP_S - margin_s
    return Sketch(person, t, (0.0, duration_s))


def held_ball(
    sketch: Sketch, rng: np.random.Generator, side: str, release_s: float, mass_kg: float
) -> Ball:
    """A ball in front of the palm, let go over about 10 ms around release_s."""
    hold = 1.0 - step(sketch.t_s, release_s - 0.006, release_s + 0.006)
    place = np.array([0.035, -0.95 * sketch.person.lengths_m[f"hand_{side}"], 0.0])
    place = place + 0.004 * rng.standard_normal(3)
    return Ball(f"hand_{side}", mass_kg, place, hold, release_s)
