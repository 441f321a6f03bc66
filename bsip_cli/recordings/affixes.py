"""What all labels of a person begin or end with: ``Subject:``, ``S01_``, ``-Raw``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

_HEADS = 0.2  # of the labels begin alike, up to a separator: five people in one file at most
_TAILS = 0.6  # end alike from a separator on: fewer may be those on the lateral side, KNEE_LAT
_FEW = 3  # places more that they name: fewer may be chance,
_ALL = 0.9  # of the labels where no separator is, or where one place more is enough
_SEPARATORS = " _.-"
_LONGEST = 40  # characters: nobody's name is longer, and hostile labels may be

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
    now = count(labels)
    gains = {affix: count(_without(labels, affix)) - now for affix in marked}
    of_all = [a for a in marked if a.is_set_apart and marked[a] >= _ALL * len(labels)]
    for candidates, enough in ((of_all, 1), (marked, _FEW)):
        better = [affix for affix in candidates if gains[affix] >= enough]
        if better:
            return max(better, key=lambda a: (gains[a], len(a.head) + len(a.tail)))
    return None


def _without(labels: Sequence[str], affix: Affix) -> list[str]:
    return [affix.off(label) if affix.marks(label) else label for label in labels]
