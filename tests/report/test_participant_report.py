import base64
import hashlib
import re
from html import unescape
from xml.etree import ElementTree

import pytest

from bsip_cli.report.words import number, with_spread
from tests.report.fake_study import EVIL, svgs

TITLES = (
    "Summary",
    "What the simulation gets wrong",
    "What was measured",
    "The motion",
    "The skeleton",
    "The inertial parameters",
    "How well the forces follow",
    "Limits, warnings, options",
)


@pytest.fixture(scope="module")
def page(reports) -> str:
    return reports.html("sub-01")


@pytest.fixture(scope="module")
def text(page) -> str:
    """What a reader sees, with plain spaces."""
    bare = re.sub(r"<(style|figure).*?</\1>", " ", page, flags=re.S)
    return re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]+>", " ", bare)))


def test_page_needs_nothing_from_outside(page):
    links = re.findall(r'(?:src|href)\s*=\s*"([^"]*)"', page)
    assert links
    assert all(link.startswith(("#", "data:image/svg+xml;base64,")) for link in links)
    assert "http" not in re.sub(r'src="data:[^"]*"', "", page).replace("http-equiv", "")


def test_the_only_script_is_the_pages_own(page):
    """Its policy names the script by its hash: whatever a label might smuggle in does not run."""
    scripts = re.findall(r"<script>(.*?)</script>", page, flags=re.S)
    assert page.count("<script") == len(scripts) == 1
    digest = base64.b64encode(hashlib.sha256(scripts[0].encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in unescape(page)


def test_page_is_small_enough(page):
    assert len(page) < 6_000_000


def test_foreign_labels_are_escaped(page, text):
    assert EVIL not in page
    assert EVIL in text  # shown as it is, not run


def test_all_sections_are_there_in_order(page):
    found = re.findall(r"<h2>\d\. (.*?)</h2>", page)
    assert tuple(found) == TITLES


def test_figures_are_whole_pictures_with_words(page):
    figures = svgs(page)
    assert len(figures) == 23
    for figure in figures:
        assert ElementTree.fromstring(figure).tag.endswith("svg")
    assert all(re.findall(r'<img src="[^"]+" alt="([^"]+)"', page))


def test_numbers_are_those_of_the_artifacts(reports, text):
    unit = reports.unit("report", reports.study.participants[0])
    bsip = unit.read("bsip")
    for _, row in bsip[bsip["method"] == "OM"].iterrows():
        assert with_spread(row["mass_kg"], row["mass_kg_sd"], 3) in text
        assert with_spread(1e3 * row["com_y_m"], 1e3 * row["com_y_m_sd"], 1) in text
    basketball = reports.study.participants[0].trials[2]
    fit = unit.read("fit", basketball)
    for _, row in fit.iterrows():
        assert number(row["rmse"], 2) in text
        assert number(row["schwer_c"], 3) in text


def test_the_summary_begins_with_which_parameters_to_use(text):
    assert text.index("Which parameters to use") < text.index("Is anything wrong?")
    assert "Use OM: it errs less." in text
    assert "0.60 (0.54 to 0.66)" in text  # one standard error of the logarithm to either side


def test_summary_tells_where_the_table_is_better(text):
    assert (
        "OM has the smaller error in 7 of 8 components (the vertical force counts once), RM "
        "or RM+mass in moment, lab Z (up)." in text
    )
    worse = "moment, lab Z (up) 8.10 N m with RM+mass, 15.30 with OM (+89 %)"
    assert f"basketball (run 1): {worse}" in text
    assert "The plates tell 63.10 kg (+0.5 %)." in text


def test_summary_tells_what_one_number_alone_does(text):
    assert (
        "One number for the whole mass alone (RM+mass) changes RM's error in the vertical ground "
        "force by −10 %, OM by −70 %: OM errs by 67 % less than RM+mass. RM+mass is RM times 0.960 "
        "(95 % interval 0.956 to 0.964)" in text
    )


def test_decided_and_undecided_segments_are_named(text):
    assert "(data share above 80 %) the mass of left foot, right thigh, right shank" in text
    assert "(data share under 20 %) that of lower torso, upper torso and head." in text


def test_files_are_listed_with_their_hash(reports):
    person = reports.study.participants[0]
    files = reports.files("report-files", person)
    assert "sub-01/figures/fig3_cop_ml.png" in set(files["file"])
    assert "sub-01/figures/fig3_vertical_force.svg" in set(files["file"])
    for _, row in files.iterrows():
        content = (reports.out / row["file"]).read_bytes()
        assert hashlib.sha256(content).hexdigest() == row["sha256"]
    kinds = (".html", ".svg", ".png")
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


def test_excitation_and_advice_are_said_in_words(text):
    assert (
        "Of 1 combination of parameters that ground forces can show, this movement shows 1" in text
    )
    assert "Not excited: lower torso." in text  # the only one without a known combination
    assert "mass: data 4 %" in text
    assert "Swing the left shank: 3.2 points, most of all for the left shank." in text
    assert "Nod: another 1.2 points, most of all for the head." in text
    assert "it would help least to nod (1.25)" in text
    assert "Swing the left shank left shank 3.21 43 Nod head 1.25 7" in text
    assert "lets the data decide 40 %" in text


def test_base_parameters_best_first_and_counted(text):
    """The fake ones have sigma from 1 to 77 %, one of 14 below 5 %."""
    assert "determine 14 combinations of the parameters. 1 of them is known" in text
    assert "The 10 base parameters known best" in text
    assert "The 4 base parameters known worst" in text
    assert text.index("parameter 0 ") < text.index("parameter 13 ")
