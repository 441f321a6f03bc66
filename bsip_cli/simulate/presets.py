"""Ready-made studies."""

from __future__ import annotations

from bsip_cli.errors import UsageError
from bsip_cli.simulate.options import Rates, StudyOptions


def sample() -> StudyOptions:
    """Six people, small enough to ship (under 11 MB): slow trials at 50 Hz."""
    slow = Rates(marker_hz=50, analog_hz=250)
    return StudyOptions(
        participants=6,
        seed=2014,
        sexes="MFMFMF",
        durations_s={
            "static": 1.0,
            "sequence": 27.0,
            "throwing": 2.2,
            "basketball": 2.5,
            "squat": 3.4,
            "steps": 3.6,
            "walking": 1.2,
            "running": 0.8,
        },
        rates={
            "default": Rates(marker_hz=100, analog_hz=500),
            "static": slow,
            "sequence": slow,
            "squat": slow,
            "steps": slow,
        },
    )


def cohort() -> StudyOptions:
    """Twelve people with a two-minute sequence at 100 Hz, as in a full study."""
    return StudyOptions(
        participants=12,
        seed=2017,
        durations_s={
            "static": 3.0,
            "sequence": 120.0,
            "throwing": 3.0,
            "basketball": 3.0,
            "squat": 8.0,
            "steps": 6.0,
            "walking": 1.2,
            "running": 0.8,
        },
    )


def diagnosis() -> StudyOptions:
    """One person for hidden effects: stiff trunk, no ball, landings, and an unloaded plate."""
    return StudyOptions(
        participants=1,
        seed=2026,
        tasks=("static", "sequence", "squat", "hops", "stepon"),
        durations_s={
            "static": 3.0,
            "sequence": 60.0,
            "squat": 10.0,
            "hops": 6.0,
            "stepon": 9.0,
        },
    )


PRESETS = {"sample": sample, "cohort": cohort, "diagnosis": diagnosis}


def preset(name: str) -> StudyOptions:
    """The options of a preset."""
    if name not in PRESETS:
        raise UsageError(f"unknown preset {name!r}", expected=" or ".join(PRESETS))
    return PRESETS[name]()
