"""Identification problems whose truth is known: a moving person with other inertias than RM."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pinocchio as pin

from bsip_cli.body.anthropometry import regress
from bsip_cli.body.inertia import Inertia
from bsip_cli.body.person import Person
from bsip_cli.dynamics.base_parameters import Basis, find_basis
from bsip_cli.dynamics.ground_wrench import pinocchio_model, predicted_wrench, wrench_regressor
from bsip_cli.identification.prior import Prior, Spread, prior_of
from bsip_cli.identification.problem import NormalEquations, Problem, Recording, even_noise
from tests.body.standing_person import Swing, standing

MASS_KG = 72.0
RATE_HZ = 100.0
SPREAD = Spread(
    mass_sd_percent=20.0,
    com_sd_percent=6.0,
    midline_sd_m=1.0,
    inertia_sd_percent=30.0,
    left_right_correlation=0.0,
    total_mass_sd_percent=3.0,
)


@dataclass(frozen=True)
class World:
    """A person, its RM as prior, and the parameters (150,) that are true."""

    person: Person
    model: pin.Model
    basis: Basis
    prior: Prior
    phi_true: np.ndarray


@cache
def world() -> World:
    person = standing().person
    model = pinocchio_model(person)
    prior = prior_of(regress(person, "M", MASS_KG).inertias, person, SPREAD)
    return World(person, model, find_basis(model), prior, _other_body(prior, person))


def _other_body(prior: Prior, person: Person) -> np.ndarray:
    """Every segment physical, within about one standard deviation of RM."""
    rng = np.random.default_rng(11)
    rows = []
    for inertia, origin, length in zip(
        prior.inertias, prior.origin_in_joint_m, person.lengths_m, strict=True
    ):
        mass = inertia.mass_kg * np.exp(rng.normal(0, 0.15))
        com = inertia.com_m + rng.normal(0, 0.04, 3) * length
        scale = mass / inertia.mass_kg * np.exp(rng.normal(0, 0.15))
        rows.append(Inertia(mass, com, scale * inertia.tensor_kgm2).moved(-origin).phi())
    return np.concatenate(rows)


@cache
def motion(duration_s: float, seed: int = 1, amplitude: float = 0.8) -> tuple[np.ndarray, ...]:
    """q, v, a of a lively motion that excites everything."""
    swing = Swing(world().model, standing().q, seed, amplitude, frequencies_hz=(0.3, 0.8, 1.4, 2.1))
    return swing.sampled(duration_s, RATE_HZ)[1:]


def recording(duration_s: float, seed: int = 1, phi: np.ndarray | None = None) -> Recording:
    """A trial whose wrench follows exactly from the motion and the true parameters."""
    q, v, a = motion(duration_s, seed)
    phi = world().phi_true if phi is None else phi
    wrench = predicted_wrench(world().model, q, v, a, phi[:, None], np.zeros(3))[..., 0]
    return Recording(q, v, a, wrench, np.ones(len(q), dtype=bool), RATE_HZ, np.ones(len(q)))


@cache
def regressor(duration_s: float = 20.0, seed: int = 1, stride: int = 4) -> np.ndarray:
    """(n, 6, 150) rows of independent samples, unfiltered."""
    q, v, a = (x[::stride] for x in motion(duration_s, seed))
    return wrench_regressor(world().model, q, v, a, np.zeros(3))


def equations_of(rows: np.ndarray, measured: np.ndarray) -> NormalEquations:
    """Dense sums, to be compared with or used in place of those accumulated in blocks."""
    return NormalEquations(
        np.einsum("nci,ncj->cij", rows, rows, optimize=True),
        np.einsum("nci,nc->ci", rows, measured),
        (measured**2).sum(axis=0),
        len(rows),
        len(rows) / RATE_HZ,
    )


def remeasured(
    equations: NormalEquations, rows: np.ndarray, measured: np.ndarray
) -> NormalEquations:
    """The same motion with another measured wrench (n, 6)."""
    right = np.stack([rows[:, c].T @ measured[:, c] for c in range(6)])
    return replace(equations, right=right, squares=(measured**2).sum(axis=0))


def problem_of(
    rows: np.ndarray,
    measured: np.ndarray,
    noise_rms: np.ndarray | float,
    trust_ratio: float = 1.0,
) -> Problem:
    count = len(rows)
    noise = even_noise(np.broadcast_to(noise_rms, 6).astype(float), count)
    equations = equations_of(rows, measured)
    return Problem(equations, noise, world().prior, world().basis, trust_ratio)


def noisy_problem(
    rows: np.ndarray,
    noise: np.ndarray | float,
    seed: int,
    phi: np.ndarray | None = None,
    trust_ratio: float = 1.0,
) -> Problem:
    """The wrench of the true parameters, or of ``phi``, with white noise of a known size."""
    clean = rows @ (world().phi_true if phi is None else phi)
    measured = clean + np.random.default_rng(seed).normal(0, noise, clean.shape)
    return problem_of(rows, measured, noise, trust_ratio)


def standing_still(samples: int) -> np.ndarray:
    """(n, 6, 150) rows of a person who does not move for a while."""
    q, v, a = motion(30.0)
    model = world().model
    still = wrench_regressor(model, q[:1], 0 * v[:1], 0 * a[:1], np.zeros(3))
    return np.repeat(still, samples, axis=0)


def without_segment(segment: str) -> np.ndarray:
    """(n, 6, 150) rows of a motion in which a segment weighs nothing."""
    rows, i = regressor().copy(), 10 * world().person.skeleton.index(segment)
    rows[..., i : i + 10] = 0.0
    return rows


def distance(phi: np.ndarray) -> np.ndarray:
    """(150,) from RM, in standard deviations of people."""
    return np.linalg.solve(world().prior.root, phi - world().prior.phi)
