"""What judges the answers about real recordings: sizes, verdicts, what stood there before."""

from __future__ import annotations

import json
from dataclasses import asdict

from benchmarks.diagnosis_answers import Answer, Found
from benchmarks.diagnosis_page import (
    ALIKE,
    BELOW,
    ELSEWHERE,
    IN_CLASS,
    MISSED,
    PUT_RIGHT,
    RIGHT,
    WRONG,
    injected_rows,
    verdict_of,
)
from benchmarks.injected_causes import CAUSES, Parameter

BY_EFFECT = {cause.effect: cause for cause in CAUSES}
SHIFT = BY_EFFECT["plate_translation"]


def found(effect: str, target: str, class_id: str = "", **values: float) -> Found:
    intervals = {name: (x, 0.9 * x, 1.1 * x) for name, x in values.items()}
    return Found(effect, target, class_id, ("squats",), 0.001, 5.0, intervals, "")


def answer(*causes: Found, place: str = "1") -> Answer:
    return Answer(place=place, found=causes)


def verdict(cause, before: Answer, after: Answer) -> str:
    return verdict_of(cause, before, after)[0]


def test_parameters_are_scaled_lengths_or_spans():
    assert Parameter(("x",), "mm", 1e3).of({"x": -0.02}) == -20
    assert Parameter(("x", "y"), "m").of({"x": 3.0, "y": 4.0}) == 5
    assert Parameter(("start", "end"), "s", spans=True).of({"start": 2.0, "end": 5.0}) == 3


def test_verdicts():
    nothing = answer()
    right = found("plate_translation", "1", x=0.02, y=0.0, z=0.0)
    assert verdict(SHIFT, nothing, answer(right)) == RIGHT
    other = found("plate_zero", "1 mx", "A", offset=5.0)
    member = found("plate_translation", "1", "A", x=0.02, y=0.0, z=0.0)
    assert verdict(SHIFT, nothing, answer(member, other)) == IN_CLASS
    elsewhere = found("plate_translation", "2", x=0.02, y=0.0, z=0.0)
    assert verdict(SHIFT, nothing, answer(elsewhere)) == ELSEWHERE
    assert verdict(SHIFT, nothing, nothing) == MISSED
    assert verdict(SHIFT, nothing, answer(found("sync_offset", "", delay=0.01))) == WRONG


def test_what_stood_there_before_counts_only_where_it_has_changed():
    before = answer(found("plate_translation", "1", x=0.001, y=0.037, z=0.0))
    same = answer(found("plate_translation", "1", x=0.002, y=0.037, z=0.0))
    moved = answer(found("plate_translation", "1", x=0.021, y=0.037, z=0.0))
    assert verdict(SHIFT, before, same) == MISSED
    assert verdict(SHIFT, before, moved) == RIGHT
    (row,) = injected_rows(before, {SHIFT.words: moved}, [SHIFT])
    assert "20 mm" in row[4] and "beside 1 before" in row[4]


def test_a_miss_below_what_is_seen_is_told_from_others():
    """Of the three shifts only that along x was injected, 20 mm of it."""
    names = ("x", "y", "z")
    for limit, told in ((0.03, BELOW), (0.005, MISSED)):
        limits = {f"plate_translation|1|{name}": limit if name == "x" else 1e-3 for name in names}
        (row,) = injected_rows(Answer(limits=limits), {SHIFT.words: answer()}, [SHIFT])
        assert row[:3] == [SHIFT.words, f"{1e3 * limit:.3g} mm", told]


def test_what_looks_alike_and_labels_put_right():
    gain = BY_EFFECT["plate_gain"]
    alike = answer(found("plate_zero", "1 fz", offset=20.0), place="1 fz")
    assert verdict(gain, answer(), alike) == ALIKE
    swap = BY_EFFECT["marker_swap"]
    assert verdict(swap, answer(), Answer(place="A+B", swaps=("A+B",))) == PUT_RIGHT


def test_answers_come_back_from_json():
    one = answer(found("sync_offset", "", delay=0.01))
    assert Answer.read(json.loads(json.dumps(asdict(one)))).found[0].key == ("sync_offset", "")
