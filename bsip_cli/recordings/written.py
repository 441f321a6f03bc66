"""What text files hardly ever say, or say wrongly: the unit of their forces (a MOT is meant to be
in N), and the rate of the markers or of the forces, each of which has times of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.stated import percent_apart

FORCE_UNITS_N = {"kN": 1000.0, "kilogram-force": 9.80665, "pounds-force": 4.44822}
# Of exports that divide forces by the person's mass or weight: the mass of which they are a force
# of 1 on, where they carry so much.
_NORMALISED_KG = {"N per kg of the person's mass": 1.0, "parts of the weight": 1 / GRAVITY_M_S2}
# Logarithms: of thirty sessions of text files one is in another unit, as units of moments; in all
# trials of one of a hundred a foot beside the plates or a rail bears up to half of the weight, of
# one of three thousand a seat up to nine tenths.
_OTHER_UNIT, _BORNE = -3.4, {0.5: -4.6, 0.1: -8.0}
# Body-mass indices by stature: medians of children of 6 years (1.15 m, WHO 2007) and of adults
# (200 countries, NCD-RisC 2016, Lancet 387); logarithms are about normal.
_STATURES_M, _BMI_KG_M2, _BMI_SD = (1.15, 1.65), (15.3, 24.3), 0.2
_MISSTATED = 0.05  # of stated masses are somebody else's
_SHARES = 40  # of the weight, tried
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
    mass_kg: float,
    stated_kg: float | None,
    height_m: float | None,
    gross_percent: float,
    surely: float,
) -> str:
    """In which unit other than N forces surely are that make a person so heavy; empty if N, or if
    that is not sure.

    mass_kg : the force over the acceleration that it carries, if it were in N. gross_percent : what
    a stated mass may be off by, in 19 of 20. surely : probability from which on it is sure.
    """
    if height_m is None or mass_kg <= 0.0:
        return ""

    usual_kg = np.interp(height_m, _STATURES_M, _BMI_KG_M2) * height_m**2

    def log_likelihood(kg: float | np.ndarray) -> np.ndarray:
        usual = norm.logpdf(np.log(kg / usual_kg), scale=_BMI_SD)
        if stated_kg is None:
            return usual
        sd = np.log1p(gross_percent / 100) / 2
        right = norm.logpdf(np.log(kg / stated_kg), scale=sd)
        return np.logaddexp(np.log1p(-_MISSTATED) + right, np.log(_MISSTATED) + usual)

    partly = [
        rare + logsumexp(log_likelihood(mass_kg / np.geomspace(least, 1.0, _SHARES)))
        for least, rare in _BORNE.items()
    ]
    logs = {
        name: _OTHER_UNIT - np.log(len(FORCE_UNITS_N)) + log_likelihood(size * mass_kg)
        for name, size in FORCE_UNITS_N.items()
    } | {"N": log_likelihood(mass_kg), "": logsumexp(partly) - np.log(_SHARES)}
    for name, kg in _NORMALISED_KG.items():
        if percent_apart(mass_kg, kg) <= gross_percent:
            logs[name] = _OTHER_UNIT + norm.logpdf(0.0, scale=_BMI_SD)
    best = max(logs, key=lambda name: logs[name])
    is_sure = logs[best] - logsumexp(list(logs.values())) >= np.log(surely)
    return best if is_sure and best != "N" else ""


def force_N(unit: str, stated_kg: float | None) -> float:
    """Of 1 in such a unit; 1 where that needs the person's mass, which is not stated."""
    if unit in _NORMALISED_KG:
        return 1.0 if stated_kg is None else stated_kg / _NORMALISED_KG[unit]
    return FORCE_UNITS_N[unit]


def force_unit_words(size_N: float) -> str:
    """What forces of another unit were read as."""
    names = [name for name, size in FORCE_UNITS_N.items() if size == size_N]
    return f"in {names[0]}" if names else f"as divided by the person's mass, times {size_N:.4g}"
