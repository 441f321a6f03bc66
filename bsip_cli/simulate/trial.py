"""One simulated trial: poses, ground wrench of each foot, and what the plates measure of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.simulate.balance import balanced
from bsip_cli.simulate.effects.base import Effect
from bsip_cli.simulate.movements import DEFAULT_DURATION_S, MOVEMENTS
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import STEP_S, Foot, Plan
from bsip_cli.simulate.poses import Poses
from bsip_cli.simulate.wrench import ground_wrench

THIN = 4  # trials without flight are balanced at 250 Hz and interpolated


@dataclass(frozen=True)
class Contact:
    """One contact of one foot with the ground. Times on the recording's clock."""

    side: str
    start_s: float
    end_s: float
    on_plate: bool
    cop_m: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Trial:
    """A simulated trial at 1000 Hz, walkway frame (X ahead, Y up, Z right, origin on the ground).

    time_s : (T,) on the recording's clock.
    poses : of all bodies.
    force_n, moment_nm : (T, 3) total ground wrench on the body, moment about the origin.
    feet_force_n, feet_moment_nm : the same by side; both feet sum to the total.
    on_plate : (T,) by side: whether the foot's contact (if any) is on the first plate.
    """

    task: str
    time_s: np.ndarray
    poses: Poses
    force_n: np.ndarray
    moment_nm: np.ndarray
    feet_force_n: dict[str, np.ndarray]
    feet_moment_nm: dict[str, np.ndarray]
    on_plate: dict[str, np.ndarray]
    contacts: tuple[Contact, ...]
    plan: Plan

    def plate_wrench(self) -> tuple[np.ndarray, np.ndarray]:
        """Force and moment (T, 3) of the contacts on the first plate."""
        force, moment = np.zeros_like(self.force_n), np.zeros_like(self.force_n)
        for side in SIDES:
            on = self.on_plate[side][:, None]
            force += on * self.feet_force_n[side]
            moment += on * self.feet_moment_nm[side]
        return force, moment

    def all_contacts_measured(self) -> np.ndarray:
        """(T,) no foot on the ground beside the plate."""
        off = [
            ~self.on_plate[side] & (np.abs(self.feet_force_n[side]).max(axis=1) > 0.0)
            for side in SIDES
        ]
        return ~(off[0] | off[1])


def simulate_trial(
    person: Person,
    task: str,
    rng: np.random.Generator,
    duration_s: float | None = None,
    ball_mass_kg: float = 0.3,
    effects: Sequence[Effect] = (),
) -> Trial:
    """Draw a movement, hide effects in it, and make it physically possible."""
    duration = DEFAULT_DURATION_S[task] if duration_s is None else duration_s
    for effect in effects:
        person = effect.body(person)
    plan = MOVEMENTS[task](person, rng, duration, ball_mass_kg)
    for effect in effects:
        plan = effect.plan(person, plan)
    poses = balanced(person, plan, 1 if plan.flights else THIN)
    return trial_of(person, task, plan, poses)


def trial_of(person: Person, task: str, plan: Plan, poses: Poses) -> Trial:
    """Wrenches of a balanced movement, cut to what is recorded."""
    force, moment = ground_wrench(person.inertias, poses, plan.step_s, plan.all_loads())
    keep, planned = plan.keep, plan.cop_m()
    feet_force, feet_moment = {}, {}
    for side in SIDES:
        foot = plan.feet[side]
        feet_force[side], feet_moment[side] = _foot_wrench(foot, planned, force, moment, keep)
    samples = keep.stop - keep.start
    return Trial(
        task=task,
        time_s=np.arange(samples) * STEP_S,
        poses=poses.part(keep),
        force_n=force[keep],
        moment_nm=moment[keep],
        feet_force_n=feet_force,
        feet_moment_nm=feet_moment,
        on_plate={side: plan.feet[side].on_plate[keep] for side in SIDES},
        contacts=_contacts(plan),
        plan=plan,
    )


def _foot_wrench(
    foot: Foot, planned_cop: np.ndarray, force: np.ndarray, moment: np.ndarray, keep: slice
) -> tuple[np.ndarray, np.ndarray]:
    """A foot's part of the wrench: its share of the force, acting under that foot.

    The foot's COP differs from its plan as the whole body's COP differs from its own plan,
    and the free moment is shared like the force.
    """
    share = foot.share[keep, None]
    aside = foot.cop_m[keep] - planned_cop[keep]
    lever = np.stack([aside[:, 0], np.zeros(len(aside)), aside[:, 1]], axis=1)
    part = share * force[keep]
    return part, share * moment[keep] + np.cross(lever, part)


def _contacts(plan: Plan) -> tuple[Contact, ...]:
    """The loaded stretches of each foot within the recording, in order of time."""
    contacts = []
    for side in SIDES:
        foot, keep = plan.feet[side], plan.keep
        loaded = (foot.share[keep] > 1e-9).astype(int)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], loaded, [0]])))
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            cop = foot.cop_m[keep][a:b].mean(axis=0)
            contacts.append(
                Contact(
                    side,
                    round(a * STEP_S, 3),
                    round((b - 1) * STEP_S, 3),
                    bool(foot.on_plate[keep][a:b].any()),
                    (float(cop[0]), float(cop[1])),
                )
            )
    return tuple(sorted(contacts, key=lambda contact: (contact.start_s, contact.side)))
