"""From an estimate to what people read: values, standard deviations, and the data's share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.stats import chi2

from bsip_cli.body.inertia import from_phi, readable_jacobians
from bsip_cli.identification.prior import Prior
from bsip_cli.identification.problem import Estimate, Problem

# --- how well the motion excited the inertial parameters ------------------------------------------


_BETTER_THAN_TABLE = 0.5  # part of the prior variance: below it the data know more than the table


@dataclass(frozen=True, eq=False)
class Excitation:
    """What the motion shows, each parameter in its prior spread, each component in its noise.

    singular_values : (rank,) of the base regressor; below 1 the table knows better than the data.
    condition_number : their ratio.
    segment_share : (n,) mean share of its ten parameters that the data could decide.
    combinations : (n,) of a segment's ten parameters, how many independent combinations the data
        know better than the table does. With none the segment was not excited.
    """

    singular_values: np.ndarray
    condition_number: float
    segment_share: np.ndarray
    combinations: np.ndarray


def excitation(problem: Problem) -> Excitation:
    """Singular values, condition number and what the data could know of each segment."""
    information, _ = problem.trusted_equations()
    root = problem.prior.root
    strength = np.linalg.eigvalsh(root.T @ information @ root)[::-1][: problem.basis.rank]
    singular = np.sqrt(np.maximum(strength, 0.0))
    smallest = singular[-1]
    condition = float(singular[0] / smallest) if smallest > 0 else float("inf")
    known = beforehand(problem)
    n = len(information) // 10
    own = np.arange(n)  # (n, 10, 10) of each segment's own parameters
    table, left = (
        known.covariance(x).reshape(n, 10, n, 10)[own, :, own]
        for x in (0 * information, information)
    )
    share = 1.0 - np.einsum("nii->n", left) / 10
    parts = [eigh(*pair, eigvals_only=True) for pair in zip(left, table, strict=True)]
    combinations = (np.array(parts) < _BETTER_THAN_TABLE).sum(axis=1)
    return Excitation(singular, condition, share, combinations)


# --- what a motion can add to the table on each segment: how much the data decide -----------------


_GROUPS = (("mass", slice(0, 1)), ("centre of mass", slice(1, 4)), ("inertia", slice(4, 10)))
_FROM_TABLE = 0.2


@dataclass(frozen=True, eq=False)
class Beforehand:
    """What is known before any wrench, about the table, in coordinates that scatter as N(0, 1).

    seen : (P, P) change of the parameters.
    readable : (P, P) change of mass, centre of mass and tensor of each segment that goes along, in
        units of their standard deviations.
    """

    seen: np.ndarray
    readable: np.ndarray

    def covariance(self, information: np.ndarray) -> np.ndarray:
        """(P, P) of the readable parameters, in units of their prior standard deviations.

        ``information`` (P, P) is the weighted sum of Y^T Y of the wrench's regressor.
        """
        left = np.eye(len(self.seen)) - self._removed(information)
        return self.readable @ left @ self.readable.T

    def share(self, information: np.ndarray) -> np.ndarray:
        """(n, 10) part of each parameter's prior variance that the information removes."""
        removed = np.sum(self.readable @ self._removed(information) * self.readable, axis=1)
        return removed.reshape(-1, 10)

    def wrench_variance(self, information: np.ndarray, motion: np.ndarray) -> float:
        """Sum of squares of the wrench that stays unknown in a motion of information ``motion``."""
        weight = self.seen.T @ motion @ self.seen
        return float(np.trace(weight) - np.sum(weight * self._removed(information)))

    def _removed(self, information: np.ndarray) -> np.ndarray:
        one = np.eye(len(self.seen))
        return one - np.linalg.inv(self.seen.T @ information @ self.seen + one)


def beforehand(problem: Problem) -> Beforehand:
    """The table's spread of a problem, linearised about the table."""
    prior = problem.prior
    rows = readable_jacobians(prior.phi) @ prior.root
    return Beforehand(prior.root, rows / prior.readable_sd.reshape(-1, 1))


def in_words(share: np.ndarray) -> str:
    """One segment's data shares (10,) as people say them, the mean over each group's numbers."""
    words = []
    for name, part in _GROUPS:
        data = float(share[part].mean())
        prior = f"prior {100 * (1 - data):.0f} %"
        if data < _FROM_TABLE:
            words.append(f"{name} from the table ({prior})")
        else:
            words.append(f"{name}: {prior if data < 0.5 else f'data {100 * data:.0f} %'}")
    return ", ".join(words)


@dataclass(frozen=True, eq=False)
class ReadableParameters:
    """Per segment (n, 10): mass, centre of mass and tensor about it in the segment frame.

    ``share`` is the part of the prior's variance that the data removed, 0 to 1.
    """

    values: np.ndarray
    sd: np.ndarray
    share: np.ndarray


def readable(estimate: Estimate, prior: Prior) -> ReadableParameters:
    """Linearised about the estimate for the sd, about the prior for the share.

    The forces show where a centre of mass lies from the model's origin; how far that lies from the
    anatomical one is left, whatever they show.
    """
    bodies = zip(estimate.phi.reshape(-1, 10), prior.origin_in_joint_m, strict=True)
    values = np.array([from_phi(phi).moved(origin).readable() for phi, origin in bodies])
    sd = _sd(readable_jacobians(estimate.phi), estimate.covariance)
    sd[:, 1:4] = np.hypot(sd[:, 1:4], prior.origin_sd_m)
    at_table, before = readable_jacobians(prior.phi), prior.readable_sd
    if estimate.prior_covariance is not None:
        before = _sd(at_table, estimate.prior_covariance)
    left = _sd(at_table, estimate.covariance) / before
    return ReadableParameters(values, sd, np.clip(1.0 - left**2, 0.0, 1.0))


def root_of(covariance: np.ndarray) -> np.ndarray:
    """(P, P) S with covariance S S^T; what rounding has made negative counts as zero."""
    values, axes = np.linalg.eigh(covariance)
    return np.asarray(axes * np.sqrt(np.maximum(values, 0.0)))


def _sd(jacobian: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """(n, 10)"""
    variance = np.sum(jacobian @ covariance * jacobian, axis=1)
    return np.sqrt(np.maximum(variance, 0.0)).reshape(-1, 10)


# --- how rare an identified body is among people: all segments, in the prior's spread -------------


RARE = 0.01  # 1 person in 100


@dataclass(frozen=True, eq=False)
class Rarity:
    """An identified body's squared distance z.z from the table, z being N(0, 1) among people.

    probability : part of people whose identified body would be as far or further. shares : (n,)
    of the distance by segment, their sum is 1; 0 for segments that keep the table's values.
    """

    distance: float
    probability: float
    shares: np.ndarray

    @property
    def is_rare(self) -> bool:
        return self.probability < RARE

    def farthest(self) -> list[int]:
        """The fewest segments that make half of the distance, the largest share first."""
        order = np.argsort(-self.shares)[: np.count_nonzero(self.shares)]
        return order[: int(np.searchsorted(self.shares[order].cumsum(), 0.5)) + 1].tolist()


def rarity_of(prior: Prior, estimate: Estimate) -> Rarity:
    """Of the free segments' parameters.

    An estimate is drawn to the table where the data are silent, so the distance of a true body,
    chi-square with as many degrees as parameters, would let everything pass. The distances of
    identified bodies of people are a sum of chi-squares weighted by what the data decide, taken
    for one with the same mean and variance (Satterthwaite 1946).

    A segment's share is that of the standardised parameters nearest to its own (the corr-max
    transformation, Garthwaite and Koch 2016, Aust. N. Z. J. Stat. 58): with the masses' sum known,
    no segment can be put back alone.
    """
    free = ~prior.fixed_parameters()
    root = prior.root[free]
    sd = np.linalg.norm(root, axis=1)
    vectors, values, _ = np.linalg.svd(root / sd[:, None], full_matrices=False)
    whiten = (vectors / values) @ vectors.T / sd  # to the nearest that are N(0, 1)
    parts = np.zeros(len(free))
    parts[free] = (whiten @ (estimate.phi - prior.phi)[free]) ** 2
    distance = float(parts.sum())
    # a body of people N(0, 1) is estimated as gain times itself, plus the data's errors
    after = whiten @ estimate.covariance[np.ix_(free, free)] @ whiten.T
    gain = np.eye(len(after)) - after
    if estimate.prior_covariance is not None:
        before = whiten @ estimate.prior_covariance[np.ix_(free, free)] @ whiten.T
        gain = np.eye(len(after)) - np.linalg.solve(before, after).T
    spread = gain @ (gain.T + after)  # covariance of the estimates of people
    mean, square = float(np.trace(spread)), float((spread**2).sum())
    probability = float(chi2.sf(distance * mean / square, mean**2 / square)) if mean > 0 else 1.0
    by_segment = parts.reshape(-1, 10).sum(axis=1)
    return Rarity(distance, probability, by_segment / distance if distance else by_segment)
