"""The plates do not read the stated mass.

Nothing in a quiet trial tells why, and nothing in moving ones where the inertial parameters follow
the plates or several plates carry the person. So this is a class of causes, of which every one is
printed with its own size.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.diagnosis.findings import Finding, Number
from bsip_cli.diagnosis.scale_mass import is_noticed, p_of
from bsip_cli.effects.loads import AddedMass
from bsip_cli.effects.plates import PlateGain, PlateZero
from bsip_cli.effects.scene import Scene
from bsip_cli.statistics.samples import Z95

CLASS = "W"  # of the weight; those found in the motion are A, B, C
REMEDY = (
    "weigh the person as recorded, put a known weight on each plate, and read them with nobody on"
)
LOADED = 0.05  # of body weight: a plate that carries less is not stood upon
_UNKNOWN = (np.nan, np.nan, np.nan)


def loaded_plate(scenes: Iterable[Scene]) -> str | None:
    """The plate that alone carries the person; None where several do."""
    loaded = {name for scene in scenes for name in _loaded_plates(scene)}
    return loaded.pop() if len(loaded) == 1 else None


def _loaded_plates(scene: Scene) -> list[str]:
    least = LOADED * scene.mass_kg * GRAVITY_M_S2
    loads = {one.name: np.nan_to_num(one.wrench[scene.valid, 2]).mean() for one in scene.plates}
    return [name for name, load in loads.items() if load > least]


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
    deviation, part of it. plate : from
    ``loaded_plate``. trials : the recordings that tell. manner : how they were read, in words.
    """
    if not is_noticed(share, mass_sd):
        return ()
    p_value = p_of(share, mass_sd)
    error = mass_sd * mass_kg
    extra = share * mass_kg
    told = (
        f"the plates read {mass_kg + extra:.2f} kg {manner}, {abs(extra):.1f} kg "
        f"{'more' if extra > 0 else 'less'} than stated"
    )
    weight, weight_error = extra * GRAVITY_M_S2, error * GRAVITY_M_S2
    gain = f"the plates' vertical gain is off by {100 * share:+.1f} %"
    zero = f"the plates' zero is off by {weight:+.0f} N"
    causes = [
        (PlateGain.name, "gain", "1", share, mass_sd, gain, "laboratory"),
        (PlateZero.name, "offset", "N", weight, weight_error, zero, "laboratory"),
    ]
    if extra > 0:
        cause = f"{extra:.1f} kg are worn or carried that the stated mass leaves out"
        causes.insert(0, (AddedMass.name, "mass", "kg", extra, error, cause, "person"))
    return tuple(
        Finding(
            effect,
            "" if effect == AddedMass.name else f"{plate or 'all'} fz",
            trials,
            "ambiguous",
            CLASS,
            p_value,
            _UNKNOWN,
            (Number(name, unit, x, x - Z95 * sd, x + Z95 * sd),),
            f"{told}: {why}, or the stated mass is wrong; to tell them apart, {REMEDY}",
            (1 - p_value) / (len(causes) + 1),
            scope,
            abs(weight),
        )
        for effect, name, unit, x, sd, why, scope in causes
    )
