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
from bsip_cli.body.names import in_words
from bsip_cli.dynamics.cop import anterior_and_right, centre_of_pressure
from bsip_cli.dynamics.regressor import move_moments

GROUPS = ("mass", "centre_of_mass", "inertia")
COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz", "cop_ap", "cop_ml")
_BESIDE = 0.5  # of the largest coordinate of a shift: smaller ones are not put into words


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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


# --- in words -----------------------------------------------------------------------------------


def difference(group: str, table: Inertia, found: Inertia) -> tuple[float, str]:
    """How far the table lies from what was identified in one group, and the unit."""
    if group == "mass":
        return table.mass_kg - found.mass_kg, "kg"
    if group == "centre_of_mass":
        return float(np.linalg.norm(table.com_m - found.com_m)), "m"
    return float(np.linalg.norm(table.tensor_kgm2 - found.tensor_kgm2)), "kg m2"


def whose(segment: str, group: str, table: Inertia, found: Inertia) -> str:
    """``head's mass, of which the table has 0.40 kg too little``."""
    owner = f"{in_words(segment)}'s {group.replace('_', ' ')}"
    size, unit = difference(group, table, found)
    if group == "mass":
        kind = "too much" if size > 0 else "too little"
        return f"{owner}, of which the table has {abs(size):.2f} kg {kind}"
    if group == "centre_of_mass":
        return (
            f"{owner}, which the table puts {_shift_in_words(segment, table.com_m - found.com_m)}"
        )
    return f"{owner}, which differs from the table's by {size:.2g} {unit}"


def sentence(share: float, error: str, source: str) -> str:
    """``68 % of the squared error in COP AP comes from the head's mass, of which ...``."""
    if share < 0:
        return f"the {source}, adds {-100 * share:.0f} % to the squared error in {error}"
    return f"{100 * share:.0f} % of the squared error in {error} comes from the {source}"


def _shift_in_words(segment: str, shift_m: np.ndarray) -> str:
    """``21 mm too far back`` of a shift (3,) in segment axes, as the person stands upright."""
    side = segment[-2:]
    across = {"_r": ("outward", "inward"), "_l": ("inward", "outward")}.get(side, ("right", "left"))
    words = (
        ("too far forward", "too far back"),
        ("too high", "too low"),
        (f"too far {across[0]}", f"too far {across[1]}"),
    )
    sizes = np.abs(shift_m)
    order = [k for k in np.argsort(-sizes) if sizes[k] >= _BESIDE * sizes.max()]
    parts = [f"{1000 * sizes[k]:.0f} mm {words[k][int(shift_m[k] < 0)]}" for k in order]
    return " and ".join(parts)
