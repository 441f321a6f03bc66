"""How much a run says: findings and errors only, or what each unit reads and how long it takes."""

import re
import time
from io import StringIO

import pytest

from bsip_cli.running.runner import Outcome
from bsip_cli.running.session import follow

REMARK = "markers: no markers on the head"


def told(capsys, outcomes: list[Outcome], code: int = 0, **voice: bool) -> str:
    assert follow("run", [], (one for one in outcomes), len(outcomes), None, **voice) == code
    return capsys.readouterr().err


def said(capsys, **voice: bool) -> str:
    outcomes = [
        Outcome("ingest", f"sub-{k}", "done", (f"sub-{k}: {REMARK}",), 0, 1.25, ("markers",))
        for k in (1, 2, 3)
    ]
    outcomes.append(Outcome("diagnose", "sub-1", "done", ("sub-1: something is wrong",)))
    outcomes.append(Outcome("ik", "sub-2", "refused", ("sub-2: too short",), 3))
    return told(capsys, outcomes, 3, **voice)


def test_a_remark_is_made_once_for_the_study(capsys):
    text = said(capsys)
    assert text.count(REMARK) == 2
    assert f"ingest: sub-1: {REMARK}" in text
    assert f"ingest: the same of sub-2, sub-3: {REMARK}" in text
    assert "1.2 s" not in text and "bsip run: 4 done, 1 refused" in text


def test_of_the_study_it_is_said_whom_a_remark_is_of(capsys):
    sentences = tuple(f"participants.tsv: height_m 168 of sub-{k} is in cm" for k in (1, 2, 3))
    text = told(capsys, [Outcome("study", "study", "noted", sentences)])
    assert "the same of sub-2, sub-3: participants.tsv: height_m 168 of it is in cm" in text


def test_another_recording_is_not_called_by_whom_it_is_said_of(capsys):
    names = "sub-1_task-a", "sub-1_task-b"
    lines = [f"{one}: as long as {two}" for one, two in (names, names[::-1])]
    pairs = zip(names, lines, strict=True)
    text = told(capsys, [Outcome("ingest", name, "done", (line,)) for name, line in pairs])
    assert f"ingest: the same of {names[1]}: as long as another trial" in text
    of_person = [f"sub-{k}: not of one body: sub-{k}_task-a" for k in (1, 2)]
    text = told(capsys, [Outcome("scale", one[:5], "done", (one,)) for one in of_person])
    assert "the same of sub-2: not of one body: one of its trials" in text


def test_a_remark_at_other_times_is_the_same(capsys):
    when = ("0.17 to 0.68 s, 1.90 to 2.42 s and 3 more", "0.00 to 0.25 s", "2.32 to 2.86 s")
    outcomes = [
        Outcome("ingest", f"sub-{k}", "done", (f"sub-{k}: left foot: beside: {one}; left out",))
        for k, one in enumerate(when, 1)
    ]
    text = told(capsys, outcomes)
    assert f"ingest: sub-1: left foot: beside: {when[0]}; left out" in text
    assert "ingest: the same of sub-2, sub-3: left foot: beside: at times; left out" in text


@pytest.mark.parametrize("stage", ["ingest", "export"])
def test_what_is_there_twice_in_one_recording_is_said_twice(capsys, stage):
    when = ("0.17 to 0.68 s", "1.90 to 2.42 s")
    sentences = tuple(f"sub-1: labels exchanged: {one}" for one in when)
    others = tuple(
        f"sub-2: labels exchanged: {one}" for one in ("0.20 to 0.30 s", "0.50 to 0.60 s")
    )
    outcomes = [Outcome(stage, "sub-1", "done", sentences), Outcome(stage, "sub-2", "done", others)]
    assert follow("run", [], (one for one in outcomes), 2, None) == 0
    text = capsys.readouterr().err
    assert all(f"{stage}: {one}" in text for one in sentences)
    assert all((one in text) == (stage == "export") for one in others)


def test_of_files_it_is_said_what_they_end_with(capsys):
    names = "sub-1_task-squat", "sub-1_task-static"
    lines = [f"{name}: out/sub-1/export: {name}_motion.mot, {name}.xml" for name in names]
    pairs = zip(names, lines, strict=True)
    text = told(capsys, [Outcome("export", name, "done", (line,)) for name, line in pairs])
    assert f"export: {lines[0]}\n" in text
    others = "the same of sub-1_task-static: out/.../export: ..._motion.mot, ....xml"
    assert f"export: {others}" in text


def test_quiet_says_findings_and_errors_only(capsys):
    assert said(capsys, quiet=True).splitlines() == [
        "diagnose: sub-1: something is wrong",
        "ik: sub-2: too short",
    ]


def test_verbose_says_what_is_read_and_how_long_it_takes(capsys):
    assert "ingest: sub-2: 1.2 s; read markers" in said(capsys, verbose=True)


class Terminal(StringIO):
    def isatty(self) -> bool:
        return True


def test_the_bar_counts_what_a_unit_costs_and_not_what_need_not_be_done(monkeypatch):
    def cost(outcome):
        return {"ik": 2, "diagnose": 12}[outcome.stage]

    def running():
        for outcome in (Outcome("ik", "sub-1", "done"), Outcome("diagnose", "sub-1", "fresh")):
            time.sleep(0.2)  # longer than the bar waits before it is drawn again
            yield outcome

    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    assert follow("run", [], running(), 20, None, cost) == 0
    drawn = [int(part) for part in re.findall(r"(\d+)%\|", terminal.getvalue())]
    assert drawn[0] == 0
    assert 10 in drawn  # 2 of 20
    assert drawn[-1] == 25  # 2 of 8
