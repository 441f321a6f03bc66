"""The gain of a plate that ingest takes off is off the corrected recording, too."""

import numpy as np
import pytest

from tests.circumstances.generator import draw, write
from tests.circumstances.taken import concluded, exported, ingest


@pytest.mark.long
@pytest.mark.parametrize(("number", "gain"), [(21, 2.0), (205, 1.25)])  # a C3D; TRC and MOT
def test_a_gain_is_not_in_the_corrected_recording(tmp_path, number, gain):
    circumstance = draw(864001, number)
    assert f"reads {gain:g} times the load" in str(circumstance)
    study, out, fixed = (tmp_path / name for name in ("study", "out", "fixed"))
    write([circumstance], study)
    concluded(study, out)
    exported(study, out, fixed)
    (before,), (after,) = (
        ingest(some, tmp_path / f"of_{some.name}").values() for some in (study, fixed)
    )
    assert any("divided its forces" in word.text for word in before.words)
    assert not any("divided its forces" in word.text for word in after.words)
    for name, trial in before.trials.items():
        for plate, wrench in trial.plates.items():
            found = after.trials[name].plates[plate]
            assert np.abs(found - wrench).max() < 0.5  # N, N m: a MOT has few decimals
