"""The figaroh recording (CSV with broken quotes) as OpenSim TRC and MOT files.

Facts of the recording: positions in mm, Z up, about 30 Hz with uneven stamps; six force channels
that are the action on one plate, whose origin lies near (0.91, 0.47) m in the markers' frame
(found by laying the centre of pressure under the mean of the markers). The action on the plate is
minus the reaction in five channels; Fy has the reaction's sign (it follows the motion with
r = 0.83 so, and -0.83 otherwise).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

PLATE_ORIGIN_M = (0.91, 0.47, 0.0)
_FORCES = ("Fx0", "Fy0", "Fz0", "Mx0", "My0", "Mz0")
_REACTION = (-1, 1, -1, -1, -1, -1)


def convert(source: Path, target: Path) -> None:
    """Write ``target``.trc and ``target``.mot from a CSV; rows before a gap of over 1 s go."""
    with source.open(encoding="utf-8") as lines:
        header = [name.strip("'‘’ \n") for name in next(lines).split(",")]
        table = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    jumps = np.flatnonzero(np.diff(table[:, 0]) > 1.0)
    table = table[jumps[-1] + 1 :] if len(jumps) else table
    times = table[:, 0] - table[0, 0]
    labels = [name[:-1] for name in header[1:-6:3]]
    _write_trc(target.with_suffix(".trc"), times, labels, table[:, 1:-6] / 1000)
    forces = table[:, [header.index(name) for name in _FORCES]] * _REACTION
    _write_mot(target.with_suffix(".mot"), times, forces)


def _write_trc(path: Path, times: np.ndarray, labels: list[str], positions: np.ndarray) -> None:
    rate = 1.0 / float(np.median(np.diff(times)))
    axes = "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, len(labels) + 1))
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame"
        "\tOrigNumFrames",
        f"{rate:.3f}\t{rate:.3f}\t{len(times)}\t{len(labels)}\tm\t{rate:.3f}\t1\t{len(times)}",
        "Frame#\tTime\t" + "\t\t\t".join(labels),
        f"\t\t{axes}",
    ]
    for k, (time, row) in enumerate(zip(times, positions, strict=True)):
        lines.append(f"{k + 1}\t{time:.5f}\t" + "\t".join(f"{value:.6f}" for value in row))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _write_mot(path: Path, times: np.ndarray, forces: np.ndarray) -> None:
    columns = [
        "time",
        *(f"ground_force_v{axis}" for axis in "xyz"),
        *(f"ground_force_p{axis}" for axis in "xyz"),
        *(f"ground_torque_{axis}" for axis in "xyz"),
    ]
    lines = [
        path.name,
        "version=1",
        f"nRows={len(times)}",
        f"nColumns={len(columns)}",
        "inDegrees=yes",
        "endheader",
        "\t".join(columns),
    ]
    for time, row in zip(times, forces, strict=True):
        values = [*row[:3], *PLATE_ORIGIN_M, *row[3:]]
        lines.append(f"{time:.5f}\t" + "\t".join(f"{value:.6f}" for value in values))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
