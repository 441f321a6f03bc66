"""The folder of results: where it may lie, and what it says of itself to users of BIDS."""

from __future__ import annotations

import json
import os
from pathlib import Path

from bsip_cli import __version__
from bsip_cli.artifacts import write_bytes
from bsip_cli.errors import UsageError
from bsip_cli.files.folders import check_path, is_folder, lies_in
from bsip_cli.files.regular import fault_of
from bsip_cli.study.participants import NAME as NAME_OF_PERSON

NAME = "dataset_description.json"
BIDS_VERSION = "1.10.0"


def make_out(out: Path, study: Path) -> None:
    """Make sure that there is a folder for results, apart from the recordings.

    Raises
    ------
    UsageError
        It is the study, lies above it or in a participant's folder, or cannot be made.
    """
    check_path(out)
    if found := _in_the_way(out, study):
        raise UsageError(
            found,
            file=out,
            expected="a folder for results, apart from the recordings",
            remedy=f"name another one with --out, like {study / 'derivatives' / 'bsip'}",
        )
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"is no folder to write to ({error.strerror})", file=out, remedy="check --out"
        ) from None


def _in_the_way(out: Path, study: Path) -> str:
    """Why results cannot lie there; empty if they can."""
    if os.path.lexists(out) and not is_folder(out):
        return f"is no folder to write to: it {fault_of(out) or 'is a file'}"
    if lies_in(study, out):
        return "is the study" if _is_same(out, study) else "holds the study"
    people = [path for path in study.glob("sub-*") if NAME_OF_PERSON.fullmatch(path.name)]
    homes = [home for person in people for home in (person, *person.glob("ses-*"))]
    inside = [home.name for home in homes if lies_in(out, home)]
    real = Path(os.path.realpath(out))
    for path in (real, *real.parents):  # a folder that would be taken for a participant's
        if NAME_OF_PERSON.fullmatch(path.name) and _is_same(path.parent, study):
            inside.append(path.name)
    return f"is the folder of {inside[0]} or lies in it" if inside else ""


def _is_same(one: Path, other: Path) -> bool:
    return lies_in(one, other) and lies_in(other, one)


def describe_dataset(out: Path, study: Path) -> str:
    """Write the description unless the same one is there; what to say of one of other origin.

    Raises
    ------
    UsageError
        It cannot be written.
    """
    description = {
        "Name": f"bsip results of {study.resolve().name}",
        "BIDSVersion": BIDS_VERSION,
        "DatasetType": "derivative",
        "GeneratedBy": [
            {
                "Name": "bsip",
                "Version": __version__,
                "Description": "body segment inertial parameters from motion and ground forces",
            }
        ],
    }
    text = json.dumps(description, indent=2) + "\n"
    path = out / NAME
    if os.path.lexists(path):
        found = _own_text(path)
        if found is None:
            return f"{path}: is not of bsip, and stays as it is"
        if found == text:
            return ""
    write_bytes(path, text.encode())
    return ""


def _own_text(path: Path) -> str | None:
    """What a description says that bsip wrote; None of any other."""
    try:
        if path.is_symlink() or fault_of(path):
            return None
        text = path.read_text(encoding="utf-8")
        is_own = any(one["Name"] == "bsip" for one in json.loads(text)["GeneratedBy"])
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return None
    return text if is_own else None
