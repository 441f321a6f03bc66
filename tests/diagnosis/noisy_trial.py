"""A trial of the moving person whose plates are noisy and may err."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from bsip_cli.body.anthropometry import regress
from bsip_cli.diagnosis.error_model import Session, TrialErrors, session_of
from bsip_cli.diagnosis.error_terms import error_terms, noise_of_instruments
from bsip_cli.diagnosis.filtering import filter_of, slow
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.scene import Scene
from bsip_cli.identification.prior import Spread, prior_of
from tests.body.standing_person import standing
from tests.effects.moving_scene import MASS_KG, moving, scene_of

CUTOFF_HZ, MARKER_NOISE_M = 5.0, 2e-4
PEOPLE = Spread(12.0, 3.0, 0.005, 30.0, 0.93, 0.8)
NOISE = np.array([2.0, 2.0, 4.0, 1.0, 1.0, 0.5])  # [N, N m] of the whole wrench, per frame


def part_of_moving(first_s: float, duration_s: float, amplitude: float = 0.4) -> Scene:
    """A part of one long movement, as a trial of its own."""
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
    """All plates show their signal a moment later."""
    at = np.clip(scene.times_s - delay_s, scene.times_s[0], None)
    plates = tuple(
        replace(plate, wrench=CubicSpline(scene.times_s, plate.wrench)(at))
        for plate in scene.plates
    )
    return replace(scene, plates=plates)


def with_effect(scene: Scene, effect: Effect, target: str, *values: float) -> Scene:
    """The scene in which an effect, one that does not hang on what is measured, is true."""
    return shown(scene, effect.change(scene, target, np.array(values)))


def prior_root() -> np.ndarray:
    """Of the inertial parameters' covariance."""
    person = standing().person
    return prior_of(regress(person, "M", MASS_KG).inertias, person, PEOPLE).root


def errors_of(scene: Scene, name: str = "a") -> TrialErrors:
    """The trial's residual and all terms that may explain it."""
    fewer = slow(scene)
    low = filter_of(fewer, CUTOFF_HZ)
    residual = low.one(fewer.measured - fewer.predicted)
    terms = tuple(
        replace(one, columns=low(one.columns))
        for one in error_terms(fewer, prior_root(), 0.005, 2.0)
    )
    noise = noise_of_instruments(fewer, low.reference_m, MARKER_NOISE_M, scene.rate_hz, CUTOFF_HZ)
    return TrialErrors(name, fewer, low, residual, terms, noise)


def session(*scenes: Scene) -> Session:
    """Trials a, b, ... of one person."""
    named = zip("abcdef", scenes, strict=False)
    return session_of([errors_of(scene, name) for name, scene in named])
