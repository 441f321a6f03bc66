"""Blocks of movement, and the trials that are put together from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from tests.blind.second_world.body import SIDES, Body
from tests.blind.second_world.motion import Motion
from tests.blind.second_world.smooth import step, window


class Block:
    """A stretch of a motion with its random pace; courses are 0 outside of it.

    phase_rad : that some of its parts are ahead of others.
    """

    def __init__(self, motion: Motion, start_s: float, length_s: float) -> None:
        self.motion, self.start_s, self.length_s = motion, start_s, length_s
        self.within = window(motion.t, start_s, length_s, 0.7)
        self.draw, self.add, self.add_both = motion.rng.uniform, motion.add, motion.add_both
        self.pace_hz, self.phase_rad = self.draw(0.35, 0.6), self.draw(0.0, 2.0 * np.pi)

    def wave(self, rate_hz: float, phase_rad: float = 0.0) -> np.ndarray:
        """Between -1 and 1."""
        since = self.motion.t - self.start_s
        return self.within * np.sin(2.0 * np.pi * rate_hz * since + phase_rad)

    def rise(self, rate_hz: float) -> np.ndarray:
        """Between 0 and 1, from 0 on."""
        since = self.motion.t - self.start_s
        return self.within * (0.5 - 0.5 * np.cos(2.0 * np.pi * rate_hz * since))


def bow(block: Block) -> None:
    down = block.draw(0.5, 0.9) * block.rise(block.draw(0.3, 0.45))
    block.add("trunk_pitch", 0.7 * down)
    block.add("pelvis_pitch", 0.5 * down)
    block.add("neck_pitch", -0.3 * down * block.draw(0.0, 1.0))
    for side in SIDES:
        block.add(f"flexion_{side}", down * block.draw(0.3, 0.9))


def lean_sideways(block: Block) -> None:
    over = block.wave(block.draw(0.3, 0.5))
    block.add("trunk_roll", block.draw(0.3, 0.45) * over)
    block.add("pelvis_roll", 0.12 * over * block.draw(0.3, 1.0))
    block.add("neck_roll", 0.2 * over)
    for side in SIDES:
        block.add(f"abduction_{side}", 0.5 * block.within * block.draw(0.5, 1.5))


def twist(block: Block) -> None:
    turn = block.wave(block.draw(0.4, 0.7))
    block.add("trunk_yaw", block.draw(0.35, 0.55) * turn)
    block.add("pelvis_yaw", 0.25 * turn)
    block.add("neck_yaw", -0.3 * turn * block.draw(-1.0, 1.0))
    apart = block.draw(0.8, 1.4)
    for side in SIDES:
        block.add(f"abduction_{side}", apart * block.within)
        block.add(f"elbow_{side}", block.draw(0.0, 0.8) * block.within)


def swing_arms(block: Block) -> None:
    swing = block.draw(0.5, 1.0) * block.wave(block.draw(0.6, 1.0))
    together = block.motion.rng.choice([-1, 1])
    block.add("flexion_r", swing + 0.3 * block.within)
    block.add("flexion_l", together * swing + 0.3 * block.within)
    block.add("elbow_r", 0.4 * block.rise(0.7))
    block.add("elbow_l", 0.4 * block.rise(0.8))


def circle_arms(block: Block) -> None:
    rate, wide = block.draw(0.5, 0.8), block.draw(0.6, 0.9)
    direction = block.motion.rng.choice([-1, 1])
    block.add_both("flexion", wide * block.wave(rate) + 0.9 * block.within)
    sideways = 0.7 * wide * block.wave(rate, direction * np.pi / 2.0)
    block.add_both("abduction", sideways + 0.5 * block.within)


def raise_arms(block: Block) -> None:
    rate, high = block.draw(0.35, 0.55), block.draw(1.2, 1.9)
    block.add_both("abduction", high * block.rise(rate))
    block.add_both("rotation", 0.4 * block.wave(rate))
    block.add_both("pronation", -0.5 * block.rise(rate))


def squat(block: Block) -> None:
    rate, deep = block.draw(0.35, 0.55), block.draw(0.15, 0.30)
    down = block.rise(rate)
    block.add("up", -deep * down)
    block.add("trunk_pitch", 1.25 * deep * down)
    block.add("pelvis_pitch", 1.1 * deep * down)
    block.add("neck_pitch", -0.25 * down)
    block.add_both("flexion", block.draw(0.5, 1.4) * down)


def _swing_leg(block: Block, side: str) -> None:
    """Ahead and back, to the side, or both, once or twice."""
    motion, draw, sign = block.motion, block.draw, SIDES[side]
    far, wide, high = draw(0.1, 0.3), draw(0.05, 0.2), draw(0.12, 0.22)
    turns, manner = int(motion.rng.integers(1, 3)), int(motion.rng.integers(3))

    def path(x: np.ndarray) -> tuple[np.ndarray, ...]:
        off = step(x / 0.25) * step((1.0 - x) / 0.25)
        angle = 2.0 * np.pi * turns * x
        swing, out = np.sin(angle), 0.5 - 0.5 * np.cos(angle)
        if manner == 0:
            up = high + 0.03 * (1.0 - np.cos(2.0 * angle))
            return far * swing * off, sign * 0.04 * off, up * off, 0.25 * swing * off
        if manner == 1:
            sideways = sign * (0.06 + wide * out) * off
            return 0.05 * off, sideways, (0.7 * high + 0.05 * out) * off, 0.1 * off
        sideways = sign * (0.05 + wide * out) * off
        return 0.8 * far * swing * off, sideways, high * off, 0.2 * swing * off

    motion.lift(side, block.start_s + 1.2, block.length_s - 2.4, path)
    while_up = window(motion.t, block.start_s + 0.6, block.length_s - 1.2, 0.9)
    for arm in SIDES:
        motion.add(f"abduction_{arm}", while_up * draw(0.3, 0.9))
    motion.add("trunk_roll", -0.06 * sign * while_up * draw(0.0, 1.5))
    motion.add("trunk_pitch", 0.08 * while_up * draw(0.0, 1.0))
    motion.add("pelvis_roll", 0.05 * sign * while_up)


def shift_weight(block: Block) -> None:
    motion = block.motion
    forth = block.wave(block.draw(0.2, 0.3)) * block.draw(0.03, 0.05) * motion.body.scale
    motion.ahead_m = motion.ahead_m + forth
    across = block.wave(block.draw(0.25, 0.4), block.phase_rad)
    motion.weight_right = motion.weight_right + 0.22 * across
    motion.add("pelvis_yaw", 0.06 * across)


def head_and_hands(block: Block) -> None:
    block.add("neck_yaw", block.draw(0.4, 0.7) * block.wave(block.draw(0.4, 0.7)))
    block.add(
        "neck_pitch", block.draw(0.2, 0.4) * block.wave(block.draw(0.3, 0.6), block.phase_rad)
    )
    block.add("neck_roll", 0.25 * block.wave(0.4, 1.0))
    for side in SIDES:
        block.add(f"elbow_{side}", block.draw(0.8, 1.5) * block.rise(block.draw(0.6, 1.0)))
        block.add(f"pronation_{side}", 0.6 * block.wave(block.draw(0.5, 0.9)))
        block.add(f"wrist_{side}", 0.5 * block.wave(block.draw(0.7, 1.1)))
        block.add(f"wrist_side_{side}", 0.2 * block.wave(0.6))


def all_together(block: Block) -> None:
    rate = block.draw(0.35, 0.5)
    down, turn = block.rise(rate), block.wave(0.5 * rate + 0.1, block.phase_rad)
    block.add("up", -block.draw(0.08, 0.2) * down)
    block.add("trunk_yaw", 0.4 * turn)
    block.add("pelvis_yaw", 0.15 * turn)
    block.add("trunk_pitch", 0.3 * down)
    block.add("pelvis_pitch", 0.15 * down)
    block.add("trunk_roll", 0.15 * block.wave(0.8 * rate, 1.0))
    swing = 0.8 * block.wave(1.3 * rate)
    block.add("flexion_r", 0.6 * block.within + swing)
    block.add("flexion_l", 0.6 * block.within - swing)
    block.add("abduction_r", 0.5 * block.rise(0.9 * rate))
    block.add("abduction_l", 0.4 * block.rise(1.1 * rate))
    block.add("elbow_r", 0.8 * down)
    block.add("elbow_l", 0.7 * block.rise(1.2 * rate))
    block.motion.weight_right = block.motion.weight_right + 0.1 * turn


def punch(block: Block) -> None:
    rate = 1.6 * block.pace_hz
    for side, forth in (("r", block.rise(rate)), ("l", block.within - block.rise(rate))):
        block.add(f"flexion_{side}", 1.2 * forth + 0.1 * block.within)
        block.add(f"elbow_{side}", 1.4 * (block.within - forth))
        block.add(f"rotation_{side}", 0.2 * block.within)
    block.add("trunk_yaw", 0.2 * block.wave(rate))
    block.add("pelvis_pitch", 0.05 * block.within)


def circle_pelvis(block: Block) -> None:
    rate = block.draw(0.4, 0.6)
    roll, pitch = block.wave(rate, block.phase_rad), block.wave(0.8 * rate, 1.3)
    block.add("pelvis_yaw", 0.15 * block.wave(0.7 * rate))
    block.add("pelvis_roll", 0.10 * roll)
    block.add("pelvis_pitch", 0.15 * pitch)
    block.add("trunk_pitch", -0.12 * pitch)
    block.add("trunk_roll", -0.08 * roll)
    block.add("up", -0.05 * block.rise(rate))


_LEGS = tuple(partial(_swing_leg, side=side) for side in SIDES)
_ONCE = (
    *(bow, lean_sideways, twist, swing_arms, circle_arms, raise_arms, squat, *_LEGS),
    *(shift_weight, head_and_hands, all_together, punch, circle_pelvis, *_LEGS),
)
_AGAIN = (all_together, swing_arms, squat, twist, *_LEGS, circle_arms, raise_arms)


def sequence(motion: Motion, length_s: float) -> None:
    """All blocks in random order, as many as there is time for."""
    order = _shuffled(motion, _ONCE)
    if _stretch(order, length_s) > 1.35:
        order += _shuffled(motion, _AGAIN)
    stretch, start = min(1.25, _stretch(order, length_s)), 1.2
    for block in order:
        length = _usual_s(block) * stretch
        if block in _LEGS:
            length = max(length, 5.2)
        if start + length > length_s - 1.0:
            break
        block(Block(motion, start, length))
        start += length - (0.1 if block in _LEGS else 0.5)


def _shuffled(motion: Motion, blocks: tuple) -> list[Callable[[Block], None]]:
    return [blocks[k] for k in motion.rng.permutation(len(blocks))]


def _usual_s(block: Callable[[Block], None]) -> float:
    return 6.0 if block in _LEGS else 4.2


def _stretch(order: list[Callable[[Block], None]], length_s: float) -> float:
    """How much longer than usual the blocks may be; neighbours overlap by half a second."""
    return (length_s - 2.6 + 0.5 * (len(order) - 1)) / sum(_usual_s(block) for block in order)


def squats(motion: Motion, length_s: float) -> None:
    t, add, draw = motion.t, motion.add, motion.rng.uniform
    within = window(t, 1.0, length_s - 2.0, 1.0)
    down = within * (0.5 - 0.5 * np.cos(2.0 * np.pi * draw(0.4, 0.55) * (t - 1.0)))
    deep = draw(0.18, 0.30)
    add("up", -deep * down)
    add("trunk_pitch", 1.2 * deep * down)
    add("pelvis_pitch", 1.12 * deep * down)
    add("neck_pitch", -0.25 * down)
    swing = 0.2 * within * np.sin(2.0 * np.pi * 0.8 * t)
    motion.add_both("flexion", draw(0.8, 1.4) * down + swing)
    motion.add_both("abduction", 0.1 * within)
    motion.add_both("elbow", 0.3 * down)
    add("trunk_yaw", 0.15 * within * np.sin(2.0 * np.pi * 0.22 * t))
    motion.weight_right = motion.weight_right + 0.06 * within * np.sin(2.0 * np.pi * 0.17 * t)


def heel_drops(motion: Motion, length_s: float) -> None:
    """Onto the balls of the feet and down hard: the pelvis goes on a little and comes back."""
    t, draw, start = motion.t, motion.rng.uniform, 1.3
    while start < length_s - 3.0:
        up, hold, drop = draw(0.6, 0.9), draw(0.2, 0.5), draw(0.26, 0.36)
        motion.raise_heels(start, up, hold, drop, draw(0.28, 0.40))
        down = start + up + hold + drop
        since = np.clip(t - down, 0.0, None)
        ringing = np.exp(-since / 0.22) * np.sin(2.0 * np.pi * 2.2 * since) * step(since / 0.12)
        motion.bounce_m = motion.bounce_m - draw(0.015, 0.03) * ringing
        motion.add_both("flexion", 0.3 * window(t, start, up + hold + 0.8, 0.4))
        motion.add("trunk_pitch", 0.05 * window(t, down - 0.1, 1.0, 0.2))
        start = down + draw(1.3, 1.8)


def steps_in_place(motion: Motion, length_s: float) -> None:
    """A foot goes ahead and back, then the other; the arms move along."""
    t, draw, start = motion.t, motion.rng.uniform, 2.2
    side = str(motion.rng.choice(["r", "l"]))
    while start < length_s - 5.2:
        far, wide = draw(0.10, 0.17), SIDES[side] * draw(0.0, 0.05)
        motion.lift(side, start, 0.8, _stride(far, wide, 1.0), shift_s=0.75)
        motion.lift(side, start + 2.4, 0.8, _stride(far, wide, -1.0), shift_s=0.75)
        within, since = window(t, start - 0.4, 3.8, 0.8), t - start
        swing = 0.4 * within * np.sin(2.0 * np.pi * 0.5 * since)
        motion.add("flexion_r", swing)
        motion.add("flexion_l", -swing)
        motion.add("trunk_yaw", 0.12 * within * np.sin(2.0 * np.pi * 0.42 * since))
        side, start = "l" if side == "r" else "r", start + 4.9


def _stride(far_m: float, wide_m: float, forth: float) -> Callable[[np.ndarray], tuple]:
    def path(x: np.ndarray) -> tuple[np.ndarray, ...]:
        off, over = step(x / 0.4) * step((1.0 - x) / 0.4), forth * step((x - 0.1) / 0.8)
        return far_m * over, wide_m * over, 0.10 * off, 0.2 * forth * off

    return path


def sway(motion: Motion, length_s: float) -> None:
    shift_weight(Block(motion, 1.0, length_s - 2.0))
    swing_arms(Block(motion, 1.0, 0.45 * length_s))
    twist(Block(motion, 0.45 * length_s, 0.5 * length_s))
    bow(Block(motion, 0.3 * length_s, 0.4 * length_s))


def stand_still(motion: Motion, length_s: float) -> None:
    """Arms a little further off the body, for all of it."""
    motion.add_both("abduction", np.full(len(motion.t), 0.15))


@dataclass(frozen=True)
class Trial:
    """move : adds a movement to a motion of length_s."""

    length_s: float
    move: Callable[[Motion, float], None]


TRIALS = {
    "static": Trial(4.5, stand_still),
    "sequence": Trial(45.0, sequence),
    "squat": Trial(10.5, squats),
    "heeldrop": Trial(11.0, heel_drops),
    "steps": Trial(12.2, steps_in_place),
    "sway": Trial(12.0, sway),
}


def moving(
    task: str,
    body: Body,
    rate_hz: float,
    rng: np.random.Generator,
    wide: bool,
    length_s: float | None = None,
) -> Motion:
    """The motion of a task, of its usual length unless told."""
    trial = TRIALS[task]
    length_s = trial.length_s if length_s is None else length_s
    motion = Motion(body, length_s, rate_hz, rng, wide, quiet=task == "static")
    trial.move(motion, length_s)
    return motion
