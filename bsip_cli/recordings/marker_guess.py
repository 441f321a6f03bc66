"""Which marker set a recording uses: a shipped one, or one made from what its labels say."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from bsip_cli.body.landmarks import JOINT_CENTRES
from bsip_cli.body.markersets import Marker, MarkerSet, load_marker_set, shipped_names
from bsip_cli.body.names import in_words
from bsip_cli.errors import BadDataError
from bsip_cli.recordings.affixes import affixes, owner
from bsip_cli.recordings.label_words import Meaning, bones, meanings
from bsip_cli.recordings.labels import columns_of, count_of, found_among, person_of
from bsip_cli.recordings.model import Finding

_ENOUGH = 0.5  # of a set's markers, its optional ones aside
_MOSTLY, _LEAST = 0.75, 10  # or of the labels, when these are at least so many: half a body
_NEEDED = {  # and what would do
    "lower_torso": "both ASIS, and the PSIS or the sacrum",
    **{f"thigh_{side}": "the lateral epicondyle of the femur, a cluster" for side in "lr"},
    **{f"shank_{side}": "the lateral malleolus, a cluster" for side in "lr"},
    **{f"foot_{side}": "the heel and a metatarsal" for side in "lr"},
}
_NAME = "words"


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
        unknown = f"; not understood: {', '.join(self.unknown)}" if self.unknown else ""
        made = Finding(
            "labels",
            "",
            f"no shipped set fits well{near}",
            "one of " + ", ".join(shipped_names()),
            f"made one from the labels: {', '.join(bony)}; {tracking} more only track{unknown}",
            "warning",
        )
        return (made, *self._about_centres())

    def _about_centres(self) -> tuple[Finding, ...]:
        if not self.centres:
            return ()
        found = Finding(
            "labels",
            ", ".join(self.centres),
            "keypoints of a markerless system: centres of joints",
            "markers on bony landmarks",
            "took them for the joints; the pelvis' and limbs' axes are estimated from them",
            "warning",
        )
        return (found,)


def fits(labels: Sequence[str]) -> tuple[SetFit, ...]:
    """All shipped sets, best first; what all labels of a person begin or end with is taken off."""
    return tuple(
        sorted(
            (_fit(load_marker_set(name), labels) for name in shipped_names()),
            key=lambda fit: -fit.score,
        )
    )


def _fit(marker_set: MarkerSet, labels: Sequence[str]) -> SetFit:
    named = [label.strip() for label in labels]
    known = affixes(named, count_of(marker_set.wanted()))
    bare = {affix.off(label) for label in named if (affix := owner(label, known)) is not None}
    found = found_among(sorted(bare), marker_set.wanted())
    required = [marker.label for marker in marker_set.markers if not marker.optional]
    return SetFit(
        marker_set, len(found), sum(name in found for name in required), len(required), len(bare)
    )


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
    if guess.base is None and (lacking := guess.lacking()):
        raise _no_set(guess, lacking, labels, source)
    return guess


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
    return _made(names, understood, best if best.fits and not has_centres else None)


def _made(names: Sequence[str], understood: Mapping[str, Meaning], base: SetFit | None) -> Guess:
    """Where the words add nothing to the shipped set, it is that one."""
    columns = columns_of(names, base.marker_set.wanted() if base else {})
    shipped = _as_shipped(base, columns, names)
    rest = [name for k, name in enumerate(names) if k not in set(columns.values())]
    more = _by_words({name: understood[name] for name in rest if name in understood}, shipped)
    if base and not more:
        return Guess(base.marker_set, base)
    unknown = tuple(name for name in rest if name not in understood)
    name = f"{base.marker_set.name}+{_NAME}" if base else _NAME
    of = f"{base.marker_set.description}, completed from" if base else "made from"
    return Guess(MarkerSet(name, f"{of} the words of the labels", (*shipped, *more)), base, unknown)


def _as_shipped(
    base: SetFit | None, columns: Mapping[str, int], names: Sequence[str]
) -> tuple[Marker, ...]:
    """The set's markers that are there, with the file's spelling among the aliases."""
    markers = base.marker_set.markers if base else ()
    return tuple(m.also(names[columns[m.label]]) for m in markers if m.label in columns)


def _by_words(understood: Mapping[str, Meaning], known: Collection[Marker]) -> tuple[Marker, ...]:
    taken = {marker.landmark for marker in known}
    labels = {marker.label for marker in known}
    return tuple(
        Marker(
            label,
            meaning.segment,
            "" if meaning.landmark in taken else meaning.landmark,
            meaning.weight,
            optional=False,
            aliases=(),
        )
        for label, meaning in understood.items()
        if label not in labels
    )


def _no_set(
    guess: Guess, lacking: Sequence[str], labels: Sequence[str], source: str
) -> BadDataError:
    best = fits(labels)[0]
    shown = ", ".join(sorted(labels)[:12]) + (" ..." if len(labels) > 12 else "")
    n_known = len(guess.marker_set.markers)
    return BadDataError(
        f"no known marker set fits ({best.marker_set.name} comes nearest with {best.share:.0%} of "
        f"its markers); of {best.labels} labels the words tell {n_known}, none on "
        f"{', '.join(lacking)}; labels are {shown}",
        expected="one of " + ", ".join(shipped_names()) + ", or labels that say these places",
        remedy=f"write a marker set (`bsip markers {source}` makes a first one of this file's "
        'labels) and name it in study.toml: marker_set = "my_set.toml"',
    )
