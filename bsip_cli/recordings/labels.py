"""Which column of a recording is which marker of a marker set."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.model import Finding

_UNLABELLED = re.compile(r"^(\*.*|#+|u\d+|unlabell?ed.*|)$", re.IGNORECASE)
_SECOND_PERSON = 0.3  # of the markers the first one has, and at least three


@dataclass(frozen=True)
class LabelMatch:
    """Where each wanted marker is."""

    index: dict[str, int]  # canonical name -> column of the recording
    missing: tuple[str, ...]
    prefix: str  # the common prefix that was stripped, with its colon
    findings: tuple[Finding, ...]

    def share(self) -> float:
        """Share of the wanted markers that were found."""
        wanted = len(self.index) + len(self.missing)
        return len(self.index) / wanted if wanted else 0.0


def match_labels(labels: Sequence[str], wanted: Mapping[str, Sequence[str]]) -> LabelMatch:
    """Find each wanted marker (canonical name -> aliases) among a recording's labels.

    Exact spellings go before spellings in other case, canonical names before aliases.
    Unlabelled points never match; a label that two columns share matches none of them.
    """
    prefix = _person(labels, wanted)
    own = {i: bare for i, label in enumerate(labels) if (bare := _bare(label, prefix)) is not None}
    counts = Counter(own.values())
    unique = {bare: i for i, bare in own.items() if counts[bare] == 1}
    index = _match(unique, wanted)
    missing = tuple(name for name in wanted if name not in index)
    return LabelMatch(index, missing, prefix, _findings(counts, wanted, missing))


def is_unlabelled(label: str) -> bool:
    """A point without a name: empty, '*12', 'U3', 'Unlabelled_7'."""
    return bool(_UNLABELLED.match(label.split(":")[-1].strip()))


def prefixes(labels: Sequence[str]) -> tuple[str, ...]:
    """All prefixes 'Subject:' in the order of their first use."""
    return tuple(dict.fromkeys(_split(label)[0] for label in labels if ":" in label))


def _split(label: str) -> tuple[str, str]:
    """'Subject:RASI' to ('Subject:', 'RASI')."""
    before, colon, bare = label.strip().rpartition(":")
    return before + colon, bare.strip()


def _bare(label: str, prefix: str) -> str | None:
    """The label without the person's prefix; None if it belongs to another or to nothing."""
    own_prefix, bare = _split(label)
    if own_prefix not in ("", prefix) or is_unlabelled(bare):
        return None
    return bare


def _person(labels: Sequence[str], wanted: Mapping[str, Sequence[str]]) -> str:
    """The prefix with the most wanted markers; a second person is refused."""
    found: dict[str, int] = {}
    for prefix in ("", *prefixes(labels)):
        bare = [b for p, b in map(_split, labels) if p == prefix and not is_unlabelled(b)]
        found[prefix] = len(_match({b: i for i, b in enumerate(bare)}, wanted))
    first = max(found, key=lambda prefix: found[prefix])
    others = [
        prefix
        for prefix, n in found.items()
        if prefix != first and n >= max(3, _SECOND_PERSON * found[first])
    ]
    if others:
        people = ", ".join(f"'{p}' ({found[p]} markers)" for p in [first, *others])
        raise BadDataError(
            f"{1 + len(others)} people in one file: {people}",
            expected="one person per recording",
            remedy="export one file per person",
        )
    return first


def _match(unique: Mapping[str, int], wanted: Mapping[str, Sequence[str]]) -> dict[str, int]:
    """Canonical name -> column; each column serves one marker."""
    folded: dict[str, int] = {}
    for bare, i in unique.items():
        folded.setdefault(bare.casefold(), i)
    index: dict[str, int] = {}
    for level in (_exact_name, _exact_alias, _folded_name):
        for name, aliases in wanted.items():
            if name in index:
                continue
            columns = level(name, aliases, unique, folded)
            free = [i for i in columns if i not in index.values()]
            if free:
                index[name] = free[0]
    return {name: index[name] for name in wanted if name in index}


def _exact_name(
    name: str, _aliases: Sequence[str], unique: Mapping[str, int], _folded: Mapping[str, int]
) -> list[int]:
    return [unique[name]] if name in unique else []


def _exact_alias(
    _name: str, aliases: Sequence[str], unique: Mapping[str, int], _folded: Mapping[str, int]
) -> list[int]:
    return [unique[alias] for alias in aliases if alias in unique]


def _folded_name(
    name: str, aliases: Sequence[str], _unique: Mapping[str, int], folded: Mapping[str, int]
) -> list[int]:
    spellings = [spelling.casefold() for spelling in (name, *aliases)]
    return [folded[spelling] for spelling in spellings if spelling in folded]


def _findings(
    counts: Mapping[str, int], wanted: Mapping[str, Sequence[str]], missing: Sequence[str]
) -> tuple[Finding, ...]:
    twice = {bare.casefold() for bare, n in counts.items() if n > 1}
    lost = [name for name in missing if any(s.casefold() in twice for s in (name, *wanted[name]))]
    findings = []
    if lost:
        found = "a label that several columns share"
        findings.append(_finding("labels", ", ".join(lost), found, "left them out"))
    if missing:
        found = f"{len(missing)} of {len(wanted)} markers not in the file"
        findings.append(_finding("labels", ", ".join(missing), found, "went on without them"))
    return tuple(findings)


def _finding(check: str, subject: str, found: str, action: str) -> Finding:
    return Finding(check, subject, found, "one column per marker", action, "warning")
