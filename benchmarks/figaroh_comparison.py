"""Base parameters by bsip and by figaroh: the same rank, the same wrench; time and memory.

figaroh is asked of another interpreter, which needs ``pip install figaroh==1.0.2`` (not part of
bsip):

    python3 -m venv bench && bench/bin/pip install figaroh==1.0.2
    python -m benchmarks.figaroh_comparison --figaroh-python bench/bin/python

Both get the same tree (Pinocchio's model, written by one and read by the other), motion and wrench,
once without noise and once with white noise. figaroh solves all frames at once in the pelvis'
frame, bsip accumulates low-passed ones in the world's: with noise the two are not the same least
squares, and both are compared with the true wrench of another motion.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.measure import ROOT, machine, markdown, run_child
from bsip_cli.config import load_config
from bsip_cli.dynamics.base_parameters import find_basis
from bsip_cli.dynamics.ground_wrench import move_moments, predicted_wrench, rotations_of
from bsip_cli.identification.base import estimate
from bsip_cli.identification.problem import Problem, accumulate, even_noise
from tests.identification.synthetic_identification import motion, recording, world

CUTOFF_HZ = load_config([]).identify.cutoff_hz
NOISE = np.array([5.0, 5.0, 5.0, 2.5, 2.5, 2.5])  # white, of each component [N, N m]
TRIFLE = 1e-3  # what counts as noise of a wrench without noise, for the weights of bsip
OTHER_S, OTHER_SEED = 10.0, 9


def write_problem(folder: Path, duration_s: float, noise: np.ndarray) -> None:
    """Model and motions for both: the identifying one with its wrench, and another one."""
    world().model.saveToXML(str(folder / "model.xml"), "person")
    one = recording(duration_s)
    measured = one.wrench + np.random.default_rng(5).normal(0, 1, one.wrench.shape) * noise
    other = motion(OTHER_S, OTHER_SEED)
    np.savez(
        folder / "motions.npz",
        q=one.q,
        v=one.v,
        a=one.a,
        measured=measured,
        measured_base=in_base(measured, one.q),
        noise=np.maximum(noise, TRIFLE),
        **dict(zip(("other_q", "other_v", "other_a"), other, strict=True)),
    )


def in_base(wrench: np.ndarray, q: np.ndarray) -> np.ndarray:
    """(N, 6) wrench about the world's origin, seen in and about the floating base's frame."""
    about_base = wrench.copy()
    about_base[:, 3:] -= np.cross(q[:, :3], wrench[:, :3])
    back = np.swapaxes(rotations_of(q[:, 3:7]), 1, 2)
    return np.concatenate([turned(back, about_base[:, :3]), turned(back, about_base[:, 3:])], 1)


def in_world(wrench: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Inverse of :func:`in_base`."""
    turn = rotations_of(q[:, 3:7])
    force, moment = turned(turn, wrench[:, :3]), turned(turn, wrench[:, 3:])
    return np.concatenate([force, moment + np.cross(q[:, :3], force)], 1)


def turned(rotations: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return np.einsum("nij,nj->ni", rotations, vectors)


def bsip_worker(folder: Path) -> None:
    """The same as figaroh_worker.py, by bsip."""
    data, model, prior = np.load(folder / "motions.npz"), world().model, world().prior
    one = replace(
        recording(1.0),
        **{name: data[name] for name in "qva"},
        wrench=data["measured"],
        use=np.ones(len(data["q"]), dtype=bool),
        noise_level=np.ones(len(data["q"])),
    )
    reference = np.append(one.q[:, :2].mean(axis=0), 0.0)
    imported_mb, seconds = peak_mb(), [time.process_time()]
    equations = accumulate(model, [one], CUTOFF_HZ, reference)
    seconds.append(time.process_time())
    basis = find_basis(model)
    noise = even_noise(data["noise"], equations.samples)
    found = estimate(Problem(equations, noise, prior, basis, 1.0))
    seconds.append(time.process_time())
    used_mb = peak_mb()
    np.save(folder / "bsip.npy", wrench_of(found.phi))
    print(
        json.dumps(
            {
                "rank": basis.rank,
                "equations_s": seconds[1] - seconds[0],
                "solve_s": seconds[2] - seconds[1],
                "imported_mb": imported_mb,
                "used_mb": used_mb,
            }
        )
    )


def wrench_of(phi: np.ndarray) -> np.ndarray:
    """(N, 6) about the world's origin, of the other motion."""
    other = motion(OTHER_S, OTHER_SEED)
    return predicted_wrench(world().model, *other, phi[:, None], np.zeros(3))[..., 0]


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def contest(folder: Path, python: str, rounds: int) -> tuple[dict, dict]:
    """What both printed, medians of rounds in turns; the wrenches lie in the folder."""
    commands = {
        "bsip": [sys.executable, "-m", "benchmarks.figaroh_comparison", "--worker", str(folder)],
        "figaroh": [python, str(ROOT / "benchmarks" / "figaroh_worker.py"), str(folder)],
    }
    printed: dict[str, list[dict]] = {name: [] for name in commands}
    for _ in range(rounds):
        for name, command in commands.items():
            stdout = run_child(command).stdout
            printed[name].append(json.loads(stdout.splitlines()[-1]))
    bsip, figaroh = (
        {
            key: statistics.median(one[key] for one in found) if key != "version" else value
            for key, value in found[0].items()
        }
        for found in printed.values()
    )
    return bsip, figaroh


def wrench_rows(folder: Path, noise: str) -> list[list[str]]:
    """Largest and root-mean-square differences, forces [N] and moments [N m] about the middle."""
    q = motion(OTHER_S, OTHER_SEED)[0]
    middle = np.append(q[:, :2].mean(axis=0), 0.0)
    true = move_moments(wrench_of(world().phi_true), middle)
    ours = move_moments(np.load(folder / "bsip.npy"), middle)
    theirs = move_moments(in_world(np.load(folder / "figaroh.npy"), q), middle)
    pairs = {"bsip - truth": ours - true, "figaroh - truth": theirs - true}
    pairs["bsip - figaroh"] = ours - theirs
    rows = []
    for name, apart in pairs.items():
        cells = [
            size
            for part in (apart[:, :3], apart[:, 3:])
            for size in (f"{np.sqrt((part**2).mean()):.1e}", f"{np.abs(part).max():.1e}")
        ]
        rows.append([noise, name, *cells])
    return rows


def cost_table(bsip: dict, figaroh: dict, frames: int) -> str:
    rows = [["rank", f"{bsip['rank']:.0f}", f"{figaroh['rank']:.0f}", ""]]
    for name, key in (("regressor, equations", "equations_s"), ("basis and solving", "solve_s")):
        ratio = f"{figaroh[key] / bsip[key]:.1f}"
        rows.append([f"{name} [CPU-s]", f"{bsip[key]:.2f}", f"{figaroh[key]:.2f}", ratio])
    totals = [one["equations_s"] + one["solve_s"] for one in (bsip, figaroh)]
    rows.append(["together [CPU-s]", *(f"{t:.2f}" for t in totals), f"{totals[1] / totals[0]:.1f}"])
    used = [one["used_mb"] - one["imported_mb"] for one in (bsip, figaroh)]
    rows.append(["memory for it [MB]", *(f"{m:.0f}" for m in used), ""])
    peaks = [one["used_mb"] for one in (bsip, figaroh)]
    rows.append(["peak of the process [MB]", *(f"{m:.0f}" for m in peaks), ""])
    return markdown(
        [f"{frames:,} frames", "bsip", f"figaroh {figaroh['version']}", "times bsip's"], rows
    )


def compare(python: str, duration_s: float, rounds: int) -> None:
    rows, table = [], ""
    for noise, size in (("none", 0.0 * NOISE), ("5 N, 2.5 N m", NOISE)):
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            write_problem(folder, duration_s, size)
            found = contest(folder, python, rounds)
            rows += wrench_rows(folder, noise)
            table = table or cost_table(*found, len(recording(duration_s).q))
    print(f"\n{table}\n")
    header = ["noise", "wrench of another motion", "forces, RMS [N]", "largest"]
    print(markdown([*header, "moments, RMS [N m]", "largest"], rows))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--figaroh-python", help="interpreter that has figaroh")
    parser.add_argument("--seconds", type=float, default=120.0, help="of motion at 100 Hz")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        bsip_worker(options.worker)
        return
    if not options.figaroh_python:
        parser.error("--figaroh-python is needed: see the first lines of this script")
    print(f"machine: {machine()}; medians of {options.rounds} rounds")
    compare(options.figaroh_python, options.seconds, options.rounds)


if __name__ == "__main__":
    main()
