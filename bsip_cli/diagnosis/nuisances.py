"""What a simulation gets wrong without anything being wrong, as columns of unit variance."""

from __future__ import annotations

import numpy as np

from bsip_cli.diagnosis.geometry import joint_errors, posture_errors
from bsip_cli.diagnosis.skin import skin_draws, skin_inertia
from bsip_cli.diagnosis.slack import slack
from bsip_cli.diagnosis.smoothing_bias import smoothing_bias
from bsip_cli.diagnosis.wander import wander
from bsip_cli.dynamics.regressor import wrench_regressor
from bsip_cli.effects.scene import Scene

_UNKNOWN_RMS_M = 0.004  # of a marker whose residuals are not known


def own_nuisances(
    scene: Scene, skin_factor: float, draws: int, rng: np.random.Generator
) -> np.ndarray:
    """(N, 6, m) of one trial: skin, the smoothing of the motion, small faults of the instruments.

    skin_factor : the skin of a segment slides as a whole this many times as far as the residuals
        of its markers show.
    """
    skin = skin_draws(scene, marker_rms_m(scene) / np.sqrt(draws), skin_factor, draws, rng)
    columns = [skin, wander(scene), smoothing_bias(scene), slack(scene)]
    return np.concatenate(columns, axis=2)


def shared_nuisances(scene: Scene, root: np.ndarray, marker_sd_m: float) -> np.ndarray:
    """(N, 6, p) that all trials of a person share: inertial parameters, skeleton, skin's inertia.

    root : (P, P) of the parameters' covariance. marker_sd_m : of the model's markers.
    """
    model = scene.model
    regressor = wrench_regressor(model, model.createData(), scene.q, scene.v, scene.a, np.zeros(3))
    columns = [
        regressor @ root,
        posture_errors(scene, marker_sd_m),
        joint_errors(scene),
        skin_inertia(scene),
    ]
    return np.concatenate(columns, axis=2)


def marker_rms_m(scene: Scene) -> np.ndarray:
    """(m,) root mean square of each marker's residuals, per direction."""
    if scene.residual_m is None:
        return np.full(len(scene.person.markers), _UNKNOWN_RMS_M)
    known = np.isfinite(scene.residual_m)
    squares = np.where(known, scene.residual_m, 0.0) ** 2
    count = known.sum(axis=(0, 2))
    rms = np.sqrt(squares.sum(axis=(0, 2)) / np.maximum(count, 1))
    return np.where(count > 0, rms, _UNKNOWN_RMS_M)
