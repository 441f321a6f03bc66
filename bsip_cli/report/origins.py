"""Options, versions and inputs that made the results, out of the artifacts' provenance."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence

from bsip_cli.report.blocks import Block, Cell, Grid, Heading
from bsip_cli.report.records import Origin

_HASH_DIGITS = 12


def options_grids(origins: Sequence[Origin]) -> list[Block]:
    """Options, versions, and the recordings with the start of their hashes."""
    blocks: list[Block] = [
        Heading("Options"),
        Grid(("option", "value"), _rows(_options(origins)), words=2),
        Heading("Versions"),
        Grid(("software", "version"), _rows(_versions(origins)), words=2),
    ]
    recordings = {
        name: digest[:_HASH_DIGITS]
        for origin in origins
        for name, digest in origin.inputs.items()
        if not name.endswith(".parquet")
    }
    if recordings:
        rows = tuple(sorted(recordings.items()))
        blocks += [
            Heading("Recordings and files read"),
            Grid(("file", "SHA-256 (start)"), rows, words=2),
        ]
    return blocks


def _rows(values: Mapping[str, set[str]]) -> tuple[tuple[str | Cell, ...], ...]:
    """A name and its value; several values of one name are set off: stages differ."""
    return tuple(
        (name, Cell(" / ".join(sorted(found)), "warning" if len(found) > 1 else ""))
        for name, found in sorted(values.items())
    )


def _options(origins: Iterable[Origin]) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for origin in origins:
        for name, value in _flat(origin.options):
            found.setdefault(name, set()).add(value)
    return found


def _flat(options: Mapping, before: str = "") -> Iterable[tuple[str, str]]:
    for name, value in options.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", value if isinstance(value, str) else json.dumps(value)


def _versions(origins: Iterable[Origin]) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for origin in origins:
        found.setdefault("bsip", set()).add(origin.bsip_version)
        for name, version in origin.libraries.items():
            found.setdefault(name, set()).add(version)
    return found
