"""ezc3d in a process of its own: a damaged file may crash it, hang it or fill the memory."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_child import REFUSED
from bsip_cli.recordings.c3d_parameters import Parameters, Value

_CHILD = Path(__file__).with_name("c3d_child.py")
# Measured on files of 0.01 to 5 MB: 100 MB of address space and 8 MB for each MB of the file,
# 0.4 s for each MB.
_MEMORY_BYTES, _MEMORY_PER_BYTE = 1_000_000_000, 40
_CPU_S, _CPU_S_PER_MB = 10, 5
_WALL_PER_CPU = 6  # other processes may want the same cores


@dataclass(frozen=True, eq=False)
class Samples:
    """What ezc3d read, in the file's units and lab frame."""

    parameters: Parameters
    positions: np.ndarray  # (n_frames, n_points, 3)
    residuals: np.ndarray  # (n_frames, n_points), negative where no camera saw the point
    analog: np.ndarray  # (n_channels, n)


def read_by_ezc3d(content: bytes, named: Path) -> Samples:
    """Parameters, points and analogs of a C3D file by ezc3d; faults name the file ``named``.

    ezc3d does not notice when reading fails half way: it gets a copy of what was read already.
    """
    size = len(content)
    memory_bytes = _MEMORY_BYTES + _MEMORY_PER_BYTE * size
    cpu_s = _CPU_S + int(_CPU_S_PER_MB * size / 1e6)
    command = [sys.executable, "-P", str(_CHILD), str(memory_bytes), str(cpu_s)]
    one_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    try:
        with tempfile.TemporaryFile() as copy:
            copy.write(content)
            copy.seek(0)
            ran = subprocess.run(
                command,
                stdin=copy,
                capture_output=True,
                check=False,
                env={**os.environ, **one_thread},
                timeout=_WALL_PER_CPU * cpu_s,
            )
    except subprocess.TimeoutExpired as error:
        raise _refusal(named, f"did not finish within {_WALL_PER_CPU * cpu_s} s") from error
    if ran.returncode == 0:
        return _samples(ran.stdout)
    words = ran.stderr.decode("utf-8", "replace").strip().rstrip(".")
    if ran.returncode == REFUSED:
        raise _refusal(named, f"cannot read it: {words}")
    raise _refusal(named, f"ended in its middle ({_ending(ran.returncode, words)})")


def _ending(code: int, words: str) -> str:
    if code < 0:
        return signal.Signals(-code).name
    return f"exit code {code}: {words.splitlines()[-1] if words else 'no word'}"


def _refusal(path: Path, found: str) -> BadDataError:
    return BadDataError(
        f"ezc3d {found}",
        expected="a standard C3D file",
        remedy="export the trial again",
        file=path,
    )


def _samples(archive: bytes) -> Samples:
    parameters: dict[str, dict[str, Value]] = {}
    with np.load(io.BytesIO(archive), allow_pickle=False) as arrays:
        for k, (group, name) in enumerate(arrays["names"]):
            value = arrays[f"parameter_{k}"]
            is_text = value.dtype.kind == "U"
            own = tuple(_cleaned(text) for text in value) if is_text else value
            parameters.setdefault(str(group).strip().upper(), {})[str(name).strip().upper()] = own
        return Samples(
            parameters=parameters,
            positions=arrays["positions"],
            residuals=arrays["residuals"],
            analog=arrays["analog"],
        )


def _cleaned(text: str) -> str:
    """Without filling blanks; bytes that are no UTF-8 come as surrogates and are Latin-1."""
    raw = str(text).encode("utf-8", "surrogateescape")
    try:
        known = raw.decode("utf-8")
    except UnicodeDecodeError:
        known = raw.decode("latin-1")
    return known.replace("\0", " ").strip()
