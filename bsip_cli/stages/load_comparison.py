"""What a person's parameters gain by a declared load: recordings with it against those without."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.body.inertia import PARAMETERS, UNITS, from_phi, readable_jacobian
from bsip_cli.body.person import Person
from bsip_cli.errors import BadDataError
from bsip_cli.identification.difference import change_of_segments, difference
from bsip_cli.identification.estimator import Problem
from bsip_cli.identification.prior import Prior
from bsip_cli.report.words import listing, segment_label
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import column_names
from bsip_cli.stages.frames import load_phi, person_of
from bsip_cli.stages.identification_problem import (
    duration_s,
    estimate_by,
    prior_from,
    problem_of,
    recordings_of,
)
from bsip_cli.study.study import Trial

TWO, LOADED, ALL = "two identifications", "loaded segments", "all"
_SHORTEST_S = 0.5
_Z95 = 1.96
_Row = tuple[str, str, str, str, float, float, float, float, float]


def compared(unit: Unit, loads_off: Unit, sets: tuple[Sequence[Trial], Sequence[Trial]]) -> None:
    """Identify from the trials with and from those without, and write the table.

    ``loads_off``: the same unit without the declared loads, which stay in the forces.
    """
    person = person_of(unit)
    skeleton = person.skeleton
    declared = load_phi(unit, person, sets[0][0]) - load_phi(unit, person, sets[1][0])
    bodies = [k for k, own in enumerate(declared.reshape(-1, 10)) if own.any()]
    loaded = [skeleton.bodies[k] for k in bodies]
    unseen = [i for i in loaded if person.without_data()[i]]
    if unseen:
        raise BadDataError(
            f"a load lies on {_names(person, unseen)}, whose motion no markers show",
            file=unit.name,
            expected="a load on a segment with markers",
            remedy="record with markers there, or put the load on another segment",
        )
    prior = prior_from(unit, unit.read("regression"), person)
    heavy, plain = (_problem(loads_off, person, prior, trials) for trials in sets)
    estimator = unit.config.identify.estimators[0]
    a, b = (estimate_by(estimator, problem) for problem in (plain, heavy))
    change = difference(a, b, prior.root @ prior.root.T)
    one = _Block(TWO, change.phi, change.covariance, declared, change.resolution @ declared)
    rows = [one.total(), *one.rows(skeleton.body_names)]
    if any(skeleton.parents[i] in loaded for i in loaded):
        unit.warn(
            f"{unit.name}: loads on {_names(person, loaded)}, of which a joint connects some: the "
            "forces do not show how these share the mass, so there is only the difference of two "
            "identifications"
        )
    else:
        part = (10 * np.array(bodies)[:, None] + np.arange(10)).ravel()
        own = change_of_segments(plain, heavy, bodies)
        both = _Block(LOADED, own.phi, own.covariance, declared[part], declared[part])
        names = [skeleton.segments[i] for i in loaded]
        rows += [*both.rows(names), *both.centres(names, person.origin_in_joint_m[loaded])]
    stems = ([trial.stem for trial in trials] for trials in sets)
    facts: dict = dict(zip(("with", "without"), stems, strict=True)) | {"estimator": estimator}
    table = pd.DataFrame(rows, columns=column_names("load-comparison"))
    unit.write("load-comparison", table, facts)


def _names(person: Person, segments: Sequence[int]) -> str:
    return listing([f"the {segment_label(person.skeleton.segments[i])}" for i in segments])


def _problem(unit: Unit, person: Person, prior: Prior, trials: Sequence[Trial]) -> Problem:
    recordings, _ = recordings_of(unit, person, trials)
    seconds = duration_s(recordings)
    if seconds < _SHORTEST_S:
        raise BadDataError(
            f"{listing([trial.stem for trial in trials])}: {seconds:.2f} s of motion with every "
            "contact on a plate",
            file=unit.name,
            expected=f"at least {_SHORTEST_S:g} s",
            remedy="name other trials with --with and --without",
        )
    problem, _ = problem_of(unit, person, prior, recordings)
    return problem


@dataclass(frozen=True, eq=False)
class _Block:
    """Changes (10 k,) of k segments with covariance, beside what is declared and to be expected."""

    analysis: str
    phi: np.ndarray
    covariance: np.ndarray
    declared: np.ndarray
    expected: np.ndarray

    def rows(self, segments: Sequence[str]) -> Iterator[_Row]:
        """Ten of each segment."""
        half = _Z95 * np.sqrt(np.diag(self.covariance))
        for k, value in enumerate(self.phi):
            unit, quantity = UNITS[k % 10], PARAMETERS[k % 10]
            interval = (value, value - half[k], value + half[k])
            known = (self.declared[k], self.expected[k])
            yield self.analysis, segments[k // 10], quantity, unit, *interval, *known

    def total(self) -> _Row:
        """The masses' sum."""
        value = float(self.phi[::10].sum())
        half = _Z95 * float(np.sqrt(self.covariance[::10, ::10].sum()))
        known = (float(self.declared[::10].sum()), float(self.expected[::10].sum()))
        return self.analysis, ALL, "m", "kg", value, value - half, value + half, *known

    def centres(self, segments: Sequence[str], origins_m: np.ndarray) -> Iterator[_Row]:
        """Three of each segment; none of one whose mass may be zero (95 %), which has no centre."""
        for k, segment in enumerate(segments):
            own = slice(10 * k, 10 * k + 10)
            phi, covariance, declared = self.phi[own], self.covariance[own, own], self.declared[own]
            if abs(phi[0]) <= _Z95 * np.sqrt(covariance[0, 0]) or declared[0] == 0:
                continue
            jacobian = readable_jacobian(phi)[1:4]
            half = _Z95 * np.sqrt(np.diag(jacobian @ covariance @ jacobian.T))
            found, known = (from_phi(x).com_m - origins_m[k] for x in (phi, declared))
            for j, quantity in enumerate(("cx", "cy", "cz")):
                interval = (found[j], found[j] - half[j], found[j] + half[j])
                yield self.analysis, segment, quantity, "m", *interval, known[j], known[j]
