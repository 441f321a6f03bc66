"""Which file of ground forces belongs to a TRC: its name says it."""

from __future__ import annotations

import re
from pathlib import Path

from bsip_cli.errors import BadDataError, printable
from bsip_cli.files.folders import entries

ENDINGS = (".mot", ".sto")
_WORD = re.compile(r"[-_ .](?:grfs?|forces?)$", re.IGNORECASE)


def trial_stem(forces: Path) -> str:
    """The name of the trial whose forces a file holds: 'walk' of walk_grf.mot."""
    return _WORD.sub("", forces.stem)


def forces_beside(trc: Path) -> Path | None:
    """The file of ground forces beside a TRC, in small letters or capitals; None without one.

    BadDataError: there are several, and which one is meant cannot be known.
    """
    own = trc.stem.casefold()
    found = [
        path
        for path in entries(trc.parent)
        if path.suffix.lower() in ENDINGS
        if own in (path.stem.casefold(), trial_stem(path).casefold())
    ]
    if len(found) > 1:
        raise BadDataError(
            f"there are {' and '.join(printable(path.name) for path in found)} beside it",
            file=trc,
            expected="one file of ground forces",
            remedy="leave the one with the forces there, and move the others elsewhere",
        )
    return found[0] if found else None
