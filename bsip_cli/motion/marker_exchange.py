"""Exchanged labels are corrected where that brings every marker involved nearer to the model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, permutations

import numpy as np

from bsip_cli.motion.marker_events import MarkerEvent, event, pieces
from bsip_cli.motion.marker_fit import MarkerFit
from bsip_cli.segments import mirrored

Refit = Callable[[np.ndarray, np.ndarray], MarkerFit]
_FAR = 3.0  # residual, of a marker or of all, over the trusted distance; over the usual residual
_NEARER = 0.5  # misfit exchanged over that as labelled; distance to the other's place over the own


@dataclass(frozen=True)
class Exchange:
    """Markers number ``a`` and ``b`` bear each other's labels over an interval of frames.

    ``statistic`` says how clearly, as in :class:`MarkerEvent`.
    """

    a: int
    b: int
    frames: slice
    statistic: float


@dataclass(frozen=True, eq=False)
class Labelling:
    """A fit, the labels it rests on, and how poses are fitted to others.

    fit : poses and markers with the labels corrected.
    refit : poses fitted to other markers (n, m, 3) at times (n,).
    done : the exchanges that correct the labels, one after the other.
    events : all exchanges that were found, corrected or not.
    """

    fit: MarkerFit
    refit: Refit
    done: tuple[Exchange, ...] = ()
    events: tuple[MarkerEvent, ...] = ()

    @property
    def order(self) -> np.ndarray:
        """(N, m) under each label, the recorded label of the marker that bears it now."""
        return _order(self.fit, self.done)

    def refitted(
        self, exchanges: Sequence[Exchange], frames: slice | np.ndarray = slice(None)
    ) -> MarkerFit:
        """The poses fitted again, to all or some frames, with these labels exchanged."""
        markers = exchanged(self.fit.measured_m, _order(self.fit, exchanges))
        return self.refit(markers[frames], self.fit.times_s[frames])

    def best_fitting(self, tried: Iterable[Sequence[Exchange]]) -> tuple[float, Sequence[Exchange]]:
        """Those exchanges with which poses fitted to some frames lie nearest to the markers, and
        how near [m]."""
        frames = _some_frames(self.fit)
        misfits = ((self.refitted(one, frames).misfit_m(), one) for one in tried)
        return min(misfits, key=lambda one: one[0])

    def exchanged_back(self, again: MarkerFit, suspected: Sequence[Exchange]) -> Labelling:
        """Exchange suspected labels back, but for those that would leave a marker farther off.

        A marker involved must come nearer to the model, or lie within what markers are trusted to;
        the others are left as labelled and the poses fitted again without them, until that holds of
        all that remain. All markers together must fit better than before, or none is exchanged.

        again : the fit with all suspected labels exchanged (:meth:`refitted`).
        """
        fit, kept = self.fit, list(suspected)
        limit = 3**0.5 * float(fit.trusted_m.min())  # trusted in each of three directions

        def comes_nearer(one: Exchange) -> bool:
            pairs = [[x.misfit_m(m, one.frames) for x in (again, fit)] for m in (one.a, one.b)]
            return all(now < max(was, limit) for now, was in pairs)

        while nearer := list(filter(comes_nearer, kept)):
            if len(nearer) == len(kept):
                break
            kept, again = nearer, self.refitted(nearer)
        return self.after(again, suspected, nearer if again.misfit_m() < fit.misfit_m() else [])

    def after(
        self, again: MarkerFit, suspected: Sequence[Exchange], done: Sequence[Exchange]
    ) -> Labelling:
        """With the events of all that are suspected, and those that are done, as ``again`` has."""
        events = list(self.events)
        for one in suspected:
            a, b = (self.fit.measured_m[one.frames, m] for m in (one.a, one.b))
            apart = float(np.nanmedian(np.linalg.norm(a - b, axis=1)))
            how = (one.frames, apart, one.statistic)
            is_done = one in done
            swap = event(self.fit, "swap", one.a, *how, partner=one.b, put_right=is_done)
            events.append(swap)
        fit, all_done = again if done else self.fit, (*self.done, *done)
        return replace(self, fit=fit, done=all_done, events=tuple(events))


def _order(fit: MarkerFit, exchanges: Iterable[Exchange]) -> np.ndarray:
    order = np.tile(np.arange(len(fit.labels)), (len(fit.times_s), 1))
    for one in exchanges:
        order[one.frames, [one.a, one.b]] = order[one.frames, [one.b, one.a]]
    return order


def exchanged(markers: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Markers (N, m, ...) with, under each label, the one that ``order`` (N, m) says."""
    return np.take_along_axis(markers, order.reshape(*order.shape, *[1] * (markers.ndim - 2)), 1)


_FRAMES = 24  # that show which exchanges are the likeliest


def _some_frames(fit: MarkerFit) -> np.ndarray:
    """(k,) evenly over the trial."""
    return np.unique(np.linspace(0, len(fit.times_s) - 1, _FRAMES).astype(int))


def relabelled(labelling: Labelling) -> Labelling:
    """Labels corrected where that is clear: of whole limbs, of all markers of a segment, of
    pairs."""
    return _swaps(_reordered(_limbs(labelling)))


# --- both arms or both legs that bear each other's labels throughout ------------------------------


_ARM, _LEG = ("upper_arm", "forearm", "hand"), ("thigh", "shank", "foot")
_LIMBS = (_ARM, ("upper_torso", *_ARM), _LEG)  # the shoulders' labels may go with the arms'
_LATERAL_M = 0.05  # a marker of the trunk this far from its middle belongs to a side
_MIRRORED_M = 0.1  # the places of a pair are mirrored to this


def _limbs(labelling: Labelling) -> Labelling:
    """Labels of both arms or both legs corrected, with the events.

    All markers of one limb pull the other limb's model over, or turn the trunk round, so single
    pairs need not show it. Where the markers fit badly, the poses are fitted again to some frames
    with the limbs exchanged; if that at least halves the residual of all markers, they are.
    """
    fit = labelling.fit
    whole = slice(0, len(fit.times_s))
    before = fit.misfit_m(frames=_some_frames(fit))
    if not before > _FAR * fit.trusted_m.min():
        return labelling
    limbs = [[Exchange(a, b, whole, 1.0) for a, b in _mirrored_pairs(fit, limb)] for limb in _LIMBS]
    after, found = labelling.best_fitting(limbs)
    if not after < _NEARER * before:
        return labelling
    suspected = [replace(one, statistic=before / after) for one in found]
    return labelling.exchanged_back(labelling.refitted(suspected), suspected)


def _mirrored_pairs(fit: MarkerFit, limb: tuple[str, ...]) -> list[tuple[int, int]]:
    """Markers of the right side of some segments and those that lie mirrored on the left one."""
    places, segments = fit.person.marker_positions_m, fit.segments
    of_trunk = np.where(np.abs(places[:, 2]) > _LATERAL_M, np.sign(places[:, 2]), 0.0)
    ends = zip(segments, of_trunk, strict=True)
    side = [{"_r": 1.0, "_l": -1.0}.get(name[-2:], own) for name, own in ends]
    seen = np.isfinite(fit.measured_m[..., 0])
    near = sorted(
        (float(np.linalg.norm(places[a] * [1.0, 1.0, -1.0] - places[b])), a, b)
        for a, segment in enumerate(segments)
        for b, other in enumerate(segments)
        if segment.removesuffix("_r") in limb and other == mirrored(segment)
        if side[a] == 1 and side[b] == -1 and (seen[:, a] & seen[:, b]).any()
    )
    pairs: list[tuple[int, int]] = []
    for apart, a, b in near:
        if apart < _MIRRORED_M and not {a, b} & {k for pair in pairs for k in pair}:
            pairs.append((a, b))
    return pairs


# --- the markers of a segment in another order, throughout ----------------------------------------


# Of a segment: three show an order by their sides alone, eight have 40,320.
_FEWEST, _MOST_MARKERS = 4, 7
_LIKELY = 8  # orders that are fitted


def _reordered(labelling: Labelling) -> Labelling:
    """Labels of segments corrected whose markers are each other's, with the events.

    Of labels that are exchanged all together no pair need show it, since the pose follows them.
    What is rigid does: turned and moved at will, the markers lie on their places at least twice as
    near in another order as in that of their labels. Poses fitted to some frames tell which of
    these orders it is, of those that are nearly alike.
    """
    fit = labelling.fit
    frames = _some_frames(fit)
    whole, limit = slice(0, len(fit.times_s)), 3**0.5 * float(fit.trusted_m.min())
    for segment in dict.fromkeys(fit.segments):
        mine = np.array([k for k, name in enumerate(fit.segments) if name == segment])
        seen = np.isfinite(fit.measured_m[frames][:, mine, 0]).all(axis=1)
        if not _FEWEST <= len(mine) <= _MOST_MARKERS or not seen.any():
            continue
        places = fit.person.marker_positions_m[mine]
        rigid = partial(_rigid_misfits_m, fit.measured_m[frames[seen]][:, mine], places)
        as_labelled = float(rigid(np.arange(len(mine))[None])[0])
        if as_labelled < limit:
            continue
        orders = np.array(list(permutations(range(len(mine)))))
        misfits = rigid(orders)
        likely = [k for k in np.argsort(misfits) if misfits[k] < _NEARER * as_labelled][:_LIKELY]
        if not likely:
            continue
        tried = []
        for k in likely:
            clear = as_labelled / float(misfits[k])
            steps = _transpositions(mine, orders[k])
            tried.append([Exchange(a, b, whole, clear) for a, b in steps])
        _, found = labelling.best_fitting(tried)
        again = labelling.refitted(found)
        nearer = again.misfit_m(mine) < _NEARER * fit.misfit_m(mine)
        if nearer and again.misfit_m() < fit.misfit_m():
            labelling = labelling.after(again, found, found)
            fit = labelling.fit
    return labelling


def _rigid_misfits_m(measured: np.ndarray, place: np.ndarray, orders: np.ndarray) -> np.ndarray:
    """(k,) root mean square distance of markers (N, n, 3) from places (n, 3) that are turned and
    moved onto them, in each order (k, n) of the markers (Kabsch 1976, Acta Cryst A32)."""
    measured = measured - measured.mean(axis=1, keepdims=True)
    place = place - place.mean(axis=0)
    products = np.einsum("fkni,nj->fkij", measured[:, orders], place)
    left, sizes, right = np.linalg.svd(products)
    sizes[..., 2] *= np.sign(np.linalg.det(left) * np.linalg.det(right))
    squares = (measured**2).sum(axis=(1, 2))[:, None] + (place**2).sum() - 2 * sizes.sum(axis=2)
    return np.sqrt(np.maximum(squares, 0.0).mean(axis=0) / len(place))


def _transpositions(markers: np.ndarray, order: np.ndarray) -> Iterator[tuple[int, int]]:
    """Exchanges that one after the other bring markers (n,) into an order (n,)."""
    now = list(range(len(order)))
    for at, wanted in enumerate(order):
        other = now.index(wanted)
        if other != at:
            now[at], now[other] = now[other], now[at]
            yield int(markers[at]), int(markers[other])


# --- pairs of markers that bear each other's labels for a while or throughout ---------------------


_BRIDGE_S = 0.1  # breaks within one swap
_UNSEEN_S = 0.25  # a reversal is looked for over gaps up to this long
_MOST = 12


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two markers, the frames (N,) in which they may be exchanged, and how sharp the signs are."""

    a: int
    b: int
    hit: np.ndarray
    ratio: float
    reverses: bool


def _swaps(labelling: Labelling) -> Labelling:
    """Labels of pairs corrected where that is clear, with the events.

    Two signs, and either is enough. The path's: the line between the two reverses from one frame
    to the next, which no segment does; it shows also where the pose follows the labels. The
    model's: both markers are far from their own places and at least twice as near to the other's.
    One wrong pair may turn a whole limb of the model over, so pairs are tried one at a time, and
    one after which the poses fit no better is none.
    """
    tried: set[tuple[int, int]] = set()
    for _ in range(_MOST):
        fit = labelling.fit
        pairs = [one for one in _suspects(fit) if (one.a, one.b) not in tried]
        if not pairs:
            break
        pair = max(pairs, key=lambda one: (one.reverses, one.ratio * one.hit.sum()))
        tried.add((pair.a, pair.b))
        unseen = ~np.isfinite(fit.measured_m[:, [pair.a, pair.b], 0]).all(axis=1)
        found = pieces(pair.hit, unseen, 1 + round(_BRIDGE_S / fit.step_s()))
        suspected = [Exchange(pair.a, pair.b, piece, pair.ratio) for piece in found]
        again = labelling.refitted(suspected)
        if again.misfit_m() < fit.misfit_m():
            labelling = labelling.exchanged_back(again, suspected)
    return labelling


def _suspects(fit: MarkerFit) -> list[_Pair]:
    own = fit.distance_m()
    usual = float(np.nanmedian(own)) if np.isfinite(own).any() else 0.0
    far = _FAR * max(float(fit.trusted_m.min()), usual)
    astray = own > far
    paths = np.ascontiguousarray(np.moveaxis(fit.measured_m, 1, 0))
    found = []
    for a, b in _pairs(fit):
        hit = astray[:, a] & astray[:, b]
        if len(frames := np.flatnonzero(hit)):
            hit[frames] = (_nearness(fit, own, a, b, frames) > 1.0 / _NEARER).all(axis=1)
        line = paths[a] - paths[b]
        hit, sharp = _between_reversals(line, fit.times_s, own[:, [a, b]], hit, far)
        if hit.any():
            ratio = float(np.nanmedian(_nearness(fit, own, a, b, np.flatnonzero(hit))))
            found.append(_Pair(a, b, hit, max(ratio, sharp), sharp > 0))
    return found


def _nearness(fit: MarkerFit, own: np.ndarray, a: int, b: int, frames: np.ndarray) -> np.ndarray:
    """(frames, 2) distance of two markers to their own places over that to the other's."""
    across = np.linalg.norm(
        fit.measured_m[frames][:, [a, b]] - fit.model_m[frames][:, [b, a]], axis=2
    )
    return own[frames][:, [a, b]] / np.maximum(across, 1e-4)


def _pairs(fit: MarkerFit) -> Iterator[tuple[int, int]]:
    """Markers of one segment, of the same one on both sides, or of two that share a joint."""
    names, parents = fit.person.skeleton.segments, fit.person.skeleton.parents
    for (a, first), (b, other) in combinations(enumerate(fit.person.marker_segments), 2):
        near = other in (first, parents[first]) or parents[other] == first
        if near or names[other] == mirrored(names[first]):
            yield a, b


def _between_reversals(
    line: np.ndarray, times_s: np.ndarray, own: np.ndarray, hit: np.ndarray, far: float
) -> tuple[np.ndarray, float]:
    """The hits; where the line (N, 3) between two markers reverses, all frames between reversals.

    Also its length over what it lacks of an exact reversal, 0 where there is none. ``own`` (N, 2)
    are the distances of the two from the model.
    """
    seen = np.flatnonzero(np.isfinite(line[:, 0]))
    d = line if len(seen) == len(line) else line[seen]
    # Most pairs never turn by a right angle between two frames: nothing to look at.
    if len(seen) < 4 or not (np.einsum("ni,ni->n", d[1:], d[:-1]) < 0).any():
        return hit, 0.0
    flips, sharp = _reversals(d, times_s[seen], far)
    if not len(flips):
        return hit, 0.0
    state = np.zeros(len(seen), dtype=int)
    state[flips] = 1
    state = np.cumsum(state) % 2
    both = own[seen].sum(axis=1)
    shares = [float(hit[seen[state == k]].mean()) for k in (0, 1)]
    means = [float(both[state == k].mean()) for k in (0, 1)]
    if max(shares) > 0.1:
        wrong = int(np.argmax(shares))
    elif max(means) > 1.5 * min(means):
        wrong = int(np.argmax(means))
    else:
        wrong = int((state == 1).mean() < 0.5)
    between = np.zeros(len(hit), dtype=bool)
    between[seen[state == wrong]] = True
    return between, float(np.median(sharp))


def _reversals(line: np.ndarray, times_s: np.ndarray, far: float) -> tuple[np.ndarray, np.ndarray]:
    """Frames (k,) from which on a line (N, 3) points the other way, having moved little before, and
    its length over what it lacks of an exact reversal.

    Where samples were interpolated, the frame between may lie anywhere on the way.
    """
    length = np.linalg.norm(line, axis=1)
    calm = np.ones(len(line), dtype=bool)
    calm[1:] = np.linalg.norm(np.diff(line, axis=0), axis=1) < 0.5 * length[1:]
    sharp = np.zeros(len(line))
    for step in (1, 2):
        lacking = np.linalg.norm(line[step:] + line[:-step], axis=1)
        turned = (lacking < 0.5 * length[step:]) & (length[step:] > far)
        turned &= times_s[step:] - times_s[:-step] < _UNSEEN_S
        if step == 1:
            calm[1:] |= turned
        else:
            turned &= (sharp[1:-1] == 0) & (sharp[2:] == 0)
        turned &= calm[:-step]
        sharp[step:] += turned * length[step:] / np.maximum(lacking, 1e-4)
    flips = np.flatnonzero(sharp)
    return flips, sharp[flips]
