"""A body that is heavier, swings or breathes otherwise than the model's."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.inertia import from_phi
from bsip_cli.dynamics.ground_wrench import centre_of_pressure
from bsip_cli.dynamics.segment_motion import UP
from bsip_cli.effects.effect import Effect, Parameter, Reported, Words, along_xyz
from bsip_cli.effects.scene import Scene
from bsip_cli.segments import in_words

# --- masses ---------------------------------------------------------------------------------------


class StatedMass(Effect):
    """A person heavier or lighter than is stated, every segment alike: what a laboratory's plates
    must not be blamed for. No part of the catalogue: within one person it looks like a
    gain of all plates."""

    name = "stated_mass"
    is_of_person = True
    remedy = "weigh the person as recorded"
    parameter = Parameter("share", "1", -0.5, 1.0, 0.01)  # scales, clothes and a week make as much
    numbers = (parameter,)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return values[0] * scene.predicted

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        order = "more" if values[0] > 0 else "less"
        return Words(f"the person weighs {100 * abs(values[0]):.1f} % {order} than is stated")


MASS_SHARE, CENTRE_SHARE, INERTIA_SHARE = 0.2, 0.06, 0.3  # how far people are from tables
LEAST_FORCE_N = 50.0


class SegmentInertia(Effect):
    """A segment whose mass, centre of mass and inertia are not those of the table."""

    name = "segment_inertia"
    is_of_person = True
    of_the_body = True
    looks = (
        "forces that go with the acceleration of one segment in every trial, beyond what "
        "people differ by"
    )
    remedy = "record a sequence that moves this segment fast, and identify with it"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return scene.bodies

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        length = scene.length_of(target)
        mass = MASS_SHARE * float(_phi(scene, target)[0])
        return (
            Parameter("mass_change", "kg", -5 * mass, 10 * mass, mass),
            *along_xyz("shift", "m", -length, length, CENTRE_SHARE * length),
            Parameter("inertia_change", "1", -1.0, 3.0, INERTIA_SHARE),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        i = scene.person.skeleton.index(target)
        return scene.wrenches(i) @ (_changes(scene, target) @ values)

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """A body with these parameters exists, with its centre of mass inside the segment."""
        phi = _phi(scene, target) + _changes(scene, target) @ values
        if phi[0] <= 0:
            return False
        origin = scene.person.origin_in_joint_m[scene.person.skeleton.index(target)]
        body = from_phi(phi).moved(origin)
        return body.is_physical() and bool(np.linalg.norm(body.com_m) < scene.length_of(target))

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """The part of the squared error of wrench and centre of pressure that it takes away."""
        heights = [plate.centre_m()[2] for plate in scene.plates]
        height = float(np.mean(heights)) if heights else 0.0  # of the plates' surface
        after = scene.predicted + self.change(scene, target, values)
        wrenches = (scene.measured, scene.predicted, after)
        seen, was, now = (centre_of_pressure(one, height, LEAST_FORCE_N) for one in wrenches)
        share, cop_share = _share(*wrenches, scene.valid), _share(seen, was, now, scene.valid)
        return (("share", "1", share), ("cop_share", "1", cop_share))

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        short = f"the {in_words(target)} has other inertial parameters than simulated with"
        return Words(f"{short} ({values[0]:+.2f} kg)", short)


def _phi(scene: Scene, target: str) -> np.ndarray:
    return scene.phi_of(scene.person.skeleton.index(target))


def _changes(scene: Scene, target: str) -> np.ndarray:
    """(10, 5) of the parameters about the joint by those of the effect: the whole segment heavier,
    its mass moved, its tensor about the centre of mass larger, each to first order."""
    phi = _phi(scene, target)
    mass = float(phi[0])
    central = phi.copy()
    central[:4] = 0.0
    central[4:] -= _steiner(phi[1:4] / mass, phi[1:4])
    columns = [phi / mass]
    for axis in np.eye(3):
        moved = np.zeros(10)
        moved[1:4] = mass * axis
        moved[4:] = _steiner(axis, phi[1:4]) + _steiner(phi[1:4] / mass, mass * axis)
        columns.append(moved)
    return np.stack([*columns, central], axis=1)


def _steiner(place: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """(6,) Ixx, Ixy, Iyy, Ixz, Iyz, Izz of a mass at a place [m] with first moment [kg m]."""
    tensor = place @ moment * np.eye(3) - np.outer(place, moment)
    return tensor[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]


def _share(measured: np.ndarray, before: np.ndarray, after: np.ndarray, valid: np.ndarray) -> float:
    """1 less the ratio of the squared errors, every component counted by its error before."""
    known = valid & np.isfinite(measured + before + after).all(axis=1)
    if not known.any():
        return float("nan")
    was, now = (((measured - x)[known] ** 2).mean(axis=0) for x in (before, after))
    return float(1 - np.mean(now / np.maximum(was, 1e-12)))


# --- soft tissue and breath -----------------------------------------------------------------------

# Body weights by which the vertical force changes within IMPACT_S: at most 0.6 in fast movements
# without impacts of either simulator, 1.1 to 3 in heel drops, hops and landings.
IMPACT, IMPACT_S = 0.8, 0.05
FREQUENCIES_HZ = (2.5, 3.0, 3.5, 4.0, 5.0, 6.5)
DAMPING = (0.1, 0.2, 0.4)
# Soft tissue is no point on one spring: its numbers are known to these standard deviations. Beneath
# the markers of a limb the skin slides, and the mass that swings there is found too low.
MASS_KG, LIMB_MASS_KG, FREQUENCY_HZ, DAMPING_RATIO = 0.5, 0.8, 0.05, 0.02


class WobblingMass(Effect):
    """A part of a segment's mass that swings against the bone.

    A mass on a spring and a damper at the segment's centre of mass.

    Looked for only where an impact sets it swinging: in slow movement it is a heavier segment. It
    need not swing to the sides as it does up and down: how much of it seems to is a number of its
    own, which is not reported.
    """

    name = "wobbling_mass"
    on_its_segment = True
    is_of_person = True
    looks = (
        "after impacts the measured force swings on at 2 to 8 Hz and dies away, which "
        "the simulated one does not"
    )
    remedy = "hop three times, or drop on the heels"
    least_named = MappingProxyType({"mass": 0.5})  # what swings to the sides only is none

    def targets(self, scene: Scene) -> tuple[str, ...]:
        """Where the vertical force ever changes by IMPACT body weights within IMPACT_S."""
        frames = max(1, round(IMPACT_S * scene.rate_hz))
        force, valid = scene.measured[:, 2], scene.valid
        change = np.abs(force[frames:] - force[:-frames])[valid[frames:] & valid[:-frames]]
        if not (change > IMPACT * scene.mass_kg * GRAVITY_M_S2).any():
            return ()
        soft = ("lower_torso", "upper_torso", "thigh", "shank")
        return tuple(s for s in scene.person.skeleton.segments if s.startswith(soft))

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        most = max(0.8 * float(_phi(scene, target)[0]), 0.1)
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

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """Without what seems to swing to the sides."""
        return super().reported(scene, target, values)[:3]

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        mass, hertz, damping, *_ = values
        short = f"{mass:.1f} kg of soft tissue of the {in_words(target)} swing against the bone"
        what = f"{short}, {hertz:.1f} times per second (damping ratio {damping:.2f})"
        return Words(what, short)


def _swings(
    scene: Scene, target: str, frequency_hz: float, damping: float
) -> tuple[np.ndarray, np.ndarray]:
    """(N, 6) each : what 1 kg adds to the wrench by swinging instead of staying in its segment, up
    and down and to the sides.

    x'' = -2 damping pace x' - pace^2 x - ground, at rest when the trial begins; exact where the
    ground's acceleration is linear between samples.
    """
    from scipy.signal import cont2discrete, lfilter  # heavy: reports never need it

    point = scene.centre(target)
    ground, pace = point.acceleration_m_s2, 2 * np.pi * frequency_hz

    def response(numerator: list[float]) -> np.ndarray:
        """(N, 3) travel of the mass against its segment [m], or with s^2 its acceleration."""
        system = (numerator, [1.0, 2 * damping * pace, pace**2])
        b, a, _ = cont2discrete(system, 1 / scene.rate_hz, method="foh")
        return lfilter(np.ravel(b), a, ground - ground[0], axis=0)

    travel, force = response([-1.0]), response([-1.0, 0.0, 0.0])

    def swinging(axes: np.ndarray) -> np.ndarray:
        own, stretch = force * axes, travel * axes
        carried = ground + own - scene.model.gravity.linear
        moment = np.cross(point.position_m, own) + np.cross(stretch, carried)
        return np.hstack([own, moment])

    upright = swinging(UP)
    return upright, swinging(np.ones(3)) - upright


SLOWEST_HZ, FASTEST_HZ = 0.12, 0.6
# The breastbone moves ahead and up; torso axes.
OUTWARD = np.array([0.8, 0.6, 0.0])
LEAST_BREATHS = 3
# A quarter of it is no finding: so much is where the markers of the chest breathe and no mass does.
TYPICAL_KG_M = 0.3
PACE_HZ = 3e-4  # to which a pace is known: nobody breathes like a clock


class Breathing(Effect):
    """The chest that moves with every breath while the model's trunk stands still.

    Moved mass times amplitude, a sine ahead and up in the upper torso.
    """

    name = "breathing"
    on_its_segment = True
    looks = "a slow swing of the vertical force in quiet parts, at the pace of breathing"
    remedy = "hold the breath for ten seconds"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("upper_torso",) if _slowest_hz(scene) < FASTEST_HZ else ()

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        apart = 0.5 / max(float(np.ptp(scene.times_s)), 1.0)
        slowest = _slowest_hz(scene)
        paces = tuple(float(f) for f in np.arange(slowest, FASTEST_HZ, apart))
        return (
            Parameter("cosine", "kg m", -1.0, 1.0, TYPICAL_KG_M),
            Parameter("sine", "kg m", -1.0, 1.0, TYPICAL_KG_M),
            Parameter("frequency", "Hz", slowest, 0.7, apart, paces, known_to=PACE_HZ),
        )

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The change is linear in cosine and sine."""
        pace = 2 * np.pi * values[2]
        phase = pace * (scene.times_s - scene.times_s[0])
        moved = np.stack([np.cos(phase), np.sin(phase)])[..., None]
        speed = pace * np.stack([-np.sin(phase), np.cos(phase)])[..., None]
        i, motion = scene.person.skeleton.index(target), scene.motion
        out = motion.rotation[:, i] @ OUTWARD
        w, dw = motion.turning_rad_s[:, i], motion.turning_acceleration_rad_s2[:, i]
        turned = np.cross(dw, out) + np.cross(w, np.cross(w, out))
        force = moved * (turned - pace**2 * out) + 2 * speed * np.cross(w, out)
        centre = scene.centre(target)
        carried = centre.acceleration_m_s2 - scene.model.gravity.linear
        moment = np.cross(centre.position_m, force) + moved * np.cross(out, carried)
        return np.moveaxis(np.concatenate([force, moment], axis=2), 0, 2)

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        amplitude = float(np.hypot(values[0], values[1]))
        return ("amplitude", "kg m", amplitude), ("frequency", "Hz", float(values[2]))

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        short, size = f"breathing moves the trunk {values[2]:.2f} times per second", values[:2]
        return Words(f"{short} (mass times amplitude {np.hypot(*size):.3f} kg m)", short)


def _slowest_hz(scene: Scene) -> float:
    """A few breaths are needed to distinguish them from any other slow signal."""
    return max(SLOWEST_HZ, LEAST_BREATHS / max(float(np.ptp(scene.times_s)), 1.0))
