"""Options of the small simulated studies that tests of whole stages run, and such a run."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import pandas as pd

from bsip_cli.artifacts import read_artifact, read_header, write_artifact
from bsip_cli.config import Config, load_config
from bsip_cli.pipeline import STAGES
from bsip_cli.running.runner import Outcome, perform
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import SCHEMAS
from bsip_cli.simulate.options import Rates, StudyOptions
from bsip_cli.study.study import load_study
from tests.program import Answer, Program


def small(sexes: str = "M", seed: int = 3, **durations_s: float) -> StudyOptions:
    """A person for each letter, markers at 50 and plates at 250 Hz; tasks by their seconds."""
    return StudyOptions(
        participants=len(sexes),
        seed=seed,
        sexes=sexes,
        tasks=tuple(durations_s),
        durations_s=durations_s,
        rates={"default": Rates(marker_hz=50, analog_hz=250)},
    )


@dataclass(frozen=True)
class Run:
    """A study and what stages made of it; units run in this process, commands in their own."""

    study: Path
    out: Path

    @classmethod
    def within(cls, folder: Path) -> Self:
        return cls(folder / "study", folder / "out")

    def copied_to(self, folder: Path) -> Self:
        """A copy to change."""
        copy = replace(self, study=folder / "study", out=folder / "out")
        shutil.copytree(self.study, copy.study)
        if self.out.exists():
            shutil.copytree(self.out, copy.out)
        return copy

    def call(self, command: str, *options: object) -> Answer:
        return Program()(command, self.study, "--out", self.out, *options)

    def done(self, command: str, *options: object) -> Answer:
        """Of a call that must succeed."""
        return Program().done(command, self.study, "--out", self.out, *options)

    def config(self) -> Config:
        return load_config([self.study / "study.toml"])

    def unit(self, stage: str, stem: str = "", config: Config | None = None) -> Unit:
        """A stage, by its name or label, on the first participant or one of the trials."""
        config = config or self.config()
        study, _ = load_study(self.study, config.roles.model_dump())
        person = study.participants[0]
        trial = next((one for one in person.trials if one.stem == stem), None)
        level = "trial" if stem else "participant"
        of_level = (one for one in STAGES if one.level == level)
        first = next(one for one in of_level if stage in (one.name, one.label))
        return Unit(first, study, self.out, config, person, trial)

    def unit_of_group(self, stage: str) -> Unit:
        config = self.config()
        study, _ = load_study(self.study, config.roles.model_dump())
        first = next(one for one in STAGES if (one.name, one.level) == (stage, "cohort"))
        return Unit(first, study, self.out, config)

    def perform(self, stage: str, stem: str = "", config: Config | None = None) -> Outcome:
        return perform(self.unit(stage, stem, config))

    def path(self, kind: str, owner: str = "sub-01") -> Path:
        """Of an artifact, or of a refusal."""
        name = SCHEMAS[kind].file_name if kind in SCHEMAS else kind
        return self.out / owner.split("_")[0] / f"{owner}_{name}.parquet"

    def read(self, kind: str, owner: str = "sub-01") -> pd.DataFrame:
        return read_artifact(self.path(kind, owner), kind)

    def provenance(self, kind: str, owner: str = "sub-01") -> dict:
        return read_header(self.path(kind, owner), kind)["provenance"]

    def rewrite(self, kind: str, table: pd.DataFrame, owner: str = "sub-01") -> None:
        """Put another table in place of an artifact's, as if its stage had written it."""
        write_artifact(self.path(kind, owner), kind, table, self.provenance(kind, owner))
