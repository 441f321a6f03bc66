"""Small faults of the instruments: taken for granted, and no help to a large one."""

import numpy as np
import pytest

from bsip_cli.diagnosis.evidence import TrialEvidence, slow, trial_evidence
from bsip_cli.diagnosis.slack import slack
from bsip_cli.diagnosis.together import together
from bsip_cli.effects.scene import Scene
from bsip_cli.effects.sync_offset import SyncOffset
from tests.diagnosis.noisy_trial import CUTOFF_HZ, fitted, late, noisy, null, part_of_moving


def beside_slack(scene: Scene) -> TrialEvidence:
    fewer = slow(scene)
    nothing = np.zeros((len(fewer.times_s), 6, 1))
    level = np.ones(len(scene.times_s))
    return trial_evidence("a", scene, slack(fewer), nothing, level, CUTOFF_HZ)


def delay_found(delay_s: float, seed: int) -> float:
    scene = late(noisy(part_of_moving(0.0, 10.0), seed, times=4.0), delay_s)
    _, fit = fitted(together((beside_slack(scene),)), null(SyncOffset(), ""))
    return fit.explanations[0].values[0]


@pytest.mark.parametrize("delay_s", [-0.02, 0.02])
def test_noisy_forces_seem_as_late_as_they_are(delay_s):
    """A slight delay besides would smooth their noise, the more the later they are taken to be."""
    found = np.mean([delay_found(delay_s, seed) for seed in (1, 2, 3)])
    assert found == pytest.approx(delay_s, rel=0.02)
