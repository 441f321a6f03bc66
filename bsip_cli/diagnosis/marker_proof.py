"""What the markers prove by themselves: one that slips or sits wrong, a second bend of the trunk.

The pose is the best that the model can do; what a cause leaves of the markers is linear in its
sizes like the wrench, and far sharper: the skin slides by millimetres. What is proven here is no
question to the plates any more, and its course in the wrench is nobody else's.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from bsip_cli.diagnosis.candidates import Candidate
from bsip_cli.diagnosis.explanation import explanation_of
from bsip_cli.diagnosis.findings import Finding, Number, interval_words, numbers_of
from bsip_cli.diagnosis.held_out import Gain
from bsip_cli.diagnosis.intervals import DRAWS, SCALE_ERROR
from bsip_cli.diagnosis.together import BLOCK_S, Evidence, clipped
from bsip_cli.dynamics.lowpass import stride_to
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.scene import Scene
from bsip_cli.motion.marker_fit import MEDIAN_LENGTH

ENOUGH_HZ = 10.0  # for a course of many seconds
# Of the markers' squared residuals, their means left out. Less than PROVEN is enough where no
# joint's centre explains a third as much: skin that follows the trunk, by 5 % at most, looks as
# much like a waist that lies elsewhere.
PROVEN, CLEAR, CLEARLY = 0.25, 0.06, 3.0
OWN = 0.5  # of a marker's own squared residual: else its skin slides more than it slips
RIVAL = 0.9  # of the best one's share: who explains as much cannot be told from it
# In the simulator the bend is told 0.42 to 0.64 times as large as it is where all trials have it.
_TAKEN_UP = 2.0
_UNKNOWN = (np.nan, np.nan, np.nan)
SLIP, BEND, CENTRE = "marker_shift", "missing_joint", "joint_centre"


@dataclass(frozen=True)
class Slip:
    """A marker off its place from a moment on, before the trial for throughout; unlikeliness in
    standard deviations; how far off it must be, once nothing else bends the pose, to be told."""

    marker: str
    start_s: float
    statistic: float
    least_m: float = 0.0


@dataclass(frozen=True, eq=False)
class Proof:
    """A cause in one trial, sized by the markers.

    values : (K,) all parameters, in the effect's order. draws : (DRAWS, K) as they might as well
    be. share : of the markers' squared residuals, of a slip of its own marker's. is_alone :
    nothing else explains them as well. is_rival : of another cause, in the place of which it would
    stand.
    """

    effect: Effect
    target: str
    values: np.ndarray
    draws: np.ndarray
    share: float
    p_value: float
    is_alone: bool = True
    is_rival: bool = False

    def columns(self, scene: Scene) -> np.ndarray:
        """(N, 6, k) what it may do to the wrench, sizes of unit variance: the plates do not judge
        how far the mass follows the markers."""
        free = self.effect.is_free(scene, self.target)
        typical = np.array([p.typical for p in self.effect.parameters(scene, self.target)])
        sizes = (typical + np.abs(self.values))[free]
        return self.effect.tangent(scene, self.target, self.values) * sizes

    def gain(self, evidence: Evidence) -> Gain:
        """What it takes off the wrench's residual in its trial's evidence, which did not help to
        find its sizes."""
        scene = evidence.trials[0].scene
        one = explanation_of(self.effect, self.target, self.values, scene, (0,))
        before = clipped(evidence.residual)
        saved = before**2 - clipped(evidence.residual - one.change(evidence)) ** 2
        numbers, block = np.unique(evidence.blocks(), return_inverse=True)
        blocks = np.bincount(block, saved)
        return Gain(blocks, np.ones(len(numbers), dtype=bool), float((before**2).sum()))

    def finding(
        self, scene: Scene, trial: str, class_id: str, gain: Gain, is_taken_up: bool
    ) -> Finding:
        """As the diagnosis prints it; the class is that of causes that look alike.

        is_taken_up : ``scale`` has fitted the body to part of it.
        """
        reported = self.effect.reported(scene, self.target, self.values)
        drawn = [self.effect.reported(scene, self.target, one) for one in self.draws]
        numbers = numbers_of(reported, drawn)
        if is_taken_up:
            numbers = tuple(_wider(one) for one in numbers)
        told = self.effect.sentence(scene, self.target, self.values) + interval_words(numbers)
        whose = "the marker's" if self.effect.name == SLIP else "all markers'"
        sentence = f"{told}; this is {100 * self.share:.0f} % of {whose} squared residual"
        if is_taken_up:
            sentence += ", and `scale` has fitted the waist to it: the bend may be twice as large"
        if not gain.is_real():
            sentence += ", and the forces do not show it"
        if not self.is_alone:
            sentence += f"; other causes look alike here: to tell them apart, {self.effect.remedy}"
        return Finding(
            self.effect.name,
            self.target,
            (trial,),
            "named" if self.is_alone else "ambiguous",
            "" if self.is_alone else class_id,
            self.p_value,
            gain.interval() if gain.is_real() else _UNKNOWN,
            numbers,
            sentence,
        )


def proofs_of(scene: Scene, slips: Sequence[Slip], rng: np.random.Generator) -> tuple[Proof, ...]:
    """What a trial's markers prove: the slips that were found in them, and a second bend."""
    if scene.residual_m is None:
        return ()
    fewer = scene.every(stride_to(scene.rate_hz, ENOUGH_HZ))
    assert fewer.residual_m is not None
    left, found = fewer.residual_m, []
    for slip in slips:
        p_value = float(chi2.sf(slip.statistic**2, 3))
        one = _sized(fewer, left, EFFECTS[SLIP], slip.marker, (slip.start_s, 0.0), rng)
        one = replace(one, p_value=p_value, share=_own_share(fewer, left, one))
        if one.share < OWN or np.linalg.norm(one.values[:3]) < slip.least_m:
            continue
        found.append(one)
        left = left - _left(one.effect, fewer, one.target, one.values)
    return (*found, *_bends(fewer, left, rng))


def _wider(one: Number) -> Number:
    low, high = min(one.low, _TAKEN_UP * one.low), max(one.high, _TAKEN_UP * one.high)
    return replace(one, low=low, high=high)


def _own_share(scene: Scene, residual_m: np.ndarray, one: Proof) -> float:
    """Part of the squared residual of the marker that is off."""
    m = scene.person.markers.index(one.target)
    own = residual_m[:, m : m + 1]
    change = _left(one.effect, scene, one.target, one.values)[:, m : m + 1]
    rows = _in_rows(scene, change[..., None], own, with_means=_is_throughout(scene, one.values[3]))
    columns, course, _ = rows
    return 1 - float(((course - columns[:, 0]) ** 2).sum() / (course @ course))


def _bends(scene: Scene, residual_m: np.ndarray, rng: np.random.Generator) -> tuple[Proof, ...]:
    """A second bend, with the joints' centres that explain as much; nothing if one explains more:
    scaling may err by that."""
    bend = next(_possible(scene, residual_m, EFFECTS[BEND], rng), None)
    if bend is None or bend.share < CLEAR:
        return ()
    centres = list(_possible(scene, residual_m, EFFECTS[CENTRE], rng))
    is_clear = all(CLEARLY * one.share < bend.share for one in centres)
    if bend.share < PROVEN and not is_clear:
        return ()
    rivals = [one for one in centres if one.share > RIVAL * bend.share]
    if any(RIVAL * one.share > bend.share for one in rivals):
        return ()
    rivals.sort(key=lambda one: -one.share)
    others = (replace(one, is_alone=False, is_rival=True) for one in rivals)
    return replace(bend, is_alone=not rivals), *others


def _possible(
    scene: Scene, residual_m: np.ndarray, effect: Effect, rng: np.random.Generator
) -> Iterator[Proof]:
    """An effect wherever it may be, where its sizes can be true."""
    for target in effect.targets(scene):
        one = _sized(scene, residual_m, effect, target, (), rng)
        if effect.possible(scene, target, one.values):
            yield one


def _sized(
    scene: Scene,
    residual_m: np.ndarray,
    effect: Effect,
    target: str,
    scanned: tuple[float, ...],
    rng: np.random.Generator,
) -> Proof:
    """The effect's free parameters from the markers' residuals (N, m, 3), scanned ones given.

    What lasts throughout shows in the means of the residuals alone, which are as sure as the
    markers' places in the model. Stretches of BLOCK_S are taken for independent: so much noise is
    laid on each frame that all frames together say no more, and the sizes have their typical
    spread before the data.
    """
    candidate = Candidate(effect, target, scanned)
    parameters = candidate.free(scene)
    typical = np.array([p.typical for p in parameters])
    shapes = [
        _left(effect, scene, target, candidate.values(scene, one)) for one in np.diag(typical)
    ]
    told = np.stack(shapes, axis=-1) * effect.is_told(scene, target)
    lasts = bool(scanned) and _is_throughout(scene, scanned[0])
    columns, course, block = _in_rows(scene, told, residual_m, with_means=lasts)
    grams, rights = _sums(columns, course, block)
    least = np.linalg.lstsq(grams.sum(axis=0), rights.sum(axis=0), rcond=None)[0]
    noise = float(((course - columns @ least) ** 2).mean()) * BLOCK_S * scene.rate_hz
    prior = noise * np.eye(len(typical))
    size = np.linalg.solve(grams.sum(axis=0) + prior, rights.sum(axis=0))
    left = course - columns @ size
    known_to = np.array([p.known_to / p.typical for p in parameters])
    spread = np.hypot(known_to, SCALE_ERROR * size)
    misplaced = _misplaced(told, residual_m, rng) if lasts else np.zeros((DRAWS, len(size)))
    draws = [
        candidate.values(scene, typical * (one + spread * rng.standard_normal(len(size))))
        for one in _bootstrap(grams, rights, prior, misplaced, rng)
    ]
    return Proof(
        effect,
        target,
        candidate.values(scene, typical * size),
        _scattered(effect, scene, target, np.array(draws), rng),
        1 - float(left @ left) / float(course @ course),
        float(chi2.sf(size @ grams.sum(axis=0) @ size / noise, len(size))),
    )


def _left(effect: Effect, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
    """(N, m, 3) what an effect that touches markers leaves of them."""
    change = effect.marker_change(scene, target, values)
    assert change is not None
    return change


def _is_throughout(scene: Scene, from_s: float) -> bool:
    return from_s < scene.times_s[0]


def _misplaced(told: np.ndarray, residual_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(DRAWS, k) what markers that sit elsewhere than the model has them, as far as these usually
    do, add to the right-hand side of shapes (N, m, 3, k)."""
    usual = np.nanmedian(np.linalg.norm(np.nanmean(residual_m, axis=0), axis=1)) / MEDIAN_LENGTH
    known = np.isfinite(residual_m)[..., None] & np.isfinite(told)
    total = np.where(known, told, 0.0).sum(axis=0).reshape(-1, told.shape[-1])
    return usual * rng.standard_normal((DRAWS, len(total))) @ total


def _in_rows(
    scene: Scene, shapes_m: np.ndarray, residual_m: np.ndarray, with_means: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shapes (r, k), residual (r,) and number of the stretch (r,) where both are known, without
    the mean of each marker and direction or with it."""
    known = np.isfinite(residual_m).all(axis=2) & np.isfinite(shapes_m).all(axis=(2, 3))
    block = ((scene.times_s - scene.times_s[0]) / BLOCK_S).astype(int)
    blocks = np.repeat(np.broadcast_to(block[:, None], known.shape)[known], 3)
    both = (shapes_m, residual_m[..., None])
    columns, course = (x[known] if with_means else _centred(x, known)[known] for x in both)
    return columns.reshape(-1, shapes_m.shape[-1]), course.ravel(), blocks


def _centred(x: np.ndarray, known: np.ndarray) -> np.ndarray:
    """(N, m, 3, k) less its mean over the known frames (N, m)."""
    weight = known[..., None, None]
    total = np.where(weight, x, 0.0).sum(axis=0)
    return x - total / np.maximum(weight.sum(axis=0), 1)


def _sums(
    columns: np.ndarray, course: np.ndarray, block: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(b, k, k) and (b, k) normal equations of each stretch."""
    mine = [block == number for number in np.unique(block)]
    grams = np.stack([columns[rows].T @ columns[rows] for rows in mine])
    return grams, np.stack([columns[rows].T @ course[rows] for rows in mine])


def _bootstrap(
    grams: np.ndarray,
    rights: np.ndarray,
    prior: np.ndarray,
    misplaced: np.ndarray,
    rng: np.random.Generator,
) -> list[np.ndarray]:
    """DRAWS of the sizes (k,), stretches drawn with replacement, ``misplaced`` (DRAWS, k) added to
    the right-hand side; what the markers hardly tell is drawn nearer to zero, by the prior, than
    it may be, and scatters by as much."""
    count, told = len(grams), grams.sum(axis=0) + prior
    drawn = rng.integers(count, size=(DRAWS, count))
    untold = prior @ np.linalg.solve(told, rng.standard_normal((len(prior), DRAWS)))
    return [
        np.linalg.solve(grams[one].sum(axis=0) + prior, rights[one].sum(axis=0) + more) + apart
        for one, more, apart in zip(drawn, misplaced, untold.T, strict=True)
    ]


def _scattered(
    effect: Effect, scene: Scene, target: str, draws: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Draws (n, K) whose scanned parameters are known as well as they can be."""
    for k, parameter in enumerate(effect.parameters(scene, target)):
        if parameter.scan:
            draws[:, k] += parameter.known_to * rng.standard_normal(len(draws))
    return draws
