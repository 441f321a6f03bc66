"""A colour means one kind of cause, and a length one size, in every report."""

import numpy as np
import pytest

from bsip_cli.report.blocks import Bar, Document, Scales, render
from bsip_cli.report.budget import COLOURS, FAULT, HATCHES, Piece, fills, overall_pieces
from bsip_cli.report.errors import yardsticks
from bsip_cli.report.words import abbreviations
from tests.report.fake_study import error_budget


def page_of(*blocks):
    return render(Document("title", "", blocks, ()))


def test_every_kind_has_a_colour_of_its_own():
    own = {kind: colour for kind, colour in COLOURS.items() if kind not in ("noise", "unknown")}
    assert len(set(own.values())) == len(own)
    terms = set(error_budget(["sub-01_task-squat_run-1"])["term"]) - {"total"}
    assert {"fault" if term.startswith("fault:") else term for term in terms} <= set(COLOURS)


def test_a_colour_keeps_its_meaning_whatever_stands_before_it():
    skin, fault = Piece("soft tissue", 60.0, ("soft_tissue",)), Piece("a delay", 40.0, (FAULT,))
    for pieces in ([skin, fault], [fault, skin], [skin]):
        assert fills(pieces)["soft tissue"].css() == COLOURS["soft_tissue"]
    both = Piece("soft tissue or smoothing", 60.0, ("soft_tissue", "smoothing"))
    css = fills([both])[both.label].css()
    assert COLOURS["soft_tissue"] in css and COLOURS["smoothing"] in css


def test_faults_share_their_colour_and_differ_by_their_hatching():
    faults = [Piece(name, 25.0, (FAULT,)) for name in "abcd"]
    found = fills(faults)
    assert {one.colours for one in found.values()} == {(COLOURS[FAULT],)}
    assert len({one.css() for one in found.values()}) == len(HATCHES)


def test_pieces_know_their_kinds():
    table = error_budget(["sub-01_task-squat_run-1"])
    kinds = {one.label: one.kinds for one in overall_pieces(table, ())}
    assert kinds["the table's segment parameters"] == ("inertial_parameters",)
    assert kinds["soft tissue or smoothing of the motion"] == ("soft_tissue", "smoothing")
    page = page_of(Bar("bar", overall_pieces(table, ())))
    assert page.count(COLOURS["inertial_parameters"]) == 2  # the bar, and its legend


@pytest.mark.parametrize(("value", "part", "beyond"), [(15.0, 0.25, False), (90.0, 1.0, True)])
def test_scales_end_at_a_fixed_size(value, part, beyond):
    first, *others = yardsticks(0.03, 5.0)
    assert first.part(value) == part and first.marks[1][0] == 0.5
    assert {one.part(one.limit) for one in others} == {0.5}
    assert ('class="arrow"' in page_of(Scales(((first, value, None),)))) == beyond
    assert first.part(np.nan) == 0.0


def test_abbreviations_of_tasks_are_spelled_out():
    assert abbreviations(["DJ1", "STS2", "walking"]) == "DJ: drop jump; STS: sit to stand"
    assert abbreviations(["squat", "ADJ1"]) == ""
