"""Laboratories of many persons, drawn from a pool of fully simulated ones.

    python -m benchmarks.laboratory POOL [--labs 100]

POOL: results of `bsip laboratory` for simulated persons of one sound laboratory, whose forces come
by the simulator's own route. Persons are drawn from it with replacement, and one fault is added to
what they tell: J theta to the pull. Printed are the errors beside the Cramer-Rao bound (deviations
between persons known), how often 95 % intervals hold, names that are false in laboratories without
a fault, and time and memory of hundreds of persons.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.measure import machine, markdown
from bsip_cli.artifacts import read_artifact, read_header
from bsip_cli.config import load_config
from bsip_cli.diagnosis.fault_model import SIZES
from bsip_cli.diagnosis.laboratory import Lag, persons_of
from bsip_cli.diagnosis.laboratory_deviations import deviations_of
from bsip_cli.diagnosis.laboratory_search import Laboratory, causes_of, laboratory_of, verdicts_of
from bsip_cli.diagnosis.shared_faults import Coordinate, Information
from bsip_cli.stages.shared_faults import information_in

KIND = "laboratory-information"
FAULTS = (  # of the first plate, [typical sizes]: 10 ms, 20 mm, 1 degree, 4 %
    Coordinate("sync_offset", "", "delay"),
    Coordinate("plate_translation", "1", "x"),
    Coordinate("plate_rotation", "1", "yaw"),
    Coordinate("plate_gain", "1 fz", "gain"),
)
COUNTS = (4, 8, 16, 64)
MANY = (10, 100, 300)


class Pool:
    """What the pool's persons tell, and laboratories drawn from it."""

    def __init__(self, out: Path) -> None:
        paths = sorted(out.glob(f"sub-*/*_{KIND}.parquet"))
        facts = [read_header(path, KIND)["provenance"]["facts"] for path in paths]
        self.told = [information_in(read_artifact(path, KIND)) for path in paths]
        self.mass_sd = [one["mass_sd"] for one in facts]
        corners = facts[0]["sessions"][""]["plates"]
        self.centres_m = {plate: np.mean(x, axis=0) for plate, x in corners.items()}
        self.options = load_config([])
        mean_s, sd_s = np.mean([one["sessions"][""]["moments_s"] for one in facts], axis=0).tolist()
        self.lag = Lag(0.001 * self.options.laboratory.tissue_lag_ms, (mean_s, sd_s))

    def laboratory(
        self, count: int, fault: Coordinate | None, size: float, rng: np.random.Generator
    ) -> Laboratory:
        """Of persons drawn with replacement, with a fault of so many typical sizes."""
        drawn = rng.integers(len(self.told), size=count)
        told = [with_fault(self.told[k], fault, size) for k in drawn]
        mine = self.options.laboratory
        masses = [self.mass_sd[k] for k in drawn]
        persons = persons_of(told, masses, mine.between_persons, self.lag)
        causes = causes_of(persons, self.centres_m)
        return laboratory_of(persons, causes, self.options.diagnosis.fault_prior_odds)

    @property
    def named_from(self) -> float:
        return self.options.diagnosis.named_from


def with_fault(told: Information, fault: Coordinate | None, size: float) -> Information:
    """The same person over plates or a clock with a fault."""
    if fault is None or fault not in told.coordinates:
        return told
    column = told.precision[:, told.coordinates.index(fault)]
    return replace(told, pull=told.pull + size * column)


def errors(pool: Pool, labs: int) -> Iterator[Sequence[object]]:
    """Rows: fault, persons, root mean square of error and bound, ratio, share of intervals."""
    for fault in FAULTS:
        for count in COUNTS:
            found = []
            for seed in range(labs):
                rng = np.random.default_rng([seed, count, FAULTS.index(fault)])
                size = float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(np.log(0.5), np.log(2))))
                lab = pool.laboratory(count, fault, size, rng)
                found.append(judged(lab, fault, size, pool.named_from, rng))
            off, bound, inside = np.array(found).T
            error, limit = (float(np.sqrt((x**2).mean())) for x in (off, bound))
            typical = next(p.typical for c, p in parameters(lab) if c == fault)
            yield (
                f"{fault.effect} {fault.target} {fault.parameter}",
                count,
                f"{error * typical:.5f}",
                f"{limit * typical:.5f}",
                f"{error / limit:.2f}",
                f"{100 * inside.mean():.0f} %",
            )


def parameters(lab: Laboratory) -> Iterator[tuple]:
    return zip(lab.persons.coordinates, lab.persons.parameters, strict=True)


def judged(
    lab: Laboratory, fault: Coordinate, size: float, named_from: float, rng: np.random.Generator
) -> tuple[float, float, bool]:
    """Error and bound [typical], and whether the interval holds."""
    keys = [(one.effect, one.target) for one in lab.causes]
    k = keys.index((fault.effect, fault.target))
    cause = lab.causes[k]
    number = [one.name for one in cause.parameters].index(fault.parameter)
    typical = cause.parameters[number].typical
    one = lab.sizes(k, named_from, rng)[number]
    _, covariance = lab.posterior(k).offset(lab.sums, cause.directions).of_size(SIZES[1])
    inside = one.low <= size * typical <= one.high
    return one.value / typical - size, float(np.sqrt(covariance[number, number])), inside


def false_names(pool: Pool, labs: int) -> tuple[int, int]:
    """Names of faults, and of sessions that deviate, in laboratories of the pool as it is."""
    faults = sessions = 0
    for seed in range(labs):
        rng = np.random.default_rng([seed, 4711])
        lab = pool.laboratory(8, None, 0.0, rng)
        odds, named_from = pool.options.diagnosis.fault_prior_odds, pool.named_from
        faults += len(lab.found)
        sessions += len(deviations_of(lab, odds, named_from, [], rng))
    return faults, sessions


def cost(pool: Pool) -> Iterator[Sequence[object]]:
    """Rows: persons, CPU-seconds, milliseconds per person, peak memory of the process."""
    for count in MANY:
        start, rng = time.process_time(), np.random.default_rng(1)
        lab = pool.laboratory(count, None, 0.0, rng)
        verdicts_of(lab, pool.named_from, rng)
        deviations_of(lab, pool.options.diagnosis.fault_prior_odds, pool.named_from, [], rng)
        took = time.process_time() - start
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        yield count, f"{took:.1f}", f"{1000 * took / count:.0f}", f"{peak:.0f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pool", type=Path)
    parser.add_argument("--labs", type=int, default=100)
    asked = parser.parse_args()
    pool = Pool(asked.pool)
    print(f"{machine()}\n\n{len(pool.told)} persons in the pool\n")
    print(markdown(("persons", "CPU s", "ms each", "peak MB"), list(cost(pool))), flush=True)
    faults, sessions = false_names(pool, 40)
    print(f"\n40 laboratories of 8 without a fault: {faults} faults named, {sessions} sessions\n")
    head = ("fault", "persons", "error", "bound", "ratio", "95 % intervals that hold")
    print(markdown(head, list(errors(pool, asked.labs))))


if __name__ == "__main__":
    main()
