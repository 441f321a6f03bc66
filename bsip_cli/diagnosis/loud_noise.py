"""Is there more in one component than the noise of the markers and the other components explain?

What is left of a trial when nothing in it can be named should be as loud in every component as
noise of the markers makes it, up to one common factor: the response of the wrench to the pose
tells the proportions. A component that is many times louder has something in it that none of the
effects and none of the regularities describe: a channel that wanders, somebody who pushes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.diagnosis.evidence import TrialEvidence
from bsip_cli.diagnosis.explanation import changes_of
from bsip_cli.diagnosis.findings import Finding, Number, interval_words
from bsip_cli.diagnosis.judging import ARM_M, NAMELESS_WORTH
from bsip_cli.diagnosis.pattern import UNEXPLAINED
from bsip_cli.diagnosis.rounds import Selection
from bsip_cli.diagnosis.together import Evidence
from bsip_cli.effects.channel_words import OF_THE_LAB, unit_of
from bsip_cli.effects.plate_frame import CHANNELS, lab_channel
from bsip_cli.effects.scene import Scene
from bsip_cli.effects.wobbling_mass import has_impacts
from bsip_cli.statistics.effective_samples import effective_samples
from bsip_cli.statistics.normal import Z95

LOUDER = 12.0  # times the median of the components
# Of body weight, moments at an arm of ARM_M: sensors and labs differ below it.
LEAST = 0.008
# Natural logarithm of how much louder the loudest is: 1.2 to 2.9 times in clean simulated trials,
# 3 to 8 times in recordings of three laboratories.
USUAL, SPREAD = 0.8, 0.55
_MAD = 1.4826  # standard deviations of a normal distribution per median absolute deviation
_POSES = 100  # are enough for the proportions
_UNKNOWN = (np.nan, np.nan, np.nan)


@dataclass(frozen=True)
class Loud:
    """A component of one trial: its noise and the standard error of that [N or N m], and how many
    times louder it is."""

    trial: str
    channel: str
    noise: float
    error: float
    louder: float


def with_loud_noise(selection: Selection, found: Sequence[Finding]) -> tuple[Finding, ...]:
    """The findings, and one per component for all trials in which it is too loud.

    Asked are trials in which nothing explains as much as what has no name must; what explains less
    of one that is loud is rejected, since it would be the wrong name. So is a constant error of the
    same channel in other trials, with all that looks like it: what wanders passes for one where it
    is short.
    """
    told = [one for one in found if one.verdict != "rejected" and not _is_slight(one)]
    named = {trial for one in told for trial in one.trials}
    evidence = selection.signatures.evidence
    changes = changes_of(evidence, selection.fit.explanations)
    asked = (
        loudest(one, change)
        for one, change in zip(evidence.trials, changes, strict=True)
        if one.name not in named
    )
    loud = [one for one in asked if one is not None]
    channels = dict.fromkeys(one.channel for one in loud)
    return (
        *(_rejected(one, why) if why else one for one, why in _with_reasons(found, loud, evidence)),
        *(_finding([one for one in loud if one.channel == c]) for c in channels),
    )


def _with_reasons(
    found: Sequence[Finding], loud: Sequence[Loud], evidence: Evidence
) -> list[tuple[Finding, str]]:
    """Each finding and why it is wrong, or nothing; a class is wrong as a whole."""
    reasons = [_why_wrong(one, loud, evidence) for one in found]
    both = list(zip(found, reasons, strict=True))
    classes = {one.class_id: why for one, why in both if why and one.class_id}
    return [(one, why or classes.get(one.class_id, "")) for one, why in both]


def _why_wrong(one: Finding, loud: Sequence[Loud], evidence: Evidence) -> str:
    """Why a finding is the wrong name for what is loud, in its trials or in others; or nothing."""
    trials = {here.trial for here in loud}
    if one.verdict == "rejected":
        return ""
    if trials.isdisjoint(one.trials):
        for other in loud:
            if _channel(one, evidence) == other.channel:
                return f"in {other.trial} {OF_THE_LAB[other.channel]} errs by far more"
    elif _is_slight(one) and trials.issuperset(one.trials):
        return "a component of the force errs by far more"
    return ""


def _channel(one: Finding, evidence: Evidence) -> str | None:
    """The component that a gain, an offset or a drift of a plate is of; None of other causes."""
    plate, _, channel = one.target.rpartition(" ")
    if not plate or channel not in CHANNELS:
        return None
    scene = next(trial.scene for trial in evidence.trials if trial.name in one.trials)
    return lab_channel(scene, one.target)


def _is_slight(one: Finding) -> bool:
    return one.verdict != "rejected" and one.gain[0] < 100 * NAMELESS_WORTH


def _rejected(one: Finding, why: str) -> Finding:
    sentence = f"not so: {one.sentence} ({why})"
    return replace(one, verdict="rejected", class_id="", sentence=sentence)


def loudest(one: TrialEvidence, change: np.ndarray) -> Loud | None:
    """The component that is too loud beside what is known to change (N, 6); None if none is.

    Nothing is asked where somebody lands: a smoothed motion cannot follow that.
    """
    if has_impacts(one.scene):
        return None
    left = one.filtered.residual - one.filtered.filter.one(change)
    without = replace(one, filtered=replace(one.filtered, residual=left))
    noise = noise_of(without.with_noise_beside(np.zeros_like(left)))
    middle = np.median(noise, axis=0)
    size = _MAD * np.median(np.abs(noise - middle), axis=0)
    ratio = size / usual_noise(one.scene, one.filtered.filter.reference_m)
    c = int(np.argmax(ratio))
    louder = float(ratio[c] / np.median(ratio))
    weight = one.scene.mass_kg * GRAVITY_M_S2
    least = LEAST * weight * (1.0 if c < 3 else ARM_M)
    if louder < LOUDER or size[c] < least:
        return None
    samples = effective_samples(noise[:, c])
    error = float(size[c] / np.sqrt(2 * max(samples, 1.0)))
    return Loud(one.name, CHANNELS[c], float(size[c]), error, louder)


def noise_of(one: TrialEvidence) -> np.ndarray:
    """(n, 6) of the filtered residual, what its nuisances do not explain."""
    filtered = one.filtered
    nuisances = np.concatenate([filtered.own, filtered.shared], axis=2)
    known = one.whitening.innovations(nuisances)
    white = one.whitening.innovations(filtered.residual[..., None])[:, 0]
    sizes = np.linalg.solve(known.T @ known + np.eye(known.shape[1]), known.T @ white)
    return filtered.residual - nuisances @ sizes


def usual_noise(scene: Scene, reference_m: np.ndarray) -> np.ndarray:
    """(6,) in proportion, what equal noise of all markers makes of the wrench, about a point."""
    fewer = scene.every(max(1, len(scene.times_s) // _POSES))
    response = fewer.response.to_acceleration.copy()
    response[:, 3:] -= np.cross(reference_m, response[:, :3], axisb=1, axisc=1)
    squares = np.einsum("fik,fkl,fil->fi", response, fewer.pose_response.inverse, response)
    return np.sqrt(np.median(squares, axis=0))


def _finding(found: list[Loud]) -> Finding:
    worst = max(found, key=lambda one: one.louder)
    unit = unit_of(worst.channel)
    likely = norm.sf((np.log(worst.louder) - USUAL) / SPREAD)
    half = Z95 * worst.error
    number = Number("noise", unit, worst.noise, worst.noise - half, worst.noise + half)
    sentence = (
        f"something without a name makes {OF_THE_LAB[worst.channel]} err by {worst.noise:.1f} "
        f"{unit} (standard deviation), {worst.louder:.0f} times what the noise of the other "
        f"components lets expect{interval_words((number,))}"
    )
    return Finding(
        UNEXPLAINED,
        worst.channel,
        tuple(one.trial for one in found),
        "named",
        "",
        float(min(1.0, len(CHANNELS) * likely)),
        _UNKNOWN,
        (number,),
        sentence,
    )
