"""Faults inside the one model of the error: their evidence, sizes and uncertainty.

A fault is a term like the others (``error_model``): columns about the values that it has by now,
whose size before the data lies between a tenth and ten times what laboratories meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import minimize

from bsip_cli.diagnosis.error_model import (
    WEIGHT,
    Scale,
    Session,
    TrialErrors,
    adapted,
    left_by,
    log_prior_of_scales,
)
from bsip_cli.diagnosis.error_terms import FAULT
from bsip_cli.diagnosis.filtering import Noise, noise_like
from bsip_cli.diagnosis.normal_equations import Equations, Solution, solved
from bsip_cli.effects.effect import Effect, Parameter, Reported, Words
from bsip_cli.effects.nameless import UNEXPLAINED
from bsip_cli.effects.scene import Scene

SIZES = (0.1, 10.0)  # of a fault, in what laboratories meet: two decades about it
_STEPS, _FEW_STEPS = 8, 2  # of expectation and maximisation
_ROUNDS = 12  # of what is left, at most
_STEADY = 0.01  # change of every scale
_CONVERGED = 0.3  # change of the logarithm of the evidence
_DIFFERENCE = 0.05  # of the typical size: a moment in time moves by a part of a frame at least
_CORRECTIONS = 3  # of the values about which the columns are
_EXACT = 0.002  # of the typical size
_SEARCH = 40  # evaluations for a moment, a frequency or a window
_NEWTON_STEPS = 8  # of Gauss and Newton
_HALVES = (1.0, 0.5, 0.25, 0.125)
_GIVEN = 1e-9  # spread of what the data do not move [typical]


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An effect at a target, in some trials, with all of its parameters in the effect's order.

    scene : of the longest of its trials; a number that hangs on the movement is that of this one.
    is_even : of the same size throughout; else it only acts like the effect, and has no name.
    """

    effect: Effect
    target: str
    trials: tuple[int, ...]
    values: np.ndarray
    session: Session
    is_even: bool = True

    @cached_property
    def scene(self) -> Scene:
        scenes = (one.scene for one in self.in_trials)
        return max(scenes, key=lambda scene: scene.times_s[-1] - scene.times_s[0])

    @property
    def in_trials(self) -> list[TrialErrors]:
        return [self.session.trials[t] for t in self.trials]

    @property
    def name(self) -> str:
        """Of what is printed."""
        return self.effect.name if self.is_even else UNEXPLAINED

    @property
    def key(self) -> tuple[str, str]:
        """What and where, whatever the size and the trials."""
        return self.name, self.target

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.effect.parameters(self.scene, self.target)

    @cached_property
    def is_free(self) -> np.ndarray:
        """(K,) True for the parameters without a scan."""
        return np.array([not p.scan for p in self.parameters])

    @cached_property
    def typical(self) -> np.ndarray:
        """(K,) sizes that laboratories meet, of all parameters."""
        return np.array([p.typical for p in self.parameters])

    def with_values(self, values: np.ndarray) -> Hypothesis:
        """With other values (K,), cut to the bounds."""
        bounds = np.array([(p.least, p.most) for p in self.parameters])
        return replace(self, values=np.clip(values, *bounds.T))

    def moved(self, step: np.ndarray) -> Hypothesis:
        """With the free parameters changed by ``step`` (k,) typical sizes, within the bounds."""
        values = self.values.copy()
        values[self.is_free] += step * self.typical[self.is_free]
        return self.with_values(values)

    def is_possible(self) -> bool:
        """Whether it can be true of a body or a lab, and the markers allow it, in all trials."""
        what = self.target, self.values
        scenes = [one.scene for one in self.in_trials]
        return all(
            self.effect.possible(one, *what) and self.effect.agrees(one, *what) for one in scenes
        )

    def filtered_change(self, trial: TrialErrors) -> np.ndarray:
        """(n, 6) what it adds to the simulated wrench of a trial, filtered."""
        return trial.filter.one(self.effect.change(trial.simulated, self.target, self.values))

    def reported(self) -> Reported:
        """Name, unit and value of what the diagnosis prints."""
        return self.effect.reported(self.scene, self.target, self.values)

    def words(self) -> Words:
        """What a person should read, without interval."""
        words = self.effect.words(self.scene, self.target, self.values)
        if self.is_even:
            return words
        return replace(words, what=f"of unknown cause: {words.what}, but not evenly", short="")

    def alike(self) -> list[Hypothesis]:
        """Those that these recordings cannot distinguish from it, the plainest first."""
        if not self.is_even:
            return [self]
        values = self.effect.alike(self.scene, self.target, self.values)
        return [replace(self, values=one) for one in values]

    def columns(self, trial: int) -> tuple[np.ndarray, np.ndarray]:
        """Of a filtered trial about its values: slope (n, 6, k) of its change by all parameters
        [typical], those with a scan counting as deviations from theirs; and offset (n, 6), the
        change less what the slope makes of the sizes."""
        errors, free = self.session.trials[trial], self.is_free
        scene, change = errors.simulated, self.filtered_change(errors)
        slope = np.zeros((*change.shape, len(free)))
        tangent = self.effect.tangent(scene, self.target, self.values)
        slope[..., free] = errors.filter(tangent * self.typical[free])
        for k in np.flatnonzero(~free):
            step = _DIFFERENCE * self.typical * (np.arange(len(free)) == k)
            ahead, behind = (
                self.effect.change(scene, self.target, self.values + x) for x in (step, -step)
            )
            slope[..., k] = errors.filter.one(ahead - behind) / (2 * _DIFFERENCE)
        return slope, change - slope[..., free] @ (self.values[free] / self.typical[free])

    def prior_root(self) -> np.ndarray:
        """(K,) spreads before the data of all parameters [typical]: a scanned one may be
        anywhere."""
        spreads = [
            (p.most - p.least) / np.sqrt(12) / p.typical if p.scan else 1.0 for p in self.parameters
        ]
        return np.where([p.is_given for p in self.parameters], _GIVEN, spreads)


@dataclass(frozen=True, eq=False)
class Piece(Equations):
    """Of a trial, white under its noise: columns white (6 n, K'), residual right (6 n,)."""

    noise: Noise
    white: np.ndarray
    right: np.ndarray

    def left(self, mean: np.ndarray) -> np.ndarray:
        """(6 n,) white, what all terms leave of the trial with coefficients (K,)."""
        return self.right - self.white @ mean[self.used]

    @property
    def log_volume(self) -> float:
        """Logarithm of the determinant that turns white noise to the trial's."""
        return len(self.right) / 6 * float(np.log(self.noise.size).sum())


@dataclass(frozen=True, eq=False)
class Fitted:
    """The model given some faults.

    faults : with their values. pieces : of the trials. solution : of all coefficients.
    """

    session: Session
    faults: tuple[Hypothesis, ...]
    pieces: tuple[Piece, ...]
    solution: Solution

    @property
    def mean(self) -> np.ndarray:
        """(K,) of all coefficients."""
        return self.solution.mean

    @property
    def root(self) -> np.ndarray:
        """(K,) standard deviations of all coefficients before the data."""
        return self.solution.root

    @cached_property
    def squares(self) -> float:
        """Of the white residuals."""
        return sum(float(one.right @ one.right) for one in self.pieces)

    @cached_property
    def log_likelihoods(self) -> np.ndarray:
        """(T,) of the trials at the mean, less a constant."""
        left = [one.left(self.mean) for one in self.pieces]
        pairs = zip(left, self.pieces, strict=True)
        return np.array([-0.5 * float(x @ x) - one.log_volume for x, one in pairs])

    @cached_property
    def log_evidence(self) -> float:
        """Of all trials, natural logarithm."""
        found = self.solution
        log = 0.5 * float(found.against @ found.mean) - 0.5 * found.log_determinant
        log -= 0.5 * self.squares + sum(one.log_volume for one in self.pieces)
        scales = np.array([self.root[mine[0]] for mine in _ordinary(self.session)])
        return log + log_prior_of_scales(scales, WEIGHT)

    def coefficients(self, number: int) -> slice:
        """Of a fault."""
        first = _starts(self.session, self.faults)[number]
        return slice(first, first + len(self.faults[number].values))

    def covariance_of(self, number: int) -> np.ndarray:
        """(k, k) of the coefficients of a fault."""
        mine = self.coefficients(number)
        return self.solution.times(np.eye(len(self.mean))[:, mine])[mine]

    def values_at(self, number: int, mean: np.ndarray) -> np.ndarray:
        """(k,) all parameters of a fault, from coefficients (K,)."""
        one = self.faults[number]
        moved = one.values * ~one.is_free + mean[self.coefficients(number)] * one.typical
        return one.with_values(moved).values


def _ordinary(session: Session) -> list[np.ndarray]:
    """Coefficients of each ordinary scale that follows from the data. The instruments are as far
    off as every laboratory has them."""
    scales = session.scales.items()
    return [mine for name, mine in scales if not name.startswith(FAULT) and len(mine)]


def fitted(
    session: Session,
    faults: Sequence[Hypothesis],
    start: Fitted | None = None,
    whole: bool = True,
    same_noise: bool = False,
) -> Fitted:
    """Coefficients, scales and noise in turn, given faults with the values that these have by now.

    start : a fit with other faults to begin with. whole : until noise and scales converge;
    else the noise of trials alone whose faults are others, once. same_noise : that of ``start``.
    """
    faults, trials = tuple(faults), range(len(session.trials))
    starts = _starts(session, faults)
    ordinary = np.ones(session.count) if start is None else start.root[: session.count]
    root = np.concatenate([ordinary, *(one.prior_root() for one in faults)])
    free = [x + np.flatnonzero(one.is_free) for x, one in zip(starts, faults, strict=True)]
    scales = [Scale(mine, WEIGHT) for mine in _ordinary(session) if whole]
    scales += [Scale(mine, 0.0, SIZES) for mine in free]
    laid = [_laid(session, t, faults) for t in trials]
    changed = [
        start is None or _touching(session, start.faults, t) != _touching(session, faults, t)
        for t in trials
    ]

    def like(t: int, left: np.ndarray) -> Piece:
        """Whitened by what may be left of a trial (n, 6)."""
        one = session.trials[t]
        return _white(noise_like(one.filter, left, one.noise), *laid[t])

    def solved_for(pieces: Sequence[Piece], root: np.ndarray) -> Fitted:
        root = adapted(pieces, root, scales, _STEPS if whole else _FEW_STEPS, _STEADY)
        return Fitted(session, faults, tuple(pieces), solved(pieces, root))

    if start is None:
        pieces = [like(t, laid[t][0]) for t in trials]
    else:
        old = zip(start.pieces, laid, changed, strict=True)
        pieces = [_white(one.noise, *x) if is_new else one for one, x, is_new in old]
    found = solved_for(pieces, root)
    for _ in range(0 if same_noise else _ROUNDS if whole else 1):
        before = found
        for t in trials:
            if whole or changed[t]:  # with the noise that the fit leaves
                pieces[t] = like(t, left_by(session, t, *laid[t][:2], found.solution)[1])
        found = solved_for(pieces, found.root)
        if abs(found.log_evidence - before.log_evidence) < _CONVERGED:
            break
    return found


def _starts(session: Session, faults: Sequence[Hypothesis]) -> list[int]:
    """First coefficient of each fault, behind the ordinary ones."""
    return np.cumsum([session.count, *(len(one.values) for one in faults)])[:-1].tolist()


def _touching(
    session: Session, faults: Sequence[Hypothesis], trial: int
) -> list[tuple[int, Hypothesis]]:
    """The faults that touch a trial, and their first coefficients."""
    pairs = zip(_starts(session, faults), faults, strict=True)
    return [(first, one) for first, one in pairs if trial in one.trials]


def _laid(
    session: Session, trial: int, faults: Sequence[Hypothesis]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Residual, columns and their coefficients, of a trial."""
    residual, offset = session.trials[trial].residual, np.zeros(())
    columns, used = [session.columns[trial]], [session.used[trial]]
    for first, one in _touching(session, faults, trial):
        slope, its_offset = one.columns(trial)
        offset = offset + its_offset
        columns.append(slope)
        used.append(first + np.arange(slope.shape[2]))
    return residual - offset, np.concatenate(columns, axis=2), np.concatenate(used)


def _white(noise: Noise, residual: np.ndarray, columns: np.ndarray, used: np.ndarray) -> Piece:
    white, right = noise.white(columns), noise.white_one(residual)
    return Piece(used, white.T @ white, white.T @ right, noise, white, right)


def corrected(fit: Fitted) -> Fitted:
    """With the faults' columns about their likeliest values."""
    for _ in range(_CORRECTIONS if fit.faults else 0):
        values = [fit.values_at(k, fit.mean) for k in range(len(fit.faults))]
        pairs = list(zip(values, fit.faults, strict=True))
        if max(np.abs((x - one.values) / one.typical).max() for x, one in pairs) < _EXACT:
            break
        faults = [replace(one, values=x) for x, one in pairs]
        fit = fitted(fit.session, faults, start=fit)
    return fit


# --- the likeliest sizes of one more fault given a fit --------------------------------------------


@dataclass(frozen=True, eq=False)
class _Marginal:
    """Given the ordinary terms, of a fault at its values: squares of what is left, and pull (k,)
    and information (k, k) of its free parameters [typical]."""

    squares: float
    pull: np.ndarray
    information: np.ndarray


def _marginal(fit: Fitted, one: Hypothesis) -> _Marginal:
    free = one.is_free
    against, squares = fit.solution.against.copy(), fit.squares
    count = int(free.sum())
    shared = np.zeros((len(fit.mean), count))
    pull, gram = np.zeros(count), np.zeros((count, count))
    for t in one.trials:
        piece, errors = fit.pieces[t], fit.session.trials[t]
        what = errors.simulated, one.target, one.values
        slope = one.effect.tangent(*what) * one.typical[free]
        both = np.concatenate([one.effect.change(*what)[..., None], slope], axis=2)
        white = piece.noise.white(errors.filter(both))
        products = piece.white.T @ white
        left, mine = piece.right - white[:, 0], white[:, 1:]
        pull += mine.T @ left
        gram += mine.T @ mine
        shared[piece.used] += products[:, 1:]
        against[piece.used] -= products[:, 0]
        squares += float(left @ left - piece.right @ piece.right)
    found = fit.solution.times(np.column_stack([against, shared]))
    mean, across = found[:, 0], found[:, 1:]
    squares -= float(against @ mean)
    return _Marginal(squares, pull - shared.T @ mean, gram - shared.T @ across)


def sized(fit: Fitted, one: Hypothesis) -> Hypothesis:
    """Free parameters by Gauss and Newton, within their bounds; a step that does not help is
    halved."""
    free, now = one.is_free, _marginal(fit, one)
    for _ in range(_NEWTON_STEPS):
        sizes = one.values[free] / one.typical[free]
        weight = 1 / np.clip((sizes**2).mean(), SIZES[0] ** 2, SIZES[1] ** 2)
        ridge = now.information + weight * np.eye(len(sizes))
        step = np.linalg.solve(ridge, now.pull - weight * sizes)
        tried = ((x, _marginal(fit, x)) for x in (one.moved(h * step) for h in _HALVES))
        better = next(((x, m) for x, m in tried if m.squares < now.squares), None)
        if better is None:
            return one
        before = now.squares
        one, now = better
        if before - now.squares < 0.1:  # of a squared residual whose noise is one
            return one
    return one


def refined(fit: Fitted, one: Hypothesis) -> Hypothesis:
    """Scanned parameters moved to where the fault explains most."""
    scanned = ~one.is_free
    if not scanned.any():
        return one
    scale = one.effect.spacing(one.scene, one.target, one.values)

    def at(x: np.ndarray) -> Hypothesis:
        values = np.where(scanned, one.values, 0.0)
        values[scanned] += x * scale
        return one.with_values(values)

    def of(x: np.ndarray) -> tuple[np.ndarray, float]:
        """Likeliest sizes there, and less what they explain."""
        scores = _marginal(fit, at(x))
        ridge = scores.information + np.eye(len(scores.pull)) / SIZES[1] ** 2
        size = np.linalg.solve(ridge, scores.pull)
        return size, -float(scores.pull @ size)

    start = np.zeros(int(scanned.sum()))
    simplex = {"initial_simplex": np.vstack([start, np.eye(len(start))])}
    options = {**simplex, "maxfev": _SEARCH, "xatol": 0.02, "fatol": 0.1}
    found = minimize(lambda x: of(x)[1], start, method="Nelder-Mead", options=options)
    return at(found.x).moved(of(found.x)[0])
