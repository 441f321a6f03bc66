"""What a label seems to mean: side, segment and landmark, read from words of several languages."""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from itertools import accumulate, chain, pairwise
from typing import Any

from bsip_cli.files.regular import shipped
from bsip_cli.recordings.labels import by_person, split
from bsip_cli.segments import LANDMARKS, SEGMENTS

_COMMON = "common"
_CLUSTER = 3  # labels that differ by a number only: a cluster, none of which marks a bone
_AXES = ("0", "1", "2", "3")  # a drawn frame: origin and three axes
_MOST_WORDS, _LONGEST = 7, 60  # of a label that is understood: words, characters
_SHORTEST = 3  # letters of a label that has a side: RK and LB may be anything
_ACROSS = 0.5  # cost of a word that reaches across a separator,
_LETTER_ACROSS = 1.5  # and of one that takes in a single letter there: S_ACR is no sacrum
# Of a part that stand for a word each, the side among them; less one beside longer words. More are
# believed only where other labels have other letters at all their places but one.
_LETTERS = 3
_ALONE = 1.0  # cost of a side whose other side no label has
_SPECIAL = 0.98  # of the worth of a language that extends another: it must say more
_NUMBER_LEFT, _TRACKS = 0.1, 0.2  # cost of a meaning that leaves a number aside, or is no bone
_SIDELESS = 1.0  # or is a bone that has sides, without one
_NOUN_FIRST = 0.01  # of a word's cost per place: a noun goes before what says where on it


@dataclass(frozen=True)
class Meaning:
    """A label's segment and landmark (empty: only tracks the segment)."""

    segment: str
    landmark: str
    weight: float = field(default=1.0, compare=False)  # how far the marker is trusted

    @property
    def is_of_foot(self) -> bool:
        """The ankle's bones among it."""
        return self.segment.startswith("foot") or self.landmark.startswith("malleolus")


@dataclass(frozen=True)
class _Reading:
    """A way to cut a label into words: what they stand for, the side (l, r or empty), the cost."""

    concepts: tuple[str, ...]
    side: str
    cost: float
    side_at: tuple[int, int] = (0, 0)  # where the word of the side begins and ends
    initials: tuple[int, ...] = ()  # places of letters that stand for a word, no side
    is_doubtful: bool = False  # by letters that may be a word of another language


@dataclass(frozen=True, eq=False)
class _Language:
    """Word to what it may stand for, and word to side; the words of all languages among them.

    Where it has telltales, one of them must be among the labels: else it may be another language.
    """

    name: str
    words: Mapping[str, frozenset[tuple[str, ...]]]
    sides: Mapping[str, str]
    longest: int
    telltales: tuple[str, ...]
    part: float  # of its worth that counts

    def may_be(self, labels: Sequence[str]) -> bool:
        """Whether labels may be of this language."""
        if not self.telltales:
            return True
        spelt = list(map(_spelt, labels))
        return any(telltale in one for telltale in self.telltales for one in spelt)


@dataclass(frozen=True)
class _Grammar:
    """What concepts mean together, whatever the language."""

    landmarks: Mapping[frozenset[str], str]
    segments: Mapping[str, str]  # noun -> segment, without its side
    homes: Mapping[str, str]  # landmark, without its side -> segment, without its side
    weights: Mapping[str, float]  # of nouns that slide
    fillers: frozenset[str]
    never: frozenset[str]
    numbered: frozenset[str]


def meanings(labels: Sequence[str]) -> dict[str, Meaning]:
    """Label to meaning, for those that are understood; every landmark has one label at most.

    What all labels of a person begin or end with does not count, and all are read in the one
    language that understands most of them. Of several labels that seem to be one landmark the
    plainest has it, the others track; two that differ by a number are the lateral and the medial
    one of a joint, whichever is which; three or more are a cluster and only track.
    """
    return dict(_of_everybody(tuple(labels)))


@lru_cache(maxsize=32)  # the trials of a person have the same labels, and all ask for them
def _of_everybody(labels: tuple[str, ...]) -> dict[str, Meaning]:
    found: dict[str, Meaning] = {}
    for own in by_person(labels, bones).values():
        of_person = _meanings(list(own.values()))
        found |= {label: of_person[b] for label, b in own.items() if b in of_person}
    return {label: found[label] for label in labels if label in found}


def meaning_of(label: str) -> Meaning | None:
    """One label's meaning, or None; a prefix ``Subject:`` does not count."""
    bare = split(label)[1]
    return _meanings([bare]).get(bare)


def is_no_marker(label: str) -> bool:
    """Whether a label's words say that it is a joint centre or what else a program computed, or a
    thing."""
    ways = (_ways(split(label)[1], language) for language in _languages() if not language.telltales)
    certain = ([way for way in one if not way[3]] for one in ways)
    return any(min(one, key=lambda way: way[1])[0] is None for one in certain if one)


def bones(labels: Sequence[str]) -> int:
    """How many landmarks some labels name, taken as they are."""
    return len({meaning.landmark for meaning in _meanings(labels).values()} - {""})


# --- a person's labels ---------------------------------------------------------------------------


def _meanings(labels: Sequence[str]) -> dict[str, Meaning]:
    labels = list(dict.fromkeys(labels))
    stems = {label[:-1] for label in labels if label.endswith(_AXES[0])}
    frames = ({stem + axis for axis in _AXES} for stem in stems)  # that a program drew
    drawn = set().union(*(frame for frame in frames if frame <= {*labels}))
    real = [label for label in labels if label not in drawn and len(label) <= _LONGEST]
    read = {lang: _read_all(real, lang) for lang in _languages() if lang.may_be(real)}
    best = read[max(read, key=lambda lang: _worth(read[lang]) * lang.part)]
    return _decided({label: meaning for label, (meaning, _) in best.items()})


def _read_all(labels: Sequence[str], language: _Language) -> dict[str, tuple[Meaning, float]]:
    """Label to the meaning of the cheapest reading and its cost.

    A body has two sides: a reading whose other side is no label of the person's costs more.
    Initials are choices: a word of another language that is cut into letters has no label beside it
    in which one of them is another.
    """
    spelt, found = set(map(_spelt, labels)), {}
    with_a_gap = Counter((one[:k], one[k + 1 :]) for one in spelt for k in range(len(one)))
    for label in labels:
        text, costs = _spelt(label), []
        for meaning, cost, twins, initials in _ways(label, language):
            chosen = sum(with_a_gap[text[:k], text[k + 1 :]] > 1 for k in initials)
            if not initials or chosen >= max(1, len(initials) - 1):
                costs.append((meaning, cost + _ALONE * (bool(twins) and not twins & spelt)))
        meaning, cost = min(costs, key=lambda one: one[1], default=(None, 0.0))
        if meaning is not None:
            found[label] = meaning, cost
    return found


def _worth(found: Mapping[str, tuple[Meaning, float]]) -> float:
    """How much a language says: labels and bones; what takes many words counts less."""
    bony: dict[str, float] = {}
    for meaning, cost in found.values():
        bony[meaning.landmark] = max(bony.get(meaning.landmark, 0.0), 1 / cost)
    bony.pop("", None)
    return sum(1 / cost for _, cost in found.values()) + sum(bony.values())


def _decided(found: Mapping[str, Meaning]) -> dict[str, Meaning]:
    """One label per landmark; clusters only track."""
    stems = Counter((found[label], _stem(label)) for label in found)

    def plainness(label: str) -> tuple[bool, int, str]:
        return label[-1:].isdigit() and stems[found[label], _stem(label)] > 1, len(label), label

    holders: dict[str, str] = {}
    for label in sorted(found, key=plainness):
        landmark, stem = found[label].landmark, _stem(label)
        if stems[found[label], stem] < _CLUSTER:
            holder = holders.setdefault(landmark, label)
            if are_numbered(holder, label):
                holders.setdefault(medial_of(landmark), label)
    held = {label: landmark for landmark, label in holders.items()}
    return {
        label: replace(meaning, landmark=held.get(label, "")) for label, meaning in found.items()
    }


def medial_of(landmark: str) -> str:
    """The medial side of a lateral landmark's joint; empty where there is none."""
    other = landmark.replace("_lateral_", "_medial_")
    return other if other != landmark and other in LANDMARKS else ""


def are_numbered(one: str, other: str) -> bool:
    """Whether two labels differ in the number at their end only."""
    stem = _stem(one)
    return one != other and stem not in (one, other) and _stem(other) == stem


def _stem(label: str) -> str:
    return re.sub(r"[\s._-]*\d+$", "", label)


# --- one label -----------------------------------------------------------------------------------


@cache
def _ways(
    label: str, language: _Language
) -> tuple[tuple[Meaning | None, float, frozenset[str], tuple[int, ...]], ...]:
    """What a label may mean: meaning, cost, how the same on the other side would be spelt, and the
    places of its initials where these are doubtful."""
    grammar, spelling = _grammar(), _Spelling(label)
    ways = []
    for reading in _cuts(spelling, 0, language, _MOST_WORDS):
        if reading.side and len(spelling.text) < _SHORTEST:
            continue
        begin, end = reading.side_at
        before, after = spelling.text[:begin], spelling.text[end:]
        others = (word for word, side in language.sides.items() if reading.side not in ("", side))
        twins = frozenset(before + other + after for other in others)
        nouns_at = sum(k for k, c in enumerate(reading.concepts) if c in grammar.segments)
        initials = reading.initials if reading.is_doubtful else ()
        for meaning, cost in _means(reading, grammar):
            ways.append((meaning, reading.cost + _NOUN_FIRST * nouns_at + cost, twins, initials))
    return tuple(ways)


def _spelt(label: str) -> str:
    return "".join(_pieces(label))


def _pieces(label: str) -> list[str]:
    """Parts of a label between separators, changes of case and digits; plain lower case."""
    plain = unicodedata.normalize("NFKD", label.replace("ß", "ss"))
    plain = "".join(c for c in plain if not unicodedata.combining(c))
    parts = re.findall(r"\d+|[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[^\W\d_a-zA-Z]+|[^\w\s.-]", plain)
    return [part.casefold() for part in parts]


class _Spelling:
    """A joined label; places where a part ends or begins, and those of them with a separator."""

    def __init__(self, label: str) -> None:
        parts = [_pieces(part) for part in re.split(r"[\s._-]+", label)]
        self.text = "".join(chain.from_iterable(parts))
        self.seams = {0, *accumulate(map(len, chain.from_iterable(parts)))}
        self.separators = {0, *accumulate(len("".join(part)) for part in parts)}


def _cuts(
    spelling: _Spelling,
    start: int,
    language: _Language,
    words_left: int,
    letters: int = 0,
    has_long: bool = False,
) -> Iterator[_Reading]:
    """All ways; of the same part, before ``start``: how many letters stand for themselves, and
    whether there is a longer word that is no side."""
    if start == len(spelling.text):
        yield _Reading((), "", 0.0)
        return
    if not words_left:
        return
    if start in spelling.seams:
        letters, has_long = 0, False
    nouns = _grammar().segments.keys()
    for end, concepts, side, cost in _words_at(spelling, start, language):
        is_letter = end - start == 1
        n_letters, is_long = letters + is_letter, has_long or not (is_letter or side)
        # Words of other languages are cut into letters, or into a word and one that is left over.
        many = n_letters + is_long > _LETTERS
        doubtful = many or (is_letter and has_long and bool(nouns & {*concepts}))
        for rest in _cuts(spelling, end, language, words_left - 1, n_letters, is_long):
            if not (side and rest.side):
                yield _Reading(
                    (*concepts, *rest.concepts),
                    side or rest.side,
                    cost + rest.cost,
                    (start, end) if side else rest.side_at,
                    (start, *rest.initials) if is_letter and not side else rest.initials,
                    doubtful or rest.is_doubtful,
                )


def _words_at(
    spelling: _Spelling, start: int, language: _Language
) -> Iterator[tuple[int, tuple[str, ...], str, float]]:
    """Words that begin at a place: where they end, concepts, side, cost.

    A word costs 1, more where it reaches across separators; a single letter 0.5 more for each end
    at which it is not set apart.
    """
    text, seams = spelling.text, spelling.seams
    if number := re.match(r"\d+", text[start:]):
        yield start + number.end(), (str(int(number[0])),), "", 1.0
    for end in range(start + 1, min(len(text), start + language.longest) + 1):
        word, cost = text[start:end], 1.0
        inside = sorted(place for place in spelling.separators if start < place < end)
        if inside:
            takes_letter = any(b - a == 1 for a, b in pairwise([start, *inside, end]))
            cost += _LETTER_ACROSS if takes_letter else _ACROSS
        if len(word) == 1:
            cost += 0.5 * ((start not in seams) + (end not in seams))
        for concepts in language.words.get(word, ()):
            yield end, concepts, "", cost
        if word in language.sides:
            yield end, (), language.sides[word], cost


def _means(reading: _Reading, grammar: _Grammar) -> Iterator[tuple[Meaning | None, float]]:
    """What words mean together, with what that costs; None for what is no marker on a body.

    A landmark by the table, dearer where a number is left aside; else the segment of the nouns.
    """
    concepts = frozenset(reading.concepts) - grammar.fillers
    words = frozenset(c for c in concepts if not c.isdigit())
    if grammar.never & words:
        yield None, 0.0
        return
    if words & grammar.numbered:  # a vertebra: its number behind it and nothing else
        spoken = [c for c in reading.concepts if c not in grammar.fillers]
        if reading.side or len(spoken) != 2 or not spoken[1].isdigit():
            return
    weight = min((grammar.weights.get(word, 1.0) for word in words), default=1.0)
    tracking = _TRACKS
    for known, cost in ((concepts, 0.0), (words, _NUMBER_LEFT)):
        name = grammar.landmarks.get(known)
        if name and (full := _sided(name, reading.side, LANDMARKS)):
            yield Meaning(_sided(grammar.homes[name], reading.side, SEGMENTS), full, weight), cost
        elif name and not reading.side:
            tracking = _SIDELESS
    segments = {grammar.segments[word] for word in words if word in grammar.segments}
    if len(segments) == 1 and (full := _sided(segments.pop(), reading.side, SEGMENTS)):
        yield Meaning(full, "", weight), tracking


def _sided(name: str, side: str, known: Sequence[str] | frozenset[str]) -> str:
    """The name with its side, where it has sides; empty where the side is missing or too much."""
    if side and f"{name}_{side}" in known:
        return f"{name}_{side}"
    if name not in known:
        return ""
    return "" if side and known is LANDMARKS else name


# --- the vocabulary ------------------------------------------------------------------------------


@cache
def _vocabulary() -> dict[str, Any]:
    return tomllib.loads(shipped("label_words.toml").read_text(encoding="utf-8"))


@cache
def _grammar() -> _Grammar:
    data = _vocabulary()
    landmarks: dict[frozenset[str], str] = {}
    homes: dict[str, str] = {}
    for segment, rows in data["landmarks"].items():
        for name, ways in rows.items():
            homes[name] = segment
            landmarks |= {frozenset(way.split()): name for way in ways}
    segments = {noun: s for s, nouns in data["segments"].items() for noun in nouns.split()}
    kinds = {kind: frozenset(words.split()) for kind, words in data["kinds"].items()}
    return _Grammar(landmarks, segments, homes, data["weights"], **kinds)


@cache
def _languages() -> tuple[_Language, ...]:
    """Each with the common words and those of the language it extends; keypoints without."""
    data, found = _vocabulary()["languages"], []
    for name, own in data.items():
        if name == _COMMON:
            continue
        words: dict[str, set[tuple[str, ...]]] = {}
        sides: dict[str, str] = {}
        for part in (own.get("instead_of_common", _COMMON), own.get("extends", ""), name):
            table = data.get(part, {})
            for side, spelt in table.get("sides", {}).items():
                sides |= dict.fromkeys(spelt.split(), side[0])
            for concepts, spelt in table.get("words", {}).items():
                for word in spelt.split():
                    words.setdefault(word, set()).add(tuple(concepts.split()))
        longest = max(map(len, [*words, *sides]))
        known = {word: frozenset(ways) for word, ways in words.items()}
        telltales, part = tuple(own.get("telltales", ())), _SPECIAL if "extends" in own else 1.0
        found.append(_Language(name, known, sides, longest, telltales, part))
    return tuple(found)
