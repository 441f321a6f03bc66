"""What the markers show by themselves: one that slips or sits wrong, a second bend of the trunk.

The pose is the best that the model can do; what a fault leaves of the markers is linear in its
sizes like the wrench, and far sharper: the skin slides by millimetres. A marker that jumps and
stays is proven by that. A bend of the trunk is not: soft tissue moving with it leaves the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import logit
from scipy.stats import chi2

from bsip_cli.diagnosis.error_model import BLOCK_S, Session
from bsip_cli.diagnosis.fault_model import Hypothesis
from bsip_cli.diagnosis.fault_scores import Candidate
from bsip_cli.diagnosis.findings import DRAWS, SCALE_ERROR, Finding, interval_words, numbers_of
from bsip_cli.diagnosis.held_out import Gain
from bsip_cli.dynamics.lowpass import stride_to
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import Effect, Number, Words
from bsip_cli.effects.markers import LEAST_S, ramp, ramp_of
from bsip_cli.effects.scene import Scene
from bsip_cli.motion.marker_fit import MEDIAN_LENGTH
from bsip_cli.segments import in_words
from bsip_cli.statistics.samples import effective_samples

ENOUGH_HZ = 10.0  # for a signal of many seconds
BENT = 0.25  # of the markers' squared residuals, their means left out: less is skin that follows
OWN = 0.5  # of a marker's own squared residual: else its skin slides more than it slips
SLIP, SLIDE = "marker_shift", "marker_slide"
BEND, SOFT_TISSUE = "missing_joint", "soft_tissue"


@dataclass(frozen=True)
class Slip:
    """A marker off its place from a moment on, before the trial for throughout; unlikeliness in
    standard deviations; how far off it must be, once nothing else bends the pose, to count."""

    marker: str
    start_s: float
    statistic: float
    least_m: float = 0.0


@dataclass(frozen=True, eq=False)
class Proof:
    """A fault in one trial, sized by the markers.

    values : (K,) all parameters, in the effect's order. draws : (DRAWS, K) as they might as well
    be. share : of the markers' squared residuals, of a slip of its own marker's.
    """

    effect: Effect
    target: str
    values: np.ndarray
    draws: np.ndarray
    share: float
    p_value: float

    def hypothesis(self, session: Session, trial: int) -> Hypothesis:
        """As the search for faults takes it."""
        return Hypothesis(self.effect, self.target, (trial,), self.values, session)

    def finding(self, scene: Scene, trial: str, gain: Gain | None) -> Finding:
        """As the diagnosis prints it. gain : of the forces."""
        whose = "the marker's" if self.effect.name in (SLIP, SLIDE) else "all markers'"
        reported, *drawn = (
            self.effect.reported(scene, self.target, x) for x in (self.values, *self.draws)
        )
        numbers = numbers_of(reported, drawn)
        remark = f"; this is {100 * self.share:.0f} % of {whose} squared residual"
        more: dict[str, Any] = {"scope": self.effect.scope}
        if gain is not None and gain.is_real():
            more["gain"] = gain.interval()
        else:
            remark += ", and the forces do not show it"
        more["closing"] = interval_words(numbers) + remark
        words = replace(self.effect.words(scene, self.target, self.values), remark=remark)
        said = self.effect.name, self.target, (trial,), numbers, words
        return Finding(*said, self.p_value, 1 - self.p_value, **more)

    def left(self, scene: Scene) -> np.ndarray:
        """(N, m, 3) what it leaves of the markers."""
        return _left(self.effect, scene, self.target, self.values)


def slips_of(
    scene: Scene, slips: Sequence[Slip], named_from: float, rng: np.random.Generator
) -> tuple[Proof, ...]:
    """The slips that a trial's markers show, of those that were found in them; slides where these
    are likelier than ``named_from``."""
    fewer = scene.every(stride_to(scene.rate_hz, ENOUGH_HZ))
    left, found = fewer.residual_m, []
    if left is None:
        return ()
    for slip in slips:
        effect, scanned = _manner(fewer, left, slip, named_from)
        one = _sized(fewer, left, effect, slip.marker, scanned, rng)
        m = fewer.person.markers.index(slip.marker)
        own, change = left[:, m : m + 1], one.left(fewer)[:, m : m + 1]
        with_means = one.values[3] < fewer.times_s[0]
        columns, observed, _ = _in_rows(fewer, change[..., None], own, with_means)
        share = 1 - float(((observed - columns[:, 0]) ** 2).sum() / (observed @ observed))
        if share >= OWN and np.linalg.norm(one.values[:3]) >= slip.least_m:
            p_value = float(chi2.sf(slip.statistic**2, 3))
            found.append(replace(one, p_value=p_value, share=share))
            left = left - one.left(fewer)
    return tuple(found)


def _manner(
    scene: Scene, residual_m: np.ndarray, slip: Slip, named_from: float
) -> tuple[Effect, tuple[float, ...]]:
    """Whether a marker slips at a moment or slides, and when: by Schwarz's criterion, a slide
    having one number more, from as many samples of its residual as are independent."""
    at_once = EFFECTS[SLIP], (slip.start_s, 0.0)
    own = residual_m[:, scene.person.markers.index(slip.marker)]
    seen = np.isfinite(own).all(axis=1)
    times_s, own = scene.times_s[seen], own[seen]
    if slip.start_s < scene.times_s[0] or np.ptp(times_s) < LEAST_S:
        return at_once
    start, end = ramp_of(times_s, own)
    left = []
    for shape in (times_s >= slip.start_s, ramp(times_s, start, end)):
        columns = np.column_stack([np.ones(len(own)), shape])
        left.append(own - columns @ np.linalg.lstsq(columns, own, rcond=None)[0])
    samples = sum(effective_samples(one) for one in left[1].T)
    gain = np.log((left[0] ** 2).sum() / (left[1] ** 2).sum())
    if 0.5 * samples * gain - 0.5 * np.log(samples) < logit(named_from):
        return at_once
    return EFFECTS[SLIDE], (0.5 * (start + end), end - start, 0.0)


def alone_and_shaken(
    scene: Scene, slips: Sequence[Proof]
) -> tuple[tuple[Proof, ...], tuple[Proof, ...]]:
    """Slips, and what several markers do within the same second: no tape gives way at six places
    at once, so that is soft tissue after a knock."""
    moments = np.array([one.values[3] for one in slips])
    near = (np.abs(moments - moments[:, None]) < BLOCK_S).sum(axis=1)
    together = (near > 1) & (moments >= scene.times_s[0])
    pairs = list(zip(slips, together, strict=True))
    return tuple(one for one, so in pairs if not so), tuple(one for one, so in pairs if so)


def shaken_finding(scene: Scene, shaken: Sequence[Proof], trial: str) -> Finding:
    """Of markers that move on their segments together."""
    sizes = [1000 * float(np.linalg.norm(one.values[:3])) for one in shaken]
    person = scene.person
    on = [int(person.marker_segments[person.markers.index(one.target)]) for one in shaken]
    target = person.skeleton.segments[max(on, key=on.count)]
    words = Words(
        f"soft tissue moves {len(shaken)} markers ({', '.join(one.target for one in shaken)}) by "
        f"{' to '.join(dict.fromkeys(f'{one:.0f}' for one in (min(sizes), max(sizes))))} mm from "
        f"{min(float(one.values[3]) for one in shaken):.2f} s on"
    )
    p_value = max(one.p_value for one in shaken)
    size = Number("size", "m", max(sizes) / 1000)
    return Finding(SOFT_TISSUE, target, (trial,), (size,), words, p_value, 1 - p_value)


def bend_of(
    scene: Scene, slips: Sequence[Proof], trial: str, class_id: str, rng: np.random.Generator
) -> tuple[Finding, ...]:
    """A second bend of the trunk or soft tissue that moves with it, which markers do not
    distinguish, where that is much of their residuals given slips; nothing where it is little."""
    fewer = scene.every(stride_to(scene.rate_hz, ENOUGH_HZ))
    left = fewer.residual_m
    if left is None:
        return ()
    for one in slips:
        left = left - one.left(fewer)
    effect = EFFECTS[BEND]
    sized = (_sized(fewer, left, effect, target, (), rng) for target in effect.targets(fewer))
    possible = (one for one in sized if effect.possible(fewer, one.target, one.values))
    bend = max(possible, key=lambda one: one.share, default=None)
    if bend is None or bend.share < BENT:
        return ()
    waist = _sized(fewer, left, EFFECTS["joint_centre"], "waist", (), rng)
    if waist.share >= bend.share:
        return ()  # by so much scaling errs
    alike = f"; a second bend and soft tissue look alike here: to distinguish them, {effect.remedy}"
    found = bend.finding(fewer, trial, None)
    found = replace(
        found,
        verdict="ambiguous",
        class_id=class_id,
        closing=found.closing + alike,
        probability=found.probability / 2,  # nothing speaks for the one rather than the other
    )
    markers = fewer.person.marker_segments == fewer.person.skeleton.index(bend.target)
    size = float(np.sqrt(np.nanmean((left[:, markers] ** 2).sum(axis=2))))
    short = f"soft tissue on the {in_words(bend.target)} moves with the trunk's posture"
    words = Words(f"{short}: its markers are {1000 * size:.0f} mm off", short)
    tissue = replace(found, effect=SOFT_TISSUE, words=words, closing=alike, scope="person")
    return found, replace(tissue, numbers=(Number("size", "m", size),))


def _left(effect: Effect, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
    """(N, m, 3) what an effect that touches markers leaves of them."""
    change = effect.marker_change(scene, target, values)
    assert change is not None
    return change


def _sized(
    scene: Scene,
    residual_m: np.ndarray,
    effect: Effect,
    target: str,
    scanned: tuple[float, ...],
    rng: np.random.Generator,
) -> Proof:
    """The effect's free parameters from the markers' residuals (N, m, 3), scanned ones given.

    What is there throughout shows in the means of the residuals alone, which are as sure as the
    markers' places in the model. Intervals of BLOCK_S are taken for independent: so much noise is
    laid on each frame that all frames together say no more, and the sizes have their typical
    spread before the data.
    """
    null, free = Candidate(effect, target, scanned).null(scene), effect.is_free(scene, target)
    parameters = effect.parameters(scene, target)
    typical, known_to = np.array([(p.typical, p.known_to) for p in parameters]).T
    of_sizes = (np.eye(len(null)) * typical)[free]  # from the free parameters [typical] to all
    shapes = [_left(effect, scene, target, null + one) for one in of_sizes]
    shown = np.stack(shapes, axis=-1) * effect.is_identifiable(scene, target)
    throughout = bool(scanned) and scanned[0] < scene.times_s[0]
    columns, observed, block = _in_rows(scene, shown, residual_m, throughout)
    mine = [block == number for number in np.unique(block)]
    grams = np.stack([columns[rows].T @ columns[rows] for rows in mine])
    rights = np.stack([columns[rows].T @ observed[rows] for rows in mine])
    gram, right = grams.sum(axis=0), rights.sum(axis=0)
    least = np.linalg.lstsq(gram, right, rcond=None)[0]
    noise = float(((observed - columns @ least) ** 2).mean()) * BLOCK_S * scene.rate_hz
    prior = noise * np.eye(len(right))
    size = np.linalg.solve(gram + prior, right)
    misplaced = _misplaced(shown, residual_m, rng) if throughout else np.zeros((DRAWS, len(size)))
    drawn = _bootstrap(grams, rights, prior, misplaced, rng)
    spread = np.hypot((known_to / typical)[free], SCALE_ERROR * size)
    noisy = [one + spread * rng.standard_normal(len(size)) for one in drawn]
    draws = null + noisy @ of_sizes
    for k in np.flatnonzero(~free):  # known as well as it can be
        draws[:, k] += known_to[k] * rng.standard_normal(len(draws))
    left = observed - columns @ size
    share = 1 - float(left @ left) / float(observed @ observed)
    p_value = float(chi2.sf(size @ gram @ size / noise, len(size)))
    return Proof(effect, target, null + size @ of_sizes, draws, share, p_value)


def _misplaced(shown: np.ndarray, residual_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(DRAWS, k) what markers misplaced in the model, as far as these usually
    do, add to the right-hand side of shapes (N, m, 3, k)."""
    seen = np.isfinite(residual_m).all(axis=2).any(axis=0)
    places = np.nanmean(residual_m[:, seen], axis=0)
    usual = np.median(np.linalg.norm(places, axis=1)) / MEDIAN_LENGTH
    known = np.isfinite(residual_m)[..., None] & np.isfinite(shown)
    total = np.where(known, shown, 0.0).sum(axis=0).reshape(-1, shown.shape[-1])
    return usual * rng.standard_normal((DRAWS, len(total))) @ total


def _in_rows(
    scene: Scene, shapes_m: np.ndarray, residual_m: np.ndarray, with_means: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shapes (r, k), residual (r,) and number of the interval (r,) where both are known, without
    the mean of each marker and direction or with it."""
    known = np.isfinite(residual_m).all(axis=2) & np.isfinite(shapes_m).all(axis=(2, 3))
    block = ((scene.times_s - scene.times_s[0]) / BLOCK_S).astype(int)
    blocks = np.repeat(np.broadcast_to(block[:, None], known.shape)[known], 3)
    both, weight = [shapes_m, residual_m[..., None]], known[..., None, None]
    if not with_means:
        counts = np.maximum(weight.sum(axis=0), 1)
        both = [x - np.where(weight, x, 0.0).sum(axis=0) / counts for x in both]
    columns, observed = (x[known] for x in both)
    return columns.reshape(-1, shapes_m.shape[-1]), observed.ravel(), blocks


def _bootstrap(
    grams: np.ndarray,
    rights: np.ndarray,
    prior: np.ndarray,
    misplaced: np.ndarray,
    rng: np.random.Generator,
) -> list[np.ndarray]:
    """DRAWS of the sizes (k,), intervals drawn with replacement, ``misplaced`` (DRAWS, k) added to
    the right-hand side; what the markers hardly show is drawn nearer to zero, by the prior, than
    it may be, and scatters by as much."""
    count, total = len(grams), grams.sum(axis=0) + prior
    drawn = rng.integers(count, size=(DRAWS, count))
    undetermined = prior @ np.linalg.solve(total, rng.standard_normal((len(prior), DRAWS)))
    return [
        np.linalg.solve(grams[one].sum(axis=0) + prior, rights[one].sum(axis=0) + more) + rest
        for one, more, rest in zip(drawn, misplaced, undetermined.T, strict=True)
    ]
