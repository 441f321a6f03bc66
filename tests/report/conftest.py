from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import pytest

from bsip_cli.config import Config, load_config
from bsip_cli.pipeline import STAGES
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.running.runner import Outcome, perform
from bsip_cli.running.unit import Unit
from bsip_cli.stages.report import record_of
from bsip_cli.study.study import Participant, Study
from tests.report.fake_study import Artifacts, study


@dataclass
class Reports:
    """A study of invented artifacts and the stages on it."""

    study: Study
    out: Path
    config: Config

    def unit(self, name: str, participant: Participant | None = None) -> Unit:
        level = "participant" if participant else "cohort"
        stage = next(s for s in STAGES if s.name == name and s.level == level)
        return Unit(stage, self.study, self.out, self.config, participant)

    def run(self, name: str, participant: Participant | None = None) -> Outcome:
        outcome = perform(self.unit(name, participant), force=True)
        assert outcome.state == "done", outcome
        return outcome

    def html(self, folder: str) -> str:
        return (self.out / folder / "report.html").read_text(encoding="utf-8")

    def files(self, kind: str, participant: Participant | None = None) -> pd.DataFrame:
        return self.unit("report", participant).read(kind)


@pytest.fixture(scope="session")
def reports(tmp_path_factory) -> Reports:
    """Three people, the last without any artifact; the reports of the first and of the cohort."""
    out = tmp_path_factory.mktemp("out")
    made = Reports(study("sub-01", "sub-02", "sub-03"), out, load_config([]))
    for seed, person in enumerate(made.study.participants[:2]):
        Artifacts(out, person, seed).write_all()
    made.run("report", made.study.participants[0])
    for stage in ("stats", "tables", "report"):
        made.run(stage)
    return made


@pytest.fixture(scope="session")
def record(reports) -> ParticipantRecord:
    """What the report of the first person is made of."""
    return record_of(reports.unit("report", reports.study.participants[0]))
