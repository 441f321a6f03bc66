"""Which column of a recording is which marker of a marker set."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.model import Finding

_UNLABELLED = re.compile(r"^(\*.*|#+|u\d+|unlabell?ed.*|)$", re.IGNORECASE)
_SECOND_PERSON, _FEW = 0.3, 3  # of the markers the first one has, and at least so many
_CUT = 4  # characters


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


def match_labels(
    labels: Sequence[str],
    wanted: Mapping[str, Sequence[str]],
    *,
    optional: Collection[str] = (),
    seen: Iterable[bool] | None = None,
    prefix: str = "",
) -> LabelMatch:
    """Find each wanted marker (canonical name -> aliases) among a recording's labels.

    Exact spellings go before those that differ in case, then in separators, then by being cut to 4
    characters; canonical names go before aliases. Unlabelled points never match; a label that two
    columns share matches none of them.

    Parameters
    ----------
    optional : wanted markers that nobody misses.
    seen : whether each column has any data; without it a column counts as not there.
    prefix : whose markers count where a file holds several people, as ``Subject:``; empty chooses
        the only one.

    Raises
    ------
    BadDataError
        Two people in the file and no prefix, no label with the prefix, or many labels that several
        columns share.
    """
    there = [True] * len(labels) if seen is None else [bool(one) for one in seen]
    prefix = _wished(labels, prefix) if prefix else _person(labels, wanted, there)
    bare = {i: b for i, label in enumerate(labels) if (b := _bare(label, prefix)) is not None}
    counts = Counter(b for i, b in bare.items() if there[i])
    unique = {b: i for i, b in bare.items() if there[i] and counts[b] == 1}
    index = _match(unique, wanted)
    missing = tuple(name for name in wanted if name not in index)
    shared = _spelt(missing, wanted, [b for b, n in counts.items() if n > 1])
    if len(shared) >= max(_FEW, _SECOND_PERSON * len(wanted)):
        raise _ambiguous(shared, len(wanted))
    empty = _spelt(missing, wanted, [b for i, b in bare.items() if not there[i]])
    missed = [name for name in missing if name not in optional]
    findings = _findings(len(wanted) - len(optional), missed, shared, empty)
    return LabelMatch(index, missing, prefix, findings)


def found_among(labels: Sequence[str], wanted: Mapping[str, Sequence[str]]) -> set[str]:
    """The wanted markers that some label means; labels without prefixes."""
    named = {label: i for i, label in enumerate(labels) if not is_unlabelled(label)}
    return set(_match(named, wanted))


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


def _wished(labels: Sequence[str], prefix: str) -> str:
    """The prefix as the labels have it, with or without its colon in the wish."""
    known = prefixes(labels)
    for spelling in (prefix, f"{prefix}:"):
        if spelling in known:
            return spelling
    raise BadDataError(
        f"no label begins with '{prefix}'",
        expected=f"one of {', '.join(known)}" if known else "labels like 'Subject:RASI'",
        remedy="correct the prefix",
    )


def _person(
    labels: Sequence[str], wanted: Mapping[str, Sequence[str]], there: Sequence[bool]
) -> str:
    """The prefix with the most wanted markers; a second person is refused."""
    found: dict[str, int] = {}
    for prefix in ("", *prefixes(labels)):
        split = [_split(label) for i, label in enumerate(labels) if there[i]]
        bare = [b for p, b in split if p == prefix and not is_unlabelled(b)]
        found[prefix] = len(_match({b: i for i, b in enumerate(bare)}, wanted))
    first = max(found, key=lambda prefix: found[prefix])
    others = [
        prefix
        for prefix, n in found.items()
        if prefix != first and n >= max(_FEW, _SECOND_PERSON * found[first])
    ]
    if others:
        people = ", ".join(f"'{p}' ({found[p]} markers)" for p in [first, *others])
        raise BadDataError(
            f"{1 + len(others)} people in one file: {people}",
            expected="one person per recording",
            remedy="export one file per person, or say whose markers count: in study.toml "
            f'[ingest] prefixes = {{ sub-01 = "{first or others[0]}" }}, for bsip markers --prefix',
        )
    return first


def _match(unique: Mapping[str, int], wanted: Mapping[str, Sequence[str]]) -> dict[str, int]:
    """Canonical name -> column; each column serves one marker."""
    index: dict[str, int] = {}
    taken: set[int] = set()
    levels = [_same, _folded, _joined]
    if _are_cut(unique):
        levels.append(_cut)
    for spelling in levels:
        known = _by_spelling(unique, spelling)
        if spelling is _cut:  # what two markers are cut to may be either
            shared = Counter(map(spelling, wanted))
            known = {s: i for s, i in known.items() if shared[s] < 2}
        for first in (slice(0, 1), slice(1, None)):
            for name, aliases in wanted.items():
                names = (name, *aliases)[first]
                column = next((known[s] for n in names if (s := spelling(n)) in known), None)
                if name not in index and column is not None and column not in taken:
                    index[name] = column
                    taken.add(column)
    return {name: index[name] for name in wanted if name in index}


def _by_spelling(unique: Mapping[str, int], spelling: Callable[[str], str]) -> dict[str, int]:
    """Columns by a simpler spelling; what two labels come down to is left out."""
    counts = Counter(map(spelling, unique))
    return {s: i for label, i in unique.items() if counts[s := spelling(label)] == 1}


def _same(name: str) -> str:
    return name


def _folded(name: str) -> str:
    return name.casefold()


def _joined(name: str) -> str:
    """Without separators: R.ASIS, R_ASIS and RASIS are one."""
    return re.sub(r"[\s._-]", "", name.casefold())


def _cut(name: str) -> str:
    """As old formats cut labels."""
    return name.casefold()[:_CUT]


def _are_cut(bare: Collection[str]) -> bool:
    """Most have the length that old formats cut to; descriptions may have restored the others."""
    return bool(bare) and 2 * sum(len(label) == _CUT for label in bare) > len(bare)


def _spelt(
    names: Sequence[str], wanted: Mapping[str, Sequence[str]], bare: Sequence[str]
) -> list[str]:
    """Those of the names that bare labels may mean, case aside, and cut where labels are."""
    spelling = _cut if _are_cut(bare) else _folded
    spelt = {spelling(b) for b in bare}
    return [n for n in names if any(spelling(s) in spelt for s in (n, *wanted[n]))]


def _ambiguous(shared: Sequence[str], wanted: int) -> BadDataError:
    return BadDataError(
        f"{len(shared)} of {wanted} markers have a label that several points share: "
        f"{', '.join(shared)}",
        expected="one point per label",
        remedy="if the labels are cut short, export them in full or put the names into "
        "POINT:DESCRIPTIONS; if two people are in the file, export one file per person or labels "
        "with prefixes",
    )


def _findings(
    wanted: int, missing: Sequence[str], shared: Sequence[str], empty: Sequence[str]
) -> tuple[Finding, ...]:
    lost = [
        (shared, "a label that several columns share", "left them out"),
        (empty, "labelled, but seen in no frame", "left them out"),
        (missing, f"{len(missing)} of {wanted} markers not in the file", "went on without them"),
    ]
    return tuple(
        Finding("labels", ", ".join(names), found, "one column per marker", action, "warning")
        for names, found, action in lost
        if names
    )
