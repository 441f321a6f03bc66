"""Whose parameters make the error of the simulated wrench and centre of pressure.

The wrench is linear in the inertial parameters, so RM's and OM's differ by a sum of steps, one for
each segment and group of parameters. The squared error that goes when steps are taken together is
shared among them as Shapley (1953, A value for n-person games) has it: the mean, over all orders in
which they may be taken, of what goes with each. Of a sum of squares that is the step times the
mean of the errors before and after, a closed form.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.body.inertia import SYMMETRIC, Inertia
from bsip_cli.dynamics.cop import anterior_and_right, centre_of_pressure
from bsip_cli.dynamics.regressor import move_moments

GROUPS = ("mass", "centre_of_mass", "inertia")
COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz", "cop_ap", "cop_ml")


@dataclass(frozen=True, eq=False)
class Ground:
    """Where and towards what the centre of pressure is taken.

    Attributes
    ----------
    surface_height_m : of the plates.
    anterior : (2,) the person's anterior direction, world x and y.
    min_force_N : vertical force below which there is none.
    """

    surface_height_m: float
    anterior: np.ndarray
    min_force_N: float


@dataclass(frozen=True, eq=False)
class Attribution:
    """One component's error.

    Attributes
    ----------
    component : one of `COMPONENTS`.
    rmse : of RM [N, N m or m].
    shares : (n, 3) part of RM's mean squared error by segment and group.
    rest : part that OM leaves; with the shares it makes 1.
    samples : how many frames it rests on.
    """

    component: str
    rmse: float
    shares: np.ndarray
    rest: float
    samples: int


def parameter_steps(rm: tuple[Inertia, ...], om: tuple[Inertia, ...]) -> np.ndarray:
    """(10 n, 3 n) steps from RM to OM about the joint centres; columns by segment, then group.

    A product's change is the sum of one factor's change times the other's mean, so that the three
    steps of a segment add up to its whole difference and no group goes first.
    """
    steps = np.zeros((len(rm), 10, len(rm), len(GROUPS)))
    for i, (table, found) in enumerate(zip(rm, om, strict=True)):
        tensors = [Inertia(1.0, body.com_m, np.zeros((3, 3))).phi() for body in (table, found)]
        steps[i, :, i, 0] = (found.mass_kg - table.mass_kg) * (tensors[0] + tensors[1]) / 2
        steps[i, :, i, 1] = (found.mass_kg + table.mass_kg) / 2 * (tensors[1] - tensors[0])
        turning = found.tensor_kgm2 - table.tensor_kgm2
        steps[i, 4:, i, 2] = [turning[j, k] for j, k in SYMMETRIC]
    return steps.reshape(10 * len(rm), -1)


def attributions(
    measured: np.ndarray, rm: np.ndarray, steps: np.ndarray, judged: np.ndarray, ground: Ground
) -> tuple[Attribution, ...]:
    """Who makes RM's error in every component; moments about the mean centre of pressure.

    About the world's origin the weight of a segment would count by its distance from there.

    Parameters
    ----------
    measured, rm : (N, 6) wrench about the world's origin [N, N m].
    steps : (N, 6, 3 n) change of the wrench by each of `parameter_steps`; their sum leads to OM.
    judged : (N,) frames that count.

    Returns
    -------
    One for each of `COMPONENTS` that has a frame to judge by.
    """
    middle = _middle(measured, judged, ground)
    error = move_moments(measured - rm, middle)
    moved = steps.copy()
    moved[:, 3:] -= np.cross(middle, steps[:, :3], axisb=1, axisc=1)
    parts = {name: (error[:, k], moved[:, k]) for k, name in enumerate(COMPONENTS[:6])}
    parts |= _cop_parts(measured, rm, steps, ground)
    made = (_attribution(name, *part, judged) for name, part in parts.items())
    return tuple(one for one in made if one is not None)


def _middle(measured: np.ndarray, judged: np.ndarray, ground: Ground) -> np.ndarray:
    """(3,) mean measured centre of pressure; the world's origin where there is none."""
    points = centre_of_pressure(measured[judged], ground.surface_height_m, ground.min_force_N)
    known = points[np.isfinite(points).all(axis=1)]
    return np.array([*known.mean(axis=0), ground.surface_height_m]) if len(known) else np.zeros(3)


def _attribution(
    name: str, error: np.ndarray, steps: np.ndarray, judged: np.ndarray
) -> Attribution | None:
    known = judged & np.isfinite(error) & np.isfinite(steps).all(axis=1)
    if not known.any():
        return None
    error, steps = error[known], steps[known]
    left = error - steps.sum(axis=1)
    whole = float((error**2).mean())
    shares = ((error + left)[:, None] * steps).mean(axis=0) / whole
    rest = float((left**2).mean()) / whole
    return Attribution(
        name, np.sqrt(whole), shares.reshape(-1, len(GROUPS)), rest, int(known.sum())
    )


def _cop_parts(
    measured: np.ndarray, rm: np.ndarray, steps: np.ndarray, ground: Ground
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Error of RM (N,) and its steps (N, 3 n) in the person's AP and ML directions [m].

    A quotient's change is exactly the numerator's less the mean quotient times the denominator's,
    over the mean denominator: linear in the steps, and their sum leads to OM's.
    """
    om = rm + steps.sum(axis=2)
    height = ground.surface_height_m
    points = [centre_of_pressure(w, height, ground.min_force_N) for w in (measured, rm, om)]
    middle = (points[1] + points[2]) / 2
    vertical = (rm[:, 2] + om[:, 2]) / 2
    lever = np.stack(
        [height * steps[:, 0] - steps[:, 4], height * steps[:, 1] + steps[:, 3]], axis=2
    )
    moved = (lever - middle[:, None] * steps[:, 2, :, None]) / vertical[:, None, None]
    errors = anterior_and_right(points[0] - points[1], ground.anterior)
    shifts = anterior_and_right(moved, ground.anterior)
    return {
        name: (error, shift)
        for name, error, shift in zip(COMPONENTS[6:], errors, shifts, strict=True)
    }
