"""Which file of ground forces belongs to a TRC: its name says it."""

from __future__ import annotations

from pathlib import Path

from bsip_cli.errors import BadDataError, printable
from bsip_cli.files.folders import entries

ENDINGS = (".mot", ".sto")
_NAMES = tuple(f"{word}{ending}" for word in ("", "_grf", "_forces") for ending in ENDINGS)


def forces_beside(trc: Path) -> Path | None:
    """The file of ground forces beside a TRC, in small letters or capitals; None without one.

    Raises
    ------
    BadDataError
        There are several, and which one is meant cannot be known.
    """
    wanted = {f"{trc.stem}{name}".casefold() for name in _NAMES}
    found = [path for path in entries(trc.parent) if path.name.casefold() in wanted]
    if len(found) > 1:
        raise BadDataError(
            f"there are {' and '.join(printable(path.name) for path in found)} beside it",
            file=trc,
            expected="one file of ground forces",
            remedy="leave the one with the forces there, and move the others elsewhere",
        )
    return found[0] if found else None
