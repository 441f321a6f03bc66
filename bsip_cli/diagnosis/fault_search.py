"""Which faults of the catalogue a person's recordings show: by posterior probability.

One fault after the other joins the model, the likeliest first, while one more is likelier than
none. The likelihood of each trial counts by so much less as the other candidates explain more of
it than chance lets them (Devlin and Roeder 1999, Biometrics 55, "genomic control"; Efron 2004,
J Am Stat Assoc 99, "empirical null"): no model of ordinary errors is exact, and what it lacks goes
along a little with every candidate.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit, logsumexp

from bsip_cli.diagnosis.fault_model import Fitted, Hypothesis, corrected, fitted, refined, sized
from bsip_cli.diagnosis.fault_scores import Kind, Library, Scores, scores_of, smallest
from bsip_cli.diagnosis.held_out import unevenness
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.nameless import UNEXPLAINED, Course, Mean
from bsip_cli.statistics.samples import Z95

_TRIED = 8  # candidates of a round that are fitted in full
_OF_A_KIND = 2  # of them, of the same effect
_POLISHED = 3  # of those that have moments, frequencies or windows
_STARTS = 2  # values of a scan from which a finer search begins
_MOST = 8  # faults of a person
Where = tuple[str, str, tuple[int, ...]]
"""A fault's name and target, and its trials."""


@dataclass(frozen=True, eq=False)
class Tried:
    """A fault in full given others: the fit whose last it is, logarithms of the prior odds and of
    the odds against its absence."""

    fit: Fitted
    log_prior: float
    log_odds: float = np.nan

    @property
    def fault(self) -> Hypothesis:
        return self.fit.faults[-1]

    def weighed(self, before: Fitted, inflation: np.ndarray) -> Tried:
        """With its odds against ``before``, the fit without it; inflation (T,)."""
        each = self.fit.log_likelihoods - before.log_likelihoods
        rest = self.fit.log_evidence - before.log_evidence - each.sum()
        odds = self.log_prior + float((each / inflation).sum()) + float(rest)
        return replace(self, log_odds=odds)


@dataclass(frozen=True, eq=False)
class Verdict:
    """What is there in the end: a fault given all others, or one of several.

    number : in the fit. members : what it may be, with probabilities, the likeliest first; they
    hold at least the probability that was asked for. others : what it hardly is, with
    probabilities. probability : that any of all these is there.
    """

    number: int
    members: tuple[tuple[Tried, float], ...]
    others: tuple[tuple[Hypothesis, float], ...]
    probability: float


@dataclass(frozen=True, eq=False)
class Found:
    """Faults of a person's recordings: the fit with all of them, a verdict for each, and what was
    tried in full and is not there, with its probability given what is."""

    fit: Fitted
    verdicts: tuple[Verdict, ...]
    rejected: tuple[tuple[Hypothesis, float], ...]
    scores: Scores


def search(library: Library, named_from: float, known: Sequence[Hypothesis] = ()) -> Found:
    """named_from : probability from which on one name is said; else so many as hold it. known :
    faults that are there for other reasons; they come first in the fit and have no verdict."""
    fit, refuted = fitted(library.session, known), frozenset[Where]()
    tried = one_round(library, fit)
    while tried and tried[0].log_odds >= 0 and len(fit.faults) < len(known) + _MOST:
        before, uneven = fit, -np.inf
        fit = corrected(fitted(library.session, tried[0].fit.faults, start=tried[0].fit))
        if _can_be_uneven(fit.faults[-1]):  # is it likelier of another size in every second?
            inflation = scores_of(library, fit).inflation
            uneven = unevenness(fit, len(fit.faults) - 1, inflation) + np.log(library.prior_odds)
            if uneven >= 0 and _moves_others(before, fit, inflation):
                refuted, fit, uneven = refuted | {_place_of(fit.faults[-1])}, before, -np.inf
        tried = one_round(library, fit, refuted)
        # what no fault explains yet may seem to be it: then one more is likelier
        if uneven >= 0 and not (tried and tried[0].log_odds > uneven):
            fit = _unnamed(fit)
            tried = one_round(library, fit, refuted)
    fit, verdicts = _judged(library, fit, named_from, len(known), refuted)
    hardly = [(one.fault, float(expit(one.log_odds))) for one in tried]
    said = set()
    for verdict in verdicts:
        members = [(x.fault, p) for x, p in verdict.members]
        if verdict.probability >= named_from:
            said |= {_place_of(one) for one, _ in members}
        else:
            hardly += members
        hardly += verdict.others
    best: dict[Where, tuple[Hypothesis, float]] = {}
    for one, probability in sorted(hardly, key=lambda pair: -pair[1]):
        if (place := _place_of(one)) not in said:
            best.setdefault(place, (one, probability))
    return Found(fit, verdicts, tuple(best.values()), scores_of(library, fit))


def _place_of(one: Hypothesis) -> Where:
    return (*one.key, one.trials)


def _moves_others(before: Fitted, fit: Fitted, inflation: np.ndarray) -> bool:
    """Whether the last fault takes another that was there ``before`` out of its 95 % interval: what
    is uneven, and beside which another is of another size, is neither."""
    for number, one in enumerate(before.faults):
        spread = np.sqrt(np.diag(before.covariance_of(number)) * inflation[list(one.trials)].mean())
        moved = (fit.faults[number].values - one.values) / one.typical
        if (np.abs(moved) > Z95 * spread)[one.is_free].any():
            return True
    return False


def _can_be_uneven(one: Hypothesis) -> bool:
    """A rail is touched now more, now less; what trials share is as it is."""
    return one.effect.is_shared and one.name != UNEXPLAINED


def _unnamed(fit: Fitted) -> Fitted:
    """The last fault without its name: nothing more is asked of its trials then."""
    *others, last = fit.faults
    return replace(fit, faults=(*others, replace(last, is_even=False)))


def _judged(
    library: Library, fit: Fitted, named_from: float, known: int, refuted: frozenset[Where]
) -> tuple[Fitted, tuple[Verdict, ...]]:
    """Each fault given the others, no two by one name; one that is likelier absent goes, the least
    likely first."""
    while True:
        inflation = scores_of(library, fit).inflation
        found: list[tuple[Verdict, Fitted]] = []
        for k in range(known, len(fit.faults)):
            called = {_place_of(one.members[0][0].fault) for one, _ in found}
            found.append(_verdict(library, fit, k, named_from, inflation, refuted | called))
        weakest = min(found, key=lambda one: one[0].probability, default=None)
        if weakest is None or weakest[0].probability > 0.5:
            return fit, tuple(verdict for verdict, _ in found)
        fit = corrected(weakest[1])


def _verdict(
    library: Library,
    fit: Fitted,
    number: int,
    named_from: float,
    inflation: np.ndarray,
    refuted: Collection[Where],
) -> tuple[Verdict, Fitted]:
    """Of the probability that a fault or another in its place is there, the shares of each; and the
    fit without it."""
    one = replace(fit.faults[number], is_even=True)
    others = [other for k, other in enumerate(fit.faults) if k != number]
    without = fitted(fit.session, others, start=fit)
    again = fitted(fit.session, (*others, one), start=without, whole=False)
    prior = library.log_prior_of(Kind(one.effect, one.target, one.trials))
    mine = {one.key: Tried(again, prior)}
    for other in _in_full(library, without, refuted, set(one.trials)):
        mine.setdefault(other.fault.key, other)
    mine |= {other.fault.key: other for other in _means_of_nameless(without, one)}
    mine = {key: x.weighed(without, inflation) for key, x in mine.items()}
    odds = library.prior_odds
    if any(x.name == UNEXPLAINED and set(x.trials).isdisjoint(one.trials) for x in others):
        odds = 1.0  # what has no name in one trial is in another as likely as not
        for key, x in mine.items():
            if x.fault.name == UNEXPLAINED:
                mine[key] = replace(x, log_odds=x.log_odds - np.log(library.prior_odds))
    itself = mine.pop(one.key)
    weighed = [itself, *mine.values()]
    if _can_be_uneven(one):
        log = unevenness(itself.fit, len(others), inflation) + np.log(odds)
        weighed.insert(1, replace(itself, fit=_unnamed(itself.fit), log_odds=itself.log_odds + log))
    weighed.sort(key=lambda x: -x.log_odds)
    logs = np.array([x.log_odds for x in weighed])
    there = float(expit(logsumexp(logs)))
    shares: dict[Tried, float] = {}
    unnamed = [x for x in weighed if x.fault.name == UNEXPLAINED]
    for each, share in zip(weighed, np.exp(logs - logsumexp(logs)).tolist(), strict=True):
        name = unnamed[0] if each in unnamed else each  # without a name they are all one
        shares[name] = shares.get(name, 0.0) + share * there
    members = tuple((each, shares[each]) for each in smallest(shares, named_from))
    rest = sorted(shares, key=lambda x: -shares[x])[len(members) :]
    hardly = tuple((each.fault, shares[each]) for each in rest)
    return Verdict(number, members, hardly, there), without


def _means_of_nameless(without: Fitted, one: Hypothesis) -> Iterator[Tried]:
    """What errors without a name in a fault's trials are on average, if not zero: no fault is
    needed for it, so nothing is rare about it."""
    if one.name == UNEXPLAINED:
        return
    for number, other in enumerate(without.faults):
        if not isinstance(other.effect, Course) or set(one.trials).isdisjoint(other.trials):
            continue
        values = without.values_at(number, without.mean)
        sizes = other.effect.sizes(other.scene, other.target, values)
        effect, target = Mean(sizes), Mean.target_of(other.target)
        fault = replace(other, effect=effect, target=target, values=np.zeros(len(sizes)))
        if (fit := _with_one_more(without, without, fault)) is not None:
            size, scale = (x[fit.coefficients(-1)] for x in (fit.mean, fit.root))
            prior = float((0.5 * (size / scale) ** 2 - 0.5 * size**2 + np.log(scale)).sum())
            yield Tried(fit, prior)


def one_round(library: Library, fit: Fitted, refuted: Collection[Where] = ()) -> list[Tried]:
    """The likeliest candidates in full given a fit's faults, the likeliest first, but for those
    ``refuted``; how much of them is chance is seen next to the best one."""
    tried = _in_full(library, fit, refuted)
    if not tried:
        return []
    best = max(tried, key=lambda one: one.fit.log_evidence)
    inflation = scores_of(library, best.fit).inflation
    return sorted((one.weighed(fit, inflation) for one in tried), key=lambda one: -one.log_odds)


def _in_full(
    library: Library, fit: Fitted, refuted: Collection[Where], trials: set[int] | None = None
) -> list[Tried]:
    """The likeliest candidates, those that touch some of ``trials``, fitted."""
    scores = scores_of(library, fit)
    inflation = [scores.inflation_in(place.trials) for place in library.places]
    log = scores.log_factor / inflation + library.log_prior
    tried: list[tuple[Tried, Iterator[Hypothesis]]] = []
    for kind in _chosen(library, fit, log, refuted, trials):
        starts = _starts(library, scores, kind, log)
        fits = (_with_one_more(fit, fit, one) for one in starts)
        if (now := next((one for one in fits if one is not None), None)) is not None:
            tried.append((Tried(now, library.log_prior_of(kind)), starts))
    tried.sort(key=lambda one: -one[0].log_prior - one[0].fit.log_evidence)
    scanned = [k for k, (one, _) in enumerate(tried) if not one.fault.is_free.all()]
    found = [one for one, _ in tried]
    for k in scanned[:_POLISHED]:
        found[k] = _polished(fit, *tried[k])
    return found


def _polished(fit: Fitted, one: Tried, starts: Iterable[Hypothesis]) -> Tried:
    """With the best of other moments, frequencies or windows, and these sought once more given the
    noise that it leaves: before it was found, it was taken for noise."""
    fits = [one.fit, *(_with_one_more(fit, fit, start) for start in starts)]
    now = max((x for x in fits if x is not None), key=lambda x: x.log_evidence)
    quiet = fitted(fit.session, fit.faults, start=now, whole=False, same_noise=True)
    again = _with_one_more(fit, quiet, now.faults[-1])
    return replace(one, fit=max(now, again or now, key=lambda x: x.log_evidence))


def _chosen(
    library: Library,
    fit: Fitted,
    log: np.ndarray,
    refuted: Collection[Where],
    asked: set[int] | None,
) -> Iterator[Kind]:
    """The likeliest kinds of places; no effect takes all of them.

    Where an error without a name is in the model already nothing more can be named: what it leaves
    has no name either. What stands beside it may be another of the named ones.
    """
    known = {(*one.key, t) for one in fit.faults for t in one.trials}
    unnamed = (one for one in fit.faults if one.name == UNEXPLAINED)
    closed = {t for one in unnamed for t in one.trials} if asked is None else set()
    kinds = {}
    for kind, mine in library.kinds.items():
        effect, target, trials = kind
        new = all((effect.name, target, t) not in known for t in trials)
        new &= (effect.name, target, trials) not in refuted
        if new and closed.isdisjoint(trials) and (asked is None or asked & set(trials)):
            kinds[kind] = np.logaddexp.reduce(log[mine])
    taken: Counter[tuple[Effect, bool]] = Counter()
    for kind in sorted(kinds, key=lambda kind: -kinds[kind]):
        lasting = (kind.effect, len(kind.trials) > 1)
        if taken[lasting] < _OF_A_KIND:
            taken[lasting] += 1
            yield kind
        if taken.total() >= _TRIED:
            return


def _with_one_more(fit: Fitted, noise: Fitted, one: Hypothesis) -> Fitted | None:
    """The model with one more fault, sized given the noise of a fit with the same others; None if
    it is not possible."""
    one = sized(noise, refined(noise, one))
    if not one.is_possible():
        return None
    return fitted(fit.session, (*fit.faults, one), start=noise, whole=False)


def _starts(library: Library, scores: Scores, kind: Kind, log: np.ndarray) -> Iterator[Hypothesis]:
    """A kind of the likeliest values of a scan that are further apart than a finer search looks,
    with the sizes of one linear step."""
    effect, target, trials = kind
    scene = library.session.trials[trials[0]].scene
    reached: list[tuple[np.ndarray, np.ndarray]] = []  # by a search from each of them
    for k in sorted(library.kinds[kind], key=lambda k: -log[k]):
        candidate = library.places[k].candidate
        at, null = np.array(candidate.scanned), candidate.null(scene)
        if all((np.abs(at - other) > reach).any() for other, reach in reached):
            reached.append((at, effect.spacing(scene, target, null)))
            yield Hypothesis(effect, target, trials, null, library.session).moved(scores.sizes[k])
        if len(reached) == (_STARTS if len(at) else 1):
            return
