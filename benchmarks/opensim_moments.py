"""Joint moments of bsip against OpenSim's InverseDynamicsTool on what `bsip export` wrote.

    python -m benchmarks.opensim_moments STUDY OUT --method OM

STUDY and OUT: up to `bsip identify`. Needs the opensim package. Printed are, per trial and joint,
the largest difference and its part of the peak.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.measure import markdown
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.commands.export import Request, export_session
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.dynamics.joint_moments import Spread, joint_loads
from bsip_cli.dynamics.segment_motion import segment_motion
from bsip_cli.pipeline import Stage
from bsip_cli.running.session import open_study
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import person_from
from bsip_cli.stages.joints import trial_of
from bsip_cli.stages.reconstruct import parameters_of
from tests.exports.opensim_files import by_coordinate, of_the_tool

_READER = Stage("export", "trial", "", (), (), options=("skeleton", "joints"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--method", default="OM")
    arguments = parser.parse_args()
    opened = open_study(arguments.study, arguments.out, (), None)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        request = Request(method=arguments.method, what="opensim", to=Path(folder))
        export_session(arguments.study, arguments.out, (), None, request)
        for setup in sorted(Path(folder).glob("*/*_inverse-dynamics.xml")):
            stem = setup.stem.removesuffix("_inverse-dynamics")
            person = next(p for p in opened.study.participants if p.id == setup.parent.name)
            trial = next(t for t in person.trials if t.stem == stem)
            unit = Unit(_READER, opened.study, arguments.out, opened.config, person, trial)
            rows += compared(unit, arguments.method, setup)
    print(markdown(("trial", "joint", "largest difference [N m]", "peak [N m]", "%"), rows))


def compared(unit: Unit, method: str, setup: Path) -> list[tuple[str, ...]]:
    """A row per joint; without the low-pass that `bsip joints` puts over both."""
    skeleton = load_skeleton(unit.config.skeleton)
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    trial = trial_of(unit, person)
    methods, phi = parameters_of(unit.read("bsip"), person)
    body, feet = phi[:, [methods.index(method)]], trial.ground(trial.readings)[1]
    known = Spread((None,), 0.0)
    found = joint_loads(person, trial.q, trial.v, trial.a, body, feet, known)
    R = segment_motion(pinocchio_model(person), trial.q, trial.v, trial.a).rotation
    theirs = of_the_tool(setup)
    first, *_, last = np.searchsorted(trial.times_s, theirs["time"] - 1e-6)
    frames = slice(first, last + 1)
    worst: dict[str, tuple[float, float]] = {}
    for name, mine in by_coordinate(person, R, found).items():
        other = np.interp(trial.times_s[frames], theirs["time"], theirs[name])
        joint = name.rsplit("_", 1)[0]
        most, peak = worst.get(joint, (0.0, 0.0))
        apart = np.nanmax(np.abs(mine[frames] - other))
        worst[joint] = max(most, float(apart)), max(peak, float(np.abs(other).max()))
    return [
        (unit.name, joint, f"{most:.4f}", f"{peak:.2f}", f"{100 * most / peak:.3f}")
        for joint, (most, peak) in worst.items()
    ]


if __name__ == "__main__":
    main()
