import math

import numpy as np
import pytest

from bsip_cli.dynamics.lowpass import valid_intervals
from bsip_cli.report.blocks import Document, Paragraph, render
from bsip_cli.report.errors import gains_of
from bsip_cli.report.figures.canvas import middle_of_longest, plain, thinned, ticks
from bsip_cli.report.figures.charts import Panel, curves
from bsip_cli.report.words import (
    component_label,
    count,
    listing,
    number,
    segment_label,
    signed,
    significant,
    trial_label,
)
from tests.report.fake_study import frame


@pytest.mark.parametrize(
    ("value", "text"),
    [(1.25, "1.2"), (-0.04, "0.0"), (-3.0, "−3.0"), (math.nan, "–"), (None, "–"), (math.inf, "–")],
)
def test_number(value, text):
    assert number(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (812.0, "812"),
        (182345.0, "182\N{THIN SPACE}000"),
        (0.05, "0.0500"),
        (1.2e-5, "1.20 × 10⁻⁵"),
        (-3.14159, "−3.14"),
        (1.5e9, "1.50 × 10⁹"),
        (99.96, "100"),
        (0.0, "0.00"),
        (math.nan, "–"),
    ],
)
def test_significant(value, text):
    assert significant(value) == text


def test_words():
    assert [signed(v) for v in (3.2, -3.2, 0.2, math.nan)] == ["+3", "−3", "0", "–"]
    assert listing(["a", "b", "c"]) == "a, b and c"
    assert listing([]) == "none"
    assert (count(1, "trial"), count(2, "trial")) == ("1 trial", "2 trials")
    assert trial_label("sub-01_task-static") == "static"
    assert trial_label("<odd>") == "<odd>"
    segments = [segment_label(name) for name in ("upper_arm_l", "lower_torso", "clavicle_r")]
    assert segments == ["left upper arm", "lower torso", "right clavicle"]
    assert component_label("unheard") == "unheard"


def test_units_stay_with_their_numbers():
    page = render(Document("", "", (Paragraph("5 % of 3 mm in 2 N m"),), ()))
    assert "5\xa0% of 3\xa0mm in 2\xa0N\xa0m" in page


def test_labels_lose_mathematics_and_control_signs():
    assert plain("$x_1$") == "$x_1$"
    assert plain("a\x00b\nc") == "a?b?c"
    assert len(plain("x" * 99)) == 16


def test_runs_and_thinning():
    assert valid_intervals(np.array([True, True, False, True])) == [(0, 2), (3, 4)]
    assert valid_intervals(np.zeros(3, dtype=bool)) == []
    assert len(np.arange(100_000)[thinned(100_000)]) <= 1200


@pytest.mark.parametrize(
    ("low", "high", "most", "labels"),
    [
        (0.1, 2.4, 5, ["0.5", "1.0", "1.5", "2.0"]),
        (-160.0, 10.0, 5, ["−150", "−100", "−50", "0"]),
        (-0.3, 0.6, 4, ["−0.25", "0.00", "0.25", "0.50"]),
        (0.0, 100.0, 2, ["0", "50", "100"]),
    ],
)
def test_ticks_are_round_and_say_what_they_are(low, high, most, labels):
    found = ticks(low, high, most)
    assert [*found.values()] == labels
    assert [*found] == pytest.approx([float(x.replace("−", "-")) for x in labels])


def test_a_curve_is_drawn_where_there_is_one_frame_or_none():
    for signal in (np.array([2.0]), np.array([np.nan])):
        page = curves([Panel("force <N>", np.array([1.0]), {"RM": signal})], 1).svg().decode()
        assert "force &lt;N&gt;" in page and "nan" not in page


def test_window_is_the_middle_of_the_longest_interval():
    time = np.arange(0.0, 30.0, 0.1)
    flags = (time < 4.0) | (time > 8.95)
    window = middle_of_longest(time, flags, 10.0)
    assert time[window][0] == pytest.approx(14.4, abs=0.11)
    assert np.ptp(time[window]) == pytest.approx(10.0, abs=0.11)
    assert middle_of_longest(time, np.zeros(300, dtype=bool), 10.0) == slice(0, 0)
    assert middle_of_longest(time, time < 4.0, 10.0) == slice(0, 40)


def test_gains():
    fit = frame(
        "method component rmse",
        ("RM", "fx", 10.0),
        ("OM", "fx", 6.0),
        ("RM", "fz", 10.0),
        ("OM", "fz", 10.05),
        ("RM", "my", 10.0),
        ("RM+mass", "my", 5.0),
        ("OM", "my", 6.0),
        ("RM", "grf_vertical", 10.0),
        ("OM", "grf_vertical", 12.0),
        ("RM", "mz", 3.0),
    )
    fit = fit.assign(unit="N", rmse_percent_bw=0.1 * fit["rmse"], n=100, data="held_out")
    gains = {gain.component: gain for gain in gains_of("throw", fit)}
    assert set(gains) == {"fx", "fz", "my", "grf_vertical"}
    assert gains["my"].of == {"RM": 10.0, "RM+mass": 5.0, "OM": 6.0}
    assert (gains["grf_vertical"].unit, gains["grf_vertical"].of["RM"]) == ("% BW", 1.0)
