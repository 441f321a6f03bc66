"""A segment whose mass, centre of mass and inertia are not those of the table."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.inertia import PARAMETERS, UNITS, from_phi
from bsip_cli.body.names import in_words
from bsip_cli.dynamics.cop import centre_of_pressure
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

MASS_SHARE, CENTRE_SHARE, INERTIA_SHARE = 0.2, 0.06, 0.3  # how far people are from tables
LEAST_FORCE_N = 50.0


class SegmentInertia(Effect):
    """Deviation of a segment's ten parameters from those simulated with, about the joint."""

    name = "segment_inertia"
    of_the_lab = False
    remedy = "record a sequence that moves this segment fast, and identify with it"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return scene.bodies

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        body, length = _phi(scene, target), scene.length_of(target)
        moment = CENTRE_SHARE * length * body[0] + MASS_SHARE * np.linalg.norm(body[1:4])
        sizes = [MASS_SHARE * body[0], *[moment] * 3, *[INERTIA_SHARE * body[4:].max()] * 6]
        return tuple(
            Parameter(name, unit, -10 * size, 10 * size, float(size))
            for name, unit, size in zip(PARAMETERS, UNITS, sizes, strict=True)
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        i = scene.person.skeleton.index(target)
        return scene.once((self.name, i), lambda: scene.motion.wrenches(i)) @ values

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """A body with these parameters exists, with its centre of mass inside the segment."""
        phi = _phi(scene, target) + values
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
