"""The commands ``bsip simulate`` and ``bsip inject``: presets and the options a user chooses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import click

from bsip_cli.errors import UsageError
from bsip_cli.simulate.asked import pair_up
from bsip_cli.simulate.presets import preset
from bsip_cli.simulate.study import simulate_study


def simulate_command(
    study: Path,
    preset_name: str,
    participants: int | None,
    seed: int | None,
    sequence_s: float | None,
    effects: Sequence[str] = (),
    sizes: Sequence[float] = (),
    targets: Sequence[str] = (),
    effect_tasks: Sequence[str] = (),
) -> None:
    """Write a simulated study into a new or empty folder."""
    if study.exists() and any(study.iterdir()):
        raise UsageError(
            "the folder is not empty", file=study, remedy="name a new folder for the study"
        )
    options = preset(preset_name)
    if participants is not None:
        options = replace(options, participants=participants, sexes="")
    if seed is not None:
        options = replace(options, seed=seed)
    if sequence_s is not None:
        options = replace(options, durations_s={**options.durations_s, "sequence": sequence_s})
    asked = pair_up(effects, sizes, targets)
    options = replace(options, effects=asked, effect_tasks=tuple(effect_tasks))
    simulate_study(study, options)
    click.echo(f"bsip simulate: {options.participants} people in {study}", err=True)
