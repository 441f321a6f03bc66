"""The one door to recordings: a path in, a recording out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from bsip_cli.errors import BadDataError
from bsip_cli.files.regular import check_regular
from bsip_cli.recordings.cop_near_feet import cop_findings
from bsip_cli.recordings.model import Recording


def read_recording(path: Path) -> Recording:
    """Read a ``.c3d``, or a ``.trc`` with the file of ground forces beside it."""
    recording = _read(Path(path))
    return replace(recording, findings=(*recording.findings, *cop_findings(recording)))


def _read(path: Path) -> Recording:
    check_regular(path)
    suffix = path.suffix.lower()
    if suffix == ".c3d":
        from bsip_cli.recordings.c3d import read_c3d

        return read_c3d(path)
    if suffix == ".trc":
        from bsip_cli.recordings.trc_mot import read_trc_mot

        return read_trc_mot(path)
    raise BadDataError(
        f"a recording of type '{suffix}'",
        expected="a .c3d or a .trc file",
        remedy="export it as C3D",
        file=path,
    )
