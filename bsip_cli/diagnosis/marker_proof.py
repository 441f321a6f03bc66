"""What the markers show by themselves: one that slips or sits wrong, a second bend of the trunk.

The pose is the best that the model can do; what a fault leaves of the markers is linear in its
sizes like the wrench, and far sharper: the skin slides by millimetres. A marker that jumps and
stays is proven by that. A bend of the trunk is not: soft tissue moving with it leaves the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logit
from scipy.stats import chi2

from bsip_cli.body.names import in_words
from bsip_cli.diagnosis.findings import (
    DRAWS,
    SCALE_ERROR,
    Finding,
    Number,
    interval_words,
    numbers_of,
    scope_of,
)
from bsip_cli.diagnosis.held_out import BLOCK_S, Gain
from bsip_cli.diagnosis.hypothesis import Candidate, Hypothesis
from bsip_cli.dynamics.lowpass import stride_to
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.markers import LEAST_S, ramp, ramp_of
from bsip_cli.effects.scene import Scene
from bsip_cli.motion.marker_fit import MEDIAN_LENGTH
from bsip_cli.statistics.effective_samples import effective_samples

ENOUGH_HZ = 10.0  # for a course of many seconds
BENT = 0.25  # of the markers' squared residuals, their means left out: less is skin that follows
OWN = 0.5  # of a marker's own squared residual: else its skin slides more than it slips
_UNKNOWN = (np.nan, np.nan, np.nan)
SLIP, SLIDE = "marker_shift", "marker_slide"
BEND, SOFT_TISSUE = "missing_joint", "soft_tissue"


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

    def hypothesis(self, trial: int) -> Hypothesis:
        """As the search for faults takes it."""
        return Hypothesis(self.effect, self.target, (trial,), self.values)

    def finding(self, scene: Scene, trial: str, gain: Gain | None) -> Finding:
        """As the diagnosis prints it. gain : of the forces."""
        whose = "the marker's" if self.effect.name in (SLIP, SLIDE) else "all markers'"
        is_shown = gain is not None and gain.is_real()
        reported = self.effect.reported(scene, self.target, self.values)
        drawn = [self.effect.reported(scene, self.target, one) for one in self.draws]
        numbers = numbers_of(reported, drawn)
        told = self.effect.sentence(scene, self.target, self.values) + interval_words(numbers)
        sentence = f"{told}; this is {100 * self.share:.0f} % of {whose} squared residual"
        if not is_shown:
            sentence += ", and the forces do not show it"
        return Finding(
            self.effect.name,
            self.target,
            (trial,),
            "named",
            "",
            self.p_value,
            gain.interval() if gain is not None and is_shown else _UNKNOWN,
            numbers,
            sentence,
            1 - self.p_value,
            scope_of(self.effect),
        )


def slips_of(
    scene: Scene, slips: Sequence[Slip], named_from: float, rng: np.random.Generator
) -> tuple[Proof, ...]:
    """The slips that a trial's markers show, of those that were found in them; slides where these
    are likelier than ``named_from``."""
    fewer = _slower(scene)
    left, found = fewer.residual_m, []
    if left is None:
        return ()
    for slip in slips:
        p_value = float(chi2.sf(slip.statistic**2, 3))
        effect, scanned = _manner(fewer, left, slip, named_from)
        one = _sized(fewer, left, effect, slip.marker, scanned, rng)
        one = replace(one, p_value=p_value, share=_own_share(fewer, left, one))
        if one.share < OWN or np.linalg.norm(one.values[:3]) < slip.least_m:
            continue
        found.append(one)
        left = left - _left(one.effect, fewer, one.target, one.values)
    return tuple(found)


def _manner(
    scene: Scene, residual_m: np.ndarray, slip: Slip, named_from: float
) -> tuple[Effect, tuple[float, ...]]:
    """Whether a marker slips at a moment or slides, and when: by Schwarz's criterion, a slide
    having one number more, from as many samples of its residual as are independent."""
    at_once = EFFECTS[SLIP], (slip.start_s, 0.0)
    own = residual_m[:, _number(scene, slip.marker)]
    seen = np.isfinite(own).all(axis=1)
    times_s, own = scene.times_s[seen], own[seen]
    if _is_throughout(scene, slip.start_s) or np.ptp(times_s) < LEAST_S:
        return at_once
    start, end = ramp_of(times_s, own)
    left = []
    for course in (times_s >= slip.start_s, ramp(times_s, start, end)):
        columns = np.column_stack([np.ones(len(own)), course])
        left.append(own - columns @ np.linalg.lstsq(columns, own, rcond=None)[0])
    samples = sum(effective_samples(course) for course in left[1].T)
    gain = np.log((left[0] ** 2).sum() / (left[1] ** 2).sum())
    if 0.5 * samples * gain - 0.5 * np.log(samples) < logit(named_from):
        return at_once
    return EFFECTS[SLIDE], (0.5 * (start + end), end - start, 0.0)


def alone_and_shaken(
    scene: Scene, slips: Sequence[Proof]
) -> tuple[tuple[Proof, ...], tuple[Proof, ...]]:
    """Slips, and what several markers do within the same second: no tape gives way at six places
    at once, so that is soft tissue after a knock."""
    moments = [one.values[3] for one in slips]
    shaken = tuple(
        one
        for one, moment in zip(slips, moments, strict=True)
        if not _is_throughout(scene, moment)
        and sum(abs(moment - other) < BLOCK_S for other in moments) > 1
    )
    return tuple(one for one in slips if one not in shaken), shaken


def shaken_finding(scene: Scene, shaken: Sequence[Proof], trial: str) -> Finding:
    """Of markers that move on their segments together."""
    sizes = [1000 * float(np.linalg.norm(one.values[:3])) for one in shaken]
    moments = [float(one.values[3]) for one in shaken]
    segments = [int(scene.person.marker_segments[_number(scene, one.target)]) for one in shaken]
    target = scene.person.skeleton.segments[max(segments, key=segments.count)]
    names = ", ".join(one.target for one in shaken)
    said = (
        f"soft tissue moves {len(shaken)} markers ({names}) by {min(sizes):.0f} to "
        f"{max(sizes):.0f} mm from {min(moments):.2f} s on"
    )
    p_value = max(one.p_value for one in shaken)
    number = Number("size", "m", max(sizes) / 1000, np.nan, np.nan)
    return Finding(
        SOFT_TISSUE,
        target,
        (trial,),
        "named",
        "",
        p_value,
        _UNKNOWN,
        (number,),
        said,
        1 - p_value,
        "trial",
    )


def _number(scene: Scene, marker: str) -> int:
    return scene.person.markers.index(marker)


def bend_of(
    scene: Scene, slips: Sequence[Proof], trial: str, class_id: str, rng: np.random.Generator
) -> tuple[Finding, ...]:
    """A second bend of the trunk or soft tissue that moves with it, which markers do not tell
    apart, where that is much of their residuals beside slips; nothing where it is little."""
    fewer = _slower(scene)
    left = fewer.residual_m
    if left is None:
        return ()
    for one in slips:
        left = left - _left(one.effect, fewer, one.target, one.values)
    effect = EFFECTS[BEND]
    sized = (_sized(fewer, left, effect, target, (), rng) for target in effect.targets(fewer))
    possible = (one for one in sized if effect.possible(fewer, one.target, one.values))
    bend = max(possible, key=lambda one: one.share, default=None)
    if bend is None or bend.share < BENT:
        return ()
    waist = _sized(fewer, left, EFFECTS["joint_centre"], "waist", (), rng)
    if waist.share >= bend.share:
        return ()  # by so much scaling errs
    alike = f"a second bend and soft tissue look alike here: to tell them apart, {effect.remedy}"
    told = bend.finding(fewer, trial, None)
    told = replace(
        told,
        verdict="ambiguous",
        class_id=class_id,
        sentence=f"{told.sentence}; {alike}",
        probability=told.probability / 2,  # nothing speaks for the one rather than the other
    )
    markers = fewer.person.marker_segments == fewer.person.skeleton.index(bend.target)
    size = float(np.sqrt(np.nanmean((left[:, markers] ** 2).sum(axis=2))))
    number = Number("size", "m", size, np.nan, np.nan)
    said = (
        f"soft tissue on the {in_words(bend.target)} moves with the trunk's posture: its markers "
        f"are {1000 * size:.0f} mm off; {alike}"
    )
    return told, replace(told, effect=SOFT_TISSUE, numbers=(number,), sentence=said, scope="person")


def _slower(scene: Scene) -> Scene:
    return scene.every(stride_to(scene.rate_hz, ENOUGH_HZ))


def _own_share(scene: Scene, residual_m: np.ndarray, one: Proof) -> float:
    """Part of the squared residual of the marker that is off."""
    m = _number(scene, one.target)
    own = residual_m[:, m : m + 1]
    change = _left(one.effect, scene, one.target, one.values)[:, m : m + 1]
    rows = _in_rows(scene, change[..., None], own, with_means=_is_throughout(scene, one.values[3]))
    columns, course, _ = rows
    return 1 - float(((course - columns[:, 0]) ** 2).sum() / (course @ course))


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
    seen = np.isfinite(residual_m).all(axis=2).any(axis=0)
    places = np.nanmean(residual_m[:, seen], axis=0)
    usual = np.median(np.linalg.norm(places, axis=1)) / MEDIAN_LENGTH
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
