"""Sizes are told in the units that people use."""

from __future__ import annotations

import pytest

from bsip_cli.diagnosis.findings import interval_words
from bsip_cli.effects.effect import Number, digits_of


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (Number("yaw", "rad", 0.0227, 0.0211, 0.0242), "yaw: 95 % interval 1.21 to 1.39°"),
        (Number("delay", "s", -0.0187, -0.02, -0.0174), "delay: 95 % interval -20.0 to -17.4 ms"),
        (
            Number("rate_error", "1", 3e-4, 2.7e-4, 3.2e-4),
            "rate error: 95 % interval 270 to 320 ppm",
        ),
        (Number("gain", "1", -0.018, -0.0195, -0.0156), "gain: 95 % interval -1.95 to -1.56 %"),
        (
            Number("damping_ratio", "1", 0.2, 0.12, 0.24),
            "damping ratio: 95 % interval 0.12 to 0.24",
        ),
        (Number("shift_x", "m", 0.03, 0.0, 0.05), "shift x: 95 % interval 0 to 50 mm"),
        (Number("force", "N", 28.0, 28.0, 28.0), "force: 95 % interval 28 to 28 N"),
    ],
)
def test_an_interval_in_words(number, words):
    assert interval_words((number,)) == f" ({words})"


def test_digits_that_count():
    assert [digits_of(x) for x in (0.0, 0.031, 2.6, 31.0, -0.5)] == [1, 3, 1, 0, 2]
