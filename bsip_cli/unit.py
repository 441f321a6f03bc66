"""One piece of work: a stage on one trial, participant or cohort, with its files and options."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from bsip_cli.artifacts import SCHEMAS, Level, read_artifact, read_header, write_artifact
from bsip_cli.config import Config
from bsip_cli.errors import BadDataError
from bsip_cli.pipeline import Stage
from bsip_cli.provenance import describe
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
        """Tell the user now, and the reader of the artifact later."""
        self.messages.append(message)

    # --- where things lie -------------------------------------------------------------------

    def path(
        self, kind: str, trial: Trial | None = None, participant: Participant | None = None
    ) -> Path:
        """Final path of an artifact; trial and participant default to the unit's own."""
        level = SCHEMAS[kind].level
        if level == "cohort":
            return self.out / "group" / f"group_{kind}.parquet"
        participant = participant or self.participant
        assert participant is not None
        owner = trial or self.trial if level == "trial" else None
        stem = owner.stem if owner else participant.id
        return self.out / participant.id / f"{stem}_{kind}.parquet"

    def refusal_path(self, stage: str | None = None, trial: Trial | None = None) -> Path:
        """Where a refusal of this unit (or of another stage or trial) is written down."""
        folder = self.participant.id if self.participant else "group"
        stem = trial.stem if trial else self.name
        return self.out / folder / f"{stem}_refusal-{stage or self.stage.name}.parquet"

    def participants(self) -> tuple[Participant, ...]:
        return (self.participant,) if self.participant else self.study.participants

    def trials(self, *kinds: str) -> tuple[Trial, ...]:
        """The participant's trials for which all these kinds are there and not refused."""
        assert self.participant is not None
        return tuple(
            trial
            for trial in self.participant.trials
            if all(self._usable(kind, self.participant, trial) for kind in kinds)
        )

    def _usable(self, kind: str, participant: Participant, trial: Trial) -> bool:
        path = self.path(kind, trial, participant)
        refusals = path.parent.glob(f"{trial.stem}_refusal-*.parquet")
        return path.exists() and not any(refusals)

    # --- inputs, freshness ------------------------------------------------------------------

    def inputs(self) -> dict[str, Path]:
        """Name and path of every file the unit reads; those a refusal left out are not in it."""
        files = {}
        for kind in self.stage.reads:
            for path in self._input_paths(kind, SCHEMAS[kind].level):
                files[path.name] = path
        if self.trial is not None and not self.stage.reads:
            files |= {path.name: path for path in _recording_files(self.trial.path)}
        for name in ("marker_set", "skeleton"):
            own = Path(getattr(self.config, name))
            if name in self.stage.options and own.suffix == ".toml":
                files[own.name] = own
        return files

    def _input_paths(self, kind: str, level: Level) -> list[Path]:
        if level == "cohort":
            return [self.path(kind)]
        found = []
        for participant in self.participants():
            if level == "participant":
                found.append(self.path(kind, participant=participant))
            elif self.trial is not None:
                found.append(self.path(kind))
            else:
                found += [
                    self.path(kind, trial, participant)
                    for trial in participant.trials
                    if self._usable(kind, participant, trial)
                ]
        return found

    def missing(self) -> list[str]:
        """Kinds the unit cannot do without and that are not there."""
        gone = []
        for kind in self.stage.reads:
            paths = self._input_paths(kind, SCHEMAS[kind].level)
            there = [path for path in paths if path.exists()]
            enough = bool(there) if self.participant is None else len(there) == len(paths) > 0
            if not enough:
                gone.append(kind)
        if self.trial is not None and self.stage.reads:
            refused = any(self.path("markers").parent.glob(f"{self.trial.stem}_refusal-ingest.*"))
            if refused and "markers" not in gone:
                gone.append("markers")
        return gone

    def provenance(self) -> dict:
        present = {name: path for name, path in self.inputs().items() if path.exists()}
        options = self.config.options(self.stage.options)
        if self.participant is not None:
            options["participant"] = {
                "sex": self.participant.sex,
                "mass_kg": self.participant.mass_kg,
                "height_m": self.participant.height_m,
            }
        return describe(self.stage.name, present, options)

    def is_fresh(self) -> bool:
        """Everything the unit writes is there and made from what it would read now."""
        paths = [self.path(kind) for kind in self.stage.writes]
        if not all(path.exists() for path in paths) or self.refusal_path().exists():
            return False
        wanted = self.provenance()
        try:
            return all(read_header(path)["provenance"]["made_by"] == wanted for path in paths)
        except BadDataError:
            return False

    # --- reading and writing ----------------------------------------------------------------

    def read(
        self, kind: str, trial: Trial | None = None, participant: Participant | None = None
    ) -> pd.DataFrame:
        return read_artifact(self.path(kind, trial, participant), kind)

    def facts(self, kind: str, trial: Trial | None = None) -> dict:
        """What the producing stage said of its result as a whole."""
        return read_header(self.path(kind, trial))["provenance"]["facts"]

    def write(self, kind: str, frame: pd.DataFrame, facts: dict | None = None) -> None:
        made_by = self.provenance()
        notes = {"made_by": made_by, "messages": list(self.messages), "facts": facts or {}}
        write_artifact(self.path(kind), kind, frame, notes)


def _recording_files(path: Path) -> list[Path]:
    companions = (path.with_suffix(".mot"), path.with_name(f"{path.stem}_grf.mot"))
    return [path, *(file for file in companions if path.suffix == ".trc" and file.exists())]
