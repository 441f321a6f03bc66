"""What text files hardly ever say, or say wrongly: the unit of their forces (a MOT is meant to be
in N), and the rate of the markers or of the forces, each of which has times of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.stated import BMI_KG_M2, USUAL_BMI_KG_M2, percent_apart

FORCE_UNITS_N = {"kN": 1000.0, "kilogram-force": 9.80665, "pounds-force": 4.44822}
_HALF = 0.5  # of the weight: a person of whom one foot stands off the plates
_STEPS = 2.0  # of the coarser clock: lengths that differ by less are the same
OTHER_RATE = -4.6
"""Logarithm: one session of a hundred states another rate than that of its cameras."""

# How many times as fast as stated: ratios of usual rates (50, 60, 100, 120, 150, 200, 240, 250 Hz).
_SLOWER = (1.2, 1.25, 1.5, 5 / 3, 2.0, 2.4, 3.0, 4.0)
PACES = np.array([1.0, *_SLOWER, *(1 / times for times in _SLOWER)])

_ALIKE = 0.9  # of trials: markers and forces last as long, where nothing is wrong with their rates
_COINCIDENCE = 0.01  # of lengths that are cut anyhow: rarer ones are none
_OF_CHANCE = 0.1  # of trials: one file is cut, at a place that is anywhere in it


@dataclass(frozen=True)
class Written:
    """A force of 1 in the file in N; how many times as fast as stated the cameras ran, or the
    forces were sampled; and how probable it is that it is these and not the others."""

    force_N: float = 1.0
    pace: float = 1.0
    force_pace: float = 1.0
    probability: float = 1.0


AS_WRITTEN = Written()


@dataclass(frozen=True)
class Lengths:
    """Of the markers and of the forces of a trial, and the step of either's clock that is longer
    [s], all by their own files."""

    markers_s: float
    forces_s: float
    step_s: float

    def are_alike(self, pace: float) -> bool:
        """If the cameras ran so many times as fast as stated."""
        return abs(self.markers_s / pace - self.forces_s) <= _STEPS * self.step_s

    def log_likelihood(self, pace: float) -> float:
        """Of lengths so alike or different, if that is the pace, logarithm."""
        if self.are_alike(pace):
            return float(np.log(_ALIKE))
        by_chance = 2.0 * _STEPS * self.step_s / max(self.markers_s, self.forces_s)
        return float(np.log(_OF_CHANCE) + np.log(min(by_chance, 1.0)))


def likely_paces(trials: Sequence[Lengths | None]) -> dict[float, float]:
    """Paces at which markers and forces last as long in more trials than at the stated rate, with
    their logarithm of odds against that; a length counts once, as both files may be cut to it."""
    different: list[Lengths] = []
    for one in filter(None, trials):
        if all(abs(one.markers_s - two.markers_s) > _STEPS * one.step_s for two in different):
            different.append(one)
    prior = OTHER_RATE - np.log(len(PACES) - 1)
    odds = {
        float(pace): prior + sum(x.log_likelihood(pace) - x.log_likelihood(1.0) for x in different)
        for pace in PACES[1:]
    }
    return {pace: log for pace, log in odds.items() if log > prior}


def of_other_trials(trials: Sequence[Lengths | None]) -> dict[int, int]:
    """Trials, by number, whose forces are not as long as their markers, with the one whose markers
    are: where all such trials have each other's lengths, they have each other's forces."""
    odd = {k: one for k, one in enumerate(trials) if one is not None and not one.are_alike(1.0)}
    markers, forces = (
        np.array([getattr(one, name) for one in odd.values()]) for name in ("markers_s", "forces_s")
    )
    near_s = _STEPS * max((one.step_s for one in odd.values()), default=0.0)
    by_chance = np.minimum(2 * near_s / np.maximum(np.abs(markers - forces), near_s), 1.0).prod()
    is_other = (np.abs(np.sort(markers) - np.sort(forces)) <= near_s).all()
    if len(odd) < 2 or not is_other or by_chance > _COINCIDENCE:
        return {}
    whose = [int(np.argmin(np.abs(markers - force_s))) for force_s in forces]
    return {k: list(odd)[one] for k, one in zip(odd, whose, strict=True)}


def force_unit(
    mass_kg: float, stated_kg: float | None, height_m: float | None, gross_percent: float
) -> str:
    """In which unit other than N forces surely are that make a person so heavy; empty if N, or if
    that is not sure.

    mass_kg : the force over the acceleration that it carries, if it were in N. Nobody of this
    stature is so light, or twice as light; and one unit alone makes the stated mass, or a usual
    one.
    """
    if height_m is None or not 0.0 < mass_kg < _HALF * BMI_KG_M2[0] * height_m**2:
        return ""
    usual = np.array(USUAL_BMI_KG_M2) * height_m**2
    masses = {name: size * mass_kg for name, size in FORCE_UNITS_N.items()}
    # Forces over the person's own weight are in no unit.
    masses[""] = usual.mean() if is_over_weight(mass_kg, gross_percent) else 0.0
    if stated_kg is not None:
        found = [
            name
            for name, mass in masses.items()
            if name and percent_apart(mass, stated_kg) <= gross_percent
        ]
    else:
        found = [name for name, mass in masses.items() if usual[0] <= mass <= usual[1]]
    return found[0] if len(found) == 1 else ""


def is_over_weight(mass_kg: float, gross_percent: float) -> bool:
    """Whether forces are parts of the weight."""
    return percent_apart(mass_kg * GRAVITY_M_S2, 1.0) <= gross_percent
