"""Laboratories of many persons, drawn from a pool of fully simulated ones.

    python -m benchmarks.laboratory POOL [POOL ...] [--table drawn] [--count 4 8] [--write]

POOL: results of `bsip laboratory` for simulated persons of one sound laboratory, whose forces come
by the simulator's own route, such as

    bsip simulate study --participants 64 --seed 90210 --task static --task walking \\
        --soft-tissue measured
    bsip simulate more --participants 64 --seed 90210 --run 2 --task walking --soft-tissue measured
    cp -r more/sub-* study; bsip run study --out POOL --until laboratory

Persons are drawn from them with replacement, and one fault is added to what they tell: J theta to
the pull; to what they tell in motion alone, where trials of who stands still are clean. In another
kind persons only know as much as those of the pool, and what they tell is drawn as the model has
it, deviations and all. Tables: ``drawn``, the errors beside the Cramer-Rao bound (the persons'
deviations and every other number known to be as usual) and how often 95 % intervals hold;
``nulls``, names that are false in laboratories without a fault; ``alike``, how far all persons of
the pool err alike in each direction; ``cost``, time and memory of the files of many persons.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.measure import machine
from bsip_cli.artifacts import read_artifact, read_header
from bsip_cli.config import load_config
from bsip_cli.diagnosis.laboratory import (
    Persons,
    alike_in,
    persons_of,
    posterior_of,
    scales_of,
    sums_of,
)
from bsip_cli.diagnosis.laboratory_search import (
    Laboratory,
    causes_of,
    deviations_of,
    laboratory_of,
    verdicts_of,
)
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
COUNTS = (4, 8, 16, 64)
MANY = (100, 300, 1000)
SEED = 20261127
PLACE = Path("docs/results")


class Pool:
    """What the pool's persons tell, and laboratories drawn from it."""

    def __init__(self, paths: Sequence[Path]) -> None:
        of_all = {path: read_header(path, KIND)["provenance"]["facts"] for path in paths}
        paths = [path for path, one in of_all.items() if one["sessions"]]  # some show nothing
        facts = [of_all[path] for path in paths]
        self.told = [information_in(read_artifact(path, KIND)) for path in paths]
        self.mass_sd = [one["mass_sd"] for one in facts]
        corners = facts[0]["sessions"][""]["plates"]
        self.centres_m = {plate: np.mean(x, axis=0) for plate, x in corners.items()}
        self.options = load_config([])
        mean_s, sd_s = np.mean([one["sessions"][""]["moments_s"] for one in facts], axis=0).tolist()
        self.moments_s = (mean_s, sd_s)

    def laboratory(
        self,
        count: int,
        rng: np.random.Generator,
        sizes: Mapping[Coordinate, float] | None = None,
        manner: str = SIMULATED,
    ) -> Laboratory:
        """Of persons drawn with replacement, with faults of so many typical sizes."""
        drawn = rng.integers(len(self.told), size=count)
        return self.of(drawn.tolist(), rng, sizes, manner)

    def of(
        self,
        drawn: Sequence[int],
        rng: np.random.Generator,
        sizes: Mapping[Coordinate, float] | None = None,
        manner: str = SIMULATED,
    ) -> Laboratory:
        """Of these persons."""
        told = [self.told[k] for k in drawn]
        if manner == MODEL:
            common = self._of_all(rng)
            told = [self._as_modelled(one, common, rng) for one in told]
        told = [with_faults(one, sizes or {}, manner == CLEAN) for one in told]
        masses = [self.mass_sd[k] for k in drawn]
        persons = self.persons(told, masses)
        causes = causes_of(persons, self.centres_m)
        return laboratory_of(persons, causes, self.options.diagnosis.fault_prior_odds)

    def persons(self, told: Sequence[Information], mass_sd: Sequence[float]) -> Persons:
        options = self.options.laboratory
        between, alike = options.between_persons, options.alike
        return persons_of(told, mass_sd, between, alike, self.moments_s)

    def _of_all(self, rng: np.random.Generator) -> dict[Coordinate, float]:
        """What every laboratory has of a fault, and what the model lacks of all alike [typical]."""
        first = self.persons(self.told, self.mass_sd)
        number = first.ordinary * rng.standard_normal(len(first.ordinary))
        differences = first.differences(np.ones(first.count))
        root = alike_in(first)
        alike = root @ rng.standard_normal(root.shape[1])
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
    sizes = lab.sizes(k, named_from, rng)
    if lab.found.keys() - {k}:  # perhaps in its place: then the size is that without the other
        said = verdicts_of(lab, named_from, rng)
        sizes = next(one.sizes for one in said if one.cause is cause)
    one = sizes[number]
    usual = np.ones(lab.persons.count)
    sums = sums_of(lab.persons, usual)
    alone = replace(lab, found={}, scale=usual, sums=sums)
    covariance = alone.posterior().offset(sums, cause.directions).covariance
    inside = one.low <= size * typical <= one.high
    return one.value / typical - size, float(np.sqrt(covariance[number, number])), inside


def false_names(
    pool: Pool, count: int, labs: int, manners: Sequence[str]
) -> Iterator[dict[str, object]]:
    """Names of faults, and of sessions that deviate, in laboratories without a fault."""
    for manner in manners:
        faults, sessions = [], []
        for seed in range(labs):
            rng = np.random.default_rng([SEED, seed, count, len(FAULTS)])
            lab = pool.laboratory(count, rng, manner=manner)
            odds, named_from = pool.options.diagnosis.fault_prior_odds, pool.named_from
            said = verdicts_of(lab, named_from, rng)
            faults += [f"{x.cause.effect} {x.cause.target}" for x in said if x.said == "named"]
            deviating = deviations_of(lab, odds, named_from, [], rng)
            sessions += [f"{x.cause.effect} {x.cause.target}" for x in deviating]
        yield {
            "persons": manner,
            "count": count,
            "laboratories": labs,
            "faults named": len(faults),
            "sessions named": len(sessions),
            "which": "; ".join(f"{n} {name}" for name, n in Counter(faults + sessions).items()),
        }


def errors_alike(pool: Pool) -> Iterator[dict[str, object]]:
    """Of each direction of the numbers in motion, the best known first: what all persons of a sound
    laboratory err by, every fault being free, and what part it is of what one person errs by."""
    persons = pool.persons(pool.told, pool.mass_sd)
    scale = scales_of(persons)
    one = (alike_in(persons) / np.sqrt(persons.alike))[:, :-1]  # the last is a lag that grows
    sizes = np.linalg.norm(one, axis=0)
    ordinary, free = persons.both * persons.ordinary, 10 * one
    root = np.hstack([ordinary, persons.differences(scale), free])
    mean = posterior_of(sums_of(persons, scale), root).mean
    for k in np.argsort(sizes):
        most = persons.coordinates[int(np.argmax(np.abs(one[:, k])))]
        error = float(one[:, k] @ mean / sizes[k])
        yield {
            "mostly": f"{most.effect} {most.target} {most.parameter}".replace("  ", " "),
            "one person [typical]": round(float(sizes[k]), 3),
            "all persons [typical]": round(error, 3),
            "part": round(error / sizes[k], 2),
        }


def cost(paths: Sequence[Path], count: int) -> dict[str, object]:
    """CPU-seconds of reading and summing so many persons' files and of all verdicts, and memory
    beyond that of three persons; in a process of its own."""
    rng = np.random.default_rng(1)
    drawn = [paths[k] for k in rng.integers(len(paths), size=count)]
    _judged_from(drawn[:3], rng)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    start = time.process_time()
    _judged_from(drawn, rng)
    took = time.process_time() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {
        "persons": count,
        "CPU s": round(took, 1),
        "ms per person": round(1000 * took / count, 1),
        "MB more": round(peak - before, 1),
        "MB more per person": round((peak - before) / count, 3),
    }


def _judged_from(paths: Sequence[Path], rng: np.random.Generator) -> None:
    pool = Pool(paths)
    lab = pool.of(range(len(pool.told)), rng)
    verdicts_of(lab, pool.named_from, rng)
    odds, order = pool.options.diagnosis.fault_prior_odds, range(len(pool.told))
    deviations_of(lab, odds, pool.named_from, order, rng)


def costs(paths: Sequence[Path]) -> Iterator[dict[str, object]]:
    for count in MANY:
        context = get_context("spawn")
        with ProcessPoolExecutor(max_workers=1, mp_context=context) as alone:
            yield alone.submit(cost, paths, count).result()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pool", type=Path, nargs="+")
    parser.add_argument("--table", choices=("drawn", "nulls", "alike", "cost"), default="drawn")
    parser.add_argument("--labs", type=int, default=25, help="per fault and number of persons")
    parser.add_argument("--count", type=int, nargs="+", default=COUNTS, help="persons in each")
    kinds = range(len(MANNERS))
    parser.add_argument("--kind", type=int, nargs="+", choices=kinds, default=(0, 1))
    parser.add_argument("--write", action="store_true", help="into docs/results")
    asked = parser.parse_args()
    paths = [path for out in asked.pool for path in sorted(out.glob(f"sub-*/*_{KIND}.parquet"))]
    print(f"{machine()}; {len(paths)} persons", flush=True)
    found = []
    for row in rows_of(asked, paths):
        found.append(row)
        print(*row.values(), sep=", ", flush=True)
    if asked.write:
        pd.DataFrame(found).to_csv(PLACE / f"laboratory_{asked.table}.csv", index=False)


def rows_of(asked: argparse.Namespace, paths: Sequence[Path]) -> Iterator[dict[str, object]]:
    manners = [MANNERS[k] for k in asked.kind]
    if asked.table == "cost":
        yield from costs(paths)
    elif asked.table == "alike":
        yield from errors_alike(Pool(paths))
    else:
        made = errors if asked.table == "drawn" else false_names
        pool = Pool(paths)
        for count in asked.count:
            yield from made(pool, count, asked.labs, manners)


if __name__ == "__main__":
    main()
