"""What ten more seconds of each movement would tell about this person, beside what is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from bsip_cli.body.person import Person
from bsip_cli.dynamics.regressor import wrench_regressor
from bsip_cli.identification.data_share import Beforehand, beforehand
from bsip_cli.identification.estimator import Problem
from bsip_cli.identification.movements import (
    DURATION_S,
    Movement,
    load_movements,
    motion_of,
    possible,
)

_ADVISED = 3
_STRIDE = 2  # frames; squares of 2.2 Hz need 9 Hz


@dataclass(frozen=True, eq=False)
class Gain:
    """What a movement adds.

    share : increase of the mean data share of all parameters (0 to 1); segments (n,) of each.
    wrench : part of the unknown variance of the ground wrench that it removes, in the mean of all
        movements (0 to 1): there the heavy segments count.
    """

    movement: Movement
    share: float
    segments: np.ndarray
    wrench: float

    @property
    def best_segment(self) -> int:
        """Index of the segment that gains most."""
        return int(np.argmax(self.segments))


@dataclass(frozen=True)
class Advice:
    """Every possible movement on its own, best first, and the few that help most together.

    A gain in ``together`` counts what the movements before it in the tuple already tell: the
    second best on its own is often the first one's twin.
    """

    alone: tuple[Gain, ...]
    together: tuple[Gain, ...]


def advice(problem: Problem, person: Person, model: pin.Model) -> Advice:
    """Gains over what the recordings of the problem tell, at their noise.

    A second of movement is taken to hold as many independent samples as one of the recordings'.
    """
    known, _ = problem.trusted_equations()
    offers = [
        (movement, _information(movement, problem, person, model))
        for movement in load_movements()
        if possible(movement, person)
    ]
    before = beforehand(problem)
    all_motion = np.sum([added for _, added in offers], axis=0)
    alone = _gains(before, known, offers, all_motion)
    together: list[Gain] = []
    best = alone
    while best and len(together) < _ADVISED:
        together.append(best[0])
        known = known + next(added for m, added in offers if m is best[0].movement)
        offers = [offer for offer in offers if offer[0] is not best[0].movement]
        best = _gains(before, known, offers, all_motion)
    return Advice(tuple(alone), tuple(together))


def _information(
    movement: Movement, problem: Problem, person: Person, model: pin.Model
) -> np.ndarray:
    """(P, P) weighted sum of Y^T Y over the movement, moments about the ground below the pelvis."""
    q, v, a = motion_of(movement, person, model)
    reference = np.append(q[:, :2].mean(axis=0), 0.0)
    q, v, a = (rows[::_STRIDE] for rows in (q, v, a))
    regressor = wrench_regressor(model, model.createData(), q, v, a, reference)
    regressor = regressor * ~problem.prior.fixed_parameters()
    noise = problem.noise
    independent = noise.effective * DURATION_S / problem.equations.duration_s
    rows = regressor * (np.sqrt(independent / len(q)) / noise.rms / problem.trust_ratio)[:, None]
    rows = rows.reshape(-1, rows.shape[-1])
    return rows.T @ rows


def _gains(
    before: Beforehand,
    known: np.ndarray,
    offers: list[tuple[Movement, np.ndarray]],
    all_motion: np.ndarray,
) -> list[Gain]:
    """Gain of each offer on its own over what is known, best first."""
    if not offers:
        return []
    now, unknown = before.share(known), before.wrench_variance(known, all_motion)
    gains = []
    for movement, added in offers:
        more = before.share(known + added) - now
        left = before.wrench_variance(known + added, all_motion) / unknown
        gains.append(Gain(movement, float(more.mean()), more.mean(axis=1), 1.0 - left))
    return sorted(gains, key=lambda gain: -gain.share)
