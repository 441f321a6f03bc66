"""The terms of the one model of the error: what each may do to a trial's simulated wrench.

A term is a set of columns of unit variance where it is as large as usual; how large it is in these
recordings follows from the data (``error_model``).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from scipy.signal import butter, sosfiltfilt

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.dynamics.ground_wrench import move_moments, wrench_regressor
from bsip_cli.effects.body import JointCentre
from bsip_cli.effects.catalogue import CATALOGUE
from bsip_cli.effects.plates import GravityTilt
from bsip_cli.effects.scene import Scene, place_of_stance_m

INERTIA, JOINTS, MARKERS = "inertial_parameters", "joint_centres", "marker_places"
SKIN, TRUNK, SMOOTHING = "soft_tissue", "trunk_and_shoulders", "smoothing"
FAULT = "fault:"
# Joints that stand for many: their shift is what a trunk or a shoulder girdle that bends does.
_BENDING = ("waist", "neck", "sternoclavicular", "shoulder")
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
# What every laboratory has of a fault of its instruments, part of the size that is met.
SHARE = 0.02
# Noise that no lab goes below: parts of body weight, and arms of it (half a millimetre) [m].
LEAST = np.array([0.0003, 0.0003, 0.0005, 0.0005, 0.0005, 0.0001])
_HEAVIER = 0.01  # usual error of the whole mass, part of it: a scale's, clothes and shoes
SKIN_HZ = 8.0  # at which skin swings by itself
# Part of critical damping, mean and standard deviation: from none to all, each as likely. Undamped
# tissue would never be late, and its lag would pass for the clock's.
SKIN_DAMPING = (1 / 2, 1 / np.sqrt(12))
_UNKNOWN_RMS_M = 0.004  # of a marker whose residuals are not known
DRIFT_M = 0.001  # standard deviation of the centre of mass, in each horizontal direction
_SLOWER_HZ = 0.3
_CUTOFFS_HZ = (3.0, 6.0, 10.0)
_GROUPS = (
    ("root", "hip", "knee", "ankle"),
    ("waist", "neck"),
    ("sternoclavicular", "shoulder", "elbow", "wrist"),
)


@dataclass(frozen=True, eq=False)
class Term:
    """Columns (N, 6, k) of a term at one target, about the world's origin [N, N m]; or (n, 6, k)
    that have passed a trial's filter.

    own : whether the trial has coefficients of its own; else the person's trials share them.
    scale : columns of the same scale are as many times larger than usual as each other.
    known : (n, 6) what it adds at the values about which the columns are, of a named fault.
    mixing : (k, m) where the columns are not of unit variance, columns @ mixing are; ``targets``
        have as many of the columns each.
    """

    term: str
    target: str
    scale: str
    own: bool
    columns: np.ndarray
    known: np.ndarray | None = None
    mixing: np.ndarray | None = None
    targets: tuple[str, ...] = ()

    @property
    def of_unit_variance(self) -> np.ndarray:
        """(n, 6, m)."""
        return self.columns if self.mixing is None else self.columns @ self.mixing


def error_terms(
    scene: Scene, root: np.ndarray, landmark_sd_m: float, skin_factor: float
) -> Iterator[Term]:
    """All terms of one trial.

    root : (10 n, 10 n) of the covariance of the inertial parameters. landmark_sd_m : of the places
    of the model's markers on their segments. skin_factor : the skin of a segment slides as a whole
    this many times as far as the residuals of its markers show.
    """
    skeleton, model = scene.person.skeleton, scene.model
    regressor = wrench_regressor(model, scene.q, scene.v, scene.a, np.zeros(3))
    segments = skeleton.body_names
    yield Term(INERTIA, "", INERTIA, False, regressor, None, root, segments)
    heavier = _HEAVIER * scene.phi[:, None]
    yield Term(INERTIA, "", f"{INERTIA} in all", False, regressor, None, heavier, segments)
    centre = JointCentre()
    for joint in centre.targets(scene):
        term = TRUNK if joint.startswith(_BENDING) else JOINTS
        sd_m = JOINT_SD_M[joint.removesuffix("_l").removesuffix("_r")]
        columns = sd_m * centre.tangent(scene, joint, np.zeros(3))
        yield Term(term, joint, term, False, columns)
    for segment, places, skin, swinging in _of_markers(scene, landmark_sd_m, skin_factor):
        name = skeleton.segments[segment]
        yield Term(MARKERS, name, MARKERS, False, places)
        yield Term(SKIN, name, f"{SKIN} {name}", True, skin)
        yield Term(SKIN, name, f"{SKIN} swings", False, swinging)
    yield Term(SKIN, "", f"{SKIN} of the whole body", False, _swinging_body(scene))
    yield Term(SKIN, "", f"{SKIN} drifts", True, drift(scene))
    yield Term(SMOOTHING, "", SMOOTHING, True, smoothing_bias(scene))
    source = as_simulated(scene)
    for effect in CATALOGUE:
        if not (effect.of_the_forces or isinstance(effect, GravityTilt)):
            continue  # not of plates, clocks or the lab's vertical
        name, own = FAULT + effect.name, effect.scope != "laboratory"  # one for the session
        for target in effect.targets(scene):  # each place, as far as every laboratory has it
            null = np.zeros(len(effect.parameters(source, target)))
            wrench = SHARE * effect.signature(source, target, null)
            numbers = f"{len(null)} numbers"  # a file that places its plates has fewer
            yield Term(name, target, f"{name} {target}, {numbers}", own, wrench)


def as_simulated(scene: Scene) -> Scene:
    """The plates read what is simulated: of what they measured, a gain or a delay would explain a
    part of any residual by itself. Each plate bears its part of the vertical force."""

    def reading() -> Scene:
        off = scene.measured - scene.predicted
        loads = [np.maximum(one.wrench[:, 2:3], 0.0) for one in scene.plates]  # flight is noise
        total = np.maximum(np.sum(loads, axis=0), np.finfo(float).tiny)
        plates = tuple(
            replace(one, wrench=one.wrench - np.nan_to_num(load / total) * off)
            for one, load in zip(scene.plates, loads, strict=True)
        )
        return scene.reading(plates, scene.predicted)

    return scene.once("as simulated", reading, of_readings=True)


def _of_markers(
    scene: Scene, sd_m: float, skin_factor: float
) -> Iterator[tuple[int, np.ndarray, np.ndarray, np.ndarray]]:
    """Per segment with markers: what misplaced markers on it do; what skin that follows the angles
    of the joints next to it does, each marker as far as its residuals show; and what (N, 6, 2) its
    skin does if it swings on."""
    rms = _marker_rms_m(scene)
    for segment in np.unique(scene.person.marker_segments).tolist():
        (mine,) = np.nonzero(scene.person.marker_segments == segment)
        turn = scene.motion.rotation[:, segment][:, None]
        angles = _nearby_angles(scene, segment)
        rate = np.gradient(angles, 1 / scene.rate_hz, axis=0)
        signals = (angles, rate, np.gradient(rate, 1 / scene.rate_hz, axis=0))
        parts = [scene.response.parts(scene.pose_response.of(turn, [m])) for m in mine.tolist()]
        places = sd_m * np.concatenate([one[0] for one in parts], axis=2)
        together = skin_factor * np.sqrt((rms[mine] ** 2).mean()) * np.sum(parts, axis=0)
        each = [rms[m] * one for m, one in zip(mine, parts, strict=True)]
        skin = [_following(one, signals) for one in (*each, together)]
        behind = stays_behind(scene.motion.acceleration_m_s2[:, segment], scene.rate_hz)
        errors = np.broadcast_to(behind[:, None], (len(behind), len(mine), 3, 2))
        swinging = scene.response.of(scene.pose_response.of(errors, mine.tolist()))
        yield segment, places, np.concatenate(skin, axis=2), swinging


def _marker_rms_m(scene: Scene) -> np.ndarray:
    """(m,) root mean square of each marker's residuals, per direction."""
    if scene.residual_m is None:
        return np.full(len(scene.person.markers), _UNKNOWN_RMS_M)
    known = np.isfinite(scene.residual_m)
    squares = np.where(known, scene.residual_m, 0.0) ** 2
    count = known.sum(axis=(0, 2))
    rms = np.sqrt(squares.sum(axis=(0, 2)) / np.maximum(count, 1))
    return np.where(count > 0, rms, _UNKNOWN_RMS_M)


def _nearby_angles(scene: Scene, segment: int) -> np.ndarray:
    """(N, j) from the neutral pose, of the joints at a segment, its own and those of its children;
    of variance 1 together."""
    skeleton = scene.person.skeleton
    angles = []
    for i in range(1, len(skeleton.parents)):
        if segment in (i, skeleton.parents[i]):
            at = skeleton.q_starts[i]
            if skeleton.joint_types[i] == "spherical":
                x = scene.q[:, at : at + 4]
                x = x * np.sign(x[:, 3:] + 1e-300)
                angles.append(2 * x[:, :3])
            else:
                angles.append(scene.q[:, at : at + 1])
    nearby = np.concatenate(angles, axis=1)
    return nearby / max(np.sqrt((nearby**2).sum(axis=1).mean()), 1e-9)


def _following(parts: np.ndarray, signals: Sequence[np.ndarray]) -> np.ndarray:
    """(N, 6, 3 j) of parts (3, N, 6, 3) for signals s, s' and s'' (N, j) of each angle."""
    both = sum(p[..., None] * s[:, None, None, :] for p, s in zip(parts, signals, strict=True))
    return np.asarray(both).reshape(*parts.shape[1:3], -1)


def stays_behind(acceleration: np.ndarray, rate_hz: float) -> np.ndarray:
    """How far (N, ..., 2) soft tissue stays behind bones that are accelerated by a (N, ...).

    It is held by a spring and a damper: far below the pace w at which it swings by itself that is
    -(a - 2 z a' / w) / w^2. So markers overshoot slightly, and late, where they turn back. Of z
    only mean and standard deviation are known, which two signals of unit variance say as well.
    """
    pace, (mean, sd) = 2 * np.pi * SKIN_HZ, SKIN_DAMPING
    later = 2 / pace * np.gradient(acceleration, 1 / rate_hz, axis=0)
    return np.stack([mean * later - acceleration, sd * later], axis=-1) / pace**2


def drift(scene: Scene) -> np.ndarray:
    """(N, 6, 2 k) changes of the wrench if the body stood in another place, of unit variance
    together.

    Slow drift of the skin moves the whole model to and fro over the plates. It goes along with
    no joint, and is too slow to be noise of which a trial has many cycles.
    """
    length_s = scene.times_s[-1] - scene.times_s[0]
    halves = np.arange(1, max(1, int(2 * length_s * _SLOWER_HZ)) + 1)  # periods, two of them one
    signal = np.cos(np.pi * np.outer(scene.times_s - scene.times_s[0], halves) / length_s)
    signal *= DRIFT_M * np.sqrt(2 / len(halves))
    force = np.nan_to_num(scene.predicted[:, :3])
    columns = np.zeros((len(signal), 6, 2, len(halves)))
    for axis in range(2):
        columns[:, 3:, axis] = np.cross(np.eye(3)[axis], force)[..., None] * signal[:, None]
    return columns.reshape(len(signal), 6, -1)


def smoothing_bias(scene: Scene) -> np.ndarray:
    """(N, 6, 9) change of the wrench if each group of joints had lost its motion above each
    cut-off.

    A smoothed motion lacks a part of its fast changes. To first order the lack looks like what a
    second smoothing would take away: pose minus low-passed pose.
    """
    groups = [[float(n.startswith(g)) for n in scene.person.skeleton.v_names] for g in _GROUPS]
    parts = []
    for cutoff in _CUTOFFS_HZ:
        corner = min(cutoff, 0.45 * scene.rate_hz)
        slow = sosfiltfilt(butter(2, corner, fs=scene.rate_hz, output="sos"), scene.q, axis=0)
        pairs = zip(slow, scene.q, strict=True)
        tangent = [pin.difference(scene.model, pin.normalize(scene.model, s), q) for s, q in pairs]
        parts += [np.array(tangent) * group for group in groups]
    return scene.response.of(np.stack(parts, axis=-1))


def _swinging_body(scene: Scene) -> np.ndarray:
    """(N, 6, 7) if all soft tissue swings at SKIN_HZ: the wrench as far behind as tissue is, each
    component by itself, since tissue is not held alike in all directions; and as late in all."""
    place = place_of_stance_m(scene)
    signal = move_moments(scene.predicted, place)
    bent = np.gradient(np.gradient(signal, axis=0), axis=0) * scene.rate_hz**2
    behind, later = np.moveaxis(stays_behind(bent, scene.rate_hz), -1, 0)
    columns = (*(behind * axis for axis in np.eye(6)), later)
    return np.stack([-move_moments(one, -place) for one in columns], axis=-1)


def noise_of_instruments(
    scene: Scene, reference_m: np.ndarray, marker_noise_m: float, rate_hz: float, cutoff_hz: float
) -> np.ndarray:
    """(6,) standard deviation of the filtered residual, moments about a point, that white noise of
    the markers and the plates' own noise make: nothing of it is what a fit leaves over.

    marker_noise_m : white noise of the markers at ``rate_hz``, as the smoothing has found it.
    cutoff_hz : of the Gaussian low-pass that the residual has passed, which leaves half of the
        power there. The spline's own smoothing is not counted: so the noise is not more than this.
    """
    person = scene.person
    joint = np.searchsorted(person.skeleton.v_starts, range(scene.model.nv), side="right") - 1
    known = ~person.without_data()[joint]
    information = np.linalg.inv(scene.pose_response.inverse)[:, known][:, :, known]
    covariance = np.linalg.inv(information)
    decay = np.log(2) / cutoff_hz**2
    of_position = np.sqrt(np.pi / decay) / rate_hz
    of_acceleration = (2 * np.pi) ** 4 * 0.75 * np.sqrt(np.pi) / decay**2.5 / rate_hz
    response = scene.response
    variance = of_acceleration * _size(
        response.to_acceleration[..., known], reference_m, covariance
    )
    variance += of_position * _size(response.to_position[..., known], reference_m, covariance)
    return np.hypot(marker_noise_m * np.sqrt(variance), LEAST * scene.mass_kg * GRAVITY_M_S2)


def _size(response: np.ndarray, reference_m: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """(6,) variance, in the median over the frames, of pose errors (N, k, k)."""
    moved = response.copy()
    moved[:, 3:] -= np.cross(reference_m, moved[:, :3], axisb=1, axisc=1)
    return np.median(np.einsum("fik,fkl,fil->fi", moved, covariance, moved), axis=0)
