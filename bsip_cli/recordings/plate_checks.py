"""A plate's wrench against physics: baseline, moment unit, origin, sign, size."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from bsip_cli.recordings.analog import SampleCheck
from bsip_cli.recordings.cop_polynomial import correct_cop
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.plates import (
    LOADED_N,
    LocalWrench,
    PlateDescription,
    inside_share,
    surface_offset_m,
)

_LIGHTLY_LOADED_N = 20.0
_ABSURD_N = 15_000.0
_PULL_N = -20.0
_GOOD_SHARE = 0.9
_BAD_SHARE = 0.5
_NO_LABORATORY_M = 10.0  # a centre of pressure so far away: the moments' unit is wrong
_PULL_SHARE = 0.2  # of the push's impulse
_PERCENT = 100.0


@dataclass(frozen=True)
class Checked:
    """A plate's wrench about the centre of its surface, plate frame, sign and unit settled."""

    wrench: LocalWrench | None  # None: the plate is nonsense
    findings: tuple[Finding, ...]

    def is_reversed(self) -> bool:
        return any(f.check == "plate_sign" and f.level == "corrected" for f in self.findings)


def check_wrench(
    wrench: LocalWrench,
    plate: PlateDescription,
    down_sign: float,
    samples: SampleCheck,
    baseline: slice | None,
) -> Checked:
    """Settle baseline, moment unit, origin and sign of one plate by what the data show.

    ``wrench`` is at the sensor's origin; ``down_sign`` is -1 where the plate's z points into
    the floor (as the format wants) and +1 where the corners are wound the other way, so that
    ``down_sign * Fz`` should be positive for a standing person; ``baseline`` are the samples
    of FORCE_PLATFORM:ZERO.
    """
    findings: list[Finding] = []
    good = samples.usable()
    wrench, found = _without_baseline(wrench, plate, down_sign, good, baseline)
    findings += found
    if fault := _absurd(wrench, plate, good):
        return Checked(None, (*findings, fault))
    at_surface, found = _settle_moments(wrench, plate, good)
    findings += found
    at_surface, about_maker = correct_cop(at_surface, plate)
    findings += about_maker
    at_surface, found = _settle_sign(at_surface, plate, down_sign, good)
    findings += found
    if fault := _pulls(at_surface, plate, down_sign, good):
        return Checked(None, (*findings, fault))
    return Checked(at_surface, tuple(findings))


def _without_baseline(
    wrench: LocalWrench,
    plate: PlateDescription,
    down_sign: float,
    good: np.ndarray,
    baseline: slice | None,
) -> tuple[LocalWrench, list[Finding]]:
    """Subtract the mean of the ZERO samples if it is a pull, which no person can do."""
    if baseline is None or not good[baseline].all():
        return wrench, []
    level_force = wrench.force_N[baseline].mean(axis=0)
    level_moment = wrench.moment_Nm[baseline].mean(axis=0)
    level = down_sign * level_force[2]
    rest = (down_sign * wrench.force_N[:, 2] - level)[good]
    is_loaded_above = np.percentile(rest, 95) > LOADED_N and np.percentile(rest, 2) > _PULL_N
    if level > _PULL_N or not is_loaded_above:
        return wrench, []
    finding = Finding(
        check="plate_zero",
        subject=plate.name,
        found=f"{level:.0f} N in the samples of FORCE_PLATFORM:ZERO, a pull",
        expected="0 N without load",
        action="subtracted that baseline from all channels",
        level="corrected",
    )
    return LocalWrench(wrench.force_N - level_force, wrench.moment_Nm - level_moment), [finding]


def _absurd(wrench: LocalWrench, plate: PlateDescription, good: np.ndarray) -> Finding | None:
    largest = np.percentile(np.abs(wrench.force_N[good, 2]), 99.5) if good.any() else 0.0
    if largest < _ABSURD_N:
        return None
    return Finding(
        check="plate_force",
        subject=plate.name,
        found=f"vertical forces up to {largest / 1000:.1f} kN",
        expected=f"less than {_ABSURD_N / 1000:.0f} kN",
        action="left the plate out",
        level="excluded",
    )


def _settle_moments(
    wrench: LocalWrench, plate: PlateDescription, good: np.ndarray
) -> tuple[LocalWrench, list[Finding]]:
    """The reading of unit and origin that puts the centre of pressure on the plate."""
    loaded = good & (np.abs(wrench.force_N[:, 2]) > LOADED_N)
    offset = surface_offset_m(plate)
    stated = wrench.at_surface(offset)
    if not loaded.any():
        return stated, []
    share = _share_inside(stated, plate, loaded)
    if share >= _BAD_SHARE:
        return stated, []
    for other, why in _other_readings(wrench, plate, offset, loaded):
        if _share_inside(other, plate, loaded) >= _GOOD_SHARE:
            return other, [_cop_finding(plate, share, why, "corrected")]
    return stated, [_cop_finding(plate, share, "kept the plate", "warning")]


def _other_readings(
    wrench: LocalWrench, plate: PlateDescription, offset: np.ndarray, loaded: np.ndarray
) -> Iterator[tuple[LocalWrench, str]]:
    """Moments a thousand times too large (else any load would fit), and ORIGIN the other way."""
    far_m = float(np.median(np.linalg.norm(wrench.at_surface(offset).cop()[loaded], axis=1)))
    if far_m > _NO_LABORATORY_M:
        yield wrench.scaled(1e-3).at_surface(offset), "read the moments in N mm"
    if plate.kind in (2, 4):
        yield wrench.at_surface(-offset), "reversed ORIGIN"


def _share_inside(wrench: LocalWrench, plate: PlateDescription, loaded: np.ndarray) -> float:
    return inside_share(wrench.cop()[loaded], plate.half_size_m())


def _cop_finding(plate: PlateDescription, share: float, action: str, level: str) -> Finding:
    return Finding(
        check="plate_cop",
        subject=plate.name,
        found=f"centre of pressure inside the plate in {_PERCENT * share:.0f} % of loaded samples",
        expected=f"at least {_PERCENT * _GOOD_SHARE:.0f} %",
        action=action,
        level=level,
    )


def _pulls(
    wrench: LocalWrench, plate: PlateDescription, down_sign: float, good: np.ndarray
) -> Finding | None:
    """A plate that pulls hard for long, whatever its sign, measures no person."""
    lift = down_sign * wrench.force_N[good, 2]
    pull, push = -lift[lift < -_LIGHTLY_LOADED_N].sum(), lift[lift > _LIGHTLY_LOADED_N].sum()
    if pull <= _PULL_SHARE * push or lift.min() > -LOADED_N:
        return None
    return Finding(
        check="plate_sign",
        subject=plate.name,
        found=f"pushes up to {lift.max():.0f} N and pulls up to {-lift.min():.0f} N",
        expected="pushes only",
        action="left the plate out",
        level="excluded",
    )


def _settle_sign(
    wrench: LocalWrench, plate: PlateDescription, down_sign: float, good: np.ndarray
) -> tuple[LocalWrench, list[Finding]]:
    """A person presses: the plate's impulse on the body points up."""
    lift = down_sign * wrench.force_N[good, 2]
    loaded = lift[np.abs(lift) > _LIGHTLY_LOADED_N]
    pull, push = -loaded[loaded < 0].sum(), loaded[loaded > 0].sum()
    if pull <= 3 * push or pull == 0 or -np.percentile(loaded, 5) < LOADED_N:
        return wrench, []
    finding = Finding(
        check="plate_sign",
        subject=plate.name,
        found=f"median vertical force on the body {np.median(loaded):.0f} N",
        expected="a push (positive)",
        action="reversed all six components",
        level="corrected",
    )
    return replace(wrench, force_N=-wrench.force_N, moment_Nm=-wrench.moment_Nm), [finding]
