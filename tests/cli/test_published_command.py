"""``bsip published`` as a user meets it."""

from __future__ import annotations

import pytest


def test_audit_prints_every_paper(bsip):
    answer = bsip("published", "audit")
    assert answer.code == 0
    for name in ("Hansen 2014", "Hansen 2017", "Robert 2017"):
        assert f"**{name}: " in answer.out
    assert "AP RM (12.69(4.82)) and ML OM (88.67(11.03)) are exchanged" in answer.out
    assert "nothing in it can be recomputed from what is printed" in answer.out


def test_show_prints_the_tables_as_they_are(bsip):
    answer = bsip("published", "show", "hansen2017")
    assert answer.code == 0
    assert answer.out.count(", as printed.**") == 4
    assert "3.84(1.49)" in answer.out
    assert "Robert" not in answer.out


@pytest.mark.parametrize("what", ["show", "audit"])
def test_an_unknown_paper_is_told_with_the_known_ones(bsip, what):
    answer = bsip("published", what, "hansen2071")
    assert answer.code == 2
    expected = "there is no paper 'hansen2071'; expected hansen2014, hansen2017, robert2017."
    assert expected in answer.err
