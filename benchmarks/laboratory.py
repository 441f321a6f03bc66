"""Laboratories of many persons, drawn from a pool of fully simulated ones.

    python -m benchmarks.laboratory POOL [POOL ...] [--labs 100] [--count 8] [--kind 0] [--write]

POOL: results of `bsip laboratory` for simulated persons of one sound laboratory, whose forces come
by the simulator's own route. Persons are drawn from them with replacement, and one fault is added
to what they tell: J theta to the pull; to what they tell in motion alone, where trials of who
stands still are clean. In another kind persons only know as much as those of the pool, and what
they tell is drawn as the model has it, deviations and all. Printed are the errors beside the
Cramer-Rao bound (the persons' deviations and every other number known to be as usual), how often 95
% intervals hold, names that are false in laboratories without a fault, and time and memory of many
persons.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.measure import machine
from bsip_cli.artifacts import read_artifact, read_header
from bsip_cli.config import load_config
from bsip_cli.diagnosis.fault_model import SIZES
from bsip_cli.diagnosis.laboratory import Alike, persons_of, sums_of
from bsip_cli.diagnosis.laboratory_deviations import deviations_of
from bsip_cli.diagnosis.laboratory_search import Laboratory, causes_of, laboratory_of, verdicts_of
from bsip_cli.diagnosis.shared_faults import STATED_MASS, Coordinate, Information
from bsip_cli.stages.known_laboratory import information_in

KIND = "laboratory-information"
FAULTS = (  # of the first plate, [typical sizes]: 10 ms, 20 mm, 1 degree, 4 %
    Coordinate("sync_offset", "", "delay"),
    Coordinate("plate_translation", "1", "x"),
    Coordinate("plate_rotation", "1", "yaw"),
    Coordinate("plate_gain", "1 fz", "gain"),
)
UNITS = {
    "sync_offset": (1000.0, "ms"),
    "plate_translation": (1000.0, "mm"),
    "plate_rotation": (180 / np.pi, "degrees"),
    "plate_gain": (100.0, "%"),
}
SIMULATED, MODEL = "of the simulator", "as the model has them"
CLEAN = "of the simulator, who stands still without the fault"
MANNERS = (SIMULATED, MODEL, CLEAN)
MANY = (10, 100, 1000)
SEED = 20261127
PLACE = Path("docs/results")


class Pool:
    """What the pool's persons tell, and laboratories drawn from it."""

    def __init__(self, outs: Sequence[Path]) -> None:
        paths = [path for out in outs for path in sorted(out.glob(f"sub-*/*_{KIND}.parquet"))]
        facts = [read_header(path, KIND)["provenance"]["facts"] for path in paths]
        self.told = [information_in(read_artifact(path, KIND)) for path in paths]
        self.mass_sd = [one["mass_sd"] for one in facts]
        corners = facts[0]["sessions"][""]["plates"]
        self.centres_m = {plate: np.mean(x, axis=0) for plate, x in corners.items()}
        self.options = load_config([])
        mean_s, sd_s = np.mean([one["sessions"][""]["moments_s"] for one in facts], axis=0).tolist()
        self.alike = Alike(self.options.laboratory.alike, (mean_s, sd_s))

    def laboratory(
        self,
        count: int,
        rng: np.random.Generator,
        sizes: Mapping[Coordinate, float] | None = None,
        manner: str = SIMULATED,
    ) -> Laboratory:
        """Of persons drawn with replacement, with faults of so many typical sizes."""
        drawn = rng.integers(len(self.told), size=count)
        told = [self.told[k] for k in drawn]
        if manner == MODEL:
            common = self._of_all(rng)
            told = [self._as_modelled(one, common, rng) for one in told]
        told = [with_faults(one, sizes or {}, manner == CLEAN) for one in told]
        masses = [self.mass_sd[k] for k in drawn]
        persons = persons_of(told, masses, self.options.laboratory.between_persons, self.alike)
        causes = causes_of(persons, self.centres_m)
        return laboratory_of(persons, causes, self.options.diagnosis.fault_prior_odds)

    def _of_all(self, rng: np.random.Generator) -> dict[Coordinate, float]:
        """What every laboratory has of a fault, and what the model lacks of all alike [typical]."""
        first = persons_of(
            self.told, self.mass_sd, self.options.laboratory.between_persons, self.alike
        )
        number = first.ordinary * rng.standard_normal(len(first.ordinary))
        differences = first.differences(np.ones(first.count))
        alike = first.alike @ rng.standard_normal(first.alike.shape[1])
        sizes = first.both @ number + alike
        sizes += differences @ rng.standard_normal(differences.shape[1])
        return dict(zip(first.coordinates, sizes.tolist(), strict=True))

    def _as_modelled(
        self, told: Information, common: Mapping[Coordinate, float], rng: np.random.Generator
    ) -> Information:
        """What a person who knows as much would tell."""
        between = self.options.laboratory.between_persons
        own: dict[Coordinate, float] = {}
        for one in told.coordinates:
            own.setdefault(replace(one, standing=False), between * rng.standard_normal())
        mass = Coordinate(STATED_MASS.name, "", STATED_MASS.parameter.name)
        own[mass] = rng.standard_normal() * self.mass_sd[0] / STATED_MASS.parameter.typical
        truth = [common[one] + own[replace(one, standing=False)] for one in told.coordinates]
        values, vectors = np.linalg.eigh(told.precision)
        noise = vectors @ (np.sqrt(np.maximum(values, 0)) * rng.standard_normal(len(values)))
        return replace(told, pull=told.precision @ np.array(truth) + noise)

    @property
    def named_from(self) -> float:
        return self.options.diagnosis.named_from


def with_faults(
    told: Information, sizes: Mapping[Coordinate, float], in_motion: bool
) -> Information:
    """The same person over plates or a clock with faults; perhaps in motion alone."""
    of_all = [
        0.0 if in_motion and one.standing else sizes.get(replace(one, standing=False), 0.0)
        for one in told.coordinates
    ]
    return replace(told, pull=told.pull + told.precision @ np.array(of_all))


def errors(
    pool: Pool, count: int, labs: int, manners: Sequence[str]
) -> Iterator[dict[str, object]]:
    """A row for each manner and fault: root mean square of error and bound, and intervals."""
    for manner in manners:
        for fault in FAULTS:
            found = []
            for seed in range(labs):
                rng = np.random.default_rng([SEED, seed, count, FAULTS.index(fault)])
                size = float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(np.log(0.5), np.log(2))))
                lab = pool.laboratory(count, rng, {fault: size}, manner)
                others = sum(lab.causes[k].effect != fault.effect for k in lab.found)
                found.append((*judged(lab, fault, size, pool.named_from, rng), others))
            off, bound, inside, others = np.array(found).T
            error, limit = (float(np.sqrt((x**2).mean())) for x in (off, bound))
            factor, unit = UNITS[fault.effect]
            typical = factor * next(p.typical for c, p in parameters(lab) if c == fault)
            yield {
                "persons": manner,
                "count": count,
                "fault": f"{fault.effect} {fault.target} {fault.parameter}".replace("  ", " "),
                "unit": unit,
                "error": round(error * typical, 3),
                "Cramer-Rao bound": round(limit * typical, 3),
                "ratio": round(error / limit, 2),
                "95 % intervals that hold, %": round(100 * inside.mean(), 1),
                "laboratories": labs,
                "other faults found": int(others.sum()),
            }


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
    usual = np.ones(lab.persons.count)
    sums = sums_of(lab.persons, usual)
    alone = replace(lab, found={}, scale=usual, sums=sums)
    _, covariance = alone.posterior().offset(sums, cause.directions).of_size(SIZES[1])
    inside = one.low <= size * typical <= one.high
    return one.value / typical - size, float(np.sqrt(covariance[number, number])), inside


def false_names(pool: Pool, labs: int, manners: Sequence[str]) -> Iterator[dict[str, object]]:
    """Names of faults, and of sessions that deviate, in laboratories without a fault."""
    for manner in manners:
        faults, sessions = [], []
        for seed in range(labs):
            rng = np.random.default_rng([SEED, seed, 4711])
            lab = pool.laboratory(8, rng, manner=manner)
            odds, named_from = pool.options.diagnosis.fault_prior_odds, pool.named_from
            said = verdicts_of(lab, named_from, rng)
            faults += [f"{x.cause.effect} {x.cause.target}" for x in said if x.said == "named"]
            deviating = deviations_of(lab, odds, named_from, [], rng)
            sessions += [f"{x.cause.effect} {x.cause.target}" for x in deviating]
        yield {
            "persons": manner,
            "laboratories of 8": labs,
            "faults named": len(faults),
            "sessions named": len(sessions),
            "which": "; ".join(faults + sessions),
        }


def cost(pool: Pool, count: int) -> dict[str, object]:
    """CPU-seconds, milliseconds per person, memory that the fit takes beyond what was there."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    start, rng = time.process_time(), np.random.default_rng(1)
    lab = pool.laboratory(count, rng)
    verdicts_of(lab, pool.named_from, rng)
    deviations_of(lab, pool.options.diagnosis.fault_prior_odds, pool.named_from, [], rng)
    took = time.process_time() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {
        "persons": count,
        "CPU s": round(took, 1),
        "ms per person": round(1000 * took / count),
        "MB more": round(peak - before),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pool", type=Path, nargs="+")
    parser.add_argument("--labs", type=int, default=100, help="per fault and kind")
    parser.add_argument("--count", type=int, help="persons in each; without it cost and nulls")
    parser.add_argument(
        "--kind", type=int, choices=range(len(MANNERS)), help="of MANNERS; else all"
    )
    parser.add_argument("--write", action="store_true", help="into docs/results")
    asked = parser.parse_args()
    pool = Pool(asked.pool)
    print(f"{machine()}; {len(pool.told)} persons in the pool", flush=True)
    manners = MANNERS if asked.kind is None else (MANNERS[asked.kind],)
    tables: dict[str, Iterable[dict[str, object]]] = (
        {f"laboratory_of_{asked.count}": errors(pool, asked.count, asked.labs, manners)}
        if asked.count
        else {
            "laboratory_nulls": false_names(pool, 40, manners),
            "laboratory_cost": (cost(pool, count) for count in MANY),
        }
    )
    for name, rows in tables.items():
        found = []
        for row in rows:
            found.append(row)
            print(*row.values(), sep=", ", flush=True)
        if asked.write:
            pd.DataFrame(found).to_csv(PLACE / f"{name}.csv", index=False)


if __name__ == "__main__":
    main()
