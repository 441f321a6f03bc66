"""One piece of work: a stage on one trial, participant or cohort, with its files and options."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from importlib.metadata import version
from itertools import compress, takewhile
from pathlib import Path
from typing import Any

import pandas as pd

from bsip_cli import __version__, artifacts
from bsip_cli.config import Config, Load, load_config
from bsip_cli.errors import BadDataError, printable
from bsip_cli.files.fingerprints import file_hash
from bsip_cli.files.regular import shipped
from bsip_cli.pipeline import STAGES, Stage, producer
from bsip_cli.schemas import SCHEMAS
from bsip_cli.study.study import Participant, Study, Trial


@dataclass(eq=False)
class Unit:
    """What a stage is handed: it reads, writes and warns through this and nothing else.

    ``config`` are the options that the stage names. ``left_out`` are participants whose results are
    not up to date, with the reason: a cohort stage reports them and does not use them.
    ``recordings`` are opened already, by their trials' stems; others are opened from their files.
    """

    stage: Stage
    study: Study
    out: Path
    config: Config
    participant: Participant | None = None
    trial: Trial | None = None
    messages: list[str] = field(default_factory=list)
    left_out: Mapping[str, str] = field(default_factory=dict)
    recordings: Mapping[str, Any] = field(default_factory=dict)
    config_of_all: Config = field(init=False)

    def __post_init__(self) -> None:
        self.config_of_all = self.config
        self.config = self.config.only(self.stage.options)

    @property
    def name(self) -> str:
        return self.trial.stem if self.trial else _owner(self.participant)

    @property
    def person(self) -> Participant:
        """Of a unit of a participant or trial, whom it is about."""
        assert self.participant is not None
        return self.participant

    @property
    def own_trial(self) -> Trial:
        """Of a unit of a trial, which."""
        assert self.trial is not None
        return self.trial

    def warn(self, message: str) -> None:
        """For the user when the unit is done or refused, and the reader of its artifacts later."""
        self.messages.append(printable(message))

    def say(self, sentence: str) -> None:
        """The same of this unit, with its name."""
        self.warn(f"{self.name}: {sentence}")

    # --- where things lie -------------------------------------------------------------------

    def path(
        self, kind: str, trial: Trial | None = None, participant: Participant | None = None
    ) -> Path:
        """Final path of an artifact; trial and participant default to the unit's own."""
        level, name = SCHEMAS[kind].level, SCHEMAS[kind].file_name
        if level == "cohort":
            return self.out / "group" / f"group_{name}.parquet"
        participant = participant or self.person
        owner = trial or self.trial if level == "trial" else None
        stem = owner.stem if owner else participant.id
        return self.out / participant.id / f"{stem}_{name}.parquet"

    def refusal_path(self) -> Path:
        """Where a refusal of this unit is written down."""
        name = f"{self.name}_refusal-{self.stage.name}.parquet"
        return self.out / _owner(self.participant) / name

    def loads(self, trial: Trial | None = None) -> tuple[Load, ...]:
        """Known loads of a trial (by default the unit's own; without one, of the participant)."""
        trial, loads = trial or self.trial, self.config.loads
        if trial is None:
            everybody = [person.id for person in self.participants()]
            return tuple(one for one in loads if any(map(one.is_worn_by, everybody)))
        where = (trial.participant_id, trial.task, trial.run)
        return tuple(load for load in loads if load.is_carried_in(*where))

    def load_kg(self, trial: Trial | None = None) -> float:
        """What the known loads of a trial weigh together."""
        return sum((load.mass_kg for load in self.loads(trial)), 0.0)

    def participants(self) -> tuple[Participant, ...]:
        return (self.participant,) if self.participant else self.study.participants

    def trials(self, *kinds: str) -> tuple[Trial, ...]:
        """The participant's trials for which all these kinds are there and not refused."""
        whose, names = self.person, self._names(self.person)
        there = (all(self.stands(k, one, whose, names) for k in kinds) for one in whose.trials)
        return tuple(compress(whose.trials, there))

    def stands(
        self,
        kind: str,
        trial: Trial | None,
        participant: Participant | None,
        names: Collection[str] | None = None,
    ) -> bool:
        """An artifact is there, and no stage up to its own has refused the trial or participant
        since; ``names`` of the files in the folder, where they are known."""
        names = self._names(participant) if names is None else names
        before = STAGES[: STAGES.index(producer(kind)) + 1]
        of_trials = [stage for stage in before if stage.level == "trial"]
        return (
            self.path(kind, trial, participant).name in names
            and not _refusals(names, [_owner(participant)], before)
            and not (trial and _refusals(names, [trial.stem], of_trials))
        )

    def _names(self, participant: Participant | None) -> frozenset[str]:
        """Of the files of a participant, or of the group, at this moment."""
        try:
            with os.scandir(self.out / _owner(participant)) as entries:
                return frozenset(entry.name for entry in entries)
        except FileNotFoundError:
            return frozenset()

    # --- inputs ------------------------------------------------------------------------------

    def inputs(self) -> dict[str, Path]:
        """Name and path of every file that a unit of a participant reads, but for refused ones."""
        files = self._files_of(self.participant)
        files |= {path.name: path for path in self._recordings()}
        return files | self._files_of_options()

    def _recordings(self) -> list[Path]:
        """Files of its recordings, of a stage that reads these."""
        if not self.stage.reads_recordings or self.participant is None:
            return []
        trials = (self.trial,) if self.trial else self.participant.trials
        return [path for trial in trials for path in trial.files]

    def kinds_read(self) -> Iterator[str]:
        """The kinds of artifacts that it reads and that are there, and the names of recordings."""
        yield from (kind for kind in self.stage.inputs if self._has(kind))
        yield from (path.name for path in self._recordings())

    def _files_of(self, participant: Participant | None) -> dict[str, Path]:
        """What the unit reads of a participant, or of the group: artifacts, refusals."""
        names, kinds = self._names(participant), self.stage.inputs
        own = [kind for kind in kinds if (SCHEMAS[kind].level == "cohort") == (not participant)]
        paths = [path for kind in own for path in self._valid(kind, participant, names)]
        if participant is not None and self.trial is None:
            owners = [participant.id, *(trial.stem for trial in participant.trials)]
            before = takewhile(lambda stage: stage.label != self.stage.label, STAGES)
            folder = self.out / participant.id  # reports speak of them
            paths += [folder / name for name in _refusals(names, owners, tuple(before))]
        return {path.name: path for path in paths}

    def _files_of_options(self) -> dict[str, Path]:
        named = (n for n in ("marker_set", "skeleton") if n in self.stage.options)
        paths = (Path(getattr(self.config, name)) for name in named)
        return {path.name: path for path in paths if path.suffix == ".toml"}

    def _valid(
        self, kind: str, participant: Participant | None, names: Collection[str]
    ) -> list[Path]:
        """Artifacts of a kind that the unit reads: its own, or those of all trials below it."""
        below = participant and SCHEMAS[kind].level == "trial" and self.trial is None
        trials = participant.trials if participant and below else (self.trial,)
        valid = (one for one in trials if self.stands(kind, one, participant, names))
        return [self.path(kind, one, participant) for one in valid]

    def missing(self) -> list[str]:
        """Kinds the unit cannot do without and that are not there.

        A cohort stage judges itself what refusals leave of the cohort.
        """
        return [k for k in (*self.stage.reads, *self.stage.amends) if not self._has(k)]

    def has(self, *kinds: str) -> bool:
        """Whether all these kinds, which the stage may read, are there and not refused."""
        return all(kind in self.stage.inputs and self._has(kind) for kind in kinds)

    def _has(self, kind: str) -> bool:
        if SCHEMAS[kind].level == "cohort" or self.participant is not None:
            whose = None if SCHEMAS[kind].level == "cohort" else self.participant
            return bool(self._valid(kind, whose, self._names(whose)))
        return any(
            self.path(kind, trial, person).exists()
            for person in self.study.participants
            for trial in (person.trials if SCHEMAS[kind].level == "trial" else (None,))
        )

    @cached_property
    def made_by(self) -> dict[str, Any]:
        """Provenance of what the unit writes: its inputs as they were when it was first asked."""
        options = self.config.options(self.stage.options)
        for name in ("marker_set", "skeleton"):
            if str(options.get(name, "")).endswith(".toml"):  # its content counts, not its place
                options[name] = Path(options[name]).name
        if "loads" in options:  # another person's or trial's load changes nothing here
            options["loads"] = [load.model_dump(mode="json") for load in self.loads()]
        if (one := self.participant) is not None:
            names = ("sex", "mass_kg", "height_m")
            options["participant"] = {name: getattr(one, name) for name in names}
        return {
            "stage": self.stage.name,
            "bsip_version": __version__,
            "code": code_hash(self.stage.module),
            "libraries": library_versions(),
            "inputs": dict(sorted(self._hashes().items())),
            "options": json.loads(json.dumps(options, sort_keys=True)),
        }

    def _hashes(self) -> dict[str, str]:
        """Of every input; in the group, of everything of a participant together."""
        if self.participant is not None:
            files = self.inputs()
            hashes = {name: file_hash(path) for name, path in files.items() if path.exists()}
            of_all = [k for k in self.stage.inputs if SCHEMAS[k].level == "cohort" and self._has(k)]
            for kind in of_all:  # what a result of the group says to its participants
                answer = json.dumps(self.facts(kind)["answer"], sort_keys=True)
                hashes[f"{kind} of the group"] = hashlib.sha256(answer.encode()).hexdigest()
            return hashes
        people = {}
        for person in self.study.participants:
            if own := sorted(self._files_of(person).items()):
                lines = "".join(f"{name} {file_hash(path)}\n" for name, path in own)
                text = lines.encode("utf-8", "surrogateescape")
                people[person.id] = hashlib.sha256(text).hexdigest()
        files = self._files_of(None) | self._files_of_options()
        hashes = {name: file_hash(path) for name, path in files.items()}
        return hashes | people | {name: f"left out: {why}" for name, why in self.left_out.items()}

    # --- reading and writing ----------------------------------------------------------------

    @staticmethod
    def shipped_options() -> dict[str, Any]:
        """Every option's value in configs/default.toml."""
        return load_config([]).model_dump()

    def read(
        self,
        kind: str,
        trial: Trial | None = None,
        participant: Participant | None = None,
        **wanted: Collection[str],
    ) -> pd.DataFrame:
        """An artifact, or those of its rows with the wanted values in text columns."""
        return self._table(self.path(kind, trial, participant), kind, **wanted)

    def facts(
        self, kind: str, trial: Trial | None = None, participant: Participant | None = None
    ) -> dict[str, Any]:
        """What the producing stage said of its result as a whole."""
        return self._provenance(self.path(kind, trial, participant), kind)["facts"]

    def said_before(self, kind: str) -> dict[str, Any]:
        """Facts of what the unit has written last; empty where that cannot be read."""
        try:
            return self.facts(kind)
        except BadDataError:
            return {}

    def write(self, kind: str, frame: artifacts.Rows, facts: dict[str, Any] | None = None) -> None:
        self._keep(self.path(kind), kind, frame, self._notes(facts or {}))

    def write_in_parts(
        self, kind: str, parts: Iterable[pd.DataFrame], facts: Callable[[], dict[str, Any]]
    ) -> None:
        """Write what does not fit into memory; the facts are known after the last part."""
        path = self.path(kind)
        artifacts.write_artifact_in_parts(path, kind, parts, lambda: self._notes(facts()))

    def _notes(self, facts: dict[str, Any]) -> dict[str, Any]:
        return {"made_by": self.made_by, "messages": list(self.messages), "facts": facts}

    def amend(self, kind: str, rows: pd.DataFrame) -> None:
        """Put rows below those of the stage that made the artifact, instead of earlier ones.

        What made the artifact stays what it was: its maker need not work again.
        """
        path = self.path(kind)
        notes = self._provenance(path, kind)
        made = self._table(path, kind).iloc[: notes.get("rows_made")]
        notes |= {"amended_by": self.made_by, "rows_made": len(made)}
        whole = pd.concat([made, rows], ignore_index=True) if len(rows) else made
        self._keep(path, kind, whole, notes)

    # where tables lie: here in files

    def _table(self, path: Path, kind: str, **wanted: Collection[str]) -> pd.DataFrame:
        return artifacts.read_artifact(path, kind, **wanted)

    def _provenance(self, path: Path, kind: str) -> dict[str, Any]:
        return artifacts.read_header(path, kind)["provenance"]

    def _keep(self, path: Path, kind: str, frame: artifacts.Rows, notes: dict[str, Any]) -> None:
        artifacts.write_artifact(path, kind, frame, notes)


def _owner(participant: Participant | None) -> str:
    return participant.id if participant else "group"


def _refusals(
    names: Collection[str], owners: Collection[str], stages: Iterable[Stage]
) -> list[str]:
    """Among some files, the refusals of these owners (ids, stems of trials) by these stages."""
    if not any("_refusal-" in name for name in names):
        return []
    asked = (f"{owner}_refusal-{stage.name}.parquet" for owner in owners for stage in stages)
    return [name for name in dict.fromkeys(asked) if name in names]


# --- what made an artifact: inputs, options, code, versions; no clock: same work, same bytes ------

# Which code and shipped tables a stage's results depend on is one hash.

_PACKAGE = Path(__file__).parents[1]
_NAME = _PACKAGE.name
_FROM = re.compile(rf"^\s*from\s+({_NAME}[\w.]*)\s+import\s+(\([^)]*\)|[^\n(]*)", re.MULTILINE)
_IMPORT = re.compile(rf"^\s*import\s+({_NAME}[\w.]*)", re.MULTILINE)
_CHOSEN_LATER = re.compile(rf'"({_NAME}[\w.]*)\.\{{')  # import_module(f"bsip_cli.package.{name}")
_SHIPPED = re.compile(r'\bshipped\(\s*"([^"]+)"')
_OPTIONS = "default.toml"  # its values are in the provenance one by one


@lru_cache(maxsize=64)
def code_hash(module: str) -> str:
    """SHA-256 over the modules that ``module`` imports, directly or not, and the files they read.

    Those are the files in ``configs/`` that they name, and the tables and templates that lie in
    their packages.
    """
    modules = imported_by(module)
    digest = hashlib.sha256()
    for name in sorted(modules):
        digest.update(f"{name}\n{_sources()[name]}".encode())
    for file in sorted(_data_of(modules)):
        digest.update(f"{file.name}\n".encode() + file.read_bytes())
    return digest.hexdigest()


def imported_by(module: str) -> frozenset[str]:
    """The modules of the package that ``module`` imports anywhere, with it and their packages."""
    found: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name in _sources() and name not in found:
            found.add(name)
            waiting += [name.rpartition(".")[0], *_named_in(name)]
    return frozenset(found)


@lru_cache(maxsize=1)
def _sources() -> dict[str, str]:
    """The text of every module of the package, by its dotted name."""
    files = {file.relative_to(_PACKAGE.parent): file for file in _PACKAGE.rglob("*.py")}
    named = {".".join(place.with_suffix("").parts): file for place, file in files.items()}
    texts = {name: file.read_text(encoding="utf-8") for name, file in named.items()}
    return {name.removesuffix(".__init__"): text for name, text in texts.items()}


@lru_cache(maxsize=1024)
def _named_in(module: str) -> frozenset[str]:
    text = _sources()[module]
    named = set(_IMPORT.findall(text))
    for package, names in _FROM.findall(text):
        words = re.findall(r"\w+", re.sub(r"#.*", "", names))
        named |= {package, *(f"{package}.{word}" for word in words)}
    later = {*_CHOSEN_LATER.findall(text)}
    return frozenset(named | {name for name in _sources() if name.rpartition(".")[0] in later})


def _data_of(modules: frozenset[str]) -> set[Path]:
    """Files that are no code: those named in ``configs/``, and those in the modules' packages."""
    named = {name for module in modules for name in _SHIPPED.findall(_sources()[module])}
    folders = {_PACKAGE.parent.joinpath(*module.split(".")[:-1]) for module in modules}
    folders -= {_PACKAGE, _PACKAGE.parent}
    inside = (file for folder in folders for file in _below(folder))
    package_of = {f: next(p for p in f.parents if (p / "__init__.py").is_file()) for f in inside}
    own = {file for file, package in package_of.items() if package in folders}
    return own.union(*(_below(shipped(name)) for name in named - {_OPTIONS}))


def _below(place: Path) -> set[Path]:
    """Files that belong to the package and are no code, nor left by Python, numba or an editor."""
    return {
        file
        for file in (place.rglob("*") if place.is_dir() else [place])
        if file.is_file()
        and file.suffix != ".py"
        and not (file.parent.name == "__pycache__" or file.name[0] == "." or file.name[-1] == "~")
    }


_LIBRARIES = "clarabel ezc3d jinja2 numba numpy pandas pin pyarrow pydantic scipy statsmodels"


@lru_cache(maxsize=1)
def library_versions() -> dict[str, str]:
    """Versions of the libraries that numbers and figures depend on."""
    return {name: version(name) for name in _LIBRARIES.split()}
