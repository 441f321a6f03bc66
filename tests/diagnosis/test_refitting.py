"""What a candidate may not ask of a person."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.diagnosis.explanation import fit_together
from bsip_cli.diagnosis.refitting import FURTHER, needs_another_mass
from bsip_cli.diagnosis.together import together
from tests.diagnosis.noisy_trial import MASS_SD_KG, SEGMENTS, all_of, noisy, part_of_moving

STATED_SD_KG = 0.25


@pytest.mark.parametrize(
    ("without", "beside", "needed"),
    [(0.0, FURTHER - 1, False), (0.0, FURTHER + 1, True), (4.0, FURTHER + 1, False)],
)
def test_a_cause_that_takes_the_body_away_from_the_stated_mass(without, beside, needed):
    (one,) = all_of(noisy(part_of_moving(0, 10), 1)).trials
    heavier = np.full(len(SEGMENTS), MASS_SD_KG / STATED_SD_KG)
    evidence = together((replace(one, filtered=replace(one.filtered, heavier=heavier)),))
    fit = fit_together(evidence, ())
    share = -evidence.beyond_stated(fit.residual)

    def with_body(size: float) -> np.ndarray:
        shared = evidence.turned(one.shared.sum(axis=1, keepdims=True))[:, 0]
        return fit.residual + shared * (size + share) / evidence.beyond_stated(shared)

    first, second = (replace(fit, residual=with_body(size)) for size in (without, beside))
    assert evidence.beyond_stated(second.residual) == pytest.approx(beside)
    assert needs_another_mass(evidence, first, second) == needed
