"""What tests ask of effects and of regularities without a name alike."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.effect import Effect
from bsip_cli.effects.scene import Scene


def some(effect: Effect, scene: Scene) -> list[str]:
    """First, middle and last target."""
    targets = effect.targets(scene)
    assert targets
    return sorted({targets[0], targets[len(targets) // 2], targets[-1]})


def values_of(effect: Effect, scene: Scene, target: str, size: float) -> np.ndarray:
    """``size`` times typical, at the middle of what is scanned."""
    parameters = effect.parameters(scene, target)
    return np.array([p.scan[len(p.scan) // 2] if p.scan else size * p.typical for p in parameters])


def assert_tangent_is_the_derivative(effect: Effect, scene: Scene, size: float) -> None:
    """By differences of fourth order, at ``size`` times typical."""
    for target in some(effect, scene):
        values = values_of(effect, scene, target, size)
        tangent = effect.tangent(scene, target, values)
        at = [k for k, p in enumerate(effect.parameters(scene, target)) if not p.scan]
        assert tangent.shape == (*scene.predicted.shape, len(at))
        for column, k in enumerate(at):
            step = np.zeros(len(values))
            step[k] = 1e-2 * effect.parameters(scene, target)[k].typical

            def moved(n, target=target, values=values, step=step):
                return effect.change(scene, target, values + n * step)

            far, near = moved(2) - moved(-2), moved(1) - moved(-1)
            expected = (8 * near - far) / (12 * step[k])
            scale = max(float(np.abs(expected).max()), 1e-9)
            np.testing.assert_allclose(tangent[..., column], expected, atol=1e-4 * scale)
