"""Which marker set a recording uses: a shipped one, or one made from what its labels say, and as
TOML to be corrected. Which of two markers of a joint under one label is the lateral one."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bsip_cli.body.joint_centres import breadth_m
from bsip_cli.body.markersets import Marker, MarkerSet, load_marker_set, shipped_names
from bsip_cli.errors import BadDataError
from bsip_cli.files.templates import templates_in
from bsip_cli.recordings.label_words import (
    Meaning,
    are_numbered,
    bones,
    is_no_marker,
    meanings,
    medial_of,
)
from bsip_cli.recordings.labels import (
    by_person,
    columns_of,
    count_of,
    found_among,
    person_of,
    spelling_of,
)
from bsip_cli.recordings.model import Finding
from bsip_cli.segments import JOINT_CENTRES, LANDMARKS, SEGMENTS, TRUNK, in_words

_ENOUGH = 0.5  # of a set's markers, its optional ones aside
_MOSTLY, _LEAST = 0.75, 10  # or of the labels, when these are at least so many: half a body
_NEEDED = {  # and what would do
    "lower_torso": "both ASIS, and the PSIS or the sacrum",
    **{f"thigh_{side}": "the lateral epicondyle of the femur, a cluster" for side in "lr"},
    **{f"shank_{side}": "the lateral malleolus, a cluster" for side in "lr"},
    **{f"foot_{side}": "the heel and a metatarsal" for side in "lr"},
}
_OUTER = 0.8  # of the frames in which both are seen
# How far markers of a joint are apart, over its mean breadth in people of 1 and 2.1 m: 38 public
# pairs have 0.88 to 1.32 of that in people of 1.75 m.
_BROAD = (0.85, 1.0), (1.3, 2.1)


@dataclass(frozen=True)
class SetFit:
    """How well a marker set and a recording's labels agree.

    found : markers of the set, optional ones too, that have a label; required : of the set, and how
    many of these are found; labels : of the recording.
    """

    marker_set: MarkerSet
    found: int
    required_found: int
    required: int
    labels: int

    @property
    def share(self) -> float:
        """Of the set's required markers."""
        return self.required_found / self.required

    @property
    def fits(self) -> bool:
        known = self.found / self.labels if self.labels else 0.0
        return self.share >= _ENOUGH or (known >= _MOSTLY and self.found >= _LEAST)

    @property
    def fits_well(self) -> bool:
        """Nothing that the set requires is missing: its other labels are extras."""
        return self.fits and self.required_found == self.required

    @property
    def score(self) -> float:
        """Agreement in both directions: the found ones' parts of the labels and of the set."""
        return self.found / max(self.labels, 1) + self.found / self.required


@dataclass(frozen=True)
class Guess:
    """The marker set, the shipped one it is or began with, and labels that say nothing."""

    marker_set: MarkerSet
    base: SetFit | None
    unknown: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        return self.marker_set.name

    @property
    def is_shipped(self) -> bool:
        return self.base is not None and self.marker_set is self.base.marker_set

    @property
    def centres(self) -> tuple[str, ...]:
        """Labels of joint centres, as markerless systems give them."""
        return tuple(m.label for m in self.marker_set.markers if m.is_joint_centre)

    def lacking(self) -> list[str]:
        """Segments that must not be held and have no label, with what would do.

        Their landmarks are asked for by the calibrating trial only; whether the trunk may be held
        is for the scaling's options to say.
        """
        marked = {marker.segment for marker in self.marker_set.markers}
        return [
            f"the {in_words(segment)} ({serve})"
            for segment, serve in _NEEDED.items()
            if segment not in marked
        ]

    def findings(self) -> tuple[Finding, ...]:
        """What a set that was made from the labels takes them for; nothing of a shipped one."""
        if self.is_shipped:
            return ()
        markers = self.marker_set.markers
        bony = [f"{m.label} = {in_words(m.landmark)}" for m in markers if m.landmark]
        tracking = sum(not m.landmark for m in markers)
        near = f"; {self.base.marker_set.name} fits partly" if self.base else ""
        none = [label for label in self.unknown if is_no_marker(label)]
        strange = [label for label in self.unknown if label not in none]
        unknown = f"; not understood: {', '.join(strange)}" if strange else ""
        unknown += f"; no markers on the body: {', '.join(none)}" if none else ""
        expected = "one of " + ", ".join(shipped_names())
        action = f"made one from the labels: {', '.join(bony)}; {tracking} more only track{unknown}"
        made = Finding("labels", "", f"no shipped set fits well{near}", expected, action, "warning")
        if not self.centres:
            return (made,)
        of, found = ", ".join(self.centres), "keypoints of a markerless system: centres of joints"
        action = "took them for the joints; the pelvis' and limbs' axes are estimated from them"
        expected = "markers on bony landmarks"
        return made, Finding("labels", of, found, expected, action, "warning")


def fits(labels: Sequence[str]) -> tuple[SetFit, ...]:
    """All shipped sets, best first; what all labels of a person begin or end with is taken off."""
    found = []
    named = [label.strip() for label in labels]
    for marker_set in map(load_marker_set, shipped_names()):
        people = by_person(named, count_of(marker_set.wanted()))
        bare = {name for own in people.values() for name in own.values()}
        there = found_among(sorted(bare), marker_set.wanted())
        required = [marker.label for marker in marker_set.markers if not marker.optional]
        n_found = sum(name in there for name in required)
        found.append(SetFit(marker_set, len(there), n_found, len(required), len(bare)))
    return tuple(sorted(found, key=lambda fit: -fit.score))


def guess_marker_set(labels: Sequence[str], prefix: str = "", source: str = "FILE") -> Guess:
    """The shipped set that fits well, else one made from the labels, the best one's among them.

    ``prefix`` says whose labels count where a file holds several people; ``source`` is the file as
    the remedy of a refusal names it. The guess depends on nothing but labels.

    Raises
    ------
    BadDataError
        No shipped set fits, and the labels leave segments bare that no skeleton can do without.
    """
    guess = told_from(labels, prefix)
    if guess.base is not None or not (lacking := guess.lacking()):
        return guess
    best = fits(labels)[0]
    shown = ", ".join(sorted(labels)[:12]) + (" ..." if len(labels) > 12 else "")
    raise BadDataError(
        f"no known marker set fits ({best.marker_set.name} comes nearest with {best.share:.0%} of "
        f"its markers); of {best.labels} labels the words identify "
        f"{len(guess.marker_set.markers)}, "
        f"none on {', '.join(lacking)}; labels are {shown}",
        expected="one of " + ", ".join(shipped_names()) + ", or labels that say these places",
        remedy=f"write a marker set (`bsip markers {source}` makes a first one of this file's "
        'labels) and name it in study.toml: marker_set = "my_set.toml"',
    )


def told_from(labels: Sequence[str], prefix: str = "") -> Guess:
    """As :func:`guess_marker_set`, without its refusal.

    The set is made of the labels that are understood: as the best shipped one has them where it
    fits, else by their words. A shipped set has no say over joint centres: it marks the skin.
    """
    best = fits(labels)[0]
    if best.fits_well:
        return Guess(best.marker_set, best)
    in_set = count_of(best.marker_set.wanted() if best.fits else {})
    person = person_of(labels, lambda some: bones(some) + in_set(some), prefix)
    times = Counter(person.names.values())
    names = [name for name, n in times.items() if n == 1]  # of twins nobody knows which is which
    understood = meanings(names)
    has_centres = any(meaning.landmark in JOINT_CENTRES for meaning in understood.values())
    base = best if best.fits and not has_centres else None
    columns: dict[str, int] = {}
    shipped: tuple[Marker, ...] = ()
    if base:
        columns = columns_of({name: k for k, name in enumerate(names)}, base.marker_set.wanted())
        # The set's markers that are there, with the file's spelling among the aliases.
        there = (m for m in base.marker_set.markers if m.label in columns)
        shipped = tuple(m.also(names[columns[m.label]]) for m in there)
    taken, known = {m.landmark for m in shipped}, {m.label for m in shipped}
    rest = [name for k, name in enumerate(names) if k not in set(columns.values())]
    more = []
    spelt = {names[columns[m.label]]: m.segment for m in shipped}
    for name in rest:
        if name not in understood or name in known:
            continue
        meant = understood[name]
        sibling = next((s for o, s in spelt.items() if are_numbered(name, o)), meant.segment)
        if sibling != meant.segment:  # numbered ones sit on one segment
            meant = Meaning(sibling, "")
        landmark = "" if meant.landmark in taken else meant.landmark
        more.append(Marker(name, meant.segment, landmark, meant.weight, False, ()))
    if base and not more:  # the words add nothing
        return Guess(base.marker_set, base)
    unknown = tuple(name for name in rest if name not in understood)
    name = f"{base.marker_set.name}+words" if base else "words"
    of = f"{base.marker_set.description}, completed from" if base else "made from"
    return Guess(MarkerSet(name, f"{of} the words of the labels", (*shipped, *more)), base, unknown)


# --- two markers under one label ------------------------------------------------------------------


def with_pairs_named(
    labels: Sequence[str], markers_m: np.ndarray, marker_set: MarkerSet, prefix: str = ""
) -> tuple[tuple[str, ...], list[Finding]]:
    """Labels in which the lateral and the medial marker of a joint have names of their own, where
    two columns share the one that both are spelt as: the lateral one is further out, as left and
    right of the trunk are, and they are as far apart as such a joint is broad. ``markers_m``
    (n_frames, n_markers, 3), NaN = missing."""
    meant = _meant(labels, markers_m, marker_set, prefix)
    to_right = _to_right(markers_m, meant)
    named, outer_ones, inner_ones = list(labels), {}, []
    for name, count in Counter(name for name, _ in meant.values()).items():
        two = [column for column, (one, _) in meant.items() if one == name]
        may_be = {m.landmark: m for m in meant[two[0]][1]}
        pairs = (one for one in may_be if medial_of(one) and medial_of(one) in may_be)
        lateral = next(pairs, None)
        if lateral is None or len(may_be) != 2 or count != 2:
            continue
        pair = _Pair.of(markers_m, two, to_right, lateral)
        if pair.outer is None or not pair.is_joint:
            continue
        inner = two[1 - two.index(pair.outer)]
        outer_ones[name] = may_be[lateral].label
        inner_ones.append(may_be[medial_of(lateral)].label)
        named[pair.outer] = labels[pair.outer].replace(name, outer_ones[name])
        named[inner] = labels[inner].replace(name, inner_ones[-1])
    if not outer_ones:
        return tuple(labels), []
    found, action = "a label that two columns share", _sides_of(outer_ones.values(), inner_ones)
    one_each = "one column per marker"
    about = Finding("labels", ", ".join(outer_ones), found, one_each, action, "corrected")
    return tuple(named), [about]


def with_numbers_placed(
    labels: Sequence[str], markers_m: np.ndarray, marker_set: MarkerSet, prefix: str = ""
) -> tuple[MarkerSet, list[Finding]]:
    """A set in which the lateral and the medial marker of a joint that differ by a number only are
    told by their places, as `with_pairs_named` has it."""
    meant = _meant(labels, markers_m, marker_set, prefix)
    to_right = _to_right(markers_m, meant)
    columns = {m.label: column for column, (_, of) in meant.items() for m in of[:1]}
    known = (m for m in marker_set.markers if m.landmark and m.label in columns)
    by_landmark = {m.landmark: m.label for m in known}
    now: dict[str, str | None] = {}  # landmarks by label; None: no marker of the joint
    said: dict[tuple[str, str], list[str]] = {}
    outer_ones, inner_ones = [], []
    for landmark, lateral in by_landmark.items():
        medial = by_landmark.get(inner := medial_of(landmark))
        if medial is None or not are_numbered(lateral, medial):
            continue
        pair = _Pair.of(markers_m, [columns[lateral], columns[medial]], to_right, landmark)
        if not pair.is_joint:
            now |= {lateral: None, medial: None}
            found = f"two numbers, no pair of a joint: {1e3 * pair.apart_m:.0f} mm apart"
            said.setdefault((found, "left them out"), []).extend((lateral, medial))
        elif pair.outer is None:
            now |= {lateral: "", medial: ""}
            found = "two numbers, of which none is the outer one in most frames"
            said.setdefault((found, "took them to track only"), []).extend((lateral, medial))
        elif pair.outer == columns[medial]:
            now |= {lateral: inner, medial: landmark}
            outer_ones.append(medial)
            inner_ones.append(lateral)
    expected = "the lateral and the medial marker of a joint"
    findings = [
        Finding("labels", ", ".join(names), found, expected, action, "warning")
        for (found, action), names in said.items()
    ]
    if outer_ones:
        action, found = _sides_of(outer_ones, inner_ones), "the lower number is the inner one"
        subject = ", ".join(inner_ones)
        findings.append(Finding("labels", subject, found, expected, action, "corrected"))
    kept = tuple(
        replace(m, landmark=place)
        for m in marker_set.markers
        if (place := now.get(m.label, m.landmark)) is not None
    )
    return replace(marker_set, markers=kept), findings


def _sides_of(outer: Iterable[str], inner: Iterable[str]) -> str:
    return f"took the outer ones for {', '.join(outer)}, the inner ones for {', '.join(inner)}"


def _meant(
    labels: Sequence[str], markers_m: np.ndarray, marker_set: MarkerSet, prefix: str
) -> dict[int, tuple[str, list[Marker]]]:
    """By column that is seen, the person's name of it and the markers it may be."""
    there = np.isfinite(markers_m).all(axis=2).any(axis=0).tolist()
    names = person_of(labels, count_of(marker_set.wanted()), prefix, there).names
    names = {column: name for column, name in names.items() if there[column]}
    spelling = spelling_of(list(names.values()))
    spelt = [(m, {spelling(one) for one in (m.label, *m.aliases)}) for m in marker_set.markers]
    return {c: (one, [m for m, of in spelt if spelling(one) in of]) for c, one in names.items()}


@dataclass(frozen=True)
class _Pair:
    """Two columns of a joint: whether they are as far apart as it is broad in most frames, how far
    in the middle, and which one is outside; None where that is not seen."""

    is_joint: bool
    apart_m: float
    outer: int | None

    @staticmethod
    def of(markers_m: np.ndarray, two: Sequence[int], to_right: np.ndarray, landmark: str) -> _Pair:
        """``to_right`` : of the trunk, (n_frames, 3)."""
        apart = markers_m[:, two[0]] - markers_m[:, two[1]]
        far_m = np.linalg.norm(apart, axis=1)
        far_m = far_m[np.isfinite(far_m)]
        if not len(far_m):
            return _Pair(False, float("nan"), None)
        low, high = (times * breadth_m(landmark, stature_m) for times, stature_m in _BROAD)
        is_joint = bool(np.mean((far_m > low) & (far_m < high)) > 0.5)
        ahead = (apart * to_right).sum(axis=1) * (1 if landmark.endswith("_r") else -1)
        first = float(np.mean(ahead[np.isfinite(ahead)] > 0)) if np.isfinite(ahead).any() else 0.5
        outer = two[0] if first >= _OUTER else two[1] if first <= 1 - _OUTER else None
        return _Pair(is_joint, float(np.median(far_m)), outer)


def _to_right(
    markers_m: np.ndarray, meant: Mapping[int, tuple[str, Sequence[Marker]]]
) -> np.ndarray:
    """From left to right of the trunk, (n_frames, 3); NaN where that is not seen."""
    sure = {column: of[0] for column, (_, of) in meant.items() if len(of) == 1}
    trunk = {column: marker.landmark for column, marker in sure.items() if marker.segment in TRUNK}
    right, left = ([c for c, name in trunk.items() if name.endswith(side)] for side in ("_r", "_l"))
    if not right or not left:
        return np.full((len(markers_m), 3), np.nan)
    return np.asarray(markers_m[:, right].mean(axis=1) - markers_m[:, left].mean(axis=1))


# --- as TOML to be corrected ----------------------------------------------------------------------

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def starter_toml(marker_set: MarkerSet, unknown: Sequence[str], source: str, name: str) -> str:
    """TOML of a marker set, and labels that were not understood as a comment.

    What is not printable is left out; ``source`` names the recording, ``name`` the file to be
    written. A segment without markers is a comment that shows how to fill it in.
    """
    environment = templates_in(Path(__file__).parent)
    filters = (_printable, _quoted, _key, _listed, _wrapped)
    environment.filters |= {one.__name__[1:]: one for one in filters}
    return environment.get_template("marker_set.toml.j2").render(
        source=source,
        name=name,
        landmarks=sorted({re.sub(r"_[lr]$", "", one) for one in LANDMARKS}),
        segments=SEGMENTS,
        markers=[m for m in marker_set.markers if _printable([m.label])],
        unknown=_printable(dict.fromkeys(unknown)),
    )


def _printable(labels: Iterable[str]) -> list[str]:
    return [label for label in labels if label and label.isprintable()]


def _listed(labels: Iterable[str]) -> str:
    return f"[{', '.join(map(_quoted, labels))}]"


def _key(label: str) -> str:
    return label if _BARE_KEY.fullmatch(label) else _quoted(label)


def _quoted(text: str) -> str:
    """As a TOML string; printable text differs from JSON's in nothing."""
    return json.dumps(text, ensure_ascii=False)


def _wrapped(words: Sequence[str], width: int = 96) -> str:
    """The words as comment lines."""
    lines, line = [], "#"
    for word in words:
        if len(line) + len(word) + 2 > width:
            lines.append(line)
            line = "#"
        line += f" {word}"
    return "\n".join([*lines, line])
