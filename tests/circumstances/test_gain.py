"""The gain of a plate that ingest takes off is off the corrected recording, too."""

import numpy as np
import pytest

from tests.circumstances.generator import draw, write
from tests.circumstances.taken import concluded, exported, ingest


@pytest.mark.long
@pytest.mark.parametrize("format_", ["c3d", "trc"])
def test_a_gain_is_not_in_the_corrected_recording(tmp_path, format_):
    """Of somebody who walks: then each plate bears the body alone for a while."""
    circumstance = next(
        c
        for number in range(100)
        if len((c := draw(36, number, "one_plate_gain")).things) == 1
        and c.export.format == format_
        and any("walking" in trial.name for trial in c.session.trials)
    )
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
