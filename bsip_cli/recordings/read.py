"""The one door to recordings: a path in, a recording out."""

from __future__ import annotations

from pathlib import Path

from bsip_cli.errors import BadDataError
from bsip_cli.files.regular import check_regular
from bsip_cli.recordings.assemble import assemble
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.opened import Opened
from bsip_cli.recordings.settle import SessionReading, settle_session
from bsip_cli.recordings.trial_samples import TrialSamples


def read_recording(path: Path, session: SessionReading | None = None) -> Recording:
    """Read a ``.c3d``, or a ``.trc`` with the file of ground forces beside it.

    ``session`` says how its numbers are to be understood; without it this trial alone decides.
    """
    opened = open_recording(path)
    return assemble(opened, session or settle_session([TrialSamples.of(opened)]))


def open_recording(path: Path) -> Opened:
    """A recording whose plates are still as the file has them."""
    path = Path(path)
    check_regular(path)
    suffix = path.suffix.lower()
    if suffix == ".c3d":
        from bsip_cli.recordings.c3d import open_c3d

        return open_c3d(path)
    if suffix == ".trc":
        from bsip_cli.recordings.trc_mot import open_trc_mot

        return open_trc_mot(path)
    raise BadDataError(
        f"a recording of type '{suffix}'",
        expected="a .c3d or a .trc file",
        remedy="export it as C3D",
        file=path,
    )
