"""Effects with their numbers, fitted together to the evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear, minimize

from bsip_cli.diagnosis.candidates import Candidate
from bsip_cli.diagnosis.evidence import FLOOR
from bsip_cli.diagnosis.signatures import Place
from bsip_cli.diagnosis.together import Evidence, clipped, together
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.joint_change import joint_change
from bsip_cli.effects.scene import Scene

NEGLIGIBLE = 0.25  # of the typical size
_STEPS = 20  # of Gauss and Newton: large effects come out of the clipping step by step
_DIFFERENCE = 0.1  # of the typical size: a moment in time moves by a part of a frame at least
_SEARCH = 80  # evaluations for a moment, a frequency or a window
_UNTOLD = 1e-6  # of the largest derivative: a hinge does not tell a shift along its axis


@dataclass(frozen=True, eq=False)
class Explanation:
    """An effect in some trials, all of its parameters in the effect's order."""

    place: Place
    values: np.ndarray

    def wrench(self, scene: Scene) -> np.ndarray:
        """(N, 6) change of a trial's simulated wrench."""
        return self.effect.change(scene, self.target, self.values)

    def change(self, evidence: Evidence) -> np.ndarray:
        """(R,) white change of the simulated wrench."""
        parts = {}
        for t in self.place.trials:
            one = evidence.trials[t]
            parts[t] = one.white(self.wrench(one.scene)[..., None])
        return evidence.white(parts)[:, 0]

    def tangent(self, evidence: Evidence) -> np.ndarray:
        """(R, k) white derivative by the free parameters, per typical size."""
        parts = {}
        for t in self.place.trials:
            one = evidence.trials[t]
            slope = self.effect.tangent(one.scene, self.target, self.values)
            parts[t] = one.white(slope * self.typical(evidence))
        return evidence.white(parts)

    def full_tangent(self, evidence: Evidence) -> np.ndarray:
        """(R, K) white derivative by all parameters, those with a scan too, per typical size."""
        sizes = self.all_typical(evidence)
        columns = []
        for k, size in enumerate(sizes):
            step = np.zeros(len(sizes))
            step[k] = _DIFFERENCE * size
            ahead = Explanation(self.place, self.values + step).change(evidence)
            behind = Explanation(self.place, self.values - step).change(evidence)
            columns.append((ahead - behind) / (2 * _DIFFERENCE))
        return np.stack(columns, axis=1)

    def all_typical(self, evidence: Evidence) -> np.ndarray:
        """(K,) typical sizes of all parameters."""
        return np.array([p.typical for p in self.parameters(evidence)])

    def all_moved(self, evidence: Evidence, step: np.ndarray) -> Explanation:
        """With all parameters changed by ``step`` (K,) typical sizes, within their bounds."""
        return self._within(evidence, self.values + step * self.all_typical(evidence))

    def alike(self, evidence: Evidence) -> list[Explanation]:
        """Those that these recordings cannot tell from it, the plainest first."""
        values = self.effect.alike(self.scene(evidence), self.target, self.values)
        return [Explanation(self.place, one) for one in values]

    def reported(self, evidence: Evidence) -> tuple[tuple[str, str, float], ...]:
        """Name, unit and value of what the diagnosis prints."""
        return self.effect.reported(self.scene(evidence), self.target, self.values)

    def sentence(self, evidence: Evidence) -> str:
        """What a person should read, without interval."""
        return self.effect.sentence(self.scene(evidence), self.target, self.values)

    @property
    def effect(self) -> Effect:
        return self.place.candidate.effect

    @property
    def target(self) -> str:
        return self.place.candidate.target

    def is_free(self, evidence: Evidence) -> np.ndarray:
        """(K,) True for the parameters without a scan."""
        return self.effect.is_free(self.scene(evidence), self.target)

    def typical(self, evidence: Evidence) -> np.ndarray:
        """(k,) typical sizes of the free parameters."""
        return self.all_typical(evidence)[self.is_free(evidence)]

    def known_to(self, evidence: Evidence) -> np.ndarray:
        """(k,) standard deviations that no recording betters, of the free parameters [typical]."""
        known = np.array([p.known_to for p in self.parameters(evidence)])
        return known[self.is_free(evidence)] / self.typical(evidence)

    def moved_freely(self, evidence: Evidence, step: np.ndarray) -> Explanation:
        """With the free parameters changed by ``step`` (k,) typical sizes."""
        values = self.values.copy()
        values[self.is_free(evidence)] += step * self.typical(evidence)
        return Explanation(self.place, values)

    def moved(self, evidence: Evidence, step: np.ndarray) -> Explanation:
        """As ``moved_freely``, within the bounds."""
        return self._within(evidence, self.moved_freely(evidence, step).values)

    def _within(self, evidence: Evidence, values: np.ndarray) -> Explanation:
        """With values (K,) cut to the bounds."""
        return Explanation(self.place, np.clip(values, *self._bounds(evidence).T))

    def room(self, evidence: Evidence) -> np.ndarray:
        """(k, 2) by how much the free parameters may change, down and up [typical]."""
        room = self._bounds(evidence) - self.values[:, None]
        return room[self.is_free(evidence)] / self.typical(evidence)[:, None]

    def _bounds(self, evidence: Evidence) -> np.ndarray:
        """(K, 2) of all parameters."""
        return np.array([(p.least, p.most) for p in self.parameters(evidence)])

    def is_negligible(self, evidence: Evidence) -> bool:
        """Whether it is too small to matter beside what labs meet."""
        sizes = self.values[self.is_free(evidence)] / self.typical(evidence)
        return bool(np.linalg.norm(sizes) < NEGLIGIBLE)

    def is_possible(self, evidence: Evidence) -> bool:
        """Whether it can be true of a body or a lab, in all of its trials."""
        scenes = (evidence.trials[t].scene for t in self.place.trials)
        return all(self.effect.possible(scene, self.target, self.values) for scene in scenes)

    def agrees_with_markers(self, evidence: Evidence) -> bool:
        """Whether the markers of all of its trials allow it."""
        scenes = (evidence.trials[t].scene for t in self.place.trials)
        return all(self.effect.agrees(scene, self.target, self.values) for scene in scenes)

    def scene(self, evidence: Evidence) -> Scene:
        """The longest of its trials: a number that hangs on the movement is that of this one."""
        scenes = (evidence.trials[t].scene for t in self.place.trials)
        return max(scenes, key=lambda scene: scene.times_s[-1] - scene.times_s[0])

    def parameters(self, evidence: Evidence) -> tuple[Parameter, ...]:
        return self.effect.parameters(self.scene(evidence), self.target)


def explanation_of(
    effect: Effect, target: str, values: np.ndarray, scene: Scene, trials: tuple[int, ...]
) -> Explanation:
    """An effect with all of its parameters (K,), in some trials; the scene is of one of them."""
    scanned = values[~effect.is_free(scene, target)]
    candidate = Candidate(effect, target, tuple(scanned.tolist()))
    return Explanation(Place(candidate, trials), values)


@dataclass(frozen=True, eq=False)
class Fit:
    """Explanations fitted together: white residual that they leave (R,), and the derivative (R, K)
    of the change by all their free parameters, one after the other [typical]."""

    explanations: tuple[Explanation, ...]
    residual: np.ndarray
    tangent: np.ndarray

    @property
    def squares(self) -> float:
        """Squared white residual."""
        return float((self.residual**2).sum())

    def columns(self, number: int, evidence: Evidence) -> slice:
        """Which columns of the tangent belong to an explanation."""
        widths = [len(e.typical(evidence)) for e in self.explanations]
        ends = np.cumsum([0, *widths])
        return slice(int(ends[number]), int(ends[number + 1]))


def fit_together(evidence: Evidence, explanations: tuple[Explanation, ...]) -> Fit:
    """Free parameters of all explanations by Gauss and Newton, within their bounds."""
    found = explanations
    for _ in range(_STEPS):
        residual, tangent = _linear(evidence, found)
        step = _step(evidence, found, residual, tangent)
        now = Fit(found, residual, tangent)
        found = tuple(
            one.moved(evidence, step[now.columns(k, evidence)]) for k, one in enumerate(found)
        )
        if np.abs(step).max(initial=0.0) < 1e-3:
            break
    return fit_of(evidence, found)


def fit_of(evidence: Evidence, explanations: tuple[Explanation, ...]) -> Fit:
    """Explanations with the sizes that they have."""
    return Fit(explanations, *_linear(evidence, explanations))


def _step(
    evidence: Evidence, found: tuple[Explanation, ...], residual: np.ndarray, tangent: np.ndarray
) -> np.ndarray:
    """(K,) change of all free parameters [typical]; one at its bound leaves the others free, and
    what the motion does not tell stays where it is."""
    if not found:
        return np.zeros(0)
    basis, triangle = np.linalg.qr(tangent)
    left, sizes, right = np.linalg.svd(triangle)
    least = _UNTOLD * sizes[0]
    told = np.where(sizes > least, sizes, 0.0)[:, None] * right
    still = least * np.eye(len(sizes))
    wanted = np.concatenate([left.T @ (basis.T @ residual), np.zeros(len(sizes))])
    room = np.concatenate([one.room(evidence) for one in found])
    return lsq_linear(np.vstack([told, still]), wanted, room.T, method="bvls").x


def changes_of(evidence: Evidence, explanations: tuple[Explanation, ...]) -> list[np.ndarray]:
    """(N, 6) of each trial: what all explanations change together."""
    return [
        joint_change(
            one.scene, [(e.effect, e.target, e.values) for e in explanations if t in e.place.trials]
        )
        for t, one in enumerate(evidence.trials)
    ]


def with_noise_beside(
    evidence: Evidence,
    explanations: tuple[Explanation, ...],
    more: Sequence[np.ndarray] | None = None,
    floor: float = FLOOR,
) -> Evidence:
    """In the coordinates of the noise beside explanations, and beside ``more`` changes (n, 6) of
    each trial, filtered; ``floor`` as in the trial's evidence."""
    filtered = [
        one.filtered.filter.one(change)
        for one, change in zip(evidence.trials, changes_of(evidence, explanations), strict=True)
    ]
    beside = filtered if more is None else [a + b for a, b in zip(filtered, more, strict=True)]
    trials = zip(evidence.trials, beside, strict=True)
    return together(tuple(one.with_noise_beside(change, floor) for one, change in trials))


def left_by(evidence: Evidence, explanations: tuple[Explanation, ...]) -> np.ndarray:
    """(R,) white residual that explanations leave, outliers clipped."""
    if not explanations:
        return clipped(evidence.residual)
    changes = enumerate(changes_of(evidence, explanations))
    touched = {t for e in explanations for t in e.place.trials}
    parts = {t: evidence.trials[t].white(x[..., None]) for t, x in changes if t in touched}
    return clipped(evidence.residual - evidence.white(parts)[:, 0])


def _linear(
    evidence: Evidence, explanations: tuple[Explanation, ...]
) -> tuple[np.ndarray, np.ndarray]:
    residual = left_by(evidence, explanations)
    tangents = [np.zeros((len(residual), 0)), *(one.tangent(evidence) for one in explanations)]
    return residual, np.concatenate(tangents, axis=1)


def refined(evidence: Evidence, one: Explanation, others: Fit) -> Explanation:
    """The explanation with its scanned parameters moved to where it explains most."""
    scanned = ~one.is_free(evidence)
    if not scanned.any():
        return one
    scale = one.effect.spacing(one.scene(evidence), one.target, one.values)
    bounds = np.array([(p.least, p.most) for p in one.parameters(evidence) if p.scan])
    basis, _ = np.linalg.qr(others.tangent)
    residual = others.residual - basis @ (basis.T @ others.residual)

    def left(x: np.ndarray) -> float:
        moved = _with(one, scanned, np.clip(one.values[scanned] + x * scale, *bounds.T))
        null = Explanation(moved.place, np.where(scanned, moved.values, 0.0))
        tangent = null.tangent(evidence)
        tangent = tangent - basis @ (basis.T @ tangent)
        size = np.linalg.lstsq(tangent, residual, rcond=None)[0]
        return float(((residual - tangent @ size) ** 2).sum())

    start = np.zeros(int(scanned.sum()))
    simplex = np.vstack([start, np.eye(len(start))])
    found = minimize(
        left,
        start,
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": _SEARCH, "xatol": 0.02, "fatol": 0.1},
    )
    return _with(one, scanned, np.clip(one.values[scanned] + found.x * scale, *bounds.T))


def _with(one: Explanation, which: np.ndarray, values: np.ndarray) -> Explanation:
    changed = one.values.copy()
    changed[which] = values
    return Explanation(one.place, changed)
