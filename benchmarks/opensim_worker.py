"""Run OpenSim's inverse kinematics; started by inverse_kinematics.py with OpenSim's interpreter.

Needs nothing but ``opensim``. Prints the CPU-seconds of the run and of one over few frames, whose
difference is free of what is paid once.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import opensim


def solve(model, markers: Path, frames: int, rate_hz: float, accuracy: float, name: str) -> float:
    """Solve the first frames, leave the marker errors beside the markers; CPU-seconds."""
    tool = opensim.InverseKinematicsTool()
    tool.setName(name)
    tool.setModel(model)
    tool.setMarkerDataFileName(str(markers))
    tool.setStartTime(0.0)
    tool.setEndTime((frames - 0.5) / rate_hz)
    tool.set_accuracy(accuracy)
    tool.setResultsDir(str(markers.parent))
    tool.setOutputMotionFileName(str(markers.parent / f"{name}.mot"))
    tool.set_report_errors(True)
    for marker in (model.getMarkerSet().get(k) for k in range(model.getNumMarkers())):
        task = opensim.IKMarkerTask()
        task.setName(marker.getName())
        task.setApply(True)
        task.setWeight(1.0)
        tool.getIKTaskSet().cloneAndAppend(task)
    before = time.process_time()
    tool.run()
    return time.process_time() - before


def main() -> None:
    model_file, markers, frames, few, rate_hz, accuracy = sys.argv[1:]
    opensim.Logger.setLevelString("Error")
    model = opensim.Model(model_file)
    model.initSystem()
    times = {}
    for name, count in (("few", int(few)), ("all", int(frames))):
        times[name] = solve(model, Path(markers), count, float(rate_hz), float(accuracy), name)
    print(json.dumps({**times, "version": opensim.GetVersion()}))


if __name__ == "__main__":
    main()
