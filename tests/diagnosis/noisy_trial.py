"""A trial of the moving person whose plates are noisy and may err, and the evidence it makes.

Its own nuisances are five slow courses, the shared ones what a few segments' masses do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from bsip_cli.diagnosis.candidates import Candidate
from bsip_cli.diagnosis.evidence import TrialEvidence, slow, trial_evidence
from bsip_cli.diagnosis.explanation import Explanation, Fit, fit_together, with_noise_beside
from bsip_cli.diagnosis.signatures import Place
from bsip_cli.diagnosis.together import Evidence, together
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.scene import Scene
from tests.effects.moving_scene import moving, scene_of

CUTOFF_HZ = 8.0
NOISE = np.array([2.0, 2.0, 4.0, 1.0, 1.0, 0.5])  # [N, N m] of the whole wrench, per frame
SEGMENTS = ("upper_torso", "thigh_r", "thigh_l")
MASS_SD_KG = 0.5


def part_of_moving(first_s: float, duration_s: float, amplitude: float = 0.4) -> Scene:
    """A stretch of one long movement, as a trial of its own."""
    whole = moving(first_s + duration_s, amplitude)
    part = slice(round(first_s * whole.rate_hz), None)
    return scene_of(whole.q[part], whole.v[part], whole.a[part])


def shown(scene: Scene, change: np.ndarray | float) -> Scene:
    """The scene whose first plate shows so much more (N, 6)."""
    first, *others = scene.plates
    return replace(scene, plates=(replace(first, wrench=first.wrench + change), *others))


def noisy(scene: Scene, seed: int, times: float = 1.0) -> Scene:
    """White noise in the plates, so many times as large as usual."""
    drawn = np.random.default_rng(seed).normal(size=scene.predicted.shape)
    return shown(scene, times * NOISE * drawn)


def late(scene: Scene, delay_s: float) -> Scene:
    """All plates show their course a moment later."""
    at = np.clip(scene.times_s - delay_s, scene.times_s[0], None)
    plates = tuple(
        replace(plate, wrench=CubicSpline(scene.times_s, plate.wrench)(at))
        for plate in scene.plates
    )
    return replace(scene, plates=plates)


def with_effect(scene: Scene, effect: Effect, target: str, *values: float) -> Scene:
    """The scene in which an effect, one that does not hang on what is measured, is true."""
    return shown(scene, effect.change(scene, target, np.array(values)))


def evidence_of(name: str, scene: Scene) -> TrialEvidence:
    fewer = slow(scene)
    level = np.ones(len(scene.times_s))
    return trial_evidence(name, scene, _own(fewer), _shared(fewer), level, CUTOFF_HZ)


def all_of(*scenes: Scene) -> Evidence:
    """The evidence of trials a, b, ..."""
    return together(tuple(evidence_of(n, s) for n, s in zip("abcdef", scenes, strict=False)))


def fitted(evidence: Evidence, *explanations: Explanation, rounds: int = 3) -> tuple[Evidence, Fit]:
    """Explanations, the noise estimated anew beside them, as the selection does."""
    fit = fit_together(evidence, explanations)
    for _ in range(rounds - 1):
        evidence = with_noise_beside(evidence, fit.explanations)
        fit = fit_together(evidence, fit.explanations)
    return evidence, fit


def null(
    effect: Effect, target: str, scanned: tuple[float, ...] = (), trials: tuple[int, ...] = (0,)
) -> Explanation:
    """An effect with one free parameter, which is zero."""
    place = Place(Candidate(effect, target, scanned), trials)
    return Explanation(place, np.array([0.0, *scanned]))


def _own(scene: Scene) -> np.ndarray:
    """(N, 6, 5) a few newtons that come and go in the course of the trial."""
    x = np.linspace(0, np.pi, len(scene.times_s))
    courses = np.stack([np.cos(k * x) for k in range(1, 6)], axis=1)
    return NOISE[None, :, None] * courses[:, None]


def _shared(scene: Scene) -> np.ndarray:
    """(N, 6, 3) one standard deviation of each mass."""
    numbers = [scene.person.skeleton.index(segment) for segment in SEGMENTS]
    return MASS_SD_KG * np.stack([scene.motion.wrenches(i)[..., 0] for i in numbers], axis=2)
