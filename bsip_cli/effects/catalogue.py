"""All effects that a diagnosis considers, in the order of ``catalogue.toml``."""

from __future__ import annotations

from bsip_cli.effects import body, loads, markers, plates
from bsip_cli.effects.effect import ABOUT, Effect

_CLASSES = {
    one.name: one
    for family in (body, loads, markers, plates)
    for one in vars(family).values()
    if isinstance(one, type) and issubclass(one, Effect) and hasattr(one, "name")
}
CATALOGUE: tuple[Effect, ...] = tuple(_CLASSES[name]() for name in ABOUT)
EFFECTS = {effect.name: effect for effect in CATALOGUE}
