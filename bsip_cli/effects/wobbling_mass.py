"""A part of a segment's mass that swings against the bone."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
from scipy.signal import cont2discrete, lfilter

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.names import in_words
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

UPRIGHT = np.array([0.0, 0.0, 1.0])
# Body weights by which the vertical force changes within IMPACT_S: at most 0.6 in fast movements
# without impacts of either simulator, 1.1 to 3 in heel drops, hops and landings.
IMPACT, IMPACT_S = 0.8, 0.05
FREQUENCIES_HZ = (2.5, 3.0, 3.5, 4.0, 5.0, 6.5)
DAMPING = (0.1, 0.2, 0.4)
# Soft tissue is no point on one spring: its numbers are known to these standard deviations. Beneath
# the markers of a limb the skin slides, and the mass that swings there is told too low.
MASS_KG, LIMB_MASS_KG, FREQUENCY_HZ, DAMPING_RATIO = 0.5, 0.8, 0.05, 0.02


class WobblingMass(Effect):
    """A mass on a spring and a damper at the segment's centre of mass.

    Looked for only where an impact sets it swinging: in slow movement it is a heavier segment. It
    need not swing to the sides as it does up and down: how much of it seems to is a number of its
    own, which is not told.
    """

    name = "wobbling_mass"
    of_the_lab = False
    on_its_segment = True
    of_the_person = True
    looks = (
        "after impacts the measured force swings on at 2 to 8 Hz and dies away, which "
        "the simulated one does not"
    )
    remedy = "hop three times, or drop on the heels"
    least_named = MappingProxyType({"mass": 0.5})  # what swings to the sides only is none

    def targets(self, scene: Scene) -> tuple[str, ...]:
        if not has_impacts(scene):
            return ()
        soft = ("lower_torso", "upper_torso", "thigh", "shank")
        return tuple(s for s in scene.person.skeleton.segments if s.startswith(soft))

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        i = scene.person.skeleton.index(target)
        most = max(0.8 * float(scene.phi_of(i)[0]), 0.1)
        known_to = MASS_KG if target.endswith("torso") else LIMB_MASS_KG
        return (
            Parameter("mass", "kg", 0.0, most, 4.0, known_to=known_to),
            Parameter("frequency", "Hz", 2.0, 8.0, 1.0, FREQUENCIES_HZ, known_to=FREQUENCY_HZ),
            Parameter("damping_ratio", "1", 0.02, 1.0, 0.1, DAMPING, known_to=DAMPING_RATIO),
            Parameter("mass_sideways", "kg", -most, most, 4.0),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        mass, frequency, damping, sideways = values
        key = (self.name, target, float(frequency), float(damping))
        upright, aside = scene.once(key, lambda: _swings(scene, target, frequency, damping))
        return mass * upright + sideways * aside

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        """Without what seems to swing to the sides."""
        return super().reported(scene, target, values)[:3]

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return (
            f"{values[0]:.1f} kg of soft tissue of the {in_words(target)} swing against the bone, "
            f"{values[1]:.1f} times per second (damping ratio {values[2]:.2f})"
        )


def _swings(
    scene: Scene, target: str, frequency_hz: float, damping: float
) -> tuple[np.ndarray, np.ndarray]:
    """(N, 6) each : what 1 kg adds to the wrench by swinging instead of staying in its segment, up
    and down and to the sides."""
    point = scene.point(target, scene.centre_of(target))
    ground, pace = point.acceleration_m_s2, 2 * np.pi * frequency_hz
    travel = _response([-1.0], ground, scene.rate_hz, pace, damping)
    force = _response([-1.0, 0.0, 0.0], ground, scene.rate_hz, pace, damping)

    def swinging(axes: np.ndarray) -> np.ndarray:
        own, stretch = force * axes, travel * axes
        carried = ground + own - scene.model.gravity.linear
        moment = np.cross(point.position_m, own) + np.cross(stretch, carried)
        return np.hstack([own, moment])

    upright = swinging(UPRIGHT)
    return upright, swinging(np.ones(3)) - upright


def _response(
    numerator: list[float], ground: np.ndarray, rate_hz: float, pace_rad_s: float, damping: float
) -> np.ndarray:
    """(N, 3) travel of the mass against its segment [m], or with s^2 its acceleration.

    x'' = -2 damping pace x' - pace^2 x - ground, at rest when the trial begins; exact where the
    ground's acceleration is linear between samples.
    """
    denominator = [1.0, 2 * damping * pace_rad_s, pace_rad_s**2]
    b, a, _ = cont2discrete((numerator, denominator), 1 / rate_hz, method="foh")
    return lfilter(np.ravel(b), a, ground - ground[0], axis=0)


def has_impacts(scene: Scene) -> bool:
    """Whether the vertical force ever changes by IMPACT body weights within IMPACT_S."""
    frames = max(1, round(IMPACT_S * scene.rate_hz))
    force, valid = scene.measured[:, 2], scene.valid
    change = np.abs(force[frames:] - force[:-frames])[valid[frames:] & valid[:-frames]]
    return bool((change > IMPACT * scene.mass_kg * GRAVITY_M_S2).any())
