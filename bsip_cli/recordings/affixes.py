"""What all labels of a person begin or end with: ``Subject:``, ``S01_``, ``-Raw``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

_SHARED = 0.2  # of the labels begin or end alike: five people in one file at most
_FEW = 3  # labels: fewer may be understood by chance once they are cut

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

    What stands before a colon is always one. Else it is the longest head or tail, shared by a fifth
    of the labels, whose removal makes the labels name the most.
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
    least = max(_FEW, _SHARED * len(rest))
    while (affix := _best(rest, least, count)) is not None:
        found.append(affix)
        rest = [label for label in rest if not affix.marks(label)]
    return [*found, Affix()] if rest or not found else found


def _best(labels: Sequence[str], least: float, count: Count) -> Affix | None:
    """The affix whose removal makes the labels name the most, the longest of equals."""
    heads = Counter(label[:k] for label in labels for k in range(1, len(label)))
    tails = Counter(label[-k:] for label in labels for k in range(1, len(label)))
    candidates = [Affix(head=h) for h, n in heads.items() if n >= least]
    candidates += [Affix(tail=t) for t, n in tails.items() if n >= least]
    named = {affix: count(_without(labels, affix)) for affix in candidates}
    best = max(named, key=lambda a: (named[a], len(a.head) + len(a.tail)), default=None)
    return best if best is not None and named[best] - count(labels) >= _FEW else None


def _without(labels: Sequence[str], affix: Affix) -> list[str]:
    return [affix.off(label) if affix.marks(label) else label for label in labels]
