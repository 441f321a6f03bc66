"""The identification's equations: CPU time over bare regressor calls, memory, time to solve."""

from __future__ import annotations

import argparse
import json
import resource
import sys
import tracemalloc
from dataclasses import replace

import numpy as np
import pinocchio as pin

from benchmarks.measure import cpu_seconds, interleaved, machine, markdown, run_child
from benchmarks.moving_person import movement, sample_person
from bsip_cli.config import load_config
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.identification import consistent
from bsip_cli.identification.consistent import fit_with_weights, minimise, objective_of, terms_of
from bsip_cli.identification.problem import Problem, Recording, accumulate, even_noise
from tests.identification import synthetic_identification
from tests.identification.test_logdet_fit import by_clarabel

RATE_HZ = 100.0
CUTOFF_HZ = load_config([]).identify.cutoff_hz
REFERENCE_M = np.array([0.2, -0.1, 0.0])
_PIECE_S = 60.0
NOISE = np.array([5.0, 5.0, 5.0, 2.5, 2.5, 2.5])  # of the wrench [N, N m]


def recording(duration_s: float) -> Recording:
    """A trial of that length: one minute of movement again and again, its wrench all zero."""
    piece = movement(sample_person(), round(min(duration_s, _PIECE_S) * RATE_HZ), RATE_HZ)
    times = max(1, round(duration_s / _PIECE_S))
    q, v, a = (np.tile(part, (times, 1)) for part in piece)
    return Recording(
        q, v, a, np.zeros((len(q), 6)), np.ones(len(q), dtype=bool), RATE_HZ, np.ones(len(q))
    )


def bare_calls(model: pin.Model, one: Recording) -> None:
    """What the equations cannot do without: Pinocchio's regressor of every frame."""
    data = model.createData()
    for q, v, a in zip(one.q, one.v, one.a, strict=True):
        pin.computeJointTorqueRegressor(model, data, q, v, a)


def speed_table(frames: int, rounds: int) -> str:
    model = pinocchio_model(sample_person())
    one = recording(frames / RATE_HZ)
    accumulate(model, [one], CUTOFF_HZ, REFERENCE_M)  # the allocator has its blocks
    seconds = interleaved(
        {
            "bare regressor calls": lambda: cpu_seconds(lambda: bare_calls(model, one)),
            "accumulated equations": lambda: cpu_seconds(
                lambda: accumulate(model, [one], CUTOFF_HZ, REFERENCE_M)
            ),
        },
        rounds,
    )
    least = seconds["bare regressor calls"]
    rows = [[name, f"{value:.3f}", f"{value / least:.2f}"] for name, value in seconds.items()]
    return markdown([f"{len(one.q):,} frames", "CPU-s", "ratio (target: at most 2)"], rows)


def print_memory(duration_s: float, traced: bool) -> None:
    """What accumulating adds to the memory of this process [MB], beyond the recording."""
    model, one = pinocchio_model(sample_person()), recording(duration_s)
    accumulate(model, [recording(2.0)], CUTOFF_HZ, REFERENCE_M)  # libraries loaded
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    if traced:
        tracemalloc.start()
    accumulate(model, [one], CUTOFF_HZ, REFERENCE_M)
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    peak = tracemalloc.get_traced_memory()[1] if traced else 0
    size = sum(part.nbytes for part in (one.q, one.v, one.a, one.wrench))
    print(json.dumps([size / 1e6, (after - before) / 1024, peak / 1e6]))


def memory_table(durations_s: list[float]) -> str:
    rows = []
    for duration in durations_s:
        child = [sys.executable, "-m", "benchmarks.normal_equations", "--memory", f"{duration}"]
        plain, traced = (
            json.loads(run_child([*child, *extra]).stdout) for extra in ([], ["traced"])
        )
        rows.append([f"{duration:g}", f"{plain[0]:.0f}", f"{plain[1]:.0f}", f"{traced[2]:.1f}"])
    header = ["trial [s]", "recording itself [MB]", "growth of peak RSS [MB]", "traced peak [MB]"]
    return markdown(header, rows)


def known_problem(duration_s: float) -> Problem:
    """Equations of a person whose parameters are known, with noise on the wrench."""
    world = synthetic_identification.world()
    one = synthetic_identification.recording(duration_s)
    wrench = one.wrench + np.random.default_rng(5).normal(0, NOISE, one.wrench.shape)
    equations = accumulate(
        world.model, [replace(one, wrench=wrench)], CUTOFF_HZ, np.array(REFERENCE_M)
    )
    noise = even_noise(NOISE, equations.samples)
    trust = load_config([]).identify.trust_ratio
    return Problem(equations, noise, world.prior, world.basis, trust)


def fit_table(problem: Problem, rounds: int) -> str:
    """Time of ``consistent``, and how near one solve comes to clarabel's optimum."""
    terms = terms_of(problem)
    fit = fit_with_weights(terms)
    objective = objective_of(terms, fit.spread, fit.gamma)
    seconds = interleaved(
        {
            "consistent, all weights": lambda: cpu_seconds(lambda: consistent.estimate(problem)),
            "one solve": lambda: cpu_seconds(lambda: minimise(objective)),
            "clarabel, the same solve": lambda: cpu_seconds(lambda: by_clarabel(objective)),
        },
        rounds,
    )
    ours, (x, value) = minimise(objective), by_clarabel(objective)
    spread = np.linalg.norm(problem.prior.root, axis=1)
    apart = np.abs((objective.phi(ours.x) - objective.phi(x)) / spread).max()
    rows = [[name, f"{taken:.3f}"] for name, taken in seconds.items()]
    rows.append(
        ["optimum below clarabel's, part of it", f"{(value - ours.value) / abs(value):.0e}"]
    )
    rows.append(["largest difference of a parameter, in people's spread", f"{apart:.0e}"])
    return markdown(["equations of 120 s", "CPU-s (target: under 1)"], rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=12_000)
    parser.add_argument("--durations", type=float, nargs="+", default=[60.0, 600.0], help="[s]")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--memory", nargs="+", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.memory:
        print_memory(float(options.memory[0]), "traced" in options.memory)
        return
    print(f"machine: {machine()}; medians of {options.rounds} rounds\n")
    print(speed_table(options.frames, options.rounds))
    print("\n" + memory_table(options.durations))
    print("\n" + fit_table(known_problem(120.0), options.rounds))


if __name__ == "__main__":
    main()
