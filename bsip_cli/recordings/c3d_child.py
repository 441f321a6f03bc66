"""Reads a C3D file from its standard input with ezc3d; c3d_content runs it under limits.

    python c3d_child.py MEMORY_BYTES CPU_SECONDS < file.c3d > arrays.npz

Imports nothing of bsip, so that it starts fast.
"""

from __future__ import annotations

import io
import os
import sys

REFUSED = 3
_INPUT = "/dev/fd/0"


def main() -> None:
    memory_bytes, cpu_s = int(sys.argv[1]), int(sys.argv[2])
    result = os.dup(1)
    os.dup2(2, 1)  # whatever a library prints is no result
    _limit(memory_bytes, cpu_s)
    import ezc3d

    try:
        arrays = _arrays(ezc3d.c3d(_INPUT))
    except (RuntimeError, OSError, ValueError, TypeError, LookupError, MemoryError) as error:
        sys.stderr.write(str(error) or type(error).__name__)
        sys.exit(REFUSED)
    with os.fdopen(result, "wb") as stream:
        stream.write(arrays)


def _limit(memory_bytes: int, cpu_s: int) -> None:
    if sys.platform == "win32":  # without these limits the parent's time limit is left
        return
    import resource

    for kind, wanted in ((resource.RLIMIT_AS, memory_bytes), (resource.RLIMIT_CPU, cpu_s)):
        hard = resource.getrlimit(kind)[1]
        limit = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
        resource.setrlimit(kind, (limit, hard))


def _arrays(content) -> bytes:
    """Points, analogs and parameters as an NPZ archive without pickles."""
    import numpy as np

    data = content["data"]
    arrays = {
        "positions": np.transpose(data["points"][:3], (2, 1, 0)),
        "residuals": data["meta_points"]["residuals"][0].T,
        "analog": data["analogs"][0],
    }
    names: list[tuple[str, str]] = []
    for group, parameters in content["parameters"].items():
        for name, parameter in parameters.items():
            if name != "__METADATA__":
                arrays[f"parameter_{len(names)}"] = np.array(parameter["value"])
                names.append((group, name))
    stream = io.BytesIO()
    np.savez(stream, names=np.array(names, dtype=np.str_).reshape(-1, 2), **arrays)
    return stream.getvalue()


if __name__ == "__main__":
    main()
