"""Which column of a recording is which marker of a marker set, and what all labels of a person
begin or end with: ``Subject:``, ``S01_``, ``-Raw``."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.model import Finding

_UNLABELLED = re.compile(r"^(\*.*|#+|u\d+|unlabell?ed.*|)$", re.IGNORECASE)
_SECOND_PERSON = 0.3  # of the markers the first one has
_CUT = 4  # characters
_APART = " :_.-"  # what sets a person's name apart from a marker's

_HEADS = 0.2  # of the labels begin alike, up to a separator: five people in one file at most
_TAILS = 0.6  # end alike from a separator on: fewer may be those on the lateral side, KNEE_LAT
_FEW = 3  # places more that they name, or markers: fewer may be chance,
_ALL = 0.9  # of the labels where no separator is, or where one place more is enough
_SEPARATORS = " _.-"
_LONGEST = 40  # characters: nobody's name is longer, and hostile labels may be


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
    index = columns_of(unique, wanted)
    missing = tuple(name for name in wanted if name not in index)
    shared = _spelt(missing, wanted, [b for b, n in counts.items() if n > 1])
    if len(shared) >= max(_FEW, _SECOND_PERSON * len(wanted)):
        raise BadDataError(
            f"{len(shared)} of {len(wanted)} markers have a label that several points share: "
            f"{', '.join(shared)}",
            expected="one point per label",
            remedy="if the labels are cut short, export them in full or put the names into "
            "POINT:DESCRIPTIONS; if two people are in the file, export one file per person or "
            "labels with prefixes",
        )
    empty = _spelt(missing, wanted, [b for i, b in bare.items() if not there[i]])
    missed = [name for name in missing if name not in optional]
    n_wanted = len(wanted) - len(optional)
    lost = [
        (shared, "a label that several columns share", "left them out"),
        (empty, "labelled, but seen in no frame", "left them out"),
        (missed, f"{len(missed)} of {n_wanted} markers not in the file", "went on without them"),
    ]
    findings = [
        Finding("labels", ", ".join(names), found, "one column per marker", action, "warning")
        for names, found, action in lost
        if names
    ]
    return LabelMatch(index, missing, str(person.affix), (*person.findings, *findings))


def found_among(labels: Sequence[str], wanted: Mapping[str, Sequence[str]]) -> set[str]:
    """The wanted markers that some label means; labels without prefixes."""
    named = {label: i for i, label in enumerate(labels) if not is_unlabelled(label)}
    return set(columns_of(named, wanted))


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
    own = by_person(named, count)
    known = tuple(own)
    found = {affix: count(list(bare.values())) for affix, bare in own.items()}
    if prefix:
        chosen = _wished(labels, known, prefix)
    else:
        chosen = max(known, key=found.__getitem__, default=Affix())
    least = max(_FEW, _SECOND_PERSON * found.get(chosen, 0))
    rivals = [a for a in known if a != chosen and found[a] >= least]
    others = [chosen, *(a for a in rivals if a.head != chosen.head)]
    if len(others) > 1 and not prefix:
        one = str(others[0]) or str(others[1])
        listed = ", ".join(f"'{affix}' ({found[affix]} markers)" for affix in others)
        raise BadDataError(
            f"{len(others)} people in one file: {listed}",
            expected="one person per recording",
            remedy="export one file per person, or say whose markers count: in study.toml "
            f'[ingest] prefixes = {{ sub-XX = "{one}" }}, for bsip markers --prefix',
        )
    known = (*known, chosen)
    joined = {"", chosen.head} - {affix.head for affix in rivals}
    names = {
        i: affix.off(label.strip())
        for i, label in enumerate(labels)
        if (affix := owner(label, known)) is not None
        and not is_unlabelled(label)
        and (affix == chosen or (affix.head in joined and affix not in rivals))
    }
    findings = [
        Finding(
            "labels",
            str(chosen) or "without ending",
            f"{found[other]} markers are there twice, once {_ending(other)}",
            "one column per marker",
            f"took those {_ending(chosen)}",
            "warning",
        )
        for other in rivals
        if other.head == chosen.head
    ]
    return Person(chosen, names, tuple(findings))


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


def _ending(affix: Affix) -> str:
    return f"whose labels end in '{affix.tail}'" if affix.tail else "without an ending"


def columns_of(unique: Mapping[str, int], wanted: Mapping[str, Sequence[str]]) -> dict[str, int]:
    """Wanted marker -> column, of distinct labels without prefixes; each serves one marker."""
    index: dict[str, int] = {}
    levels: list[Callable[[str], str]] = [
        str,
        str.casefold,
        _joined,
        *([_cut] if _are_cut(unique) else []),
    ]
    for spelling in levels:
        counts = Counter(map(spelling, unique))  # what two labels come down to is left out
        known = {s: i for label, i in unique.items() if counts[s := spelling(label)] == 1}
        if spelling is _cut:  # what two markers are cut to may be either
            shared = Counter(map(spelling, wanted))
            known = {s: i for s, i in known.items() if shared[s] < 2}
        for first in (slice(0, 1), slice(1, None)):
            for name, aliases in wanted.items():
                names = (name, *aliases)[first]
                column = next((known[s] for n in names if (s := spelling(n)) in known), None)
                if name not in index and column is not None and column not in index.values():
                    index[name] = column
    return {name: index[name] for name in wanted if name in index}


def _joined(name: str) -> str:
    """Without separators: R.ASIS, R_ASIS and RASIS are one."""
    return re.sub(r"[\s._-]", "", name.casefold())


def _cut(name: str) -> str:
    """As old formats cut labels."""
    return name.casefold()[:_CUT]


def spelling_of(bare: Collection[str]) -> Callable[[str], str]:
    """What two labels must share to be one marker's."""
    return _cut if _are_cut(bare) else str.casefold


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


# --- what all labels of a person share ------------------------------------------------------------

Count = Callable[[Sequence[str]], int]  # how many bones, or wanted markers, these labels name


@dataclass(frozen=True)
class Affix:
    """Head and tail that are no part of a marker's name; both may be empty."""

    head: str = ""
    tail: str = ""

    def marks(self, label: str) -> bool:
        """Whether a label has them, and a name between."""
        return (
            label.startswith(self.head)
            and label.endswith(self.tail)
            and len(label) > len(self.head) + len(self.tail)
        )

    @property
    def is_set_apart(self) -> bool:
        """Whether a separator stands between it and the name."""
        return self.head[-1:] in _SEPARATORS and self.tail[:1] in _SEPARATORS

    @property
    def least_share(self) -> float:
        """The part of a file's labels that must have it."""
        if not self.is_set_apart:
            return _ALL
        return _HEADS if self.head else _TAILS

    def off(self, label: str) -> str:
        """The name without them."""
        return label[len(self.head) : len(label) - len(self.tail)].strip()

    def __str__(self) -> str:
        return self.head + ("..." if self.head and self.tail else "") + self.tail


def split(label: str) -> tuple[str, str]:
    """'Subject:RASI' to ('Subject:', 'RASI')."""
    before, colon, bare = label.strip().rpartition(":")
    return before + colon, bare.strip()


def affixes(labels: Sequence[str], count: Count) -> tuple[Affix, ...]:
    """One per person of a file, the empty one for labels that have none.

    What stands before a colon is always one. Else it is the longest head or tail that many labels
    share whose removal makes them name the most.
    """
    groups: dict[str, list[str]] = {}
    for label in labels:
        before, bare = split(label)
        groups.setdefault(before, []).append(bare)
    return tuple(
        Affix(before + own.head, own.tail)
        for before, group in groups.items()
        for own in _of_group(group, count)
    )


def by_person(labels: Sequence[str], count: Count) -> dict[Affix, dict[str, str]]:
    """Each person's labels, with what they are without what they share."""
    known = affixes(labels, count)
    found: dict[Affix, dict[str, str]] = {affix: {} for affix in known}
    for label in labels:
        if (affix := owner(label, known)) is not None:
            found[affix][label] = affix.off(label.strip())
    return found


def owner(label: str, known: Sequence[Affix]) -> Affix | None:
    """The longest of the affixes that a label has."""
    fitting = [affix for affix in known if affix.marks(label.strip())]
    return max(fitting, key=lambda affix: len(affix.head) + len(affix.tail), default=None)


def _of_group(labels: Sequence[str], count: Count) -> list[Affix]:
    found, rest = [], list(dict.fromkeys(labels))
    n_labels = len(rest)
    while (affix := _best(rest, n_labels, count)) is not None:
        found.append(affix)
        rest = [label for label in rest if not affix.marks(label)]
    return [*found, Affix()] if rest or not found else found


def _best(labels: Sequence[str], n_labels: int, count: Count) -> Affix | None:
    """The affix whose removal makes the labels name the most, the longest of equals.

    One of nearly all labels, set apart by a separator, goes first.
    """
    cuts = [(label, k) for label in labels for k in range(1, min(len(label), _LONGEST))]
    shared = Counter(Affix(head=label[:k]) for label, k in cuts)
    shared.update(Affix(tail=label[-k:]) for label, k in cuts)
    marked = {a: n for a, n in shared.items() if n >= max(_FEW, a.least_share * n_labels)}
    now, gains = count(labels), {}
    for affix in marked:
        gains[affix] = count([affix.off(x) if affix.marks(x) else x for x in labels]) - now
    of_all = [a for a in marked if a.is_set_apart and marked[a] >= _ALL * len(labels)]
    for candidates, enough in ((of_all, 1), (marked, _FEW)):
        better = [affix for affix in candidates if gains[affix] >= enough]
        if better:
            return max(better, key=lambda a: (gains[a], len(a.head) + len(a.tail)))
    return None
