"""Options, versions and inputs that made the results, out of the artifacts' provenance."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from bsip_cli.report.blocks import Block, Cell, Grid, Heading
from bsip_cli.report.records import Message, Origin, messages_of

_HASH_DIGITS = 12


@dataclass(frozen=True)
class HowMade:
    """What made many artifacts, without what they share again and again.

    options, versions : name -> all values; files : recordings and the like, name -> SHA-256.
    """

    options: dict[str, set[str]] = field(default_factory=dict)
    versions: dict[str, set[str]] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)
    messages: dict[Message, None] = field(default_factory=dict)

    @classmethod
    def of(cls, origins: Iterable[Origin]) -> HowMade:
        made = cls()
        for origin in origins:
            for name, value in _flat(origin.options):
                made.options.setdefault(name, set()).add(value)
            for name, version in {"bsip": origin.bsip_version, **origin.libraries}.items():
                made.versions.setdefault(name, set()).add(version)
            made.files.update(_files(origin.inputs))
            made.messages.update(dict.fromkeys(messages_of(origin)))
        return made


def options_grids(made: HowMade) -> list[Block]:
    """Options, versions, and the recordings with the start of their hashes."""
    blocks: list[Block] = [
        Heading("Options"),
        Grid(("option", "value"), _rows(made.options), words=2),
        Heading("Versions"),
        Grid(("software", "version"), _rows(made.versions), words=2),
    ]
    if made.files:
        rows = tuple((name, made.files[name][:_HASH_DIGITS]) for name in sorted(made.files))
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


def _flat(options: Mapping, before: str = "") -> Iterable[tuple[str, str]]:
    for name, value in options.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", value if isinstance(value, str) else json.dumps(value)


def _files(inputs: Mapping[str, str]) -> dict[str, str]:
    """Inputs that are neither artifacts nor all of a participant's."""
    return {
        name: digest
        for name, digest in inputs.items()
        if "." in name and not name.endswith(".parquet")
    }
