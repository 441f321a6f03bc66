"""Identify base parameters with figaroh; started by figaroh_comparison.py with its interpreter.

Needs nothing but ``figaroh`` (and what it brings: numpy, Pinocchio). Reads the model and the
motions, leaves the predicted wrench, and prints rank, CPU-seconds and memory.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pinocchio as pin
from figaroh.tools.qrdecomposition import QRDecomposer
from figaroh.tools.regressor import (
    RegressorBuilder,
    RegressorConfig,
    build_regressor_reduced,
    get_index_eliminate,
)

COMPONENTS = ["Fx", "Fy", "Fz", "Mx", "My", "Mz"]


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    folder = Path(sys.argv[1])
    model = pin.Model()
    model.loadFromXML(str(folder / "model.xml"), "person")
    data = np.load(folder / "motions.npz")
    config = RegressorConfig(
        is_joint_torques=False, is_external_wrench=True, force_torque=COMPONENTS
    )
    builder = RegressorBuilder(pin.RobotWrapper(model), config)
    names = {f"p{k}": 0.0 for k in range(10 * (model.njoints - 1))}
    imported_mb, seconds = peak_mb(), [time.process_time()]
    full = builder.build_basic_regressor(data["q"], data["v"], data["a"])
    seconds.append(time.process_time())
    eliminated, kept = get_index_eliminate(full, names)
    reduced = build_regressor_reduced(full, eliminated)
    decomposer = QRDecomposer()
    # All of one component, then all of the next, as in the regressor's rows.
    solved = decomposer.double_decomposition(data["measured_base"].T.ravel(), reduced, kept)
    seconds.append(time.process_time())
    used_mb = peak_mb()
    other = builder.build_basic_regressor(data["other_q"], data["other_v"], data["other_a"])
    rows = build_regressor_reduced(other, eliminated)[:, decomposer.get_base_indices()]
    np.save(folder / "figaroh.npy", (rows @ solved[3]).reshape(6, -1).T)
    print(
        json.dumps(
            {
                "rank": len(solved[3]),
                "equations_s": seconds[1] - seconds[0],
                "solve_s": seconds[2] - seconds[1],
                "imported_mb": imported_mb,
                "used_mb": used_mb,
                "version": version("figaroh"),
            }
        )
    )


if __name__ == "__main__":
    main()
