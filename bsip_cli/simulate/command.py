"""The command ``bsip simulate``: presets and the few options a user chooses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from bsip_cli.errors import UsageError
from bsip_cli.simulate.presets import preset
from bsip_cli.simulate.study import simulate_study


def simulate_command(
    study: Path,
    preset_name: str,
    participants: int | None,
    seed: int | None,
    sequence_s: float | None,
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
    simulate_study(study, options)
    click.echo(f"bsip simulate: {options.participants} people in {study}", err=True)
