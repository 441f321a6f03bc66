"""What bears a person: hands that hold on for a whole trial, which no plate measures; and plates
that do not carry the stated mass.

Of hands two things must come together. A hand stands still in the room while the trunk moves; and
the plates miss a mean force that nothing inside a body can make: over a trial the mean horizontal
force is the change of momentum by time, the mean vertical one the weight as well. What the hand
bears from one moment to the next no instrument shows, so nothing else is asked of such a trial: the
swings of that force would be taken for other causes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import chi2, norm

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.diagnosis.error_model import BLOCK_S
from bsip_cli.diagnosis.findings import Finding
from bsip_cli.diagnosis.held_out import FOLDS, Gain
from bsip_cli.effects.effect import Number, Words
from bsip_cli.effects.loads import AddedMass, UnmeasuredContact
from bsip_cli.effects.plates import PlateGain, PlateZero
from bsip_cli.effects.scene import Scene
from bsip_cli.segments import in_words
from bsip_cli.statistics.samples import Z95, effective_samples

HANDS, TRUNK = ("hand_l", "hand_r"), "upper_torso"
STILL_M = 0.004  # root mean square distance of a hand that holds on from its mean place
STILLER = 3.0  # times that the trunk moves further than such a hand
UNBALANCED = 0.01  # of body weight: missing mean horizontal force
LIGHTER = 0.02  # of body weight: missing mean vertical force
SURE = 4.0  # standard errors
SHORTEST_S = 2.0  # of measured contacts: what fewer seconds show is no mean of a trial


@dataclass(frozen=True)
class Support:
    """What hands hold on to in one trial; as plain numbers, since it is written and read again.

    hand_moves_m, trunk_moves_m : root mean square distance from their mean places; of the hands
        that hold on the largest. start_s, end_s : the frames compared.
    force_N, error_N : (3,) mean force on the body, world, all hands together, and standard error.
    gain_percent : what the mean force takes off the squared residual of forces it has not seen,
        and its 95 % interval.
    """

    hands: Sequence[str]
    hand_moves_m: float
    trunk_moves_m: float
    start_s: float
    end_s: float
    force_N: Sequence[float]
    error_N: Sequence[float]
    gain_percent: Sequence[float]

    def finding(self, trial: str) -> Finding:
        """As the diagnosis prints it."""
        force, errors = np.array(self.force_N), np.array(self.error_N)
        p_value = float(chi2.sf(((force / errors) ** 2).sum(), 3))
        percent, low, high = self.gain_percent
        size = float(np.linalg.norm(force))
        error = float(np.linalg.norm(force * errors)) / size
        parts = zip(("force_x", "force_y", "force_z"), self.force_N, self.error_N, strict=True)
        numbers = (
            Number("start", "s", *[self.start_s] * 3),
            Number("end", "s", *[self.end_s] * 3),
            *(
                Number.within(name, "N", x, Z95 * e)
                for name, x, e in (("force", size, error), *parts)
            ),
        )
        words = Words(f"{self.words()}, and what else may be wrong in this trial is not asked")
        said = UnmeasuredContact.name, "+".join(self.hands), (trial,), numbers, words
        gain = (percent, low, high)
        return Finding(*said, p_value, 1 - p_value, gain=gain, rms_change=size)

    def words(self) -> str:
        """What was found."""
        hands = " and ".join(in_words(hand) for hand in self.hands)
        verb = "stand" if len(self.hands) > 1 else "stands"
        return (
            f"{hands} {verb} still within {1000 * self.hand_moves_m:.0f} mm while the trunk moves "
            f"by {1000 * self.trunk_moves_m:.0f} mm, and the plates miss "
            f"{np.linalg.norm(self.force_N):.0f} N of the trial's mean force: something beside "
            "them bears it"
        )


def support_of(scene: Scene) -> Support | None:
    """What the hands hold on to throughout a trial; None if they hold on to nothing, or if its
    measured part is too short to decide."""
    if scene.valid.sum() < SHORTEST_S * scene.rate_hz:
        return None
    some = [*(name for name in HANDS if name in scene.bodies), TRUNK]
    paths = {name: scene.centre(name).position_m[scene.valid] for name in some}
    trunk = paths.pop(TRUNK)
    missing = (scene.predicted - scene.measured)[scene.valid, :3]
    weight = scene.mass_kg * GRAVITY_M_S2
    return held_by(paths, trunk, missing, scene.times_s[scene.valid], weight)


def held_by(
    hands_m: Mapping[str, np.ndarray],
    trunk_m: np.ndarray,
    missing_N: np.ndarray,
    times_s: np.ndarray,
    weight_N: float,
) -> Support | None:
    """The same from the paths (n, 3) of hands and trunk and the force (n, 3) that the plates miss,
    all world."""
    trunk, moves = _moves_m(trunk_m), {name: _moves_m(path) for name, path in hands_m.items()}
    still = tuple(h for h, x in moves.items() if x < STILL_M and STILLER * x < trunk)
    counts = np.array([effective_samples(signal) for signal in missing_N.T])
    error = missing_N.std(axis=0) / np.sqrt(np.fmax(counts, 1.0))  # of autocorrelated signals
    force = missing_N.mean(axis=0)
    aside, its_error = (float(np.linalg.norm(x[:2])) for x in (force, error))
    pushed = aside > UNBALANCED * weight_N and aside > SURE * its_error
    lighter = force[2] > LIGHTER * weight_N and force[2] > SURE * error[2]
    if not still or not (pushed or lighter):
        return None
    largest, (start, *_, end) = max(moves[hand] for hand in still), times_s.tolist()
    known = tuple(force.tolist()), tuple(error.tolist()), _gain(missing_N, times_s).interval()
    return Support(still, largest, trunk, start, end, *known)


def _moves_m(path_m: np.ndarray) -> float:
    """Root mean square distance from the mean place."""
    return float(np.sqrt(((path_m - path_m.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _gain(missing: np.ndarray, times_s: np.ndarray) -> Gain:
    """Of the mean force, each second judged by the mean of the others."""
    numbers = ((times_s - times_s[0]) / BLOCK_S).astype(int)
    saved = np.zeros(len(missing))
    for fold in range(FOLDS):
        test = numbers % FOLDS == fold
        if test.any() and not test.all():
            mean = missing[~test].mean(axis=0)
            saved[test] = (missing[test] ** 2 - (missing[test] - mean) ** 2).sum(axis=1)
    blocks = np.bincount(np.unique(numbers, return_inverse=True)[1], weights=saved)
    return Gain(blocks, float((missing**2).sum()))


# --- do the plates carry the person whose mass is stated? -----------------------------------------

# The wrench alone does not show it: free parameters follow the plates. Nothing in a quiet trial
# shows why the plates read another mass, and nothing in moving ones where the inertial
# parameters follow the plates or several plates carry the person. So this is a class of causes,
# of which every one is printed with its own size.

NOTICED = 0.02  # part of the mass from which on it is reported, if a scale errs less
SURE_OF_SCALE = 2.5  # standard deviations of a stated mass beyond which it is
LOADED = 0.05  # of body weight: a plate that carries less is not stood upon
CLASS = "W"  # of the weight; those found in the motion are A, B, C
REMEDY = (
    "weigh the person as recorded, put a known weight on each plate, and read them with nobody on"
)


def weight_share(scene: Scene) -> float:
    """Mean vertical force beyond the simulated one, part of body weight."""
    missing = (scene.measured - scene.predicted)[scene.valid, 2]
    return float(missing.mean()) / (scene.mass_kg * GRAVITY_M_S2)


def is_noticed(share: float, mass_sd: float) -> bool:
    """Whether the plates read so much more or less (part of the stated mass) than a scale errs by.

    mass_sd : standard deviation of the stated mass, part of it.
    """
    return abs(share) >= max(NOTICED, SURE_OF_SCALE * mass_sd)


def agreed_share(scenes: Sequence[Scene], mass_sd: float) -> float | None:
    """What moving trials say of the stated mass, like ``weight_share``; nothing if plates and scale
    agree, or the trials do not agree with each other."""
    shares = np.array([weight_share(one) for one in scenes])
    share = float(np.median(shares))
    agree = np.abs(shares - share).max() <= 0.5 * abs(share)
    return share if agree and is_noticed(share, mass_sd) else None


def loaded_plate(scenes: Iterable[Scene]) -> str | None:
    """The plate that alone carries the person; None where several do."""
    loaded = {
        plate.name
        for scene in scenes
        for plate in scene.plates
        if np.nan_to_num(plate.wrench[scene.valid, 2]).mean()
        > LOADED * scene.mass_kg * GRAVITY_M_S2
    }
    return loaded.pop() if len(loaded) == 1 else None


def stated_mass_findings(
    share: float,
    mass_kg: float,
    mass_sd: float,
    plate: str | None,
    trials: tuple[str, ...],
    manner: str,
) -> tuple[Finding, ...]:
    """The class of causes if the plates differ from the stated mass by more than a scale does.

    share : of the stated mass, from ``weight_share`` or ``agreed_share``. mass_sd : its standard
    deviation, part of it. plate : from ``loaded_plate``. trials : the recordings that show it.
    manner : how they were read, in words.
    """
    if not is_noticed(share, mass_sd):
        return ()
    p_value = float(2 * norm.sf(abs(share) / mass_sd))  # how likely a scale errs by that much
    extra, where = share * mass_kg, f"{plate or 'all'} fz"
    found = (
        f"the plates read {mass_kg + extra:.2f} kg {manner}, {abs(extra):.1f} kg "
        f"{'more' if extra > 0 else 'less'} than stated"
    )
    per_share = {"kg": mass_kg, "1": 1.0, "N": mass_kg * GRAVITY_M_S2}
    weight = per_share["N"] * share
    gain = f"the plates' vertical gain is off by {100 * share:+.1f} %"
    zero = f"the plates' zero is off by {weight:+.0f} N"
    causes = [
        (PlateGain.name, where, "gain", "1", gain, "laboratory"),
        (PlateZero.name, where, "offset", "N", zero, "laboratory"),
    ]
    if extra > 0:
        worn = f"{extra:.1f} kg are worn or carried that the stated mass leaves out"
        causes.insert(0, (AddedMass.name, "", "mass", "kg", worn, "person"))
    more: dict[str, Any] = {"verdict": "ambiguous", "class_id": CLASS, "rms_change": abs(weight)}
    more["closing"] = f"; to distinguish them, {REMEDY}"
    findings = []
    for effect, target, name, unit, why, scope in causes:
        size = Number.within(name, unit, per_share[unit] * share, Z95 * per_share[unit] * mass_sd)
        words = Words(f"{found}: {why}, or the stated mass is wrong", why, found)
        said = effect, target, trials, (size,), words
        sure = p_value, (1 - p_value) / (len(causes) + 1)
        findings.append(Finding(*said, *sure, scope=scope, **more))
    return tuple(findings)
