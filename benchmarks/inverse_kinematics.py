"""Inverse kinematics against OpenSim's and Pinocchio's: the same optimum, and how fast.

OpenSim is asked of another interpreter, which needs ``pip install opensim`` (not part of bsip):

    python3 -m venv bench && bench/bin/pip install opensim
    python -m benchmarks.inverse_kinematics --opensim-python bench/bin/python
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pinocchio as pin

from benchmarks.measure import cpu_seconds, interleaved, machine, markdown, run_child
from benchmarks.moving_person import movement, noisy_markers, sample_person, standing
from bsip_cli.body.anthropometry import regress
from bsip_cli.body.exports import model_text
from bsip_cli.body.exports.identified import IdentifiedPerson
from bsip_cli.body.person import Person
from bsip_cli.config import load_config
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.motion.inverse_kinematics import (
    Poses,
    posed,
    solve_poses,
    subtrees,
)
from bsip_cli.motion.smoothing import smooth_motion
from tests.body.standing_person import joint_frames, random_poses

NOISE_M = 0.005
# No robust limit and hardly a prior: the same sum of squares as OpenSim's.
SAME_PROBLEM = {
    "marker_sd_m": 0.005,
    "robust_limit_m": 10.0,
    "posture_sd_rad": 1e5,
    "iterations": 50,
}
CONFIG = load_config([])
AS_SHIPPED = CONFIG.ik.model_dump(include=set(SAME_PROBLEM))
SMOOTHING = CONFIG.smoothing.model_dump() | {"robust_limit_m": CONFIG.ik.robust_limit_m}
FEW = 10
JOINTS = ("ball", "custom")  # of OpenSim: turned by quaternions, and by three angles in turn
STEPS = 20
OPTIMUM = (
    "marker RMS, bsip [mm]",
    "marker RMS, OpenSim [mm]",
    "bsip over OpenSim, all frames [%]",
    "bsip over OpenSim, OpenSim's best frame [%]",
    "bsip over OpenSim, bsip's best frame [%]",
    "frames in which OpenSim is better by 0.1 %",
)


@dataclass(frozen=True)
class OpenSimRun:
    """(N,) marker RMS of each frame [m], CPU-seconds per frame, and the version."""

    rms_m: np.ndarray
    cpu_s_per_frame: float
    version: str


def run_opensim(
    python: str,
    person: Person,
    markers_m: np.ndarray,
    rate_hz: float,
    accuracy: float,
    joint_family: str = "ball",
) -> OpenSimRun:
    """OpenSim's InverseKinematicsTool on the same tree and markers."""
    count = len(markers_m)
    with tempfile.TemporaryDirectory() as folder:
        model, markers = Path(folder, "person.osim"), Path(folder, "markers.trc")
        model.write_text(opensim_model(person, joint_family), encoding="utf-8")
        markers.write_text(trc_text(person.markers, markers_m, rate_hz), encoding="utf-8")
        worker = str(Path(__file__).resolve().with_name("opensim_worker.py"))
        sizes = [str(number) for number in (count, FEW, rate_hz, accuracy)]
        used = run_child([python, worker, str(model), str(markers), *sizes], folder=Path(folder))
        errors = storage_column(Path(folder, "all_ik_marker_errors.sto"), "marker_error_RMS")
    printed = json.loads(used.stdout.splitlines()[-1])
    per_frame = (printed["all"] - printed["few"]) / (count - FEW)
    return OpenSimRun(errors, per_frame, printed["version"])


def opensim_model(person: Person, joint_family: str) -> str:
    """The model that `bsip export` writes; of the other family with ball and free joints."""
    body = IdentifiedPerson(person, regress(person, "M", 70.0).inertias, "person", "RM", ())
    document = ET.fromstring(model_text("osim", body))
    for joint in document.findall(".//CustomJoint") if joint_family == "ball" else ():
        joint.tag = "FreeJoint" if len(joint.findall("coordinates/*")) == 6 else "BallJoint"
        joint[:] = [part for part in joint if part.tag != "SpatialTransform"]
    return ET.tostring(document, encoding="unicode")


def trc_text(labels: tuple[str, ...], markers_m: np.ndarray, rate_hz: float) -> str:
    """A .trc file of markers (N, m, 3) [m], turned from Z up to Y up as OpenSim has it."""
    count, width = markers_m.shape[:2]
    turned = (markers_m[..., [0, 2, 1]] * [1.0, 1.0, -1.0]).reshape(count, -1)
    head = {"DataRate": rate_hz, "CameraRate": rate_hz, "NumFrames": count, "NumMarkers": width}
    head |= {"Units": "m", "OrigDataRate": rate_hz, "OrigDataStartFrame": 1, "OrigNumFrames": count}
    lines = ["PathFileType\t4\t(X/Y/Z)\tmarkers.trc", "\t".join(head)]
    lines += ["\t".join(map(str, head.values())), "Frame#\tTime\t" + "\t\t\t".join(labels)]
    lines += ["\t\t" + "\t".join(f"{a}{k + 1}" for k in range(width) for a in "XYZ"), ""]
    for k, row in enumerate(turned):
        lines.append("\t".join([str(k + 1), *(f"{x:.12f}" for x in (k / rate_hz, *row))]))
    return "\n".join([*lines, ""])


def storage_column(path: Path, name: str) -> np.ndarray:
    """One column of an OpenSim storage file."""
    lines = path.read_text(encoding="utf-8").splitlines()
    start = next(k for k, line in enumerate(lines) if line.strip() == "endheader") + 1
    at = lines[start].split().index(name)
    return np.array([float(line.split()[at]) for line in lines[start + 1 :] if line.strip()])


def optimum_column(ours: np.ndarray, theirs: np.ndarray) -> list[str]:
    """How the marker RMS (N,) [m] of two solvers compare; the meanings are in ``OPTIMUM``."""
    total = [float(np.sqrt((rms**2).mean())) for rms in (ours, theirs)]
    ratio = ours / theirs - 1
    return [
        f"{1e3 * total[0]:.4f}",
        f"{1e3 * total[1]:.4f}",
        f"{100 * (total[0] / total[1] - 1):+.4f}",
        f"{100 * ratio.max():+.4f}",
        f"{100 * ratio.min():+.4f}",
        f"{int((ratio > 1e-3).sum())} of {len(ours)}",
    ]


def pinocchio_loop(person: Person, markers_m: np.ndarray, q_first: np.ndarray) -> np.ndarray:
    """(N, nq) least-squares poses by Gauss-Newton over Pinocchio's calls, each from the last.

    One call per step fills Pinocchio's Jacobian of all joints; the markers' columns follow from
    it by whole-array numpy. It stops at the kernel's criterion: a gain of 1e-9 of the cost.
    """
    model = pinocchio_model(person)
    data = model.createData()
    joints = [int(j) + 1 for j in person.marker_segments]
    local = person.markers_in_joint_m()
    sizes = {"free": 6, "spherical": 3, "revolute": 1}
    counts = [sizes[kind] for kind in person.skeleton.joint_types]
    moves = np.repeat(subtrees(person), counts, axis=0).T[..., None]  # whether v moves a marker
    out = np.empty((len(markers_m), model.nq))
    q = q_first
    for frame, measured in enumerate(markers_m):
        cost = np.inf
        for _ in range(STEPS):
            pin.computeJointJacobians(model, data, q)
            placements = [data.oMi[j] for j in range(model.njoints)]
            R = np.array([placement.rotation for placement in placements])[joints]
            p = np.array([placement.translation for placement in placements])[joints]
            places = p + np.einsum("mij,mj->mi", R, local)
            apart = measured - places
            before, cost = cost, 0.5 * float((apart**2).sum())
            if before - cost <= 1e-9 * cost:
                break
            J = data.J
            columns = (J[:3].T[None] + np.cross(J[3:].T[None], places[:, None])) * moves
            flat = np.swapaxes(columns, 1, 2).reshape(-1, model.nv)
            normal = flat.T @ flat
            normal[np.diag_indices_from(normal)] += 1e-12
            q = pin.integrate(model, q, np.linalg.solve(normal, flat.T @ apart.ravel()))
        out[frame] = q
    return out


def forward_difference(person: Person, count: int) -> float:
    """Largest difference [1 and m] of forward kinematics to Pinocchio's at random poses."""
    q = random_poses(person, count, 1.0, seed=3)
    at = posed(person, q)
    pairs = zip((at.R, at.p), joint_frames(person, q), strict=True)
    return max(float(np.abs(ours - theirs).max()) for ours, theirs in pairs)


def rms_of(person: Person, q: np.ndarray, markers_m: np.ndarray) -> np.ndarray:
    """(N,) marker RMS [m] of given poses."""
    apart = markers_m - posed(person, q).markers_m
    return np.sqrt((apart**2).sum(axis=2).mean(axis=1))


def first_call() -> None:
    """Print the CPU-seconds of the first solved pose in this process, and of the second."""
    person = sample_person()
    start = standing(person)
    markers = noisy_markers(person, start[None], NOISE_M)
    times = [
        cpu_seconds(lambda: solve_poses(person, markers, start, **AS_SHIPPED)) for _ in range(2)
    ]
    print(json.dumps(times))


def compile_rows() -> list[list[str]]:
    """First call in a fresh process, with an empty cache and with a full one."""
    rows = []
    command = [sys.executable, "-m", "benchmarks.inverse_kinematics", "--first-call"]
    with tempfile.TemporaryDirectory() as cache:
        for label in ("first solve, empty cache", "first solve, cached"):
            used = run_child(command, {"NUMBA_CACHE_DIR": cache})
            first, second = json.loads(used.stdout.splitlines()[-1])
            rows.append([label, f"{first - second:.2f}"])
    return rows


def long_trial_rows(person: Person, rounds: int) -> list[list[str]]:
    """120 s at 250 Hz, as shipped: poses alone, and with smoothing."""
    rate, count = 250.0, 30_000
    q, _, _ = movement(person, count, rate)
    markers = noisy_markers(person, q, NOISE_M)
    last: list[Poses] = []

    def poses() -> float:
        last[:] = [solve_poses(person, markers, q[0], **AS_SHIPPED)]
        return 0.0

    def smoothing() -> None:
        known = np.ones(count, dtype=bool)
        smooth_motion(person, last[0].q, known, rate, markers=markers, **SMOOTHING)

    poses()
    smoothing()  # compiled once
    found = interleaved(
        {"ik": lambda: cpu_seconds(poses), "smoothing": lambda: cpu_seconds(smoothing)}, rounds
    )
    return [
        ["inverse kinematics", f"{found['ik']:.2f}", f"{count / found['ik']:,.0f}"],
        ["smoothing", f"{found['smoothing']:.2f}", f"{count / found['smoothing']:,.0f}"],
        ["both (target: at most 10)", f"{sum(found.values()):.2f}", ""],
    ]


def compare(options: argparse.Namespace) -> None:
    """The same least squares by every solver: tables of the optimum and of the speed."""
    person, rate = sample_person(), options.rate
    q, _, _ = movement(person, options.frames, rate)
    markers = noisy_markers(person, q, NOISE_M)
    many = np.tile(markers, (max(1, 4000 // options.frames), 1, 1))
    some = markers[: options.pinocchio_frames]
    ours = solve_poses(person, markers, q[0], **SAME_PROBLEM).frame_rms_m()
    runs: dict[str, OpenSimRun] = {}
    looped: list[np.ndarray] = []

    def kernel() -> float:
        return cpu_seconds(lambda: solve_poses(person, many, q[0], **SAME_PROBLEM)) / len(many)

    def loop() -> float:
        def work() -> None:
            looped[:] = [pinocchio_loop(person, some, q[0])]

        return cpu_seconds(work) / len(some)

    def opensim(family: str) -> float:
        python, accuracy = options.opensim_python, options.accuracy
        runs[family] = run_opensim(python, person, markers, rate, accuracy, family)
        return runs[family].cpu_s_per_frame

    contestants = {"bsip": kernel, "Pinocchio in a Python loop": loop}
    if options.opensim_python:
        for family in JOINTS:
            contestants[f"OpenSim, {family} joints"] = partial(opensim, family)
    seconds = interleaved(contestants, options.rounds)
    print(
        f"\n{len(person.markers)} markers with {1e3 * NOISE_M:g} mm noise, "
        f"{options.frames} frames at {rate:g} Hz"
    )
    if runs:
        version = next(iter(runs.values())).version
        print(f"OpenSim {version}, accuracy {options.accuracy:g}\n")
        columns = [optimum_column(ours, run.rms_m) for run in runs.values()]
        header = ["optimum", *(f"{family} joints" for family in runs)]
        print(markdown(header, list(zip(OPTIMUM, *columns, strict=True))))
    apart = np.abs(rms_of(person, looped[0], some) / ours[: len(some)] - 1).max()
    print(f"\nPinocchio's loop ends at bsip's marker RMS to {100 * apart:.0e} %;")
    print(f"forward kinematics equals Pinocchio's to {forward_difference(person, 200):.0e}.\n")
    rows = [
        [name, f"{1 / value:,.0f}", f"{value / seconds['bsip']:.0f}"]
        for name, value in seconds.items()
    ]
    print(markdown(["solver", "frames per CPU-second", "CPU time over bsip's"], rows))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--opensim-python", help="interpreter that has opensim")
    parser.add_argument("--frames", type=int, default=400)
    parser.add_argument("--pinocchio-frames", type=int, default=200)
    parser.add_argument("--rate", type=float, default=100.0, help="[Hz]")
    parser.add_argument("--accuracy", type=float, default=1e-5, help="OpenSim's")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--first-call", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.first_call:
        first_call()
        return
    print(f"machine: {machine()}; medians of {options.rounds} rounds")
    if not options.opensim_python:
        print(f"without OpenSim: see the first lines of {Path(__file__).name} for how to add it")
    compare(options)
    print("\n" + markdown(["compiling", "CPU-s"], compile_rows()))
    header = ["120 s at 250 Hz, options as shipped", "CPU-s", "frames per CPU-second"]
    print("\n" + markdown(header, long_trial_rows(sample_person(), options.rounds)))


if __name__ == "__main__":
    main()
