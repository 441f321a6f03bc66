"""What a skeleton that is not quite the person's does to the simulated wrench.

The static trial puts markers and joint centres somewhere near their true places, and the error
stays the same in every trial: markers that are off on their segments turn every pose by the same
angles; joint centres that are off shift the limb when the joint turns. Neither is an effect unless
it is larger than scaling may err.
"""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.joint_centre import JointCentre
from bsip_cli.effects.scene import Scene
from bsip_cli.motion.jacobian import coordinate_covariance

# What scaling may err by. The spine bends in many places, which no single joint stands for.
JOINT_SD_M = {
    "waist": 0.04,
    "neck": 0.03,
    "sternoclavicular": 0.01,
    "shoulder": 0.02,
    "elbow": 0.008,
    "wrist": 0.008,
    "hip": 0.012,
    "knee": 0.008,
    "ankle": 0.008,
}
POSTURE_SD_RAD = 0.2  # of an angle that markers hardly decide


def posture_errors(scene: Scene, marker_sd_m: float) -> np.ndarray:
    """(N, 6, nv) change of the wrench for pose errors that last, of unit variance.

    Their covariance is what independent errors of the model's markers make of the pose in the
    middle of the trial.
    """
    middle = scene.valid.nonzero()[0][scene.valid.sum() // 2]
    pose = scene.q[middle : middle + 1]
    covariance = coordinate_covariance(scene.person, pose, POSTURE_SD_RAD / marker_sd_m)[0]
    root = marker_sd_m * np.linalg.cholesky(covariance)
    return scene.response.of(np.broadcast_to(root, (len(scene.q), *root.shape)))


def joint_errors(scene: Scene) -> np.ndarray:
    """(N, 6, 3 joints) change of the wrench for joint centres that are off by one sd."""
    effect = JointCentre()
    columns = [
        JOINT_SD_M[target.removesuffix("_l").removesuffix("_r")]
        * effect.tangent(scene, target, np.zeros(3))
        for target in effect.targets(scene)
    ]
    return np.concatenate(columns, axis=2)
