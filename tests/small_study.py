"""Options of the small simulated studies that tests of whole stages run."""

from __future__ import annotations

from bsip_cli.simulate.options import Rates, StudyOptions


def small(sexes: str = "M", seed: int = 3, **durations_s: float) -> StudyOptions:
    """A person for each letter, markers at 50 and plates at 250 Hz; tasks by their seconds."""
    return StudyOptions(
        participants=len(sexes),
        seed=seed,
        sexes=sexes,
        tasks=tuple(durations_s),
        durations_s=durations_s,
        rates={"default": Rates(marker_hz=50, analog_hz=250)},
    )
