"""Evidence from the scale: do the plates carry the person whose mass is stated?

The wrench alone cannot tell: free parameters follow the plates. A vertical gain or offset of
the plates in all trials shows against the stated mass only.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import norm

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.diagnosis.candidates import Candidate
from bsip_cli.diagnosis.explanation import Explanation, fit_together
from bsip_cli.diagnosis.held_out import gain_of
from bsip_cli.diagnosis.judging import Tried
from bsip_cli.diagnosis.refitting import score_of
from bsip_cli.diagnosis.rivals import rivals_of
from bsip_cli.diagnosis.rounds import Round
from bsip_cli.diagnosis.signatures import Place
from bsip_cli.diagnosis.together import Evidence
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.plate_gain import PlateGain
from bsip_cli.effects.plate_zero import PlateZero
from bsip_cli.effects.scene import Scene

NOTICED = 0.02  # part of the mass from which on it is told, if a scale errs less
SURE = 2.5  # standard deviations of a stated mass beyond which it is


def weight_share(scene: Scene) -> float:
    """Mean vertical force beyond the simulated one, part of body weight."""
    apart = (scene.measured - scene.predicted)[scene.valid, 2]
    return float(apart.mean()) / (scene.mass_kg * GRAVITY_M_S2)


def is_noticed(share: float, mass_sd: float) -> bool:
    """Whether the plates read so much more or less (part of the stated mass) than a scale errs by.

    mass_sd : standard deviation of the stated mass, part of it.
    """
    return abs(share) >= max(NOTICED, SURE * mass_sd)


def p_of(share: float, mass_sd: float) -> float:
    """How likely a scale errs by that much."""
    return float(2 * norm.sf(abs(share) / mass_sd))


def agreed_share(evidence: Evidence) -> float | None:
    """What moving trials say of the stated mass, like ``weight_share``; nothing if plates and scale
    agree, or the trials do not agree with each other."""
    apart = np.array([weight_share(one.scene) for one in evidence.trials])
    share = float(np.median(apart))
    agree = np.abs(apart - share).max() <= 0.5 * abs(share)
    return share if agree and is_noticed(share, mass_sd_of(evidence)) else None


def weight_round(evidence: Evidence, share: float, plate: str) -> Round | None:
    """A gain of the vertical channel of the only plate that carries the person, in all trials, and
    an offset beside it; nothing where no plate's gain is that far off.

    share : of body weight, from ``agreed_share``.
    """
    channel = f"{plate} fz"
    p_value = p_of(share, mass_sd_of(evidence))
    weight = share * evidence.trials[0].scene.mass_kg * GRAVITY_M_S2
    gain = _tried(evidence, EFFECTS[PlateGain.name], channel, share, p_value)
    offset = _tried(evidence, EFFECTS[PlateZero.name], channel, weight, p_value)
    if not gain.explanation.is_possible(evidence):
        return None
    kept = replace(gain, rivals=rivals_of(evidence, gain, (gain, offset)))
    return Round(evidence, (kept, offset), kept, None)


def mass_sd_of(evidence: Evidence) -> float:
    """Standard deviation of the stated mass, part of it."""
    return evidence.trials[0].filtered.mass_sd


def _tried(evidence: Evidence, effect: Effect, target: str, size: float, p_value: float) -> Tried:
    trials = tuple(
        t for t, one in enumerate(evidence.trials) if target in effect.targets(one.scene)
    )
    place = Place(Candidate(effect, target, ()), trials)
    before = fit_together(evidence, ())
    found = Explanation(place, np.array([size]))
    fit = fit_together(evidence, (found,))
    gain = gain_of(evidence, trials, before.residual, fit.residual, fit.tangent)
    score = score_of(before, fit, 1)
    return Tried(
        fit.explanations[0],
        score,
        p_value,
        gain,
        fit,
        is_leftover=False,
        is_first=True,
        is_tiny=False,
    )
