"""``OUT/dataset_description.json``: what the folder of results is, as BIDS derivatives have it."""

from __future__ import annotations

import json
from pathlib import Path

from bsip_cli import __version__
from bsip_cli.artifacts import write_atomically

NAME = "dataset_description.json"
BIDS_VERSION = "1.10.0"


def describe_dataset(out: Path, study: Path) -> None:
    """Write the description unless the same one is there.

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
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        write_atomically(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
