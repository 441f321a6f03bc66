"""What ``bsip show`` prints of a diagnosis: lines that fit, and nothing that a file could hide."""

import os
from dataclasses import replace
from unittest.mock import patch

import pandas as pd

from bsip_cli.commands import show
from bsip_cli.commands.show import shown, verdict_text
from bsip_cli.report.verdict import corrected_sentence, verdict_of
from tests.report.fake_study import Artifacts, detection, diagnosis, marker_events

TRIALS = ["sub-01_task-sequence_run-1", "sub-01_task-basketball_run-1"]


def text_of(table: pd.DataFrame, columns: int = 100, right: tuple[str, ...] = ()) -> str:
    with patch.dict(os.environ, COLUMNS=str(columns)):
        return verdict_text("sub-01", verdict_of(table, detection(TRIALS)), right)


def test_causes_are_numbered_and_lines_fit():
    for columns in (60, 100, 500):
        text = text_of(diagnosis(TRIALS), columns)
        assert max(map(len, text.splitlines())) <= min(columns, 100)
    assert "\n 1. Plate 1 is turned by +2.0 degrees" in text
    assert "\n 2. One of these, which these recordings cannot distinguish" in text
    assert text.startswith("\n## Is anything wrong: sub-01\n2 findings.")


def test_what_was_put_right_is_told_too():
    events = marker_events().assign(put_right=True, what="A and B bear labels")
    right = corrected_sentence([(TRIALS[0], events)])
    assert right == (
        "Corrected already, before the search for faults: in sequence (run 1) A and B bear labels.",
    )
    assert "Corrected already" in text_of(diagnosis(TRIALS), right=right)
    assert corrected_sentence([(TRIALS[0], marker_events())]) == ()


def test_a_file_cannot_send_commands_to_the_terminal():
    table = diagnosis(TRIALS).assign(what="marker \x1b[2J\x07KNEE\u202e sits wrong")
    text = text_of(table)
    assert "Marker ?[2J?KNEE? sits wrong" in text
    assert all(c.isprintable() or c == "\n" for c in text)


def test_a_person_fits_on_a_screen_the_most_important_first(reports, tmp_path):
    person = reports.study.participants[0]
    Artifacts(tmp_path, person).write_all()
    text = "\n".join(shown(tmp_path))
    assert len(text.splitlines()) <= 24 and max(map(len, text.splitlines())) <= 100
    assert text.startswith("sub-01: 2 findings")
    flat = " ".join(text.split())
    assert " 1. Force plate turned or tilted: plate 1 is turned by +2.0 degrees" in flat
    assert "Use " not in flat  # which the page says, that is not there
    replace(reports, out=tmp_path).run("report", person)
    assert "Use RM for now: OM comes from sequence" in " ".join("\n".join(shown(tmp_path)).split())
    full = "\n".join(shown(tmp_path, full=True))
    assert "## Is anything wrong: sub-01" in full and len(full) > len(text)
    assert "identification (OM against RM) changes" in " ".join(full.split())


def test_the_answer_is_that_of_the_first_page(reports, tmp_path):
    """Nothing is found and an error is large: the diagnosis alone would say that all is fine."""
    person = reports.study.participants[0]
    artifacts = Artifacts(tmp_path, person)
    artifacts.write_all()
    nothing = diagnosis(TRIALS).query("verdict == 'rejected'")
    artifacts.write("overall-diagnosis", nothing)
    for trial in person.trials[1:]:
        artifacts.write("fit", artifacts.fit(trial).assign(rmse_percent_bw=9.0), trial)
    assert "sub-01: No fault found" in "\n".join(shown(tmp_path))  # no report, no yardstick
    replace(reports, out=tmp_path).run("report", person)
    said = " ".join("\n".join(shown(tmp_path)).split())
    assert said.startswith("sub-01: Large error even with OM. Large with RM (table): vertical")
    page = replace(reports, out=tmp_path).html("sub-01")
    assert "<strong>Large error even with OM</strong>" in page


def test_of_several_people_each_has_a_line(reports):
    text = "\n".join(shown(reports.out))
    assert "sub-01: 2 findings" in text and "sub-02: 2 findings" in text
    assert "Plate 1 is turned" not in text
    assert text.rstrip().endswith("report: " + str(reports.out / "group" / "report.html"))


def test_reports_of_other_code_are_told_in_one_line(tmp_path):
    for name in ("sub-01", "sub-02"):
        (tmp_path / name).mkdir()
        (tmp_path / name / f"{name}_report-files.parquet").touch()
    with patch.object(show, "outdated", lambda path: f"{path.name} was made by other code"):
        assert show._no_more_true(tmp_path) == [
            "sub-01, sub-02: report-files.parquet was made by other code"
        ]
