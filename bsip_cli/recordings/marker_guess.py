"""Which of the shipped marker sets a recording uses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bsip_cli.body.markersets import MarkerSet, load_marker_set, shipped_names
from bsip_cli.errors import BadDataError
from bsip_cli.recordings.labels import found_among

_ENOUGH = 0.5  # of a set's markers, its optional ones aside
_MOSTLY, _LEAST = 0.75, 10  # or of the labels, when these are at least so many: half a body


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
    def score(self) -> float:
        """Agreement in both directions: the found ones' parts of the labels and of the set."""
        return self.found / max(self.labels, 1) + self.found / self.required


def fits(labels: Sequence[str]) -> tuple[SetFit, ...]:
    """All shipped sets, best first; labels may carry a ``Subject:`` prefix."""
    return tuple(
        sorted(
            (_fit(load_marker_set(name), labels) for name in shipped_names()),
            key=lambda fit: -fit.score,
        )
    )


def _fit(marker_set: MarkerSet, labels: Sequence[str]) -> SetFit:
    bare = {label.rsplit(":", 1)[-1].strip() for label in labels}
    found = found_among(sorted(bare), marker_set.wanted())
    required = [marker.label for marker in marker_set.markers if not marker.optional]
    return SetFit(
        marker_set, len(found), sum(name in found for name in required), len(required), len(bare)
    )


def guess_marker_set(labels: Sequence[str]) -> MarkerSet:
    """The shipped set that agrees best with the labels; they may carry a ``Subject:`` prefix.

    Raises
    ------
    BadDataError
        No set has half of its markers among the labels, nor three quarters of the labels.
    """
    ranked = fits(labels)
    for fit in ranked:
        if fit.fits:
            return fit.marker_set
    best = ranked[0]
    shown = ", ".join(sorted(labels)[:12]) + (" ..." if len(labels) > 12 else "")
    raise BadDataError(
        f"no known marker set fits: {best.marker_set.name} comes nearest with {best.share:.0%} of "
        f"its markers; labels are {shown}",
        expected="one of " + ", ".join(shipped_names()),
        remedy="write a marker set (`bsip markers FILE` makes a first one of this file's labels) "
        'and name it in study.toml: marker_set = "my_set.toml"',
    )
