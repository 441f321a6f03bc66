"""Options, versions and inputs that made the results, out of the artifacts' provenance."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from bsip_cli.report.blocks import Block, Bullets, Grid, Heading, Paragraph, Terms
from bsip_cli.report.records import Message, Origin, messages_of
from bsip_cli.report.words import labelled

_HASH_DIGITS = 12
_MOST_WARNINGS = 6


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

    def number(self, option: str, otherwise: float) -> float:
        """An option that was run with."""
        return float(next(iter(self.options.get(option, ())), otherwise))


def how_made(made: HowMade, defaults: Mapping[str, Any]) -> list[Block]:
    """Warnings, versions, options that differ from the shipped ones, and the recordings with the
    start of their hashes."""
    said = [
        f"{stage}{f' ({unit})' if unit else ''}: {labelled(text)}"
        for stage, unit, text in made.messages
    ]
    blocks: list[Block] = [Heading("Warnings")]
    if said:
        blocks.append(Bullets(tuple(said[:_MOST_WARNINGS])))
    if len(said) > _MOST_WARNINGS:
        blocks.append(Paragraph(f"{len(said) - _MOST_WARNINGS} more in the artifacts.", "note"))
    if not said:
        blocks.append(Paragraph("No stage had anything to warn of."))
    shipped = {name: {value} for name, value in _flat(defaults)}
    changed = {n: v for n, v in made.options.items() if n in shipped and v != shipped[n]}
    blocks.append(Heading("Options that differ from the shipped ones"))
    if changed:
        blocks.append(Terms(tuple((n, " / ".join(sorted(v))) for n, v in sorted(changed.items()))))
    else:
        blocks.append(Paragraph("None."))
    versions = (f"{name} {' / '.join(sorted(v))}" for name, v in sorted(made.versions.items()))
    blocks += [Heading("Versions"), Paragraph(", ".join(versions))]
    if made.files:
        rows = tuple((name, made.files[name][:_HASH_DIGITS]) for name in sorted(made.files))
        blocks.append(Grid(("file read", "SHA-256 (start)"), rows, words=2))
    return blocks


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
