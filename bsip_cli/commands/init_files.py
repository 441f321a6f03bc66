"""The files that ``bsip init`` is given: recordings, the forces that belong to each, all else."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.files.fingerprints import file_hash
from bsip_cli.files.regular import ENDINGS, entries, fault_of, is_folder, lies_in
from bsip_cli.recordings.labels import is_unlabelled
from bsip_cli.recordings.model import Recording, StatedPerson
from bsip_cli.recordings.mot import read_mot
from bsip_cli.recordings.read import read_recording
from bsip_cli.study.new_study import WORDS, Found
from bsip_cli.study.trials import PACKED, RECORDINGS

NO_RECORDING = "no recording"
_WINDOW_S = 0.5
_FASTEST = 90.0  # percentile


@dataclass(frozen=True)
class Listed:
    """A file, and the folders that lead to it from where the search began."""

    path: Path
    folders: tuple[str, ...]

    @property
    def kind(self) -> str:
        return self.path.suffix.lower()


@dataclass(frozen=True)
class Unused:
    """A file that is left where it is, and why."""

    path: Path
    why: str
    is_fault: bool = False


@dataclass(frozen=True, eq=False)
class Source(Found):
    """A recording that can be read, with the forces next to a TRC; ``written``: the labels of named
    markers as in the file."""

    forces: Path | None
    stated: StatedPerson
    written: tuple[str, ...]


def list_files(given: Sequence[Path], out: Path) -> list[Listed]:
    """All files that are given or lie below given folders, but hidden ones and those in ``out``.

    UsageError: one is not there, or may not be read.
    """
    folders = [path for path in given if is_folder(path)]
    listed: dict[Path, Listed] = {}
    for path in given:
        if path in folders:
            start = (path.resolve().name,) if len(folders) > 1 else ()
            found: Iterable[Listed] = _below(path, start, out)
        elif fault := fault_of(path):
            raise UsageError(fault, file=path, expected="recordings, or folders with recordings")
        else:
            found = [Listed(path, ())]
        for one in found:
            listed.setdefault(one.path.absolute(), one)
    return sorted(listed.values(), key=lambda one: one.path)


def _below(folder: Path, start: tuple[str, ...], out: Path) -> Iterator[Listed]:
    def cannot(error: OSError) -> None:
        raise UsageError(
            f"cannot be listed ({error.strerror or error})", file=error.filename or folder
        )

    for place, inner, names in os.walk(folder, onerror=cannot):
        here = Path(place)
        inner[:] = sorted(n for n in inner if not n.startswith(".") and not lies_in(here / n, out))
        parts = (*start, *here.relative_to(folder).parts)
        yield from (Listed(here / name, parts) for name in sorted(names) if name[0] != ".")


def read_sources(
    files: Sequence[Listed], progress: Callable[[list[Listed]], Iterable[Listed]]
) -> tuple[list[Source], list[Unused]]:
    """Recordings that can be read, and every other file with the reason why it is not used."""
    unused: list[Unused] = []
    kept: list[Source] = []
    hashes: dict[str, Path] = {}
    # A C3D holds markers and forces: it goes before a TRC of its name in its folder.
    c3d_of = {_place(one.path): one.path for one in reversed(files) if one.kind == ".c3d"}
    for one in progress([file for file in files if file.kind in RECORDINGS]):
        try:
            twin = hashes.setdefault(file_hash(one.path), one.path)
            if twin != one.path:
                unused.append(Unused(one.path, f"holds the same as {twin.name}"))
            elif one.kind == ".trc" and (c3d := c3d_of.get(_place(one.path))):
                unused.append(Unused(one.path, f"{c3d.name}, of the same name, is used"))
            else:
                kept.append(_source(one, files, unused))
        except BadDataError as refusal:
            unused.append(Unused(one.path, _why(refusal), is_fault=True))
    done = {source.forces for source in kept} | {one.path for one in unused}
    whole = {source.path.stem.casefold() for source in kept if source.forces is None}
    left = (one for one in files if one.path not in done and one.kind not in RECORDINGS)
    unused += [_unused(one, files, whole) for one in left]
    return kept, unused


def _place(path: Path) -> tuple[Path, str]:
    return path.parent, path.stem.casefold()


def _why(refusal: BadDataError) -> str:
    expected = f"expected {refusal.expected}" if refusal.expected else ""
    return "; ".join(filter(None, (refusal.found, expected, refusal.remedy)))


def _unused(one: Listed, files: Sequence[Listed], used: Collection[str]) -> Unused:
    inner = Path(one.path.stem.removesuffix(".tar")).suffix.lower()
    if one.kind in PACKED and inner in (*RECORDINGS, *ENDINGS):
        return Unused(one.path, "is packed: unpack it", is_fault=True)
    if one.kind not in ENDINGS:
        return Unused(one.path, NO_RECORDING)
    if one.path.stem.casefold() in used:
        return Unused(one.path, "a C3D of its name has forces of its own")
    if several := _markers_of(one, files):
        names = " and ".join(str(file.path) for file in several)
        why = f"may belong to {names}: which is meant is not guessed"
        return Unused(one.path, why if len(several) > 1 else "no forces that could be used")
    return Unused(one.path, "no TRC of its name is there")


# --- which files are of one trial, by their names and places --------------------------------------


def _markers_of(table: Listed, files: Sequence[Listed]) -> list[Listed]:
    """The TRC files of a table's name, from the nearest folder that has one."""
    return _nearest(table, (file for file in files if file.kind == ".trc"))


def _nearest(one: Listed, others: Iterable[Listed]) -> list[Listed]:
    """Those of its name that lie next to a file, else in the deepest folder that holds both."""
    name = trial_words(one.path)

    def nearness(other: Listed) -> int:
        if one.path.parent == other.path.parent:
            return len(one.path.parts)
        pairs = zip(one.folders, other.folders, strict=False)
        return next((k for k, (a, b) in enumerate(pairs) if a != b), 0)

    near = {other: nearness(other) for other in others if trial_words(other.path) == name}
    return [other for other, k in near.items() if k == max(near.values())]


def trial_words(path: Path) -> tuple[str, ...]:
    """What is left of a file's name without the words for markers and forces."""
    parts = [part.casefold() for part in re.split(r"[\W_]+", path.stem) if part]
    return tuple(part for part in parts if part not in WORDS["files"])


# --- reading --------------------------------------------------------------------------------------


def _source(one: Listed, files: Sequence[Listed], unused: list[Unused]) -> Source:
    forces = None
    if one.kind == ".trc":
        recording, forces = _with_forces(one, _tables_of(one, files, unused), unused)
    else:
        recording = read_recording(one.path)
    bare = [label.rpartition(":")[2].strip() for label in recording.labels]
    seen = np.isfinite(recording.markers_m[..., 0]).any(axis=0)
    named = [k for k, label in enumerate(bare) if seen[k] and not is_unlabelled(label)]
    if not named:
        raise BadDataError(
            f"{len(bare)} points and no marker with a name that is seen",
            expected="labelled markers of a person",
            remedy="label the trial and export it again",
            file=one.path,
        )
    median, fastest = marker_speeds(recording.markers_m[:, named], recording.marker_rate_hz)
    names = frozenset(bare[k].casefold() for k in named)
    found = (one.path, one.folders, recording.stated.name, names, median, fastest)
    written = tuple(recording.labels[k] for k in named)
    return Source(*found, forces, recording.stated, written)


def _tables_of(one: Listed, files: Sequence[Listed], unused: list[Unused]) -> list[Path]:
    """Tables of a TRC's name, from the nearest folder that has one, which no other TRC has; where
    there are several, those that hold forces."""
    tables = _nearest(one, (file for file in files if file.kind in ENDINGS))
    own = [table for table in tables if _markers_of(table, files) == [one]]
    is_alone = sum(file.path.parent == one.path.parent for file in files) == 1
    if not tables and is_alone:  # a file was given, and not the folder
        nearby = (Listed(path, one.folders) for path in entries(one.path.parent))
        own = _nearest(one, (file for file in nearby if file.kind in ENDINGS))
    paths = sorted(file.path for file in own)
    if len(paths) < 2:
        return paths
    forces = []
    for path in paths:
        try:
            read_mot(path)
            forces.append(path)
        except BadDataError as refusal:
            unused.append(Unused(path, f"no table of forces: {_why(refusal)}"))
    return forces


def _with_forces(
    one: Listed, tables: Sequence[Path], unused: list[Unused]
) -> tuple[Recording, Path | None]:
    """A TRC with its table of forces; without, where that cannot be read or there are several."""
    if len(tables) > 1:
        names = " and ".join(path.name for path in tables)
        why = f"{names} are both forces of {one.path.name}: which are meant is not guessed"
        unused += [Unused(path, why, is_fault=True) for path in tables]
    if len(tables) != 1:
        return _read_pair(one.path, None), None
    try:
        return _read_pair(one.path, tables[0]), tables[0]
    except BadDataError as refusal:
        recording = _read_pair(one.path, None)  # if it is the markers, this refuses
        unused.append(Unused(tables[0], _why(refusal), is_fault=True))
        return recording, None


def _read_pair(trc: Path, forces: Path | None) -> Recording:
    """Read both under the names that they will have."""
    with tempfile.TemporaryDirectory(prefix="bsip-init-") as folder:
        place = Path(folder) / "trial.trc"
        place.symlink_to(trc.resolve())
        if forces is not None:
            place.with_suffix(forces.suffix.lower()).symlink_to(forces.resolve())
        return read_recording(place)


def marker_speeds(markers_m: np.ndarray, rate_hz: float) -> tuple[float, float]:
    """Mean speed of markers (n_frames, m, 3) over half a second: median and 90th percentile [m/s].

    Over half a second noise counts for nothing. Infinite where nothing is seen twice.
    """
    step = min(max(1, round(_WINDOW_S * rate_hz)), len(markers_m) - 1)
    if step < 1:
        return np.inf, np.inf
    moved = np.linalg.norm(markers_m[step:] - markers_m[:-step], axis=2)
    seen = np.isfinite(moved)
    count = seen.sum(axis=1)
    mean = np.where(seen, moved, 0.0).sum(axis=1)[count > 0] / count[count > 0]
    if not len(mean):
        return np.inf, np.inf
    speed = mean * rate_hz / step
    return float(np.median(speed)), float(np.percentile(speed, _FASTEST))
