"""The report of one person: a first page that answers five questions, the rest folded."""

import hashlib
import re
from dataclasses import replace
from datetime import date
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from bsip_cli.report.blocks import Bullets, Light, Links, Numbered, Picture, first_of
from bsip_cli.report.causes import candidates_of
from bsip_cli.report.errors import use_sentence
from bsip_cli.report.first_page import front, who
from bsip_cli.report.joints import joint_blocks
from bsip_cli.report.participant import nearest, participant_document
from bsip_cli.report.recordings import large_finding, light_for
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.report.verdict import light_of
from bsip_cli.report.words import number, with_spread
from tests.report.fake_study import EVIL, MASS_KG, pictures_of, svgs, words_of

FILE = "sub-01_task-static.c3d"
TITLES = (
    "Is anything wrong, and how sure is that?",
    "How large are the errors, when, and what makes them?",
    "What does it change at the joints?",
    "Which segment parameters come out?",
    "What was recorded?",
    "How was it made, and what can it not know?",
    "What do the words mean?",
)


@pytest.fixture(scope="module")
def page(reports) -> str:
    return reports.html("sub-01")


@pytest.fixture(scope="module")
def text(page) -> str:
    return words_of(page)


@pytest.fixture(scope="module")
def first(page) -> str:
    return words_of(page[page.index("<main") : page.index("</main>")])


# --- the page -----------------------------------------------------------------------------------


def test_page_needs_nothing_from_outside(reports, page):
    links = re.findall(r'(?:src|href)\s*=\s*"([^"]*)"', page)
    data = "data:image/svg+xml;base64,"
    files = [link for link in links if not link.startswith(data)]
    assert len(files) < len(links)
    assert all((reports.out / "sub-01" / file).is_file() for file in files)
    assert "http" not in re.sub(r'src="data:[^"]*"', "", page).replace("http-equiv", "")
    assert "<script" not in page


def test_page_is_small_and_short(page, text, first):
    assert len(page) < 2_000_000
    assert len(text.split()) <= 4000
    assert len(first.split()) <= 400


def test_foreign_labels_are_escaped(page, text):
    assert EVIL not in page
    assert EVIL in text  # shown as it is, not run


def test_all_sections_are_there_in_order_and_folded(page):
    folds = re.findall(r"<details>\n<summary><h2>(.*?)</h2></summary>", page)
    assert tuple(folds) == TITLES


def test_figures_are_whole_pictures_with_words_and_numbers(reports, record, page):
    figures = svgs(page)
    pictures = pictures_of(participant_document(record))
    assert len(figures) == len(pictures) == 6
    for figure in figures:
        assert ElementTree.fromstring(figure).tag.endswith("svg")
    assert all(re.findall(r'<img[^>]* alt="([^"]+)"', page))
    for picture in pictures:
        if picture.kind == "picture":
            assert picture.shows and picture.reading and picture.action
        if picture.data is not None:
            file = reports.out / "sub-01" / "figures" / f"{picture.name}.csv"
            assert len(pd.read_csv(file)) == len(picture.data)


def test_files_are_listed_with_their_hash(reports):
    person = reports.study.participants[0]
    files = reports.files("report-files", person)
    for _, row in files.iterrows():
        content = (reports.out / row["file"]).read_bytes()
        assert hashlib.sha256(content).hexdigest() == row["sha256"]
    kinds = (".html", ".svg", ".csv")
    written = {
        path.relative_to(reports.out).as_posix()
        for path in (reports.out / "sub-01").rglob("*")
        if path.suffix in kinds
    }
    assert written == set(files["file"])


def test_second_run_gives_the_same_bytes(reports):
    person = reports.study.participants[0]
    before = reports.files("report-files", person)
    reports.run("report", person)
    assert reports.files("report-files", person).equals(before)


# --- first page ---------------------------------------------------------------------------------


def test_the_first_page_says_who_what_how_large_how_sure_and_what_to_do(first):
    assert f"sub-01, man, {MASS_KG} kg (participants.tsv; plates: 63.1 kg), 1.63 m" in first
    assert "2 findings; no large error" in first
    assert (
        "Force plate turned or tilted: plate 1 is turned by +2.0 degrees (about the vertical: 95 % "
        "interval 1.75 to 2.26°), in both recordings analysed, a usual size (1 to 4°); changes "
        "the left knee's moment by 9 % of its peak; probability 99.5 %." in first
    )
    assert "One of 2 causes that look alike here: " in first and "Together 96.0 %." in first
    assert "the errors? ● RM, ○ OM (not yet)" in first
    assert "What makes the squared error of forces (not of joint moments) with RM:" in first
    assert "the table's segment parameters 70 %" in first  # OM, which corrects these, has to wait
    assert "unknown 20 %" in first
    assert "Markers from model: 6.7 mm (good)" in first
    assert "RMS of what OM had not seen, usable or not: good to" in first
    corrected = "sequence (finding 1); basketball (findings 1 and"
    assert f"Use after acting on the finding: {corrected}" in first
    assert (
        "Use RM for now: OM comes from sequence, unusable as recorded. Correct it or choose "
        "another (study.toml: roles); run again. What to do next" in first
    )
    assert f"Files {FILE} Parameters RM: a table (regression method);" in first
    assert "OM: fitted to sequence (optimisation method), data decide 9 of 150 parameters" in first
    assert f"sequence and basketball; date unknown Files {FILE}" in first
    assert f"Report {date.today().isoformat()}, bsip 0" in first
    assert "Finding 1: Check, then correct the forces in the lab or in files (bsip export)" in first


def test_it_says_when_as_the_study_or_else_the_files_say(record):
    def said(one: ParticipantRecord) -> str:
        return dict(who(one))["Recordings"].rpartition("; ")[2]

    assert said(record) == "date unknown"
    row = record.trials[0].quality.iloc[0].copy()
    row["check"], row["found"], row["level"] = "recorded_on", "2019-05-24", "info"
    dated = pd.concat([record.trials[0].quality, row.to_frame().T])
    files = replace(record, trials=(replace(record.trials[0], quality=dated), *record.trials[1:]))
    assert said(files) == "recorded 2019-05-24"
    study = replace(files, recorded_on=("2024-03-02", "2024-03-01"))
    assert said(study) == "recorded 2024-03-01 to 2024-03-02"


def test_what_nobody_has_stated_or_checked_is_said_first(record):
    assert "Assumed" not in dict(who(record))
    facts = record.facts.copy()
    facts["sex"], facts["height_source"] = "other", "markers"
    row = record.trials[0].quality.iloc[0].copy()
    row["check"], row["level"] = "marker_set", "info"
    row["found"], row["action"] = "mine", "Guessed from the labels of a.c3d, not checked"
    quality = pd.concat([record.trials[0].quality, row.to_frame().T])
    trials = (replace(record.trials[0], quality=quality), *record.trials[1:])
    child = "1.33 m tall, and the table (RM) is of adults"
    guessed = replace(
        record, facts=facts, trials=trials, outside=f"{child}: should this be a child"
    )
    assert dict(who(guessed))["Assumed"] == (
        "sex (not stated: mean of both tables); height (from the markers); marker set mine "
        f"(Guessed from the labels of a.c3d, not checked); {child}"
    )


def test_what_was_found_is_not_among_what_was_not(record):
    """In another recording, say; and what came near twice is there once."""
    rejected = record.diagnosis[record.diagnosis["verdict"] == "rejected"].assign(class_id="")
    one = rejected.head(1)
    twice = pd.concat([one.assign(rank=80), one.assign(rank=81)])
    (grid,) = nearest(candidates_of(twice))
    assert len(grid.rows) == 1
    both = pd.concat([twice, one.assign(rank=1, verdict="named")])
    (said,) = nearest(candidates_of(both))
    assert "No other fault" in said.text


def test_long_lists_are_whole_in_a_file():
    assert first_of(["a", "b"], 2, "warnings") == Bullets(("a", "b"))
    grid = first_of(["a", "b", "c"], 2, "warnings")
    assert grid.rows == (("a",), ("b",)) and list(grid.data["warnings"]) == ["a", "b", "c"]
    assert grid.caption == "1 more:"


def test_of_many_files_it_says_how_many_and_of_which_kind(record):
    names = [f"{trial.stem}.{kind}" for trial in record.trials for kind in ("mot", "trc")]
    origins = (replace(record.origins[0], inputs=dict.fromkeys(names, "ab")),)
    assert dict(who(replace(record, origins=origins)))["Files"] == "6 (sub-01_*.mot and .trc)"


def test_a_page_without_room_has_fewer_findings(record, monkeypatch):
    assert len(next(x for x in front(record) if isinstance(x, Numbered)).items) == 2
    monkeypatch.setattr("bsip_cli.report.first_page._MOST_WORDS", 200)
    page = front(record)
    (numbered,) = (block for block in page if isinstance(block, Numbered))
    links, all_of_them = (block for block in page if isinstance(block, Links))
    assert len(numbered.items) == 1 and links.rest.startswith(". 2: ")
    assert all_of_them == page[-1] and "Steps" in all_of_them.to[0][0]


def test_yardsticks_are_those_of_data_that_identified_nothing(record, first):
    fit = record.trials[2].fit.query("method == 'RM'").set_index("component")  # as chosen there
    percent = fit.loc["grf_vertical", "rmse_percent_bw"]
    assert f"Vertical force error: {number(percent)} % of body weight" in first
    cop = (fit.loc["cop_ap", "rmse"] ** 2 + fit.loc["cop_ml", "rmse"] ** 2) ** 0.5
    assert f"Centre of pressure (COP) error: {number(cop)} mm" in first


def light(record: ParticipantRecord, diagnosis: pd.DataFrame) -> Light:
    return light_of(diagnosis, record.detection, record.budget)


def test_the_light_has_four_states(record):
    found = record.diagnosis
    rejected = found[found["verdict"] == "rejected"]
    assert light(record, found).state == "cause"
    fine = light(record, rejected)
    assert fine.state == "fine"
    assert re.fullmatch(r"None of the \d+ faults that bsip knows was found in 2 .*", fine.text)
    large = found[found["rank"] == 1].assign(
        effect="unexplained", target="", parameter="error", what="large error, cause unknown"
    )
    assert light(record, large).state == "large"
    beside = pd.concat([large, found[found["rank"] > 1]])
    assert light(record, beside).title == (
        "Large error, most of it along with the table's segment parameters (70 %); 2 findings"
    )
    assert light_of(beside, record.detection).title == "Large error, cause unknown; 2 findings"
    small = large.assign(target="1 fz", parameter="amplitude")
    assert light(record, small).state == "cause"  # a regularity without a name is no large error
    unsure = large.assign(effect="inconclusive", parameter="", what="too short")
    assert (light(record, unsure).state, light(record, unsure).text) == (
        "inconclusive",
        "Too short.",
    )
    assert light(record, found[:0]).state == "inconclusive"
    assert light_of(None, None).state == "inconclusive"


def test_no_fault_and_a_large_error_is_not_fine(record):
    nothing = record.diagnosis[record.diagnosis["verdict"] == "rejected"]
    trials = tuple(
        replace(t, fit=t.fit.assign(rmse_percent_bw=5.5 * t.fit["rmse_percent_bw"].notna()))
        for t in record.trials
    )
    large = replace(record, diagnosis=nothing, trials=trials)
    (light,) = (block for block in front(large) if isinstance(block, Light))
    assert (light.state, light.title) == ("large", "Large error even with OM")
    (finding,) = large_finding(large)
    assert finding.startswith(
        "Large error with RM: vertical force 5.5 %, most in sequence; cause unknown: none of the"
    )
    (numbered,) = (block for block in front(large) if isinstance(block, Numbered))
    assert numbered.items == (finding,)
    assert light_for(large).text.startswith(
        "Large with RM (table): vertical force 5.5 % of body weight. None of the"
    )
    *_, to_do = front(large)
    assert to_do.items[0] == (
        "Finding 1: In sequence the vertical force error is about constant: record each plate "
        "empty, and the person on a scale."
    )
    assert not any("Nothing needs to be corrected" in item for item in to_do.items)


def test_what_is_fine_is_to_be_used_as_it_is(record):
    nothing = record.diagnosis[record.diagnosis["verdict"] == "rejected"]
    *_, use, _, _, to_do = front(replace(record, diagnosis=nothing, refusals=()))
    assert use.items == ("Use (motion, forces, joint moments): all recordings.",)
    assert to_do.items[0] == "Nothing needs to be corrected."
    assert (
        to_do.items[1] == "Optional, to know the parameters better, record: swing the left shank."
    )


def test_rm_is_used_where_nothing_is_sure(record):
    choice = record.choice.assign(use="RM", ratio_om=1.05)
    said = use_sentence(choice, record.identification)
    assert said.startswith("Use RM: OM is not clearly better")
    assert ": OM is not clearly better; in 2 other recordings its error is 5 % smaller to" in said
    one = use_sentence(record.choice[:1], record.identification)
    assert one.startswith("Use OM: in 2 other recordings")
    assert "its error is 34 to 46 % smaller than RM's," in one
    held = use_sentence(record.choice.assign(data="held_out"), record.identification)
    held_out = (
        ": in seconds of 2 recordings that were held out together OM's error is 34 to 46 % smaller"
    )
    assert held_out in held
    rare = record.identification.assign(rare=True)
    assert "Do not use OM" in use_sentence(record.choice, rare)
    alone = choice.assign(ratio_om=np.nan, ratio_rm_mass=np.nan, ratio_om_rm_mass=np.nan)
    said = use_sentence(alone, rare)
    assert "or no recording is left to judge it by. " in said and "Do not use OM" in said


# --- sections -----------------------------------------------------------------------------------


def test_numbers_are_those_of_the_artifacts(reports, text):
    unit = reports.unit("report", reports.study.participants[0])
    bsip = unit.read("bsip")
    for _, row in bsip[bsip["method"] == "OM"].iterrows():
        assert with_spread(row["mass_kg"], row["mass_kg_sd"], 2) in text
    fit = unit.read("fit", reports.study.participants[0].trials[2])
    for _, row in fit[fit["component"].str.startswith("cop")].iterrows():
        assert number(row["rmse"], 1) in text


def test_joint_moments_are_told_with_what_changes_them(record, text):
    """OM is 10 % larger than RM, the named fault 10 % of RM more."""
    peak = record.trials[2].joint_peaks.query("joint == 'knee_l' and axis == 'extension'")
    largest = peak.set_index("method")["change_Nm"]
    assert abs(largest["OM"]) == pytest.approx(8.0, abs=0.1)
    changed = f"left knee extension most, by {number(largest['OM'], 1)} N m".replace(
        "by 8", "by +8"
    )
    assert (
        f"as far as known: identification (OM against RM) changes {changed}, 10 % of that joint's "
        "peak." in text
    )
    assert "known: the force plate turned or tilted changes left knee extension most" in text
    assert re.search(r"Left out of \w+ \(run 1\): both feet are on one plate: 3 frames\.", text)


def test_arms_are_shown_where_no_leg_is_known(record):
    def armed(table: pd.DataFrame) -> pd.DataFrame:
        return table[table["joint"] == "elbow_r"]

    trials = tuple(
        replace(t, joint_moments=armed(t.joint_moments), joint_peaks=armed(t.joint_peaks))
        for t in record.trials[1:]
    )
    section = tuple(joint_blocks(replace(record, trials=trials)))
    (picture,) = [block for block in section if isinstance(block, Picture)]
    assert set(picture.data["joint"]) == {"elbow_r"}
    assert set(picture.data["method"]) == {"RM", "OM", "OM+plate_rotation"}
    bare = tuple(replace(t, joint_moments=None, joint_peaks=None) for t in record.trials)
    (said,) = joint_blocks(replace(record, trials=bare))
    assert "bsip joints" in said.text


def test_advice_is_said_in_words(text):
    assert "These recordings add nothing to the table for lower torso." in text
    assert "Swing the left shank: 3.2 percentage points more decided by the data" in text


def test_only_options_that_differ_are_told(record, text):
    assert "ik.iterations 50" not in text  # as shipped, or unknown
    assert "identify.sigma_percent_limit" not in text
    origins = tuple(
        replace(one, options={"identify": {"sigma_percent_limit": 4.0}}) for one in record.origins
    )
    document = participant_document(replace(record, origins=origins))
    pairs = [pair for block in document.blocks() for pair in getattr(block, "pairs", ())]
    assert ("identify.sigma_percent_limit", "4.0") in pairs
