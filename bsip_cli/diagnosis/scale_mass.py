"""Evidence from the scale: do the plates carry the person whose mass is stated?

The wrench alone cannot tell: free parameters follow the plates. A vertical gain or offset of
the plates in all trials shows against the stated mass only.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import norm

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.diagnosis.candidates import Candidate
from bsip_cli.diagnosis.explanation import Explanation, fit_together
from bsip_cli.diagnosis.held_out import gain_of
from bsip_cli.diagnosis.judging import Tried
from bsip_cli.diagnosis.refitting import score_of
from bsip_cli.diagnosis.selection import Round
from bsip_cli.diagnosis.signatures import Place
from bsip_cli.diagnosis.together import Evidence
from bsip_cli.effects.plate_gain import PlateGain
from bsip_cli.effects.plate_zero import PlateZero
from bsip_cli.effects.scene import Scene

TRUSTED = 0.008  # standard deviation of a stated mass, relative: clothes, shoes, a meal
NOTICED = 0.02  # part of the mass from which on it is told


def mass_difference(evidence: Evidence) -> np.ndarray:
    """(trials,) mean vertical force against the simulated one, part of body weight."""
    return np.array([weight_share(one.scene) for one in evidence.trials])


def weight_share(scene: Scene) -> float:
    """Mean vertical force beyond the simulated one, part of body weight."""
    apart = (scene.measured - scene.predicted)[scene.valid, 2]
    return float(apart.mean()) / (scene.mass_kg * GRAVITY_M_S2)


def weight_round(evidence: Evidence) -> Round | None:
    """A vertical gain of the plates in all trials, and an offset beside it; nothing if plates and
    scale agree, or the trials do not agree with each other."""
    apart = mass_difference(evidence)
    share = float(np.median(apart))
    if abs(share) < NOTICED or np.abs(apart - share).max() > 0.5 * abs(share):
        return None
    target = _heaviest(evidence)
    if target is None:
        return None
    p_value = float(2 * norm.sf(abs(share) / TRUSTED))
    weight = share * evidence.trials[0].scene.mass_kg * GRAVITY_M_S2
    gain = _tried(evidence, PlateGain(), target, share, p_value)
    offset = _tried(evidence, PlateZero(), target, weight, p_value)
    return Round(evidence, (gain, offset), gain, None)


def _heaviest(evidence: Evidence) -> str | None:
    """The vertical channel of the plate that carries most."""
    loads: dict[str, float] = {}
    for one in evidence.trials:
        for plate in one.scene.plates:
            mean = float(np.nan_to_num(plate.wrench[one.scene.valid, 2]).mean())
            loads[plate.name] = loads.get(plate.name, 0.0) + mean
    return f"{max(loads, key=lambda name: loads[name])} fz" if loads else None


def _tried(
    evidence: Evidence, effect: PlateGain | PlateZero, target: str, size: float, p_value: float
) -> Tried:
    trials = tuple(
        t for t, one in enumerate(evidence.trials) if target in effect.targets(one.scene)
    )
    place = Place(Candidate(effect, target, ()), trials)
    before = fit_together(evidence, ())
    found = Explanation(place, np.array([size]))
    fit = fit_together(evidence, (found,))
    gain = gain_of(evidence, trials, before.residual, fit.residual, fit.tangent)
    score = score_of(before, fit, 1)
    return Tried(fit.explanations[0], score, p_value, gain, fit, is_leftover=False, is_first=True)
