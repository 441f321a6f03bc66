"""One mass from the intervals of all trials of a person, or why there is none, and a stated mass
against it: agreement, a small difference, or a gross one."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import chi2, norm

from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.momentum_mass import COMES_AND_GOES, Interval
from bsip_cli.recordings.one_person import odd_ones
from bsip_cli.recordings.written import FORCE_UNITS_N, force_unit
from bsip_cli.stated import BMI_KG_M2, percent_apart

# Gain of a plate and local gravity: 0.5 % of the range for a plate's linearity and hysteresis
# (makers' data sheets), 0.27 % between equator and poles for gravity.
GAIN_SD = 0.005
HALF_WIDTH = float(norm.ppf(0.975))
AGREE_P = 0.01
LOWER_Z = 3.0
LEAST_SHARE = 0.5  # of a trial's time, that must agree
LEAST_KG, MOST_KG = 10.0, 400.0  # as in participants.tsv
_PERCENT = 100.0
# What a mass in kg was taken for or from: the stated number over the mass in kg.
_UNITS = (
    ("pounds", 2.20462),
    ("stones", 1 / 6.35029),
    ("newton", 9.80665),
    ("grams", 1000.0),
    ("kilograms that were divided by 2.2046 once too often", 1 / 2.20462),
    ("kilograms that were divided by 9.81", 1 / 9.80665),
)
_LIKELY = 0.5  # a unit is named that is likelier than all else
_IN_UNIT = "the forces are likely to be in another unit, {}: export them in N"
_CM_PER_M = 100.0
_NEAR_CM = 3.0


@dataclass(frozen=True)
class MeasuredMass:
    """What the plates measure: mass [kg] with its relative standard deviation, or why none.

    mass_kg is NaN where ``reason`` says why it is not known; ``remark`` is what else is to be said.
    of_nobody : it would be known, and is no person's.
    """

    mass_kg: float
    sd: float
    seconds: float
    reason: str = ""
    remark: str = ""
    of_nobody: bool = False

    @property
    def is_known(self) -> bool:
        return not self.reason

    @property
    def half_width_percent(self) -> float:
        """Of the 95 % interval."""
        return _PERCENT * HALF_WIDTH * self.sd

    def words(self) -> str:
        """``70.21 kg (to 1.2 %) in 3.1 s with all contacts on the plates``."""
        return (
            f"{self.mass_kg:.2f} kg (to {self.half_width_percent:.1f} %) in {self.seconds:.1f} s "
            f"with all contacts on the plates{self.remark}"
        )


def unknown(reason: str) -> MeasuredMass:
    """No mass (NaN), for this reason."""
    return MeasuredMass(float("nan"), float("nan"), 0.0, reason)


def steady(intervals: Sequence[Interval]) -> tuple[Interval, ...]:
    """Those of one trial's intervals that agree with each other.

    What bears a person beside the plates takes weight off them: where intervals disagree, the
    lowest goes first.
    """
    kept = [one for one in intervals if one.steadiness < COMES_AND_GOES]
    while len(kept) > 1:
        whole = _combined([kept])
        z = (np.array([one.mass_kg for one in kept]) / whole.mass - 1.0) / whole.sds
        lowest = int(np.argmin(z))
        if whole.p > AGREE_P or z[lowest] > -LOWER_Z:
            break
        del kept[lowest]
    return tuple(kept)


def measured_mass(
    trials: Mapping[str, Sequence[Interval]],
    most_percent: float,
    height_m: float | None = None,
    static: Collection[str] = (),
) -> MeasuredMass:
    """From the intervals of each trial of a person by its name.

    Trials must agree; where they do not, those that are ``static`` decide, and without one nothing.
    most_percent : the widest half of the 95 % interval that still counts as known. height_m : the
    stature, for the body-mass index.
    """
    kept, reasons = {}, []
    for name, intervals in trials.items():
        agreeing = steady(intervals)
        if reason := _too_little(intervals, agreeing):
            reasons.append(f"{name}: {reason}" if len(trials) > 1 else reason)
        else:
            kept[name] = agreeing
    if not kept:
        return unknown("; ".join(reasons) or "there is no trial with forces")
    if not _disagree(kept.values()):
        return _judged(list(kept.values()), most_percent, height_m)
    masses = [_combined([each]).mass for each in kept.values()]
    differ = f"trials show from {min(masses):.1f} to {max(masses):.1f} kg"
    at_rest = [each for name, each in kept.items() if name in static]
    if not at_rest or _disagree(at_rest):
        return unknown(differ)
    measured = _judged(at_rest, most_percent, height_m)
    return replace(measured, remark=f" ({differ}: the static trial counts)")


def least_mass(intervals: Sequence[Interval], most_percent: float) -> MeasuredMass:
    """Of intervals that do not agree: what bears a person beside the plates takes weight off them,
    so that the lowest is the least that is on them. most_percent : as for `measured_mass`."""
    if not intervals:
        return unknown("there is no interval")
    lowest = min(intervals, key=lambda one: one.mass_kg)
    return replace(_judged([[lowest]], most_percent, None), remark=", or more")


def _too_little(intervals: Sequence[Interval], agreeing: Sequence[Interval]) -> str:
    """Why a trial shows nothing; empty if it does."""
    if not intervals:
        return "no interval shows an upright person with both feet on the plates"
    all_s, kept_s = (sum(one.seconds for one in some) for some in (intervals, agreeing))
    if kept_s >= LEAST_SHARE * all_s:
        return ""
    return (
        f"the force does not go with the motion in {all_s - kept_s:.1f} of {all_s:.1f} s: "
        "something else bears or pushes the person"
    )


class _Whole(NamedTuple):
    """Masses combined by their covariance: mass [kg], relative sd, probability of so much
    disagreement, and each one's own relative sd."""

    mass: float
    sd: float
    p: float
    sds: np.ndarray


def _combined(trials: Collection[Sequence[Interval]]) -> _Whole:
    each = [one for trial in trials for one in trial]
    mass = np.array([one.mass_kg for one in each])
    common = np.array([one.common for one in each])
    covariance = np.diag([one.own_sd**2 for one in each]) + common @ common.T
    covariance += block_diag(
        *(x @ x.T for x in (np.array([s.of_trial for s in t]) for t in trials))
    )
    solved = np.linalg.solve(covariance, np.ones(len(each)))
    best = float(solved @ mass / solved.sum())
    away = mass / best - 1.0
    chi, free = float(away @ np.linalg.solve(covariance, away)), len(each) - 1
    p, widened = (float(chi2.sf(chi, free)), max(1.0, chi / free)) if free else (1.0, 1.0)
    return _Whole(best, float(np.sqrt(widened / solved.sum())), p, np.sqrt(np.diag(covariance)))


def _disagree(trials: Collection[Sequence[Interval]]) -> bool:
    """Whether the trials, each as a whole, differ by more than their errors."""
    mass, sd = np.array([_combined([trial])[:2] for trial in trials]).T
    weight = 1.0 / (sd**2 + GAIN_SD**2)
    best = float((mass * weight).sum() / weight.sum())
    chi = float((((mass / best) - 1.0) ** 2 * weight).sum())
    return bool(len(mass) > 1 and chi2.sf(chi, len(mass) - 1) < AGREE_P)


def _judged(
    kept: Collection[Sequence[Interval]], most_percent: float, height_m: float | None
) -> MeasuredMass:
    whole = _combined(kept)
    seconds = sum(one.seconds for trial in kept for one in trial)
    measured = MeasuredMass(whole.mass, float(np.hypot(whole.sd, GAIN_SD)), seconds)
    if not measured.half_width_percent <= most_percent:
        return unknown(
            f"the plates measure {measured.mass_kg:.1f} kg to {measured.half_width_percent:.0f} % "
            f"only, in {seconds:.1f} s with all contacts on them"
        )
    if usual := _beyond_a_person(measured.mass_kg, height_m):
        unit = force_unit(measured.mass_kg, None, height_m, _PERCENT, _LIKELY)
        reason = f"the plates measure {measured.mass_kg:.1f} kg, {usual}"
        reason += f"; {_IN_UNIT.format(unit)}" if unit else ""
        return replace(unknown(reason), of_nobody=True)
    return measured


def _beyond_a_person(mass_kg: float, height_m: float | None) -> str:
    """What a person, of this stature where it is known, has; empty if the mass is a person's."""
    low, high = (LEAST_KG, MOST_KG) if height_m is None else np.array(BMI_KG_M2) * height_m**2
    stature = "" if height_m is None else f" of {height_m:.2f} m"
    is_usual = low <= mass_kg <= high
    return "" if is_usual else f"a person{stature} has {low:.0f} to {high:.0f}"


def differing_plates(
    plates: Mapping[str, Sequence[Interval]], person_kg: float | None, apart_percent: float
) -> list[Finding]:
    """A warning for each plate that, while it bears the person alone, shows another mass than
    another plate does, and than ``person_kg`` if that is stated.

    plates : intervals by the plate that bears all. apart_percent : what may differ beside the
    intervals.
    """
    measured, findings = _known(plates), []
    for name, one in measured.items():
        others = {k: two for k, two in measured.items() if _are_apart(one, two, apart_percent)}
        known = person_kg is not None and not _are_apart(
            one, replace(one, mass_kg=person_kg, sd=0.0), apart_percent
        )
        if not others or known:
            continue
        beside = " and ".join(f"{two.mass_kg:.1f} kg on plate {k}" for k, two in others.items())
        found = f"its vertical force shows {one.mass_kg:.1f} kg while it bears the person alone, "
        found += f"and {beside}"
        expected = "one weight on every plate"
        expected += "" if person_kg is None else f", the stated {person_kg:.1f} kg"
        action = "took it as it stands; look at this plate's gain, and whether something else "
        action += "bears the person there; until then the whole force and its centre of pressure "
        action += "are wrong while both plates bear the person"
        findings.append(Finding("plate_force", name, found, expected, action, "warning"))
    return findings


def differing_trials(trials: Mapping[str, Sequence[Interval]], apart_percent: float) -> str:
    """Which trials show a mass grossly other than that which most show; empty if none.

    apart_percent : what may differ beside the intervals.
    """
    shown = _known(trials)
    if len(shown) < 2:
        return ""
    usual, odd = odd_ones(
        [*shown], lambda one, two: _are_apart(shown[one], shown[two], apart_percent)
    )
    if not odd:
        return ""
    others = " and ".join(f"{shown[name].mass_kg:.1f} kg in {name}" for name in odd)
    return (
        f"the plates show {others}, and {shown[usual].mass_kg:.1f} kg in {usual}: another person "
        "or a load is on them there, or something bears the person; remove what is another "
        "person's, and state a load"
    )


def plate_gains(
    plates: Mapping[str, Mapping[str, Sequence[Interval]]],
    stated_kg: float | None,
    most_percent: float,
    alike_percent: float,
    apart_percent: float,
) -> dict[str, float]:
    """How many times the load those plates read that surely have another gain than the others.

    While it bears the person alone, such a plate shows a mass that is grossly apart from each of at
    least two others, of plates and the stated one, and those are alike.

    plates : intervals by plate and trial. most_percent : as for `measured_mass`. alike_percent,
    apart_percent : what differs by less is alike, by more is grossly apart, beside the intervals.
    """
    every = {name: measured_mass(some, most_percent) for name, some in plates.items()}
    shown = [one for one in every.values() if one.is_known]
    if stated_kg is not None:
        shown.append(MeasuredMass(stated_kg, alike_percent / _PERCENT / HALF_WIDTH, 0.0))
    gains = {}
    for name, one in every.items():
        others = [two for two in shown if two is not one]
        if (
            one.is_known
            and len(others) > 1
            and all(_are_apart(one, two, apart_percent) for two in others)
            and not any(_are_apart(*pair, alike_percent) for pair in combinations(others, 2))
        ):
            usual = np.average(
                [two.mass_kg for two in others], weights=[two.sd**-2 for two in others]
            )
            gains[name] = float(one.mass_kg / usual)
    return gains


def _known(intervals: Mapping[str, Sequence[Interval]]) -> dict[str, MeasuredMass]:
    """What each plate or trial shows, however vaguely."""
    every = {name: measured_mass({name: some}, _PERCENT) for name, some in intervals.items()}
    return {name: one for name, one in every.items() if one.is_known}


def _are_apart(one: MeasuredMass, other: MeasuredMass, percent: float) -> bool:
    apart = percent_apart(one.mass_kg, other.mass_kg)
    return apart > percent + one.half_width_percent + other.half_width_percent


# --- a stated mass --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Comparison:
    """The stated mass, and known loads with it, against what the plates measure of both."""

    stated_kg: float
    load_kg: float
    measured: MeasuredMass
    tolerance_percent: float
    gross_percent: float
    height_m: float | None

    @property
    def difference_percent(self) -> float:
        return _PERCENT * (self.measured.mass_kg / self.total_kg - 1.0)

    @property
    def total_kg(self) -> float:
        return self.stated_kg + self.load_kg

    @property
    def is_small(self) -> bool:
        """Within tolerance and interval; nothing is to be said."""
        return (
            abs(self.difference_percent)
            <= self.tolerance_percent + self.measured.half_width_percent
        )

    @property
    def is_gross(self) -> bool:
        """More than clothes, shoes and months make."""
        apart = percent_apart(self.measured.mass_kg, self.total_kg)
        return apart > self.gross_percent + self.measured.half_width_percent

    @property
    def is_of_the_forces(self) -> bool:
        """A person of this stature may have the stated mass, and none as much as the plates show;
        what they show too little may be borne by something else."""
        own_kg = self.measured.mass_kg - self.load_kg
        is_more = own_kg > self.stated_kg and _beyond_a_person(own_kg, self.height_m)
        return bool(is_more) and not _beyond_a_person(self.stated_kg, self.height_m)

    def likely(self) -> str:
        """What the stated number is likely to be; empty if it is none of the known mistakes, or the
        mistake is in the forces."""
        if self.is_of_the_forces:
            return ""
        for name, factor in _UNITS if self.measured.mass_kg >= LEAST_KG else ():
            if self._meets(self.stated_kg / factor):
                return f"{self.stated_kg:g} is likely to be in {name}"
        height = self.height_m
        if height is not None and abs(self.stated_kg - _CM_PER_M * height) < _NEAR_CM:
            return f"{self.stated_kg:g} is likely to be the height in cm"
        whole = str(int(self.stated_kg))
        turned = float(whole[::-1]) + self.stated_kg - int(self.stated_kg)  # 75.3 for 57.3
        if len(whole) == 2 and whole[0] != whole[1] and self._meets(turned):
            return f"{self.stated_kg:g} is likely to be {turned:g} with two digits exchanged"
        return ""

    def _meets(self, mass_kg: float) -> bool:
        allowed = self.tolerance_percent + self.measured.half_width_percent
        return abs(_PERCENT * ((mass_kg + self.load_kg) / self.measured.mass_kg - 1.0)) <= allowed

    def sentence(self, where: str) -> str:
        """Of a difference: both numbers; what is likely, where it is gross."""
        remark = f" ({self.difference_percent:+.1f} %)"
        if self.is_gross:
            stated = {name: self.stated_kg / size for name, size in FORCE_UNITS_N.items()}
            units = (_IN_UNIT.format(name) for name, kg in stated.items() if self._meets(kg))
            nothing_known = "a typing mistake, another person's row, plates of another gain, or a "
            nothing_known += "second person or a load on them"
            if self.is_of_the_forces:
                usual = _beyond_a_person(self.measured.mass_kg - self.load_kg, self.height_m)
                times = self.measured.mass_kg / self.total_kg
                nothing_known = f"{usual}: forces of another unit or gain, {times:.3g} times as "
                nothing_known += "large as the stated mass makes them, or a second person or a load"
            remark = f"; {self.likely() or next(units, nothing_known)}"
        return (
            f"the stated mass and the plates do not agree: {where} says {self.stated_kg:g} kg, "
            f"the plates measure {self.measured.words()}{remark}"
        )


def mass_finding(measured: MeasuredMass, comparison: Comparison | None, where: str) -> Finding:
    """The line for the quality table of a trial."""
    if measured.of_nobody:
        return Finding("mass", "", measured.reason, "a person", "left it open", "warning")
    if not measured.is_known:
        expected, action = "a mass that the plates surely show", "nothing compared"
        return Finding("plate_mass", "", f"not known: {measured.reason}", expected, action, "info")
    if comparison is None:
        return Finding("plate_mass", "", measured.words(), "no mass is stated", "", "info")
    if comparison.is_gross:
        action = "contacts found with the plates' mass"
        return Finding("mass", "", comparison.sentence(where), "", action, "warning")
    expected = f"the stated {comparison.total_kg:.2f} kg within {comparison.tolerance_percent:g} %"
    if comparison.is_small:
        found, level = measured.words(), "info"
    else:
        found, level = comparison.sentence(where), "warning"
    return Finding("plate_mass", "", found, expected, "left both as they are", level)
