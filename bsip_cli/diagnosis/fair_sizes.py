"""Vertical gains of all trials, sized beside the stated mass.

A plate that shows too much and a body that is heavier go along with each other in every trial. What
the simulation lacks of the horizontal forces and moments is less beside a lighter body, so least
squares trade mass for gain: beyond what a scale may err by, and always in the same direction.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from bsip_cli.diagnosis.explanation import Explanation, Fit, fit_of, fit_together
from bsip_cli.diagnosis.scale_mass import mass_sd_of
from bsip_cli.diagnosis.signatures import Place
from bsip_cli.diagnosis.together import Evidence, together
from bsip_cli.effects.plate_gain import PlateGain

_VERTICAL = " fz"


def fairly_sized(evidence: Evidence, fit: Fit) -> Fit:
    """The same causes; where a vertical gain in all trials is among them, with the sizes, and at
    the plates, that leave least beside a body of the stated mass."""
    if not any(goes_with_mass(evidence, one.place) for one in fit.explanations):
        return fit
    weighed = _of_stated_mass(evidence)
    choices = product(*(_at_any_plate(evidence, one) for one in fit.explanations))
    fits = (fit_together(weighed, explanations) for explanations in choices)
    return fit_of(evidence, min(fits, key=lambda one: one.squares).explanations)


def known_to(evidence: Evidence, place: Place) -> float:
    """Standard deviation that no recording betters: a scale's, of what goes with the mass."""
    return mass_sd_of(evidence) if goes_with_mass(evidence, place) else 0.0


def goes_with_mass(evidence: Evidence, place: Place) -> bool:
    """Whether it is a vertical gain in all trials of a person whose mass is stated."""
    effect, target = place.candidate.effect, place.candidate.target
    if not isinstance(effect, PlateGain) or not target.endswith(_VERTICAL):
        return False
    scenes = enumerate(one.scene for one in evidence.trials)
    possible = tuple(t for t, scene in scenes if target in effect.targets(scene))
    return place.trials == possible and bool(_heavier(evidence).any())


def _at_any_plate(evidence: Evidence, one: Explanation) -> Iterator[Explanation]:
    yield one
    if not goes_with_mass(evidence, one.place):
        return
    for target in one.effect.targets(one.scene(evidence)):
        place = replace(one.place, candidate=replace(one.place.candidate, target=target))
        if target != one.target and goes_with_mass(evidence, place):
            yield replace(one, place=place)


def _of_stated_mass(evidence: Evidence) -> Evidence:
    """The same evidence of a body that is as heavy as stated."""
    heavier = _heavier(evidence)
    trials = (
        replace(one, shared=one.shared - np.outer(one.shared @ heavier, heavier))
        for one in evidence.trials
    )
    return together(tuple(trials))


def _heavier(evidence: Evidence) -> np.ndarray:
    """(p,) shared nuisances that make the body heavier by one standard deviation; zeros where no
    mass is stated."""
    return evidence.trials[0].filtered.heavier
