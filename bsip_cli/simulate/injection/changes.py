"""Apply effects to measured instruments, and see to it that they did something."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.instruments.readings import Instruments
from bsip_cli.simulate.effects.base import Effect


def check_injectable(effects: Sequence[Effect]) -> None:
    """Refuse effects that measured data cannot have afterwards."""
    for effect in effects:
        if not effect.injectable:
            raise UsageError(
                f"{effect.name} cannot be hidden in measured data: {effect.hint}",
                remedy="hide it in a simulated study (bsip simulate)",
            )


def changed_by(effects: Sequence[Effect], before: Instruments, file: object) -> Instruments:
    """Instruments with all effects.

    Raises
    ------
    BadDataError : an effect of force plates in a file without them; a marker or a plate that the
        file does not have; an effect that changes nothing.
    """
    instruments = before
    for effect in effects:
        if effect.needs_plates and not instruments.plates:
            raise BadDataError(f"{effect.name} needs force plates, and there are none", file=file)
        if effect.needs_surface and not instruments.surfaces_known:
            raise BadDataError(
                f"{effect.name} needs to know where the plates lie, and a MOT file does not say",
                file=file,
            )
        changed = _injected(effect, instruments, file)
        if _same(instruments.points_m, changed.points_m) and _same(
            instruments.readings, changed.readings
        ):
            raise BadDataError(f"{effect.name} changes nothing in this recording", file=file)
        instruments = changed
    return instruments


def _injected(effect: Effect, instruments: Instruments, file: object) -> Instruments:
    try:
        return effect.injected(instruments)
    except (UsageError, BadDataError) as error:  # what is asked for may be in the other files
        raise BadDataError(
            error.found, expected=error.expected, remedy=error.remedy, file=file
        ) from error


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    return a.shape == b.shape and np.array_equal(a, b, equal_nan=True)
