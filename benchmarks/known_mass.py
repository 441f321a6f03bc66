"""Known masses on known segments of simulated people: do they come back?

Every person is recorded five times in one session with the same markers: twice with nothing, with
0.5 kg on the right wrist, with 1 kg on the right shank and with 2 kg on the trunk, each time in
another sequence of movements with other noise. The simulator carries the mass as a part of the body
that wears it. At first nobody tells the identification of the mass: it should come back. Declared
as a known load it should leave no more trace than there is between the two recordings with nothing.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.measure import ROOT, markdown, run_child
from bsip_cli.body.loads import PointMass, load_parameters
from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.config import Config, Load, load_config
from bsip_cli.identification.difference import Difference, change_of_segments, difference
from bsip_cli.identification.estimator import Estimate, Problem
from bsip_cli.pipeline import STAGES
from bsip_cli.running.unit import Unit
from bsip_cli.simulate import people, recording, study, trial
from bsip_cli.simulate.inertia import Inertia, combined
from bsip_cli.simulate.options import StudyOptions
from bsip_cli.stages import identification_problem
from bsip_cli.stages.frames import person_from
from bsip_cli.study.study import load_study

ESTIMATORS = ("consistent", "hansen2017")
NOTHING = "nothing"
PLAIN_RUN, AGAIN_RUN = 1, 5
BAD_DATA = 3  # some trial was refused, the rest is done


@dataclass(frozen=True)
class Worn:
    """A load, the run that it is worn in, and the simulator's body that wears it."""

    run: int
    name: str
    body: str
    load: Load


def _worn(run: int, name: str, body: str, segment: str, mass_kg: float, position_m: tuple) -> Worn:
    return Worn(
        run, name, body, Load(segment=segment, mass_kg=mass_kg, position_m=position_m, runs=(run,))
    )


LOADS = (
    _worn(2, "0.5 kg, right wrist", "forearm_r", "forearm_r", 0.5, (0.0, -0.22, 0.03)),
    _worn(3, "1 kg, right shank", "shank_r", "shank_r", 1.0, (0.03, -0.25, 0.02)),
    _worn(4, "2 kg, trunk", "thorax", "upper_torso", 2.0, (0.10, -0.20, 0.0)),
)


# --- the recordings -----------------------------------------------------------------------------


def with_load(person: people.Person, worn: Worn) -> people.Person:
    """The person, one body of whom is heavier by the load."""
    point = Inertia(worn.load.mass_kg, np.array(worn.load.position_m), np.zeros((3, 3)))
    whole = combined([(person.inertias[worn.body], np.zeros(3)), (point, np.zeros(3))])
    return replace(person, inertias={**person.inertias, worn.body: whole})


def write_study(folder: Path, seed: int, duration_s: float) -> None:
    """One person: static, runs 1 and 5 with nothing, runs 2 to 4 with a load each."""
    options = StudyOptions(
        participants=1,
        seed=seed,
        sexes="MF"[seed % 2],
        tasks=("static", "sequence"),
        durations_s={"static": 3.0, "sequence": duration_s},
    )
    study.simulate_study(folder, options)
    person = study.participant_person(options, 1)
    bodies = {AGAIN_RUN: person} | {worn.run: with_load(person, worn) for worn in LOADS}
    for run, body in bodies.items():
        moved = trial.simulate_trial(
            body, "sequence", np.random.default_rng([seed, run, 0]), duration_s
        )
        recording.write_trial(
            folder / "sub-01" / f"sub-01_task-sequence_run-{run}.c3d",
            moved,
            person,
            options.rates_of("sequence"),
            options.laboratory,
            options.richness,
            np.random.default_rng([seed, run, 1]),
        )


# --- the identifications ------------------------------------------------------------------------


@dataclass(frozen=True)
class Identified:
    """One run's problem and what every estimator made of it."""

    person: Person
    problem: Problem
    estimates: dict[str, Estimate]


def identified(folder: Path, out: Path, run: int, loads: tuple[Load, ...]) -> Identified:
    """Parameters from one run alone, with these loads declared."""
    config = load_config([folder / "study.toml"]).model_copy(update={"loads": loads})
    unit = _unit(folder, out, config)
    skeleton = load_skeleton(config.skeleton)
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    prior = identification_problem.prior_from(unit, unit.read("regression"), person)
    trials = [one for one in unit.trials("kinematics", "wrench") if one.run == run]
    recordings, _ = identification_problem.recordings_of(unit, person, trials)
    problem, _ = identification_problem.problem_of(unit, person, prior, recordings)
    estimates = {
        name: importlib.import_module(f"bsip_cli.identification.{name}").estimate(problem)
        for name in ESTIMATORS
    }
    return Identified(person, problem, estimates)


def _unit(folder: Path, out: Path, config: Config) -> Unit:
    found, _ = load_study(folder, config.roles.model_dump())
    stage = next(stage for stage in STAGES if stage.name == "identify")
    return Unit(stage, found, out, config, found.participants[0])


# --- the comparison -----------------------------------------------------------------------------


@dataclass(frozen=True)
class Found:
    """A quantity of one person and load: value, half of its 95 % interval, and the truth."""

    load: str
    method: str
    quantity: str
    value: float
    half_width: float
    truth: float

    @property
    def is_inside(self) -> bool:
        return abs(self.value - self.truth) <= self.half_width


def one_segment(
    plain: Identified, other: Identified, worn: Worn, mass_kg: float
) -> Iterator[Found]:
    """What both recordings together say of the segment that wears the load."""
    i = plain.person.skeleton.index(worn.load.segment)
    change = change_of_segments(plain.problem, other.problem, [i])
    position = np.array(worn.load.position_m) + plain.person.origin_in_joint_m[i]
    truth = mass_kg * np.array([1.0, *position])
    half_width = 1.96 * np.sqrt(np.diag(change.covariance))
    for k, quantity in enumerate(("mass", *["first moment"] * 3)):
        name = worn.name if mass_kg else NOTHING
        yield Found(name, "one segment", quantity, change.phi[k], half_width[k], truth[k])


def two_identifications(plain: Identified, other: Identified, worn: Worn) -> Iterator[Found]:
    """Differences of the estimates; of the segment's own mass as far as the wrench resolves it."""
    n = len(plain.person.skeleton.segments)
    i = plain.person.skeleton.index(worn.load.segment)
    point = PointMass(worn.load.segment, worn.load.mass_kg, np.array(worn.load.position_m))
    truth = load_parameters([point], plain.person)
    for method, change in _differences(plain, other):
        total, own = np.zeros(10 * n), np.zeros(10 * n)
        total[::10], own[10 * i] = 1.0, 1.0
        for quantity, row in (("total mass", total), ("own mass", own)):
            half_width = 1.96 * float(np.sqrt(row @ change.covariance @ row))
            shown = float(row @ change.resolution @ truth)
            yield Found(worn.name, method, quantity, float(row @ change.phi), half_width, shown)


def traces(plain: Identified, other: Identified, name: str) -> Iterator[Found]:
    """What of all segments differs, where nothing should."""
    for method, change in _differences(plain, other):
        half_width = 1.96 * np.sqrt(np.diag(change.covariance))
        for k, value in enumerate(change.phi):
            if k % 10 < 4:
                quantity = "first moments" if k % 10 else "masses"
                yield Found(name, method, quantity, float(value), float(half_width[k]), 0.0)


def _differences(plain: Identified, other: Identified) -> Iterator[tuple[str, Difference]]:
    root = plain.problem.prior.root
    for method in ESTIMATORS:
        a, b = plain.estimates[method], other.estimates[method]
        yield method, difference(a, b, root @ root.T)


def person(folder: Path, seed: int, duration_s: float) -> Iterator[Found]:
    """Simulate one person, identify every run, compare."""
    recordings, out = folder / f"study-{seed}", folder / f"out-{seed}"
    write_study(recordings, seed, duration_s)
    for stage in ("ingest", "scale", "ik", "regress"):
        command = [sys.executable, "-m", "bsip_cli", stage, str(recordings), "--out", str(out)]
        run_child(command, folder=ROOT, allowed=BAD_DATA)
    plain = identified(recordings, out, PLAIN_RUN, ())
    again = identified(recordings, out, AGAIN_RUN, ())
    yield from traces(plain, again, NOTHING)
    for worn in LOADS:
        hidden = identified(recordings, out, worn.run, ())
        declared = identified(recordings, out, worn.run, (worn.load,))
        yield from one_segment(plain, hidden, worn, worn.load.mass_kg)
        yield from one_segment(plain, again, worn, 0.0)
        yield from two_identifications(plain, hidden, worn)
        yield from traces(plain, hidden, f"{worn.name}, not declared")
        yield from traces(plain, declared, f"{worn.name}, declared")


# --- the tables ---------------------------------------------------------------------------------


def chosen(rows: list[Found], load: str, method: str, quantity: str) -> list[Found]:
    return [r for r in rows if (r.load, r.method, r.quantity) == (load, method, quantity)]


def inside(rows: list[Found]) -> str:
    return f"{sum(row.is_inside for row in rows)} of {len(rows)}"


def mean_of(rows: list[Found]) -> str:
    """Mean, its spread over people, and the mean half-width of the interval."""
    values = [row.value for row in rows]
    half_width = np.mean([row.half_width for row in rows])
    return f"{np.mean(values):.3f} (sd {np.std(values, ddof=1):.3f}) ± {half_width:.3f}"


def table_one_segment(rows: list[Found]) -> str:
    lines = []
    for load in (*(worn.name for worn in LOADS), NOTHING):
        masses = chosen(rows, load, "one segment", "mass")
        moments = chosen(rows, load, "one segment", "first moment")
        error = 1000 * np.sqrt(np.mean([(row.value - row.truth) ** 2 for row in moments]))
        lines.append([load, mean_of(masses), inside(masses), f"{error:.0f}", inside(moments)])
    return markdown(
        ["load", "mass found [kg]", "inside", "first moment, RMS error [g m]", "inside"], lines
    )


def table_differences(rows: list[Found]) -> str:
    lines = []
    for worn in LOADS:
        for method in ESTIMATORS:
            total = chosen(rows, worn.name, method, "total mass")
            own = chosen(rows, worn.name, method, "own mass")
            resolved = f"{np.mean([row.truth for row in own]):.3f}"
            lines.append(
                [
                    worn.name,
                    method,
                    mean_of(total),
                    inside(total),
                    mean_of(own),
                    resolved,
                    inside(own),
                ]
            )
    header = ["load", "estimator", "total mass [kg]", "inside", "segment's own mass [kg]"]
    return markdown([*header, "of it resolved", "inside"], lines)


def table_traces(rows: list[Found]) -> str:
    lines = []
    names = [f"{worn.name}, {how}" for worn in LOADS for how in ("not declared", "declared")]
    for name in (NOTHING, *names):
        for method in ESTIMATORS:
            cells: list[object] = [name, method]
            for quantity in ("masses", "first moments"):
                found = chosen(rows, name, method, quantity)
                rms = np.sqrt(np.mean([row.value**2 for row in found]))
                share = np.mean([row.is_inside for row in found])
                cells += [f"{rms:.3f}", f"{100 * share:.0f}"]
            lines.append(cells)
    header = ["load", "estimator", "masses, RMS [kg]", "inside [%]"]
    return markdown([*header, "first moments, RMS [kg m]", "inside [%]"], lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=60.0, help="length of each sequence")
    parser.add_argument("--seed", type=int, default=101, help="of the first person")
    options = parser.parse_args()
    rows: list[Found] = []
    for seed in range(options.seed, options.seed + options.people):
        with tempfile.TemporaryDirectory() as folder:
            rows += person(Path(folder), seed, options.seconds)
        print(f"person {seed} done", file=sys.stderr, flush=True)
    print(f"\n{table_one_segment(rows)}\n\n{table_differences(rows)}\n\n{table_traces(rows)}")


if __name__ == "__main__":
    main()
