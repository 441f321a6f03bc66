"""Names for recordings that a study is made of: whose each is, what it shows, what it serves for.

Nothing is read here: what is known of a file stands in `Found`.
"""

from __future__ import annotations

import re
import unicodedata
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from bsip_cli.files.regular import read_toml, shipped

STILL_M_S = 0.1
"""Mean speed of markers over half a second: people who stand sway by centimetres a second, in slow
movements the limbs go several times faster."""


WORDS = {key: frozenset(x.split()) for key, x in read_toml(shipped("recording_words.toml")).items()}
"""In names of recordings and folders, by what they mean."""

_STATIC, _PERHAPS_STATIC = WORDS["static"], WORDS["perhaps_static"]
_SORTING = _STATIC | _PERHAPS_STATIC | WORDS["sorting"]
_LONGEST_TASK = 40  # letters
_LONGEST_RUN = 4  # digits; longer ones are dates and belong to the name
_ENOUGH_LABELS = 0.5  # shared, of the recording with fewer: else nothing says that it is one set
_TASK = re.compile(r"task-([A-Za-z0-9]+)")
_RUN = re.compile(r"run-([0-9]+)")
_BIDS_PERSON = re.compile(r"(?<![A-Za-z0-9])(sub-[A-Za-z0-9]+)")
_SESSION = re.compile(
    r"^(?:ses|sess?ion|sitzung|day|tag|jour|visit|visite)(?:[-_ ]+([A-Za-z0-9]+)|([0-9]+))$",
    re.IGNORECASE,
)
_DATE = 6  # digits at least, as in 230105


@dataclass(frozen=True)
class Found:
    """A recording and what is known of it.

    ``folders`` lead to it from where the search began; ``subject`` is its program's name for the
    person; ``labels`` of named markers, without prefixes; ``median_m_s`` and ``fastest_m_s`` are
    the mean speed of markers over half a second, in the median and in the 90th percentile.
    """

    path: Path
    folders: tuple[str, ...]
    subject: str
    labels: frozenset[str]
    median_m_s: float
    fastest_m_s: float

    @property
    def stem(self) -> str:
        return self.path.stem


@dataclass(frozen=True)
class Named:
    """What a recording is called in the study: ``stem`` without ending, below ``folder``."""

    found: Found
    participant: str
    session: str
    task: str
    run: int

    @property
    def stem(self) -> str:
        session = f"_ses-{self.session}" if self.session else ""
        return f"{self.participant}{session}_task-{self.task}_run-{self.run}"

    @property
    def folder(self) -> Path:
        return Path(self.participant) / (f"ses-{self.session}" if self.session else "")


def name_all(
    recordings: Sequence[Found], participant: str = ""
) -> tuple[tuple[Named, ...], tuple[str, ...]]:
    """Names for all recordings, and what was guessed to find them.

    participant : whose all are, if that is known.
    """
    notes: list[str] = []
    people = {participant: [*recordings]} if participant else _people(recordings, notes)
    named: list[Named] = []
    for name, own in people.items():
        named += _trials(name, own, notes)
    without = sorted({*people} - {one.participant for one in named if one.task == "static"})
    if without:
        whose = "" if len(without) == len(people) else f" of {', '.join(without)}"
        notes.append(f"no static trial{whose}: the quietest second of a movement calibrates")
    return tuple(named), tuple(notes)


# --- whose ----------------------------------------------------------------------------------------


def _people(recordings: Sequence[Found], notes: list[str]) -> dict[str, list[Found]]:
    """Recordings by participant."""
    places = ((one.stem, "/".join(one.folders)) for one in recordings)
    found = (_BIDS_PERSON.search(stem) or _BIDS_PERSON.search(path) for stem, path in places)
    groups = _by(recordings, [match[1] if match else "" for match in found])
    named = {key: own for key, own in groups.items() if key}
    for folder, inside in _by(groups.get("", []), _person_folders(groups.get("", []))).items():
        for key, own in _in_one_folder(inside, notes).items():
            for part in _of_one_marker_set(own, notes):
                wished = key or folder
                letters = "" if wished.startswith("?") else plain(wished)
                numbers = (f"sub-{letters}{k:02d}" for k in range(1, len(named) + 2))
                names = [*([f"sub-{letters}"] if letters else []), *numbers]
                known = {name.casefold() for name in named}
                named[next(name for name in names if name.casefold() not in known)] = part
    return dict(sorted(named.items()))


def _by(recordings: Iterable[Found], keys: Iterable[str]) -> dict[str, list[Found]]:
    groups: dict[str, list[Found]] = defaultdict(list)
    for one, key in zip(recordings, keys, strict=True):
        groups[key].append(one)
    return groups


def _person_folders(recordings: Sequence[Found]) -> list[str]:
    """The folder that names each recording's person; empty where folders only sort."""
    different = [
        [folder for folder in one.folders if not _SESSION.match(folder) and not _only_sorts(folder)]
        for one in recordings
    ]
    while len({tuple(folders[:1]) for folders in different}) == 1 and different[0]:
        different = [folders[1:] for folders in different]  # all lie in it
    return [folders[0] if folders else "" for folders in different]


def _in_one_folder(recordings: Sequence[Found], notes: list[str]) -> dict[str, list[Found]]:
    """People whose recordings lie together: by the program's subjects, else by how names begin."""
    subjects = {one.subject for one in recordings if one.subject}
    if len(subjects) > 1:
        groups = _by(recordings, [one.subject for one in recordings])
        notes.append(f"{len(subjects)} people, by the subjects that the files name")
        return {_shown_name(name, groups): own for name, own in groups.items()}
    for where, guess in _GUESSES.items():
        guessed = [guess(one.stem) for one in recordings]
        if _are_people(guessed, recordings):
            notes.append(f"{len(set(guessed))} people, by how the names of their files {where}")
            return _by(recordings, guessed)
    return {"": list(recordings)}


def _shown_name(subject: str, groups: Mapping[str, Sequence[Found]]) -> str:
    """What file names show of a person anyhow; a subject's name alone is not spread."""
    clean = plain(subject)
    if clean and all(clean in plain(str(one.path)) for one in groups[subject]):
        return subject
    for guess in (_first, _glued):
        said = {name: {guess(one.stem) for one in own} for name, own in groups.items()}
        if all(len(own) == 1 for own in said.values()):
            words_of = [word for own in said.values() for word in own]
            if all(words_of) and len(set(words_of)) == len(groups):
                return next(iter(said[subject]))
    return f"?{subject}"


def _first(stem: str) -> str:
    return next(iter(_parts(stem)), "")


def _glued(stem: str) -> str:
    """S01 of S01static."""
    match = re.match(r"[A-Za-z]*\d+(?=[A-Za-z])", _first(stem))
    return match[0] if match else ""


_GUESSES: Mapping[str, Callable[[str], str]] = {
    "begin": _first,
    "begin, before other letters": _glued,
    "end": lambda stem: next((p for p in _parts(stem)[-1:] if re.search("[A-Za-z]", p)), ""),
}
"""Where in a file's name its person may stand; at the end numbers alone are runs."""


def _are_people(guessed: Sequence[str], recordings: Sequence[Found]) -> bool:
    """Whether words of file names are people: called so, or each with a static trial of its own.

    Of words with digits, like HC07, two with a static trial are enough.
    """
    if len(set(guessed)) < 2 or not all(guessed):
        return False
    letters = [{w for w in words(one) if w.isalpha()} for one in guessed]
    have_digits = all(re.search(r"\d", one) for one in guessed)
    if have_digits and all(one and one <= WORDS["persons"] for one in letters):
        return True
    pairs = zip(guessed, recordings, strict=True)
    static = {word for word, one in pairs if _is_called_static(one.stem.replace(word, " ", 1))}
    return len(static) > 1 and (have_digits or static == set(guessed))


def _of_one_marker_set(recordings: Sequence[Found], notes: list[str]) -> list[list[Found]]:
    """Parts whose recordings share markers: those that do not are not of one skeleton."""
    parts: list[list[Found]] = []
    for one in sorted(recordings, key=lambda one: -len(one.labels)):
        for part in parts:
            least = (max(1, min(len(one.labels), len(other.labels))) for other in part)
            shared = (len(one.labels & other.labels) for other in part)
            if any(n >= _ENOUGH_LABELS * of for n, of in zip(shared, least, strict=True)):
                part.append(one)
                break
        else:
            parts.append([one])
    if len(parts) > 1:
        notes.append(
            f"recordings in {recordings[0].path.parent} whose markers have other names are taken "
            f"for those of {len(parts)} people; --participant says that they are one's"
        )
    return [sorted(part, key=lambda one: one.path) for part in parts]


# --- what -----------------------------------------------------------------------------------------


def _trials(participant: str, own: Sequence[Found], notes: list[str]) -> list[Named]:
    """The trials of one person, each with a name of its own."""
    rests = _without_common([_rest(one.stem, participant) for one in own])
    for k, one in enumerate(own):  # a folder says what it shows where its name does not
        sorting = [f for f in one.folders if _only_sorts(f) and re.search(r"[A-Za-z]", f)]
        rests[k] = rests[k] or sorting[-1:]
    static = _static(participant, own, notes)
    taken: set[tuple[str, str, int]] = set()
    named = []
    for one, rest in sorted(zip(own, rests, strict=True), key=lambda pair: pair[0].path):
        task, run = _task_and_run(rest)
        if one in static:
            task = "static"
        elif task.casefold() == "static":
            task = "notstatic"
        session = next((m[1] or m[2] for f in one.folders if (m := _SESSION.match(f))), "")
        while (session, task.casefold(), run) in taken:
            run += 1
        taken.add((session, task.casefold(), run))
        named.append(Named(one, participant, session, task, run))
    return named


def _static(participant: str, own: Sequence[Found], notes: list[str]) -> list[Found]:
    """Those that calibrate: called so and still; else the stillest, if somebody stands there."""
    called = [one for one in own if _is_called_static(one.stem) or _is_in_static_folder(one)]
    # Words that movements have too must be still nearly all the time.
    clear = [one for one in called if _is_in_static_folder(one) or _STATIC & {*words(one.stem)}]
    speeds = {one.path: one.median_m_s if one in clear else one.fastest_m_s for one in called}
    still = [one for one in called if speeds[one.path] < STILL_M_S]
    moving = [one.path.name for one in called if one not in still]
    if moving:
        notes.append(
            f"{participant}: {', '.join(moving)} is called static, but its markers move: it is "
            "taken for a movement"
        )
    if still or not own:
        return still
    stillest = min(own, key=lambda one: one.fastest_m_s)
    if stillest.fastest_m_s < STILL_M_S and len(own) > 1:
        notes.append(f"{participant}: {stillest.path.name} is the stillest and serves as static")
        return [stillest]
    return []


def _is_called_static(stem: str) -> bool:
    return not (_STATIC | _PERHAPS_STATIC).isdisjoint(words(stem))


def _is_in_static_folder(one: Found) -> bool:
    return any(not _STATIC.isdisjoint(words(folder)) for folder in one.folders)


def _only_sorts(folder: str) -> bool:
    """Whether a folder's name says what lies in it or when it was recorded, and not of whom."""
    letters = [word for word in words(folder) if word.isalpha()]
    is_date = not letters and len(re.sub(r"\D", "", folder)) >= _DATE
    return is_date or (bool(letters) and _SORTING.issuperset(letters))


def is_sequence(task: str) -> bool:
    """Whether a task's name says that it is for identification."""
    return not WORDS["sequence"].isdisjoint(words(task))


def _rest(stem: str, participant: str) -> list[str]:
    """The words of a file's name without the person's."""
    if _TASK.search(stem):
        return [stem]
    parts = _parts(_BIDS_PERSON.sub("", stem))
    letters = participant.removeprefix("sub-").casefold()
    joined = ""
    for k, part in enumerate(parts):
        joined += plain(part).casefold()
        if joined == letters:
            return parts[k + 1 :]
    if letters.isdigit():  # sub-01, which no file is called after
        return parts
    if parts and _glued(parts[0]).casefold() == letters:
        return [parts[0][len(letters) :], *parts[1:]]
    return [part for part in parts if plain(part).casefold() != letters]


def _parts(stem: str) -> list[str]:
    return [part for part in re.split(r"[\W_]+", stem) if part]


def _without_common(rests: list[list[str]]) -> list[list[str]]:
    """Without the words that all names begin with, where something is left of each."""
    while (
        len(rests) > 1
        and all(len(rest) > 1 for rest in rests)
        and len({rest[0].casefold() for rest in rests}) == 1
        and any(re.search("[A-Za-z]", "".join(rest[1:])) for rest in rests)
    ):
        rests = [rest[1:] for rest in rests]
    return rests


def _task_and_run(parts: Sequence[str]) -> tuple[str, int]:
    """``walking2`` is the second run of walking; what has no letters is a trial."""
    whole = "_".join(parts)
    if task := _TASK.search(whole):  # named as in BIDS
        number = _RUN.search(whole)
        return task[1], int(number[1]) if number else 1
    match = re.fullmatch(rf"(.*?)(?<!\d)_?(\d{{1,{_LONGEST_RUN}}})", whole)
    before, run = (match[1], int(match[2])) if match else (whole, 1)
    first, *others = _parts(before) or [""]
    camel = first + "".join(part[:1].upper() + part[1:] for part in others)
    letters = plain(camel)[:_LONGEST_TASK]
    return (letters if re.search("[A-Za-z]", letters) else f"trial{letters}"), max(run, 1)


# --- words ----------------------------------------------------------------------------------------


def plain(text: str) -> str:
    """Letters and digits alone, those of ASCII: the ones that names in a study may have."""
    folded = unicodedata.normalize("NFKD", text.replace("ß", "ss"))
    return re.sub(r"[^A-Za-z0-9]", "", folded)


def words(text: str) -> list[str]:
    """The words of a name in small letters: TPose_left2 is t, pose, left, 2; and tpose."""
    folded = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    split = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", folded)
    whole = re.findall(r"[A-Za-z]+", folded)
    return list(dict.fromkeys(word.lower() for word in (*split, *whole)))
