"""Which column of a recording is which marker of a marker set."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.affixes import Affix, Count, affixes, owner, split
from bsip_cli.recordings.model import Finding

_UNLABELLED = re.compile(r"^(\*.*|#+|u\d+|unlabell?ed.*|)$", re.IGNORECASE)
_SECOND_PERSON, _FEW = 0.3, 3  # of the markers the first one has, and at least so many
_CUT = 4  # characters
_APART = " :_.-"  # what sets a person's name apart from a marker's


@dataclass(frozen=True)
class Person:
    """Whose labels count: what they begin or end with, column -> name without it, what was said."""

    affix: Affix
    names: dict[int, str]
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True)
class LabelMatch:
    """Where each wanted marker is."""

    index: dict[str, int]  # canonical name -> column of the recording
    missing: tuple[str, ...]
    prefix: str  # what all labels of the person begin or end with, and was taken off
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
        the only one. Without a colon too: what all labels of a person begin or end with is found.

    Raises
    ------
    BadDataError
        Two people in the file and no prefix, no label with the prefix, or many labels that several
        columns share.
    """
    there = [True] * len(labels) if seen is None else [bool(one) for one in seen]
    person = person_of(labels, count_of(wanted), prefix, there)
    bare = person.names
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
    return LabelMatch(index, missing, str(person.affix), (*person.findings, *findings))


def found_among(labels: Sequence[str], wanted: Mapping[str, Sequence[str]]) -> set[str]:
    """The wanted markers that some label means; labels without prefixes."""
    named = {label: i for i, label in enumerate(labels) if not is_unlabelled(label)}
    return set(_match(named, wanted))


def columns_of(labels: Sequence[str], wanted: Mapping[str, Sequence[str]]) -> dict[str, int]:
    """Wanted marker -> place among distinct labels without prefixes."""
    return _match({label: i for i, label in enumerate(labels)}, wanted)


def is_unlabelled(label: str) -> bool:
    """A point without a name: empty, '*12', 'U3', 'Unlabelled_7'."""
    return bool(_UNLABELLED.match(split(label)[1]))


def count_of(wanted: Mapping[str, Sequence[str]]) -> Count:
    """A count of the wanted markers among labels, case and separators aside."""
    names = {_joined(spelt): name for name in wanted for spelt in (name, *wanted[name])}

    def count(labels: Sequence[str]) -> int:
        return len({names[s] for label in labels if (s := _joined(label)) in names})

    return count


def person_of(
    labels: Sequence[str], count: Count, prefix: str = "", there: Sequence[bool] | None = None
) -> Person:
    """The person with the most markers, by ``count``, or the one with a prefix.

    Raises
    ------
    BadDataError
        Two people and no prefix, or no label with the prefix.
    """
    named = [
        label.strip()
        for i, label in enumerate(labels)
        if not is_unlabelled(label) and (there is None or there[i])
    ]
    known = affixes(named, count)
    found = {affix: count(_own(named, affix, known)) for affix in known}
    if prefix:
        chosen = _wished(labels, known, prefix)
    else:
        chosen = max(known, key=found.__getitem__, default=Affix())
    least = max(_FEW, _SECOND_PERSON * found.get(chosen, 0))
    rivals = [a for a in known if a != chosen and found[a] >= least]
    others = [a for a in rivals if a.head != chosen.head]
    if others and not prefix:
        raise _several([chosen, *others], found)
    known = (*known, chosen)
    joined = {"", chosen.head} - {affix.head for affix in rivals}
    names = {
        i: affix.off(label.strip())
        for i, label in enumerate(labels)
        if (affix := owner(label, known)) is not None
        and not is_unlabelled(label)
        and (affix == chosen or (affix.head in joined and affix not in rivals))
    }
    versions = [affix for affix in rivals if affix.head == chosen.head]
    return Person(chosen, names, tuple(_other_version(chosen, v, found[v]) for v in versions))


def _own(labels: Sequence[str], affix: Affix, known: Sequence[Affix]) -> list[str]:
    return [affix.off(label) for label in labels if owner(label, known) == affix]


def _wished(labels: Sequence[str], known: Sequence[Affix], prefix: str) -> Affix:
    """What was asked for as the labels have it, with or without what sets it apart."""
    for affix in known:
        if prefix and prefix.strip(_APART) in (affix.head.strip(_APART), affix.tail.strip(_APART)):
            return affix
    if any(Affix(prefix).marks(label.strip()) for label in labels):
        return Affix(prefix)
    names = [str(affix) for affix in known if str(affix)]
    raise BadDataError(
        f"no label begins with '{prefix}'",
        expected=f"one of {', '.join(names)}" if names else "labels like 'Subject:RASI'",
        remedy="correct the prefix",
    )


def _several(people: Sequence[Affix], found: Mapping[Affix, int]) -> BadDataError:
    listed = ", ".join(f"'{affix}' ({found[affix]} markers)" for affix in people)
    one = str(people[0]) or str(people[1])
    return BadDataError(
        f"{len(people)} people in one file: {listed}",
        expected="one person per recording",
        remedy="export one file per person, or say whose markers count: in study.toml "
        f'[ingest] prefixes = {{ sub-01 = "{one}" }}, for bsip markers --prefix',
    )


def _other_version(chosen: Affix, other: Affix, n_found: int) -> Finding:
    return Finding(
        "labels",
        str(chosen) or "without ending",
        f"{n_found} markers are there twice, once {_ending(other)}",
        "one column per marker",
        f"took those {_ending(chosen)}",
        "warning",
    )


def _ending(affix: Affix) -> str:
    return f"whose labels end in '{affix.tail}'" if affix.tail else "without an ending"


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


def spelling_of(bare: Collection[str]) -> Callable[[str], str]:
    """What two labels must share to be one marker's."""
    return _cut if _are_cut(bare) else _folded


def _are_cut(bare: Collection[str]) -> bool:
    """Most have the length that old formats cut to; descriptions may have restored the others."""
    return bool(bare) and 2 * sum(len(label) == _CUT for label in bare) > len(bare)


def _spelt(
    names: Sequence[str], wanted: Mapping[str, Sequence[str]], bare: Sequence[str]
) -> list[str]:
    """Those of the names that bare labels may mean, case aside, and cut where labels are."""
    spelling = spelling_of(bare)
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
