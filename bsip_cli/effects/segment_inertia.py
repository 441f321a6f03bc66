"""A segment whose mass, centre of mass and inertia are not those of the table."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.inertia import from_phi
from bsip_cli.body.names import in_words
from bsip_cli.dynamics.cop import centre_of_pressure
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

MASS_SHARE, CENTRE_SHARE, INERTIA_SHARE = 0.2, 0.06, 0.3  # how far people are from tables
LEAST_FORCE_N = 50.0


class SegmentInertia(Effect):
    """A segment heavier, with another centre of mass or tensor than simulated with."""

    name = "segment_inertia"
    of_the_lab = False
    of_the_person = True
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
        shift = CENTRE_SHARE * length
        return (
            Parameter("mass_change", "kg", -5 * mass, 10 * mass, mass),
            *(Parameter(f"shift_{axis}", "m", -length, length, shift) for axis in "xyz"),
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

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        """The part of the squared error of wrench and centre of pressure that it takes away."""
        after = scene.predicted + self.change(scene, target, values)
        wrench = _share(scene.measured, scene.predicted, after, scene.valid)
        measured, before, now = (_cop(scene, w) for w in (scene.measured, scene.predicted, after))
        cop = _share(measured, before, now, scene.valid)
        return (("share", "1", wrench), ("cop_share", "1", cop))

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return (
            f"the {in_words(target)} has other inertial parameters than simulated with "
            f"({values[0]:+.2f} kg)"
        )


def _phi(scene: Scene, target: str) -> np.ndarray:
    i = scene.person.skeleton.index(target)
    return scene.phi_of(i)


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
    was = ((measured - before)[known] ** 2).mean(axis=0)
    now = ((measured - after)[known] ** 2).mean(axis=0)
    return float(1 - np.mean(now / np.maximum(was, 1e-12)))


def _cop(scene: Scene, wrench: np.ndarray) -> np.ndarray:
    """(N, 2) centre of pressure on the plates' surface [m]."""
    heights = [plate.centre_m()[2] for plate in scene.plates]
    return centre_of_pressure(wrench, float(np.mean(heights)) if heights else 0.0, LEAST_FORCE_N)
