"""One simulated trial: poses, ground wrench of each foot, and what the plates measure of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.simulate.balance import balanced
from bsip_cli.simulate.effects.base import Effect
from bsip_cli.simulate.kinematics import ground_wrench
from bsip_cli.simulate.movements import DEFAULT_DURATION_S, MOVEMENTS
from bsip_cli.simulate.numerics import runs
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import STEP_S, Plan, Poses

THIN = 4  # trials without flight are balanced at 250 Hz and interpolated
PUSH = 0.06  # of standing feet against each other, of the less loaded foot's vertical force
LOADED_N = 1.0


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

    def all_contacts_measured(self) -> np.ndarray:
        """(T,) no foot on the ground beside the plate."""
        on_ground = {side: np.abs(self.feet_force_n[side]).max(axis=1) > 0.0 for side in SIDES}
        return ~np.any([on_ground[side] & ~self.on_plate[side] for side in SIDES], axis=0)

    def feet_wrenches(self, apart: bool) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Force and moment (T, 3) of each foot; ``apart``: with the push between them.

        The push acts along the line between the feet's centres of pressure, so that nobody but the
        plates feels it.
        """
        feet = {side: (self.feet_force_n[side], self.feet_moment_nm[side]) for side in SIDES}
        if not apart:
            return feet
        centres = {side: _centre_of_pressure(*feet[side]) for side in SIDES}
        one, other = SIDES
        line = centres[other] - centres[one]
        line /= np.maximum(np.linalg.norm(line, axis=1), 1e-9)[:, None]
        load = np.minimum(feet[one][0][:, 1], feet[other][0][:, 1])
        push = PUSH * np.where(load > LOADED_N, load, 0.0)[:, None] * line
        for side, own in ((one, push), (other, -push)):
            force, moment = feet[side]
            feet[side] = (force + own, moment + np.cross(centres[side], own))
        return feet


def _centre_of_pressure(force: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """(T, 3) on the floor; Y is up."""
    load = np.where(force[:, 1] > LOADED_N, force[:, 1], np.inf)
    return np.stack([moment[:, 2] / load, np.zeros(len(load)), -moment[:, 0] / load], axis=1)


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
    """Wrenches of a balanced movement, cut to what is recorded.

    Each foot has its share of the force, acting under that foot: its COP differs from its plan as
    the whole body's COP differs from its own plan, and the free moment is shared like the force.
    """
    keep = plan.keep
    wrench = ground_wrench(person.inertias, poses, plan.step_s, plan.all_loads())
    force, moment = (part[keep] for part in wrench)
    planned, feet_force, feet_moment = plan.cop_m()[keep], {}, {}
    for side, foot in plan.feet.items():
        share, aside = foot.share[keep, None], foot.cop_m[keep] - planned
        lever = np.stack([aside[:, 0], np.zeros(len(aside)), aside[:, 1]], axis=1)
        feet_force[side] = share * force
        feet_moment[side] = share * moment + np.cross(lever, feet_force[side])
    return Trial(
        task=task,
        time_s=np.arange(keep.stop - keep.start) * STEP_S,
        poses=poses.part(keep),
        force_n=force,
        moment_nm=moment,
        feet_force_n=feet_force,
        feet_moment_nm=feet_moment,
        on_plate={side: foot.on_plate[keep] for side, foot in plan.feet.items()},
        contacts=_contacts(plan),
        plan=plan,
    )


def _contacts(plan: Plan) -> tuple[Contact, ...]:
    """The loaded stretches of each foot within the recording, in order of time."""
    contacts = []
    for side, foot in plan.feet.items():
        share, cop, on_plate = (a[plan.keep] for a in (foot.share, foot.cop_m, foot.on_plate))
        for part in runs(share > 1e-9):
            start, end = round(part.start * STEP_S, 3), round((part.stop - 1) * STEP_S, 3)
            ahead, aside = cop[part].mean(axis=0).tolist()
            contacts.append(Contact(side, start, end, bool(on_plate[part].any()), (ahead, aside)))
    return tuple(sorted(contacts, key=lambda contact: (contact.start_s, contact.side)))
