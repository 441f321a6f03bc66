"""Force plates whose clock differs from that of the cameras."""

from __future__ import annotations

from dataclasses import dataclass

from bsip_cli.instruments.readings import Instruments
from bsip_cli.simulate.effects.base import Effect


@dataclass(frozen=True)
class SyncOffset(Effect):
    """The force comes late by `size` (early if negative)."""

    name = "sync_offset"
    unit = "s"
    least, most = -0.5, 0.5
    injectable = True
    needs_plates = True
    personal = False

    def measured(self, instruments: Instruments) -> Instruments:
        return instruments.with_forces_from(instruments.sample_times_s() - self.size)


@dataclass(frozen=True)
class ClockDrift(Effect):
    """The force's delay grows by `size` seconds per second, from 0 at the start of a trial."""

    name = "clock_drift"
    unit = "1"
    least, most = -0.02, 0.02
    injectable = True
    needs_plates = True
    personal = False

    def measured(self, instruments: Instruments) -> Instruments:
        return instruments.with_forces_from(instruments.sample_times_s() * (1.0 - self.size))
