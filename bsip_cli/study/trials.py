"""What lies in a participant's folder: recordings, known by their names, and all that is none."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from bsip_cli.errors import BadDataError, UsageError, printable
from bsip_cli.files.regular import ENDINGS, entries, fault_of, forces_beside, is_folder, trial_stem
from bsip_cli.schemas import SCHEMAS

Role = Literal["static", "sequence", "validation"]

RECORDINGS = (".c3d", ".trc")
MANY = 20
"""So many names are no more listed one by one in a message."""

_TRIAL = re.compile(
    r"(?P<participant>sub-[A-Za-z0-9]+)(_ses-(?P<session>[A-Za-z0-9]+))?"
    r"_task-(?P<task>[A-Za-z0-9]+)(_run-(?P<run>[0-9]+))?"
)
_SESSION = re.compile(r"ses-(?P<session>[A-Za-z0-9]+)")
PACKED = (".gz", ".bz2", ".xz", ".zst", ".zip", ".7z", ".rar", ".tar", ".tgz")
_FETCH = "fetch its content with `datalad get` or `git annex get`"
_NAME_BYTES = 255  # of a file's name, on the file systems of Linux and macOS
_LONGEST_KIND = max(len(one.file_name) for one in SCHEMAS.values() if one.level == "trial")
# What an artifact's name has more than the trial's, while it is written; 4194304: the last process.
STEM_BYTES = _NAME_BYTES - _LONGEST_KIND - len("._.parquet.4194304.bsip-part.bsip-part")


@dataclass(frozen=True)
class Trial:
    """One recording: ``stem`` names all its artifacts; ``run`` is None without run-... in it."""

    participant_id: str
    task: str
    stem: str
    path: Path
    role: Role
    run: int | None = None
    session: str | None = None
    forces: Path | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """All that is read of it: the recording, and the ground forces next to a TRC."""
        return (self.path, self.forces) if self.forces else (self.path,)


def trial_named(
    participant: str, name: str, path: Path, roles: Mapping[str, tuple[str, ...]]
) -> Trial:
    """A trial by what its file's name says after task-: ``walking`` or ``walking_run-2``.

    UsageError: the name is none of a trial.
    """
    stem = f"{participant}_task-{name}"
    match = _TRIAL.fullmatch(stem)
    if match is None:
        raise UsageError(
            f"a trial '{name}'",
            expected="a task, as walking or walking_run-2",
            remedy="rename it: letters and numbers alone, with _run- and a number behind",
        )
    task, run = match["task"], int(match["run"]) if match["run"] else None
    named: dict[str, Role] = {t: r for r in ("sequence", "static") for t in roles[r]}
    return Trial(participant, task, stem, path, named.get(task, "validation"), run)


def merged(faults: Iterable[BadDataError]) -> list[BadDataError]:
    """One refusal for all entries of a folder that have the same fault."""
    alike: dict[tuple[Path, str, str], list[BadDataError]] = {}
    for one in faults:
        # What was not fetched is said of several at once, wherever their links lead.
        what = "" if one.remedy == _FETCH else one.found
        alike.setdefault((Path(one.file).parent, what, one.remedy), []).append(one)
    refusals = []
    for one, *rest in alike.values():
        names = listed(Path(other.file).name for other in rest)
        found = f"{one.found} (likewise {names})" if rest else one.found
        refusals.append(_fault(one.file, found, one.expected, one.remedy))
    return refusals


def _fault(path: Path | str, found: str, expected: str, remedy: str) -> BadDataError:
    return BadDataError(found, file=path, expected=expected, remedy=remedy)


def listed(names: Iterable[str]) -> str:
    """``a.c3d, b.c3d and 7 more``, as names may be printed."""
    shown = [printable(name) for name in names]
    more = f" and {len(shown) - MANY} more" if len(shown) > MANY else ""
    return ", ".join(shown[:MANY]) + more


def kinds(paths: Iterable[Path]) -> str:
    """``3 .avi, 1 .vsk``: how many of each kind, the most first."""
    counts = Counter(path.suffix.lower() or "without an ending" for path in paths)
    return ", ".join(f"{n} {printable(kind)}" for kind, n in counts.most_common())


@dataclass
class Folder:
    """What lies in a participant's folder and in those of the sessions, but hidden entries."""

    path: Path
    participant: str
    roles: Mapping[str, tuple[str, ...]]
    trials: list[Trial] = field(default_factory=list)
    faults: list[BadDataError] = field(default_factory=list)
    refusals: list[BadDataError] = field(default_factory=list)
    others: list[Path] = field(default_factory=list)
    spare_forces: list[Path] = field(default_factory=list)
    """Tables next to a C3D, which has forces of its own."""

    def look_through(self, folder: Path, session: str | None = None) -> None:
        """Say of every entry what it is.

        BadDataError: the folder cannot be listed.
        """
        paths = entries(folder)
        names = {path.name.casefold() for path in paths}
        for path in paths:
            kind = path.suffix.lower()
            if kind in RECORDINGS:
                self._recording(path, session)
            elif kind in ENDINGS:
                self._forces(path, names)
            elif session is None and path.name.startswith("ses-") and (no := _fault_of_file(path)):
                self._session(path, no)
            elif kind in PACKED and _is_packed_recording(path, names):
                self.faults.append(_fault(path, "is packed", "the file itself", "unpack it"))
            else:
                self.others.append(path)

    def _recording(self, path: Path, session: str | None) -> None:
        fault = _fault_of_file(path) or self._fault_of_name(path, session)
        if fault is None:
            try:
                forces = forces_beside(path) if path.suffix.lower() == ".trc" else None
            except BadDataError as several:
                self.refusals.append(several)
                return
            if forces and (no := _fault_of_file(forces)):
                found = f"its forces, {forces.name}: {no.found}"
                fault = _fault(path, found, no.expected, no.remedy)
        if fault:
            self.faults.append(fault)
            return
        name = path.stem.split("_task-")[1]
        known = trial_named(self.participant, name, path, self.roles)
        self.trials.append(replace(known, stem=path.stem, session=session, forces=forces))

    def _fault_of_name(self, path: Path, session: str | None) -> BadDataError | None:
        """What is wrong with a recording's name in the folder of a session, or in none's."""
        here = _place(self.participant, session)
        expected = _names_like(here)
        match = _TRIAL.fullmatch(path.stem)
        if match is None:
            return _fault(path, "its name does not say what it is", expected, "rename it")
        named = _place(match["participant"], match["session"])
        if named != here:
            found = f"its name says {named} and its folder {here}"
            return _fault(path, found, expected, "rename it, or move it")
        if len(path.stem) > STEM_BYTES:
            found = f"a name of {len(path.stem)} letters before its ending"
            expected = f"at most {STEM_BYTES}, since the names of its results are longer"
            return _fault(path, found, expected, "shorten it")
        return None

    def _forces(self, path: Path, names: set[str]) -> None:
        """A table of forces is read with its TRC, spare next to a C3D, and lost without both."""
        stem = trial_stem(path)
        there = {f"{s}{kind}".casefold() for s in (stem, path.stem) for kind in RECORDINGS}
        found = {Path(name).suffix for name in there & names}
        if ".trc" in found:
            return
        if found:
            self.spare_forces.append(path)
        elif _TRIAL.fullmatch(stem):
            expected = f"{stem}.trc, with its markers, next to it"
            remedy = "add that file, or remove this one"
            self.faults.append(_fault(path, "forces without markers", expected, remedy))
        else:
            self.others.append(path)

    def _session(self, path: Path, no_file: BadDataError) -> None:
        if not is_folder(path):
            self.faults.append(_fault(path, no_file.found, "a session's folder", no_file.remedy))
            return
        match = _SESSION.fullmatch(path.name)
        if match is None:
            found, expected = "a session's folder of this name", "ses- and letters or digits"
            remedy = "rename the folder and the recordings in it"
            self.faults.append(_fault(path, found, expected, remedy))
            return
        try:
            self.look_through(path, match["session"])
        except BadDataError as closed:
            self.refusals.append(closed)


def find_trials(folder: Path, participant: str, roles: Mapping[str, tuple[str, ...]]) -> Folder:
    """The recordings of a participant, sorted by name, and all else in the folder.

    BadDataError: the folder cannot be listed.
    """
    found = Folder(folder, participant, roles)
    found.look_through(folder)
    found.refusals[:0] = merged(found.faults)
    found.trials.sort(key=lambda trial: trial.stem)
    names: dict[str, list[str]] = {}  # of files of results, also where capitals do not count
    for trial in found.trials:
        names.setdefault(trial.stem.casefold(), []).append(trial.path.name)
    if double := [name for alike in names.values() if len(alike) > 1 for name in alike]:
        what = f"recordings of one name, but for capitals and the ending: {listed(double)}"
        expected, remedy = "one .c3d or one .trc of each name", "remove one or give it a run number"
        found.refusals.append(_fault(folder, what, expected, remedy))
        found.trials.clear()
    if not found.trials:
        what, remedy = "no recordings", "add them"
        if found.refusals:
            what, remedy = "none of its recordings can be used", "correct what is said of each"
        expected = f"recordings with {_names_like(participant)}"
        found.refusals.append(_fault(folder, what, expected, remedy))
    return found


def _names_like(place: str) -> str:
    return f"names like {place}_task-sequence_run-1.c3d (letters and digits only)"


def _place(participant: str, session: str | None) -> str:
    return f"{participant}_ses-{session}" if session else participant


def _fault_of_file(path: Path) -> BadDataError | None:
    """Why a path is no file that can be read; nothing is opened."""
    if not (found := fault_of(path)):
        return None
    is_annexed = ".git/annex/" in found  # where a DataLad clone's links lead
    remedy = _FETCH if is_annexed else "put the file there, or remove what is in its place"
    return _fault(path, found, "a file that may be read", remedy)


def _is_packed_recording(path: Path, names: set[str]) -> bool:
    """Whether a packed file is called as a recording that does not lie unpacked next to it."""
    inner = path.stem.removesuffix(".tar")
    kind = Path(inner).suffix.lower()
    if kind in (*RECORDINGS, *ENDINGS):
        return inner.casefold() not in names
    there = {f"{inner}{ending}".casefold() for ending in RECORDINGS}
    return bool(_TRIAL.fullmatch(inner)) and not there & names
