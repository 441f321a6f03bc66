"""What every lab and every smoothing does a little wrong: too small to name, and not to be taken
for something else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bsip_cli.diagnosis.candidates import Candidate, candidates_of
from bsip_cli.dynamics.regressor import move_moments
from bsip_cli.effects.catalogue import CATALOGUE, EFFECTS
from bsip_cli.effects.delayed import Delay
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.gravity_tilt import GravityTilt
from bsip_cli.effects.scene import Scene, standing_place_m

SHARE = 0.02  # of the size that labs meet
HORIZONTAL = 0.7  # the same for the gain of horizontal forces
# The same for a plate's place: bodies of another table's segments look some centimetres higher or
# lower, as far as horizontal forces tell a height.
PLACE = (SHARE, SHARE, 1.0)
# The spline of `ik` takes as much as a low-pass at this cut-off, with a softer edge.
SPLINE_HZ, EDGE = 11.0, 3
BLUR_S = 0.015  # standard deviation of a Gaussian that the one passed and the other did not


def slack(scene: Scene) -> np.ndarray:
    """(N, 6, k) change of the wrench for one standard deviation of each small imperfection."""
    instruments = [effect for effect in CATALOGUE if is_of_instruments(effect)]
    columns = [
        slack_share(c) * c.signature(_source(effect, scene))
        for effect in (*instruments, EFFECTS["over_smoothing"])
        for c in candidates_of(effect, scene)
    ]
    return np.concatenate([*columns, _blurred(scene)], axis=2)


def _blurred(scene: Scene) -> np.ndarray:
    """(N, 6, 6) each component as if simulated motion and measured force were not equally sharp.

    Without it two opposite delays, or a delay and a clock, make up for what the motion lacks.
    """
    place = standing_place_m(scene)
    course = move_moments(scene.predicted, place)
    bent = np.gradient(np.gradient(course, axis=0), axis=0) * scene.rate_hz**2
    columns = 0.5 * BLUR_S**2 * bent[..., None] * np.eye(6)
    columns[:, 3:] += np.cross(place, columns[:, :3], axisb=1, axisc=1)
    return columns


def _source(effect: Effect, scene: Scene) -> Scene:
    """The trial whose forces come late: as simulated.

    Of the measured ones, with their noise, a slight delay would smooth what a larger one has moved,
    and make it larger still.
    """
    return replace(scene, wrench=scene.predicted) if isinstance(effect, Delay) else scene


def is_of_instruments(effect: Effect) -> bool:
    """Whether it is a fault of plates, clocks or the lab's vertical."""
    return effect.of_the_plates or isinstance(effect, (Delay, GravityTilt))


def slack_share(candidate: Candidate) -> np.ndarray:
    """(k,) or (1,) of the free parameters' typical sizes, that every lab and smoothing has.

    Horizontal forces are all motion, so what the motion's amplitude errs by is their gain.
    """
    effect, target = candidate.effect.name, candidate.target
    if effect == "over_smoothing":
        return np.array([(candidate.scanned[0] / SPLINE_HZ) ** EDGE])
    if effect == "plate_translation":
        return np.array(PLACE)
    horizontal = effect == "plate_gain" and target.endswith((" fx", " fy"))
    return np.array([HORIZONTAL if horizontal else SHARE])
