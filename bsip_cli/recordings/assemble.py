"""From checked plate channels to plates in the world frame, or the reason for none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.recordings.analog import SampleCheck
from bsip_cli.recordings.cop_near_feet import Scene
from bsip_cli.recordings.model import Finding, Plate
from bsip_cli.recordings.plate_checks import check_wrench
from bsip_cli.recordings.plate_frame import settle_frame
from bsip_cli.recordings.plates import LOADED_N, LocalWrench, PlateDescription, to_world
from bsip_cli.recordings.weight_shift import sign_doubts


@dataclass(frozen=True)
class PlateSource:
    """One plate as the file gives it: wrench at the sensor's origin, plate frame."""

    plate: PlateDescription
    wrench: LocalWrench
    samples: SampleCheck
    baseline: slice | None


@dataclass(frozen=True)
class Forces:
    plates: tuple[Plate, ...]
    findings: tuple[Finding, ...]
    note: str  # "" or why there are no forces


def settle_forces(
    sources: Sequence[PlateSource], rotation_world_lab: np.ndarray, scene: Scene
) -> Forces:
    """Check every plate against physics and turn the good ones into the world frame."""
    if not sources:
        return Forces((), (), "the file has no usable force plates")
    plates: list[Plate] = []
    findings: list[Finding] = []
    reversed_names = []
    for source in sources:
        findings += _sample_findings(source)
        plate, found, is_reversed = _settle(source, rotation_world_lab, scene)
        findings += found
        plates += [plate] if plate else []
        reversed_names += [source.plate.name] if is_reversed else []
    findings += sign_doubts(plates, reversed_names, scene.analog_rate_hz)
    note = why_no_forces(plates)
    return Forces(() if note else tuple(plates), tuple(findings), note)


def why_no_forces(plates: Sequence[Plate]) -> str:
    """Empty, or why these plates give no forces."""
    if not plates:
        return "every force plate was left out"
    if not any(plate.usable.any() for plate in plates):
        return "the force plates have no usable sample"
    total = np.sum([np.where(p.usable, p.force_N[:, 2], 0.0) for p in plates], axis=0)
    largest = np.max(total, initial=0.0)
    if largest < LOADED_N:
        return f"the force plates were never loaded (at most {largest:.0f} N)"
    return ""


def _settle(
    source: PlateSource, rotation_world_lab: np.ndarray, scene: Scene
) -> tuple[Plate | None, tuple[Finding, ...], bool]:
    """The plate or None, what was found, and whether its sign was reversed."""
    down = (rotation_world_lab @ source.plate.rotation_lab_plate()[:, 2])[2]
    checked = check_wrench(
        source.wrench, source.plate, float(np.sign(down)), source.samples, source.baseline
    )
    if checked.wrench is None:
        return None, checked.findings, False

    def to_plate(wrench: LocalWrench, description: PlateDescription) -> Plate:
        force, moment = to_world(wrench, description, rotation_world_lab)
        corners = description.corners_m @ rotation_world_lab.T
        return Plate(description.name, force, moment, corners, source.samples.usable())

    plate, found = settle_frame(checked.wrench, source.plate, scene, to_plate)
    return plate, (*checked.findings, *found), checked.is_reversed()


def _sample_findings(source: PlateSource) -> list[Finding]:
    samples = source.samples
    n = len(samples.stuck)
    findings = [
        Finding(
            check=f"analog_{name}",
            subject=source.plate.name,
            found=f"{mask.sum()} of {n} samples {words}",
            expected="none",
            action="marked them unusable",
            level="warning",
        )
        for name, words, mask in (
            ("nan", "are not a number", samples.not_a_number),
            ("clipped", "lie at the converter's limit", samples.clipped),
            ("stuck", "do not answer to the load", samples.stuck),
            ("lost", "are zero in all channels amid load", samples.lost),
            ("spike", "leave their neighbours and come back at once", samples.spikes),
        )
        if mask.any()
    ]
    if samples.silent_channels:
        names = ", ".join(str(i + 1) for i in samples.silent_channels)
        findings.append(
            Finding(
                check="analog_silent",
                subject=source.plate.name,
                found=f"channel {names} of the plate is zero throughout",
                expected="a signal that answers to the load",
                action="kept the plate",
                level="warning",
            )
        )
    return findings
