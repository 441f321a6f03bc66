"""One piece of work: a stage on one trial, participant or cohort, with its files and options."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path

import pandas as pd

from bsip_cli.artifacts import (
    read_artifact,
    read_header,
    write_artifact,
    write_artifact_in_parts,
)
from bsip_cli.config import Config, Load
from bsip_cli.errors import BadDataError
from bsip_cli.pipeline import STAGES, Stage, producer
from bsip_cli.provenance import describe, file_hash
from bsip_cli.schemas import SCHEMAS
from bsip_cli.study import Participant, Study, Trial


@dataclass
class Unit:
    """What a stage is handed: it reads, writes and warns through this and nothing else."""

    stage: Stage
    study: Study
    out: Path
    config: Config
    participant: Participant | None = None
    trial: Trial | None = None
    messages: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        if self.trial is not None:
            return self.trial.stem
        return self.participant.id if self.participant else "group"

    def warn(self, message: str) -> None:
        """Tell the user when the unit is done or refused, and the reader of its artifacts later."""
        self.messages.append(message)

    # --- where things lie -------------------------------------------------------------------

    def path(
        self, kind: str, trial: Trial | None = None, participant: Participant | None = None
    ) -> Path:
        """Final path of an artifact; trial and participant default to the unit's own."""
        level, name = SCHEMAS[kind].level, SCHEMAS[kind].file_name
        if level == "cohort":
            return self.out / "group" / f"group_{name}.parquet"
        participant = participant or self.participant
        assert participant is not None
        owner = trial or self.trial if level == "trial" else None
        stem = owner.stem if owner else participant.id
        return self.out / participant.id / f"{stem}_{name}.parquet"

    def refusal_path(self, stage: str | None = None, trial: Trial | None = None) -> Path:
        """Where a refusal of this unit (or of another stage or trial) is written down."""
        folder = self.participant.id if self.participant else "group"
        stem = trial.stem if trial else self.name
        return self.out / folder / f"{stem}_refusal-{stage or self.stage.name}.parquet"

    def loads(self, trial: Trial | None = None) -> tuple[Load, ...]:
        """Known loads of a trial (by default the unit's own; without one, of the participant)."""
        trial = trial or self.trial
        if trial is None:
            worn = (
                load
                for load in self.config.loads
                if any(load.is_worn_by(person.id) for person in self.participants())
            )
            return tuple(worn)
        where = (trial.participant_id, trial.task, trial.run)
        return tuple(load for load in self.config.loads if load.is_carried_in(*where))

    def load_kg(self, trial: Trial | None = None) -> float:
        """What the known loads of a trial weigh together."""
        return sum((load.mass_kg for load in self.loads(trial)), 0.0)

    def participants(self) -> tuple[Participant, ...]:
        return (self.participant,) if self.participant else self.study.participants

    def trials(self, *kinds: str) -> tuple[Trial, ...]:
        """The participant's trials for which all these kinds are there and not refused."""
        assert self.participant is not None
        return tuple(
            trial
            for trial in self.participant.trials
            if all(self._stands(kind, self.participant, trial) for kind in kinds)
        )

    def _stands(self, kind: str, participant: Participant | None, trial: Trial | None) -> bool:
        """It is there, and no stage up to its own has refused the trial or participant since."""
        path = self.path(kind, trial, participant)
        before = STAGES[: STAGES.index(producer(kind)) + 1]
        return path.exists() and not self._refusals(path.parent, participant, trial, before)

    def _refusals(
        self,
        folder: Path,
        participant: Participant | None,
        trial: Trial | None,
        stages: Iterable[Stage],
    ) -> list[Path]:
        owners = [participant.id if participant else "group", *([trial.stem] if trial else [])]
        names = (f"{owner}_refusal-{stage.name}.parquet" for owner in owners for stage in stages)
        return [folder / name for name in dict.fromkeys(names) if (folder / name).exists()]

    # --- inputs, freshness ------------------------------------------------------------------

    def inputs(self) -> dict[str, Path]:
        """Name and path of every file the unit reads; those a refusal left out are not in it."""
        files = {path.name: path for kind in self.stage.inputs for path in self._standing(kind)}
        if self.trial is None:
            files |= {path.name: path for path in self._refused_before()}
        elif not self.stage.inputs:
            files |= {path.name: path for path in _recording_files(self.trial.path)}
        for name in ("marker_set", "skeleton"):
            own = Path(getattr(self.config, name))
            if name in self.stage.options and own.suffix == ".toml":
                files[own.name] = own
        return files

    def _owners(self, kind: str) -> list[tuple[Participant | None, Trial | None]]:
        """Whose artifact of a kind the unit reads: its own, or that of everybody below it."""
        level = SCHEMAS[kind].level
        if level == "cohort":
            return [(None, None)]
        if level == "trial" and self.trial is None:
            return [(person, trial) for person in self.participants() for trial in person.trials]
        return [(person, self.trial) for person in self.participants()]

    def _standing(self, kind: str) -> list[Path]:
        return [
            self.path(kind, trial, person)
            for person, trial in self._owners(kind)
            if self._stands(kind, person, trial)
        ]

    def _refused_before(self) -> list[Path]:
        """What earlier stages refused of the unit's participants: reports tell of it."""
        before = tuple(takewhile(lambda stage: stage.label != self.stage.label, STAGES))
        return [
            path
            for person in self.participants()
            for trial in (None, *person.trials)
            for path in self._refusals(self.out / person.id, person, trial, before)
        ]

    def missing(self) -> list[str]:
        """Kinds the unit cannot do without and that are not there.

        A cohort stage judges itself what refusals leave of the cohort.
        """
        return [k for k in (*self.stage.reads, *self.stage.amends) if not self._has(k)]

    def has(self, *kinds: str) -> bool:
        """Whether all these kinds, which the stage may read, are there and not refused."""
        return all(kind in self.stage.inputs and self._has(kind) for kind in kinds)

    def _has(self, kind: str) -> bool:
        if self.participant is None and SCHEMAS[kind].level != "cohort":
            return any(self.path(kind, trial, p).exists() for p, trial in self._owners(kind))
        return bool(self._standing(kind))

    def provenance(self) -> dict:
        present = {name: path for name, path in self.inputs().items() if path.exists()}
        options = self.config.options(self.stage.options)
        for name in ("marker_set", "skeleton"):
            if str(options.get(name, "")).endswith(".toml"):  # its content counts, not its place
                options[name] = Path(options[name]).name
        if "loads" in options:  # another person's or trial's load changes nothing here
            options["loads"] = [load.model_dump(mode="json") for load in self.loads()]
        if self.participant is not None:
            options["participant"] = {
                "sex": self.participant.sex,
                "mass_kg": self.participant.mass_kg,
                "height_m": self.participant.height_m,
            }
        return describe(self.stage.name, present, options)

    def is_fresh(self) -> bool:
        """Everything the unit writes is there and made from what it would read now."""
        if self.refusal_path().exists():
            return False
        wanted = self.provenance()
        return all(self._is_current(kind, wanted) for kind in self.stage.writes) and all(
            self._is_amended(kind, wanted) for kind in self.stage.amends
        )

    def _is_amended(self, kind: str, amended_by: dict) -> bool:
        try:
            header = read_header(self.path(kind), kind)
        except BadDataError:
            return False
        return header["provenance"].get("amended_by") == amended_by

    def _is_current(self, kind: str, made_by: dict) -> bool:
        path = self.path(kind)
        try:
            header = read_header(path, kind)
            if header["provenance"]["made_by"] != made_by:
                return False
            listed = read_artifact(path, kind) if SCHEMAS[kind].column("sha256") else None
        except BadDataError:
            return False
        if listed is None:
            return True
        files = zip(listed["file"], listed["sha256"], strict=True)
        return all(
            (self.out / name).is_file() and file_hash(self.out / name) == known
            for name, known in files
        )

    # --- reading and writing ----------------------------------------------------------------

    def read(
        self,
        kind: str,
        trial: Trial | None = None,
        participant: Participant | None = None,
        **wanted: Collection[str],
    ) -> pd.DataFrame:
        """An artifact, or those of its rows with the wanted values in text columns."""
        return read_artifact(self.path(kind, trial, participant), kind, **wanted)

    def facts(self, kind: str, trial: Trial | None = None) -> dict:
        """What the producing stage said of its result as a whole."""
        return read_header(self.path(kind, trial), kind)["provenance"]["facts"]

    def write(self, kind: str, frame: pd.DataFrame, facts: dict | None = None) -> None:
        write_artifact(self.path(kind), kind, frame, self._notes(facts or {}))

    def write_in_parts(
        self, kind: str, parts: Iterable[pd.DataFrame], facts: Callable[[], dict]
    ) -> None:
        """Write what does not fit into memory; the facts are known after the last part."""
        write_artifact_in_parts(self.path(kind), kind, parts, lambda: self._notes(facts()))

    def _notes(self, facts: dict) -> dict:
        return {"made_by": self.provenance(), "messages": list(self.messages), "facts": facts}

    def amend(self, kind: str, rows: pd.DataFrame) -> None:
        """Put rows below those of the stage that made the artifact, instead of earlier ones.

        What made the artifact stays what it was: its maker need not work again.
        """
        path = self.path(kind)
        notes = read_header(path, kind)["provenance"]
        made = read_artifact(path, kind).iloc[: notes.get("rows_made")]
        notes |= {"amended_by": self.provenance(), "rows_made": len(made)}
        whole = pd.concat([made, rows], ignore_index=True) if len(rows) else made
        write_artifact(path, kind, whole, notes)


def _recording_files(path: Path) -> list[Path]:
    companions = (path.with_suffix(".mot"), path.with_name(f"{path.stem}_grf.mot"))
    return [path, *(file for file in companions if path.suffix.lower() == ".trc" and file.exists())]
