"""``bsip markers``: what a recording's labels are, which marker set they fit, what is missing."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from shlex import quote

import click
import numpy as np

from bsip_cli.body.joint_centres import missing_landmarks
from bsip_cli.body.markersets import MarkerSet, load_marker_set
from bsip_cli.body.skeleton import Skeleton, load_skeleton
from bsip_cli.config import load_config
from bsip_cli.errors import UsageError, printable
from bsip_cli.recordings.labels import LabelMatch, match_labels
from bsip_cli.recordings.marker_guess import (
    Guess,
    fits,
    starter_toml,
    told_from,
    with_numbers_placed,
    with_pairs_named,
)
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.read import read_recording
from bsip_cli.segments import how_held, in_words, without_side

_ALTERNATIVES = 3


def markers_command(file: Path, marker_set: str, prefix: str, write: Path | None) -> int:
    """Print everything; write a starter set where asked, or where no shipped set fits well.

    marker_set : "auto" guesses. prefix : of the person's labels. write : where the starter goes.

    Returns 0 where the set has all that a skeleton needs, 3 where something that a skeleton cannot
    do without is missing.
    """
    recording = read_recording(file)
    size = f"{len(recording.labels)} markers, {recording.n_frames} frames"
    corrected = [one for one in recording.findings if one.check in ("labels", "points")]
    done = [f"{x.found}: {x.action}" + f" ({x.subject})" * bool(x.subject) for x in corrected]
    _say([f"{file}: {size} at {recording.marker_rate_hz:g} Hz", *done])
    guess, chosen = _chosen(recording, marker_set, prefix)
    complete = bool(chosen.markers) and _compared(recording, chosen, prefix)
    if not chosen.markers:
        _say(["", "labels:", *_label_rows(recording, {}, "not understood")])
    if write is not None or not (guess is None or guess.is_shipped):
        _write_starter(file, guess or told_from(recording.labels, prefix), write)
    return 0 if complete else 3


def _compared(recording: Recording, chosen: MarkerSet, prefix: str) -> bool:
    """Print what a marker set finds in a recording; whether a skeleton can be built from it."""
    seen_as = recording.labels, recording.markers_m
    chosen, placed = with_numbers_placed(*seen_as, chosen, prefix)
    labels, paired = with_pairs_named(*seen_as, chosen, prefix)
    _say([finding.sentence() for finding in (*placed, *paired)])
    seen = np.isfinite(recording.markers_m[..., 0]).any(axis=0)
    how = {"optional": chosen.optional(), "seen": seen, "prefix": prefix}
    match = match_labels(labels, chosen.wanted(), **how)
    there = {match.index[m.label]: m for m in chosen.markers if m.label in match.index}
    words = {}
    for k, marker in there.items():
        renamed = "" if recording.labels[k].strip().endswith(marker.label) else f"{marker.label}: "
        landmark = in_words(marker.landmark) if marker.landmark else "tracks only"
        words[k] = f"{renamed}{in_words(marker.segment)}, {landmark}"
    who = [f"labels of the person with the prefix '{match.prefix}'"] if match.prefix else []
    _say([*who, "", "labels:", *_label_rows(recording, words, "not in the set")])
    config = load_config([])
    skeleton = load_skeleton(config.skeleton)
    informed = skeleton.informed({marker.segment for marker in there.values()})
    unmarked = [s for s, known in zip(skeleton.segments, informed, strict=True) if not known]
    held = {s for s in unmarked if without_side(s) in config.scale.may_be_held}
    _say(["", "segments:", *_segment_rows(chosen, match, skeleton, unmarked, held)])
    needed = missing_landmarks({marker.landmark for marker in there.values()})
    if needed:
        _say(["", f"a skeleton cannot be built without: {', '.join(needed)}"])
    return not needed and held.issuperset(unmarked)


def _say(lines: Sequence[str]) -> None:
    click.echo("\n".join(map(printable, lines)))


# --- which set ---------------------------------------------------------------------------------


def _chosen(recording: Recording, marker_set: str, prefix: str) -> tuple[Guess | None, MarkerSet]:
    if marker_set != "auto":
        chosen = load_marker_set(marker_set)
        _say(["", f"marker set: {chosen.name} ({chosen.description}), as asked"])
        return None, chosen
    ranked = fits(recording.labels)
    guess = told_from(recording.labels, prefix)
    chosen, best = guess.marker_set, guess.base
    if best is None:
        read = f"of {ranked[0].labels} labels the words identify {len(chosen.markers)}"
        said = f"none of the shipped sets fits; {read}"
    else:
        added = len(chosen.markers) - best.found
        more = "" if guess.is_shipped else f"; {added} more labels by their words"
        said = (
            f"{best.marker_set.name} ({best.marker_set.description}), guessed: "
            f"{best.required_found} of its {best.required} markers (optional ones aside), "
            f"{best.found} of {best.labels} labels{more}"
        )
    others = [fit for fit in ranked if fit is not best][: _ALTERNATIVES - (best is not None)]
    names = [f"  {x.marker_set.name}: {x.required_found} of {x.required} markers" for x in others]
    _say(["", f"marker set: {said}", *names])
    return guess, chosen


# --- what is there ------------------------------------------------------------------------------


def _label_rows(recording: Recording, words: Mapping[int, str], others: str) -> Iterator[str]:
    """A line per column of the file: seen in how much of the time, and what it is."""
    width = max(map(len, recording.labels), default=0)
    seen = np.isfinite(recording.markers_m[..., 0])
    for k, label in enumerate(recording.labels):
        share = 100 * float(seen[:, k].mean()) if len(seen) else 0.0
        meaning = words.get(k, others) if share > 0 else "labelled, but seen in no frame"
        yield f"  {label:<{width}}  seen {share:5.1f} %  {meaning}"


def _segment_rows(
    marker_set: MarkerSet,
    match: LabelMatch,
    skeleton: Skeleton,
    unmarked: Collection[str],
    held: Collection[str],
) -> Iterator[str]:
    """A line per segment: how many of its markers are there, which are not, what that means."""
    width = max(len(in_words(segment)) for segment in skeleton.segments)
    for segment in skeleton.segments:
        own = [m for m in marker_set.markers if m.segment == segment]
        count = sum(m.label in match.index for m in own)
        gone = [m.label for m in own if m.label not in match.index and not m.optional]
        text = f"  {in_words(segment):<{width}}  {count:2d} markers"
        if gone:
            text += f"; missing: {', '.join(gone)}"
        if segment in held:
            text += f"; {how_held(segment)}, with the table's inertia"
        elif segment in unmarked:
            text += "; refused, unless scale.may_be_held in study.toml names it"
        yield text


# --- a first set --------------------------------------------------------------------------------


def _write_starter(file: Path, guess: Guess, write: Path | None) -> None:
    """Write the labels of the file as a marker set; never over a file that is there."""
    target = write or Path(f"{file.stem.replace(' ', '_')}_markers.toml")
    names = printable(file.name), printable(target.name)
    text = starter_toml(guess.marker_set, guess.unknown, *names)
    try:
        with target.open("x", encoding="utf-8") as handle:
            handle.write(text)
    except FileExistsError:
        if write is None:
            _say(["", f"{target} is there already and is not written over"])
            return
        raise UsageError(
            "is there already and is not written over",
            file=target,
            remedy="name another file with --write, or check that one with --marker-set",
        ) from None
    except OSError as error:
        raise UsageError(f"cannot be written ({error.strerror})", file=target) from None
    again = f"bsip markers {quote(str(file))} --marker-set {quote(str(target))}"
    said = f"wrote {target}: a first marker set, guessed from the labels; correct it, check it "
    _say(["", f"{said}with `{again}`, and name it in study.toml"])
