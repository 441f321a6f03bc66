"""Do the plates carry the person whose mass is stated?

The wrench alone cannot tell: free parameters follow the plates. Nothing in a quiet trial tells why
the plates read another mass, and nothing in moving ones where the inertial parameters follow the
plates or several plates carry the person. So this is a class of causes, of which every one is
printed with its own size.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.stats import norm

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.diagnosis.findings import Finding, Number
from bsip_cli.effects.loads import AddedMass
from bsip_cli.effects.plates import PlateGain, PlateZero
from bsip_cli.effects.scene import Scene
from bsip_cli.statistics.samples import Z95

NOTICED = 0.02  # part of the mass from which on it is told, if a scale errs less
SURE = 2.5  # standard deviations of a stated mass beyond which it is
LOADED = 0.05  # of body weight: a plate that carries less is not stood upon
CLASS = "W"  # of the weight; those found in the motion are A, B, C
REMEDY = (
    "weigh the person as recorded, put a known weight on each plate, and read them with nobody on"
)


def weight_share(scene: Scene) -> float:
    """Mean vertical force beyond the simulated one, part of body weight."""
    apart = (scene.measured - scene.predicted)[scene.valid, 2]
    return float(apart.mean()) / (scene.mass_kg * GRAVITY_M_S2)


def is_noticed(share: float, mass_sd: float) -> bool:
    """Whether the plates read so much more or less (part of the stated mass) than a scale errs by.

    mass_sd : standard deviation of the stated mass, part of it.
    """
    return abs(share) >= max(NOTICED, SURE * mass_sd)


def agreed_share(scenes: Sequence[Scene], mass_sd: float) -> float | None:
    """What moving trials say of the stated mass, like ``weight_share``; nothing if plates and scale
    agree, or the trials do not agree with each other."""
    apart = np.array([weight_share(one) for one in scenes])
    share = float(np.median(apart))
    agree = np.abs(apart - share).max() <= 0.5 * abs(share)
    return share if agree and is_noticed(share, mass_sd) else None


def loaded_plate(scenes: Iterable[Scene]) -> str | None:
    """The plate that alone carries the person; None where several do."""
    loaded = {
        plate.name
        for scene in scenes
        for plate in scene.plates
        if np.nan_to_num(plate.wrench[scene.valid, 2]).mean()
        > LOADED * scene.mass_kg * GRAVITY_M_S2
    }
    return loaded.pop() if len(loaded) == 1 else None


def stated_mass_findings(
    share: float,
    mass_kg: float,
    mass_sd: float,
    plate: str | None,
    trials: tuple[str, ...],
    manner: str,
) -> tuple[Finding, ...]:
    """The class of causes if the plates differ from the stated mass by more than a scale does.

    share : of the stated mass, from ``weight_share`` or ``agreed_share``. mass_sd : its standard
    deviation, part of it. plate : from ``loaded_plate``. trials : the recordings that tell.
    manner : how they were read, in words.
    """
    if not is_noticed(share, mass_sd):
        return ()
    p_value = float(2 * norm.sf(abs(share) / mass_sd))  # how likely a scale errs by that much
    error, extra = mass_sd * mass_kg, share * mass_kg
    told = (
        f"the plates read {mass_kg + extra:.2f} kg {manner}, {abs(extra):.1f} kg "
        f"{'more' if extra > 0 else 'less'} than stated"
    )
    weight, weight_error = extra * GRAVITY_M_S2, error * GRAVITY_M_S2
    where = f"{plate or 'all'} fz"
    gain = f"the plates' vertical gain is off by {100 * share:+.1f} %"
    zero = f"the plates' zero is off by {weight:+.0f} N"
    causes = [
        (PlateGain.name, where, "gain", "1", share, mass_sd, gain, "laboratory"),
        (PlateZero.name, where, "offset", "N", weight, weight_error, zero, "laboratory"),
    ]
    if extra > 0:
        cause = f"{extra:.1f} kg are worn or carried that the stated mass leaves out"
        causes.insert(0, (AddedMass.name, "", "mass", "kg", extra, error, cause, "person"))
    return tuple(
        Finding(
            effect,
            target,
            trials,
            (Number(name, unit, x, x - Z95 * sd, x + Z95 * sd),),
            f"{told}: {why}, or the stated mass is wrong; to distinguish them, {REMEDY}",
            p_value,
            (1 - p_value) / (len(causes) + 1),
            "ambiguous",
            CLASS,
            scope,
            rms_change=abs(weight),
        )
        for effect, target, name, unit, x, sd, why, scope in causes
    )
