"""What is known of a person before the data: the table's values and how far people stray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from bsip_cli.body.inertia import Inertia, readable_jacobians, rod_length_m
from bsip_cli.body.person import Person
from bsip_cli.segments import mirrored

# How the readable parameters of a left segment go with the right one's: Z points to the right on
# both sides of the body.
_MIRROR = np.array([1.0, 1, 1, -1, 1, 1, 1, 1, -1, -1])
_CENTRE = slice(1, 4)
_SIDEWAYS = 3  # the coordinate that points to the side
# What the table itself may miss: the trunk of 2007 has its centre 19 mm further back than that of
# 2015 (Dumas 2015), and its long axis tilted by 40 degrees more, which is a product of inertia.
_EDITIONS_APART_M = {"upper_torso": 0.019}
_FORWARDS, _TILT = 1, 7  # of the readable parameters: com x, ixy


@dataclass(frozen=True, eq=False)
class Spread:
    """How people stray from the table: one number, or one per segment with mass.

    mass_sd_percent, inertia_sd_percent : scalars or (n,): of the mass; of the moments of a segment
        of known mass.
    com_sd_percent : scalar or (n, 3), segment axes: of the length of the rod that has the
        segment's mass and mean moment of inertia.
    other_table_percent : (n, 2), by how much mass and centre of mass along Y differ in another
        table, in the same units.
    midline_sd_m, left_right_correlation, total_mass_sd_percent, origin_sd_m, other_table_sd : as
        in configs/default.toml.
    """

    mass_sd_percent: float | np.ndarray
    com_sd_percent: float | np.ndarray
    midline_sd_m: float
    inertia_sd_percent: float | np.ndarray
    left_right_correlation: float
    total_mass_sd_percent: float
    origin_sd_m: float = 0.0
    other_table_sd: float = 0.0
    other_table_percent: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Prior:
    """Mean and covariance of the inertial parameters before the data.

    inertias : of the n segments with mass, in the segment frame.
    origin_in_joint_m : (n, 3) segment origin seen from the joint; parallel frames.
    phi : (10 n,) mean, about the joint centres (Pinocchio's order).
    root : (10 n, 10 n) S with covariance S S^T.
    readable_sd : (n, 10) the same spread for mass, centre of mass and tensor.
    white : (10 n, 10 n) turns changes of phi into independent ones of variance 1, before the sum of
        masses is known: ten per segment, in the order of :meth:`Inertia.readable`.
    pairs : the segments whose parameters go together: both sides, or one of the midline.
    fixed : (n,) segments that keep the table's values, as those do whose motion no markers show;
        the scale says about the others.
    origin_sd_m : how far the segments' origins lie off the anatomical ones, in each direction: part
        of ``root``, since the model's body is seen from there, and of what people read.
    """

    inertias: tuple[Inertia, ...]
    origin_in_joint_m: np.ndarray
    phi: np.ndarray
    root: np.ndarray
    readable_sd: np.ndarray
    white: np.ndarray
    pairs: tuple[tuple[int, ...], ...]
    total_mass_sd_kg: float
    fixed: np.ndarray
    origin_sd_m: float = 0.0

    def fixed_parameters(self) -> np.ndarray:
        """(10 n,) which parameters keep the table's values."""
        return np.repeat(self.fixed, 10)


def prior_of(
    inertias: tuple[Inertia, ...],
    person: Person,
    spread: Spread,
    fixed: np.ndarray | None = None,
) -> Prior:
    """Build the prior: left and right alike, trunk and head not lopsided, a tensor as heavy as its
    segment, and the free masses' sum as the scale says.

    fixed : (n,) segments that keep the table's values; by default those whose motion is unknown.
    """
    bodies, names = list(person.skeleton.bodies), person.skeleton.body_names
    origins = person.origin_in_joint_m[bodies]
    fixed = person.without_data()[bodies] if fixed is None else fixed
    phi = np.concatenate([i.moved(-o).phi() for i, o in zip(inertias, origins, strict=True)])
    pairs = _pairs(names, fixed)
    own, alike = _own_spread(inertias, spread, names)
    readable = readable_jacobians(phi)
    # root of the correlation of all: a twin's is the mirrored one's, in what both sides share
    together, rows = np.eye(len(phi)), np.arange(10)
    for first, second in (10 * np.array(pair)[:, None] + rows for pair in pairs if len(pair) == 2):
        shared = spread.left_right_correlation * alike[first] * alike[second]
        together[second, first] = shared * _MIRROR
        together[second, second] = np.sqrt(1 - shared**2)
    spread_root = np.linalg.solve(readable, own @ together)
    if spread.other_table_percent is not None:
        towards = spread.other_table_sd * _towards(inertias, spread.other_table_percent).ravel()
        spread_root = _widened(spread_root, np.linalg.solve(readable, towards))
    total_mass_sd_kg = spread.total_mass_sd_percent / 100 * float(phi[::10].sum())
    # once the sum of the free masses is known to that
    total = spread_root[::10][~fixed].sum(axis=0)
    variance = total @ total
    shrink = 1.0 - total_mass_sd_kg / np.sqrt(variance + total_mass_sd_kg**2)
    root = spread_root - shrink * np.outer(spread_root @ total, total) / variance
    readable_sd = np.linalg.norm(readable @ root, axis=1).reshape(-1, 10)
    white = np.linalg.inv(spread_root)
    known = (total_mass_sd_kg, fixed, spread.origin_sd_m)
    return Prior(inertias, origins, phi, root, readable_sd, white, pairs, *known)


def likeliest(prior: Prior, information: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(P,) parameters of the largest posterior density, everything Gaussian.

    ``information`` (P, P) and ``right`` (P,) of the weighted normal equations.
    """
    scaled = prior.root.T @ information @ prior.root + np.eye(len(prior.phi))
    slope = prior.root.T @ (right - information @ prior.phi)
    return prior.phi + prior.root @ np.linalg.solve(scaled, slope)


def _towards(inertias: tuple[Inertia, ...], other_percent: np.ndarray) -> np.ndarray:
    """(n, 10) readable parameters of the other table less those of this one; a heavier segment has
    the heavier tensor too."""
    found = np.zeros((len(inertias), 10))
    for row, inertia, (mass, along) in zip(found, inertias, other_percent / 100, strict=True):
        row[0], row[2] = mass * inertia.mass_kg, along * rod_length_m(inertia)
        row[4:] = mass * inertia.readable()[4:]
    return found


def _widened(root: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(P, P) root of the covariance root root' + direction direction', near to ``root``."""
    u = np.linalg.solve(root, direction)
    squared = u @ u
    return root + (np.sqrt(1 + squared) - 1) / max(squared, 1e-300) * np.outer(root @ u, u)


def _pairs(names: tuple[str, ...], fixed: np.ndarray) -> tuple[tuple[int, ...], ...]:
    """Both sides of a limb where both are free; every other segment alone."""
    pairs: list[tuple[int, ...]] = []
    for i, name in enumerate(names):
        twin = names.index(mirrored(name)) if mirrored(name) in names else i
        if twin == i or fixed[i] or fixed[twin]:
            pairs.append((i,))
        elif i < twin:
            pairs.append((i, twin))
    return tuple(pairs)


def _own_spread(
    inertias: tuple[Inertia, ...], spread: Spread, names: tuple[str, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """(10 n, 10 n) readable parameters of independent changes: a heavier segment has the heavier
    tensor too. And the part (10 n,) of each standard deviation that both sides of a body share:
    people's, not that of the two origins."""
    mass, moments = (
        np.broadcast_to(percent, len(names))[:, None] / 100
        for percent in (spread.mass_sd_percent, spread.inertia_sd_percent)
    )
    table = np.array([inertia.readable() for inertia in inertias])
    rods = np.array([rod_length_m(inertia) for inertia in inertias])
    own = table[:, 4:7]
    products = np.sqrt(own[:, [0, 0, 1]] * own[:, [1, 2, 2]])
    centres = np.broadcast_to(spread.com_sd_percent, (len(names), 3)) / 100 * rods[:, None]
    sd = np.hstack([mass * table[:, :1], centres, moments * own, 0.5 * moments * products])
    for i, name in enumerate(names):
        if mirrored(name) == name:
            sd[i, _SIDEWAYS] = min(sd[i, _SIDEWAYS], spread.midline_sd_m)
        if name in _EDITIONS_APART_M:
            sd[i, _FORWARDS] = np.hypot(sd[i, _FORWARDS], _EDITIONS_APART_M[name])
            sd[i, _TILT] = np.hypot(sd[i, _TILT], table[i, _TILT])
    people = sd.copy()
    sd[:, _CENTRE] = np.hypot(sd[:, _CENTRE], spread.origin_sd_m)
    blocks = sd[:, :, None] * np.eye(10)
    blocks[:, 4:, 0] = mass * table[:, 4:]
    return block_diag(*blocks), (people / sd).ravel()
