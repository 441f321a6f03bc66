"""All regularities without a name that compete with the catalogue."""

from __future__ import annotations

from bsip_cli.diagnosis.body_patterns import Band, Drag, Spring, Tether
from bsip_cli.diagnosis.channel_patterns import Bend, Bow, Ceiling, Curve, Lag, Play, Tone, Warming
from bsip_cli.diagnosis.clock_pattern import ClockJump
from bsip_cli.diagnosis.pattern import Pattern

PATTERNS: tuple[Pattern, ...] = (
    Tone(),
    Curve(),
    Bend(),
    Ceiling(),
    Play(),
    Lag(),
    Warming(),
    Bow(),
    Spring(),
    Tether(),
    Drag(),
    Band(),
    ClockJump(),
)
