"""Nulls drawn anew from a recording: noise of the same kind in another order."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.diagnosis.loud_noise import noise_of
from tests.blind.blind_tables import between_marks
from tests.blind.redrawn_nulls import redrawn, summary, with_random_phases
from tests.diagnosis.noisy_trial import evidence_of, late, noisy, part_of_moving


@pytest.mark.parametrize("count", [300, 301])
def test_random_phases_keep_spectra_and_what_goes_together(count):
    rng = np.random.default_rng(1)
    first = np.convolve(rng.normal(size=count + 9), np.ones(10), "valid")
    courses = np.stack([first, 0.5 * first + 0.1 * rng.normal(size=count)], axis=1)
    drawn = with_random_phases(courses, rng)
    assert drawn.shape == courses.shape
    np.testing.assert_allclose(
        np.abs(np.fft.rfft(drawn, axis=0)), np.abs(np.fft.rfft(courses, axis=0)), atol=1e-9
    )
    assert np.corrcoef(drawn.T)[0, 1] > 0.95
    assert abs(np.corrcoef(drawn[:, 0], courses[:, 0])[0, 1]) < 0.6


def test_a_redrawn_trial_is_as_noisy_and_another():
    one = evidence_of("a", noisy(part_of_moving(0, 12), 3))
    drawn = redrawn(one, np.zeros(one.filtered.shared.shape[2]), np.random.default_rng(2))
    assert drawn.residual.std() == pytest.approx(one.residual.std(), rel=0.15)
    assert abs(np.corrcoef(drawn.residual, one.residual)[0, 1]) < 0.1
    assert drawn.scene is one.scene and drawn.filtered.filter is one.filtered.filter


def test_noise_is_what_nuisances_do_not_explain():
    one = evidence_of("a", noisy(part_of_moving(0, 12), 3))
    known = one.filtered.own @ np.array([2.0, -2.0, 1.0, 0.0, 1.0])
    spoilt = replace(one, filtered=replace(one.filtered, residual=one.filtered.residual + known))
    left = noise_of(spoilt) - noise_of(one)
    assert (left**2).sum() < 0.1 * (known**2).sum()
    delayed = evidence_of("a", noisy(late(part_of_moving(0, 12), 0.02), 3))
    assert (noise_of(delayed) ** 2).sum() > 2 * (noise_of(one) ** 2).sum()


def test_the_summary_counts_alarms_and_what_is_named(tmp_path):
    for name, draws in (("one", [[], ["plate_zero 1 fx (1 trials)"]]), ("two", [[], []])):
        (tmp_path / f"{name}.json").write_text(json.dumps(draws))
    text = summary(tmp_path)
    assert "Of 4 redrawn nulls (2 people) 1 raise an alarm: 25.0% (4.6% to 69.9%)" in text
    assert text.endswith("Named: plate_zero 1 fx 1.")


def test_only_what_stands_between_the_marks_is_replaced(tmp_path):
    page = tmp_path / "page.md"
    begin, end = "<!-- made by me: begin -->", "<!-- made by me: end -->"
    page.write_text(f"# Head\n{begin}\nold\n{end}\n\ntail\n")
    between_marks(page, "me", "new")
    assert page.read_text() == f"# Head\n{begin}\n\nnew\n\n{end}\n\ntail\n"
