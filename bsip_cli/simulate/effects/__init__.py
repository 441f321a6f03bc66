"""Effects hidden in recordings, as they are asked for, drawn and chosen for a trial."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

import numpy as np

from bsip_cli.errors import UsageError
from bsip_cli.segments import SEGMENTS
from bsip_cli.simulate.effects import instruments, loads  # noqa: F401 (they enter EFFECTS)
from bsip_cli.simulate.effects.base import EFFECTS, NOWHERE, Effect, OnSegment, Target
from bsip_cli.simulate.options import Asked, StudyOptions

__all__ = ["EFFECTS", "Effect", "drawn", "effects_of", "pair_up", "touches"]
NO_TARGET = ("", "-")
EFFECT = 4  # the stream of random numbers, next to those of `study`


def pair_up(
    names: Sequence[str], sizes: Sequence[float], targets: Sequence[str], simulated: bool = True
) -> tuple[Asked, ...]:
    """Match names, sizes and targets in the order they are given.

    simulated : whether the effects are for simulated recordings or for measured ones.
    UsageError: unknown effect; not one size for each; targets for some effects only; a size
        out of bounds or a target that the effect cannot have; one that measured data cannot have.
    """
    for name in names:
        if name not in EFFECTS:
            near = difflib.get_close_matches(name, EFFECTS, n=1, cutoff=0.0)[0]
            raise UsageError(
                f"unknown effect {name!r}, did you mean {near!r}?", expected=", ".join(EFFECTS)
            )
    for what, found, allowed, rule in (
        ("sizes", sizes, (len(names),), "one --size per --effect"),
        ("targets", targets, (0, len(names)), "no --target, or one per --effect (- for none)"),
    ):
        if len(found) not in allowed:
            raise UsageError(f"{len(names)} effects with {len(found)} {what}", expected=rule)
    asked = tuple(map(Asked, names, sizes, targets or [""] * len(names)))
    for effect in (drawn(one, np.random.default_rng(0)) for one in asked):
        if simulated and isinstance(effect, OnSegment) and effect.segment not in SEGMENTS:
            raise effect.wrong_target(effect.segment)  # only measured data can have it
        if not simulated and not effect.injectable:
            raise UsageError(
                f"{effect.name} cannot be hidden in measured data: {effect.hint}",
                remedy="hide it in a simulated study (bsip simulate)",
            )
    return asked


def drawn(asked: Asked, rng: np.random.Generator) -> Effect:
    """The effect, with what its target leaves open drawn."""
    kind = EFFECTS[asked.name]
    if not kind.least <= asked.size <= kind.most or asked.size == 0.0:
        raise UsageError(
            f"{asked.name} of size {asked.size:g}",
            expected=f"{kind.least:g} to {kind.most:g} {kind.unit}, not 0",
        )
    first, *rest = ("" if asked.target in NO_TARGET else asked.target).split(",")
    name, rest = ("", [first, *rest]) if "=" in first else (first, rest)
    try:
        settings = {key: float(number) for key, number in (part.split("=") for part in rest)}
    except ValueError as error:
        raise kind.wrong_target(asked.target) from error
    if not settings.keys() <= set(kind.settings):
        raise kind.wrong_target(asked.target)
    if name and (kind.targets == NOWHERE or name not in (kind.choices or [name])):
        raise kind.wrong_target(name)
    return kind.draw(asked.size, Target(name, settings), rng)


def effects_of(options: StudyOptions, number: int) -> tuple[Effect, ...]:
    """The effects of a participant; those of the lab are the same for all."""
    kinds = (EFFECTS[one.name] for one in options.effects)
    owners = (number if kind.drawn_for == "person" else 0 for kind in kinds)
    seeds = ([options.seed, owner, EFFECT, index] for index, owner in enumerate(owners))
    return tuple(map(drawn, options.effects, map(np.random.default_rng, seeds)))


def touches(effect: Effect, task: str, tasks: tuple[str, ...]) -> bool:
    """Whether the effect is in the trials of a task; `tasks` as asked for, or empty."""
    return task in tasks if tasks else not (effect.spares_static and task == "static")
