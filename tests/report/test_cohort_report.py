import hashlib
import re
import shutil
from dataclasses import replace
from html import unescape

import numpy as np
import pandas as pd
import pytest

from bsip_cli.artifacts import empty_table
from bsip_cli.report.blocks import render
from bsip_cli.report.cohort import cohort_document, is_far
from bsip_cli.report.cohort_record import CohortRecord, Ratios
from bsip_cli.report.records import HowMade
from bsip_cli.report.words import MISSING
from bsip_cli.schemas import column_names
from bsip_cli.stages.report import cohort_record_of
from tests.report.fake_study import Artifacts, pictures_of, words_of


@pytest.fixture(scope="module")
def page(reports) -> str:
    return reports.html("group")


def test_links_lead_to_what_is_there(reports, page):
    links = [
        link
        for link in re.findall(r'(?:src|href)="([^"]*)"', page)
        if not link.startswith(("#", "data:"))
    ]
    assert "../sub-01/report.html" in links
    assert "../sub-02/report.html" not in links  # its report was not made
    for link in links:
        assert (reports.out / "group" / link).is_file(), link


def test_all_six_tables_are_there_and_who_is_missing_is_said(page):
    assert {*re.findall(r"<h3>Table (\d)\. ", page)} == {*"123456"}
    assert "table4_cross_validation.csv" in page
    assert "2 of 3 participants" in page
    assert "sub-03 has no identified parameters: not in tables 1 and 6" in page


def test_gain_is_that_of_the_values(reports, page):
    values = reports.unit("report").read("values", table=["table4"], variable=["cop_ap"])
    ratios = []
    for _, own in values[values["data"] == "held_out"].groupby("participant"):
        errors = own.groupby("method")["value"].mean()
        ratios.append([errors["RM+mass"] / errors["RM"], errors["OM"] / errors["RM"]])
    assert len(ratios) == 2
    typical = 100 * (np.exp(np.mean(np.log(ratios), axis=0)) - 1)
    row = re.search(
        r"COP, anterior-posterior</td>\s*<td[^>]*>([^<]+)</td>\s*<td[^>]*>([^<]+)<", page
    )
    assert [unescape(cell) for cell in row.groups()] == [
        f"{change:.0f}".replace("-", "−") for change in typical
    ]


def test_person_of_whom_nothing_was_identified(reports, tmp_path):
    """The table of the identification is there, without a row."""
    shutil.copytree(reports.out, tmp_path, dirs_exist_ok=True)
    person = reports.study.participants[1]
    here = replace(reports, out=tmp_path)
    Artifacts(tmp_path, person).write("identification", empty_table("identification"))
    here.run("report")
    row = re.search(rf"{person.id}</td>.*?</tr>", here.html("group"), re.DOTALL)
    assert row[0].count(MISSING) == 5  # nor a page, which tells errors and use


def test_empty_cohort_gives_sentences(reports):
    record = cohort_record_of(reports.unit("report"))
    none = Ratios({}, held_out=False)
    bare = CohortRecord(record.members[2:], none, (), (), (), HowMade(), record.defaults)
    document = cohort_document(bare)
    text = words_of(render(document))
    assert "No trial could be compared with both methods." in text
    assert "No errors are known." in text and "No tables were made." in text
    assert not pictures_of(document)


def test_one_person_is_not_tested(reports):
    record = cohort_record_of(reports.unit("report"))
    document = cohort_document(replace(record, members=record.members[:1]))
    (tables,) = [one for one in document.sections if one.anchor == "tables"]
    said, files = tables.blocks
    assert "there is nothing to test" in said.text
    assert files.to


def test_the_first_page_has_a_dot_per_person(reports, page):
    front = page[: page.index("</main>")]
    numbers = pd.read_csv(reports.out / "group" / "figures" / "yardsticks.csv")
    assert list(numbers["participant"]) == ["sub-01", "sub-02", "sub-03"]
    values = reports.unit("report").read("values", table=["table4"], variable=["grf_vertical"])
    assert "use RM for 1" in front  # as its own page says: OM of sub-01 has to wait
    assert "OM of 2 of 3 participants; the data decide 9 of their 150 parameters" in front
    own = values[(values["participant"] == "sub-01") & (values["method"] == "RM")]
    (held_out,) = own.loc[own["data"] == "held_out", "value"]
    assert numbers["vertical_force_percent_bw"][0] == pytest.approx(held_out, rel=1e-4)
    told = reports.unit("report").facts("report-files", participant=reports.study.participants[0])
    assert numbers["cop_mm"][0] == pytest.approx(told["errors"]["cop_mm"], rel=1e-4)
    assert np.isnan(numbers["cop_mm"][1:]).all()  # they have no page
    assert "Who could not be used, and why" in front


def test_a_reader_is_led_to_those_who_lie_far_out():
    usual = np.array([10.0, 11.0, 12.0, 13.0, 14.0, np.nan])
    assert not is_far(usual, 5.0, 30.0).any()
    assert list(is_far(np.append(usual, 25.0), 5.0, 30.0)).index(True) == 6
    assert not is_far(np.append(usual, 25.0), 26.0, 30.0).any()  # good
    assert is_far(np.array([31.0]), 5.0, 30.0).all()


def test_second_run_gives_the_same_bytes(reports):
    before = reports.files("group-report-files")
    reports.run("report")
    assert reports.files("group-report-files").equals(before)
    for _, row in before.iterrows():
        content = (reports.out / row["file"]).read_bytes()
        assert hashlib.sha256(content).hexdigest() == row["sha256"]


def laboratory(verdict: str, probability: float) -> pd.DataFrame:
    """A delay in a laboratory of seven persons."""
    row = dict.fromkeys(column_names("laboratory"), "") | {
        "effect": "sync_offset", "parameter": "delay", "unit": "s", "probability": probability,
        "estimate": 0.011, "ci_low": 0.009, "ci_high": 0.013, "limit": 0.006,
        "verdict": verdict, "persons": 7, "trials": 20, "laboratory": "1", "scope": "laboratory",
        "sentence": "the forces were recorded 11 ms after the markers",
    }  # fmt: skip
    return pd.DataFrame([row])


@pytest.mark.parametrize(
    ("table", "said", "not_said"),
    [
        (
            laboratory("named", 0.9999),
            [
                "Laboratory 1: the forces were recorded 11 ms after the markers.",
                "11 ms (9.0 ms to 13 ms) 6.0 ms over 99.9 %",
            ],
            "would have shown",
        ),
        (
            laboratory("rejected", 0.01),
            [
                "no fault of plates, clock or vertical was named",
                "would have shown a delay of 6.0 ms",
            ],
            "recorded 11 ms after",
        ),
        (laboratory("named", 0.99).assign(persons=1), ["are in the person's report"], "11 ms"),
        (None, ["run `bsip laboratory`"], "11 ms"),
    ],
)
def test_a_laboratory_of_several_is_told_with_its_fault_or_what_was_seen(
    reports, table, said, not_said
):
    record = replace(cohort_record_of(reports.unit("report")), laboratory=table)
    text = words_of(render(cohort_document(record)))
    assert [one for one in said if one not in text] == []
    assert not_said not in text
