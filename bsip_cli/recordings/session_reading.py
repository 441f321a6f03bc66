"""How each plate's numbers are to be understood, decided over all trials of a session alike.

A few repairs are tried: other units, another point that moments are about, the corners in another
order, two plates exchanged; for all plates alike or for one. Each has a prior, how rare it is, and
a likelihood, how well forces so understood press under a person's feet (`under_the_feet`) and carry
and drive the body (`body_motion`). One that is surely better than what the files say is made; where
nothing makes a person of the forces, the plate is left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.special import expit, logsumexp

from bsip_cli.recordings.body_motion import USUAL, GateLimits
from bsip_cli.recordings.hypothesis import AS_IT_IS, Hypothesis, PlateFit
from bsip_cli.recordings.plate_reading import (
    FORCES_MOVED,
    MIRRORS,
    FrameChange,
    PlateReading,
    repeated_plates,
)
from bsip_cli.recordings.scene import Handedness, Stature
from bsip_cli.recordings.shared_forces import Course, of_twins
from bsip_cli.recordings.trial_samples import TrialSamples, log_odds_of, surest
from bsip_cli.recordings.under_the_feet import (
    BESIDE_M,
    STAYS_M,
    Evidence,
    is_on_surface,
    outline,
)
from bsip_cli.recordings.written import (
    AS_WRITTEN,
    Written,
    force_N,
    force_unit,
    likely_paces,
    of_other_trials,
)

_SURELY_NOBODY = 0.999  # probability from which on no reading is believed
_LEAST_LIKELY = -12.0  # logarithm: less adds nothing
_RIM_M = 0.02
_MOSTLY_OUTSIDE = 0.8  # share of the load

# Logarithms: how often something else is wrong; how each trial, plate and lean looks then (a
# person: -1).
_UNKNOWN, _UNKNOWN_EACH = -6.2, -1.5

Doubted = Literal["", "vertical moment", "force and centre of pressure"]

_ALL: Doubted = "force and centre of pressure"
_UNTOLD = "its numbers are no force under a foot as they stand, and several corrections make one"
AGAINST = "its force is not one that carries and drives the body that the markers show"


@dataclass(frozen=True)
class Verdict:
    """How a plate is understood, or why it is left out (``refusal``, a clause).

    ``before`` and ``after``: what its numbers make as the file says, and as they are understood,
    where that differs. ``alternatives``: repairs that would each explain a plate, and that cannot
    be distinguished: it is left out, or what is ``doubted`` is said: its vertical moment where only
    that differs, its force where it is likeliest as the file says. ``repeats`` names the plates
    whose copy or sum it is. ``gain`` : how many times the load it reads.
    """

    reading: PlateReading = field(default_factory=PlateReading)
    before: Evidence | None = None
    after: Evidence | None = None
    refusal: str = ""
    alternatives: tuple[str, ...] = ()
    doubted: Doubted = ""
    repeats: tuple[str, ...] = ()
    gain: float = 1.0


@dataclass(frozen=True)
class SessionReading:
    """How all recordings of a session are to be understood: their axes, and each plate.

    ``delays_s`` : by trial, of the forces after the markers, where there is one; ``drifts_s`` :
    what it grows by until the trial's end. ``paces`` : by trial, how many times as fast as stated
    it ran, where that is sure, or ``maybe_paces`` where the stated rate is not believed.
    ``of_others`` : by trial whose forces are another's, that one; ``twins`` : where both have them.
    ``odd`` : by trial that is not as all others are, in what: its "sides", its "forces", or the
    unit of these; ``against`` : of odd forces, where those are as many as all others.
    ``moment_scales``, ``point_scales`` : by trial whose units are not the others'.
    ``written`` : what the files of all trials are read as.
    ``of_paces`` : how much better each of `PACES` would suit each trial.
    """

    frame: FrameChange = field(default_factory=FrameChange)
    plates: Mapping[str, Verdict] = field(default_factory=dict)
    delays_s: Mapping[str, float] = field(default_factory=dict)
    drifts_s: Mapping[str, float] = field(default_factory=dict)
    paces: Mapping[str, float] = field(default_factory=dict)
    maybe_paces: Mapping[str, float] = field(default_factory=dict)
    of_others: Mapping[str, str] = field(default_factory=dict)
    twins: Mapping[str, str] = field(default_factory=dict)
    odd: Mapping[str, str] = field(default_factory=dict)
    against: Mapping[str, str] = field(default_factory=dict)
    moment_scales: Mapping[str, float] = field(default_factory=dict)
    point_scales: Mapping[str, float] = field(default_factory=dict)
    written: Written = AS_WRITTEN
    log_posterior: float = field(default=0.0, compare=False)  # but for a constant
    of_paces: Sequence[Sequence[float]] = field(default=(), compare=False)

    def refusals(self) -> list[str]:
        """Of plates that are left out, by name, but for copies."""
        return [name for name, one in self.plates.items() if one.refusal]

    @property
    def is_refused(self) -> bool:
        """Nothing makes a person of any plate."""
        counting = [one for one in self.plates.values() if not one.repeats]
        return bool(counting) and all(one.refusal for one in counting)

    @property
    def is_as_stated(self) -> bool:
        """Nothing is corrected but which way the forces push, and an outline."""
        left = {replace(x.reading, sign=1, half_size_m=None) for x in self.plates.values()}
        return not self.frame.moved and left <= {PlateReading()}

    def units_of(self, trial: str) -> tuple[float, float] | None:
        """Scales of moments and points, where they are not those of the session's other trials."""
        if trial not in self.moment_scales:
            return None
        return self.moment_scales[trial], self.point_scales[trial]

    def plates_of(self, trial: str) -> dict[str, Verdict]:
        """In the units of a trial."""
        if (units := self.units_of(trial)) is None:
            return dict(self.plates)
        read = {name: one.reading.in_units(*units) for name, one in self.plates.items()}
        return {name: replace(one, reading=read[name]) for name, one in self.plates.items()}

    def gains(self) -> dict[str, float]:
        """Of plates that read another force than the load."""
        return {name: one.gain for name, one in self.plates.items() if one.gain != 1.0}

    def with_gains(self, gains: Mapping[str, float]) -> SessionReading:
        plates = {
            name: replace(one, gain=gains.get(name, 1.0)) for name, one in self.plates.items()
        }
        return replace(self, plates=plates)


def reading_of_files(
    trials: Sequence[TrialSamples],
    read: Callable[[Written], Sequence[TrialSamples]],
    stated_kg: float | None,
    stated_m: float | None,
    gross_percent: float,
    limits: GateLimits = USUAL,
) -> SessionReading:
    """`session_reading` of trials as their files say, or ``read`` otherwise: with forces of another
    unit than N, or of markers or forces of another rate than the stated one. Trials that have each
    other's forces tell nothing, nor do the few that are not as the others are: left and right are
    exchanged in them, or without them the forces make a person.

    stated_kg, stated_m : of the person. gross_percent : by how much a mass may differ from it.
    """
    whose = of_other_trials([one.lengths for one in trials])
    of_others = {trials[k].name: trials[other].name for k, other in whose.items()}
    twins = of_twins([(one.name, one.course) for one in trials], limits)
    usual = Handedness.of_all([one.hands for one in trials]).sign or 1
    odd = _of_odd_units(trials, stated_m, gross_percent, limits)
    odd |= {one.name: "sides" for one in trials if one.hands.sign == -usual}
    against: dict[str, str] = {}

    def of_own_forces(written: Written = AS_WRITTEN) -> list[TrialSamples]:
        every = trials if written == AS_WRITTEN else read(written)
        return _without_forces(every, {*of_others, *twins, *odd})

    stated = stated_kg, stated_m, gross_percent, limits
    found = _reading_of_own(of_own_forces, *stated)
    if found.is_refused:
        own = of_own_forces(found.written)
        alone = {k: session_reading([one], limits) for k, one in enumerate(own) if one.sources}
        if settled := _of_own_units(own, alone, limits):
            found = replace(settled, written=found.written)
        elif names := _odd_trials(own, alone, limits):
            of_forces = dict.fromkeys(names, "forces")
            odd |= of_forces
            against = of_forces if 2 * len(names) == len(alone) else {}
            found = _reading_of_own(of_own_forces, *stated)
    return replace(found, of_others=of_others, twins=twins, odd=odd, against=against)


def _without_forces(trials: Sequence[TrialSamples], names: Collection[str]) -> list[TrialSamples]:
    """Trials as they are, those of these ``names`` without all that tells of forces."""

    def bare(one: TrialSamples) -> TrialSamples:
        left = one.without(one.sources)
        return replace(left, lengths=None, mass_kg=0.0, late=(), drift_s=0.0, course=Course())

    return [bare(one) if one.name in names else one for one in trials]


def _of_odd_units(
    trials: Sequence[TrialSamples],
    stated_m: float | None,
    gross_percent: float,
    limits: GateLimits,
) -> dict[str, str]:
    """Trials, by name, whose forces surely are in another unit than those of the others, and it."""
    units, height_m = {}, _height_m(trials, stated_m)
    for k, trial in enumerate(trials):
        others = [one.mass_kg for one in (*trials[:k], *trials[k + 1 :]) if one.mass_kg]
        if trial.mass_kg and others:
            stated = float(np.median(others)), height_m, gross_percent
            units[trial.name] = force_unit(trial.mass_kg, *stated, limits.corrected_percent / 100)
    return {name: unit for name, unit in units.items() if unit}


def _height_m(trials: Sequence[TrialSamples], stated_m: float | None) -> float | None:
    usual = Stature.of_all([one.stature for one in trials])
    return stated_m or (None if usual is None else usual.height_m)


def _of_own_units(
    trials: Sequence[TrialSamples], alone: Mapping[int, SessionReading], limits: GateLimits
) -> SessionReading | None:
    """Where trials contradict each other in units alone, which each file states for itself: those
    that are sound as they stand, or else most, are the session's, and the others have their own.
    None where some are nobody's alone, or differ in more than units."""
    units: dict[int, tuple[float, float]] = {}
    axes = {one.frame for one in alone.values()}
    rest: dict[str, set[PlateReading]] = {}
    for k, one in alone.items():
        found = {name: v.reading for name, v in one.plates.items() if not v.repeats}
        own = {(abs(x.moment_scale), x.point_scale) for x in found.values()}
        for name, x in found.items():
            bare = replace(x.in_units(1.0, 1.0), centre_m=None, half_size_m=None)
            rest.setdefault(name, set()).add(bare)
        if len(own) != 1 or one.refusals():
            return None
        (units[k],) = own
    counts = Counter(units.values())
    if len(counts) < 2 or len(axes) > 1 or any(len(each) > 1 for each in rest.values()):
        return None
    usual = (1.0, 1.0) if (1.0, 1.0) in counts else counts.most_common(1)[0][0]
    most = session_reading([trials[k] for k in units if units[k] == usual], limits)
    if most.refusals():
        return None
    plates, delays_s, drifts_s = dict(most.plates), dict(most.delays_s), dict(most.drifts_s)
    others = {k: both for k, both in units.items() if both != usual}
    for k in others:
        plates = {**alone[k].plates, **plates}
        delays_s |= alone[k].delays_s
        drifts_s |= alone[k].drifts_s
    return replace(
        most,
        plates=plates,
        delays_s=delays_s,
        drifts_s=drifts_s,
        moment_scales={trials[k].name: moments for k, (moments, _) in others.items()},
        point_scales={trials[k].name: points for k, (_, points) in others.items()},
    )


def _odd_trials(
    trials: Sequence[TrialSamples], alone: Mapping[int, SessionReading], limits: GateLimits
) -> list[str]:
    """The few trials without which forces that together are no person's are one's: half of them
    at most, which are nobody's even ``alone``, or fewer, which alone are understood alike and
    otherwise than the others; none if it may be these or those, nor half against a correction."""
    some = list(alone)
    own = {k: (one.frame, [x.reading for x in one.plates.values()]) for k, one in alone.items()}
    refused = [k for k, one in alone.items() if one.is_refused]
    if 2 * len(refused) > len(some):
        return []
    alike = [[k for k in some if own[k] == own[first]] for first in some]
    few = [list(one) for one in dict.fromkeys(map(tuple, alike)) if 2 * len(one) < len(some)]
    may_be = [refused] if refused else few
    rest = [[one for k, one in enumerate(trials) if k not in gone] for gone in may_be]
    clear = [
        gone
        for gone, others in zip(may_be, rest, strict=True)
        if any(one.sources for one in others)
        and not (found := session_reading(others, limits)).refusals()
        and (found.is_as_stated or 2 * len(gone) < len(some))
    ]
    return [trials[k].name for k in clear[0]] if len(clear) == 1 else []


def _reading_of_own(
    read: Callable[..., Sequence[TrialSamples]],
    stated_kg: float | None,
    stated_m: float | None,
    gross_percent: float,
    limits: GateLimits,
) -> SessionReading:
    """As `reading_of_files` has it, of trials that all count."""
    surely, trials = limits.corrected_percent / 100, read()
    written, masses = AS_WRITTEN, [one.mass_kg for one in trials if one.mass_kg]
    if masses:
        mass_kg, height_m = float(np.median(masses)), _height_m(trials, stated_m)
        if name := force_unit(mass_kg, stated_kg, height_m, gross_percent, surely):
            written = Written(force_N(name, stated_kg))
            trials = read(written)
    best = replace(session_reading(trials, limits), written=written)
    most = best.log_posterior + float(np.log(surely / (1 - surely)))
    # Markers and forces last alike if the times of either are wrong; forces are as large as the
    # accelerations then if it is the right one.
    for pace, odds in likely_paces([one.lengths for one in trials]).items():
        either = replace(written, pace=pace), replace(written, force_pace=1 / pace)
        found = [session_reading(read(one), limits) for one in either]
        if (log := max(one.log_posterior for one in found) + odds) > most:
            of_forces, most = float(expit(log_odds_of(found[0].of_paces, 1 / pace))), log
            k = int(of_forces > 0.5)
            share = max(of_forces, 1 - of_forces)
            as_written = replace(either[k], probability=1.0 if share >= surely else share)
            best = replace(found[k], written=as_written)
    return best


def session_reading(trials: Sequence[TrialSamples], limits: GateLimits = USUAL) -> SessionReading:
    """The axes and the plates' readings that make a person of a session, and the delays of single
    trials: what either may explain, the likelier does."""
    best = _reading(trials, limits)
    for k, trial in enumerate(trials):
        late = {one.delay: [*trials[:k], one, *trials[k + 1 :]] for one in trial.late}
        found = {delay: _reading(some, delay.limits(limits)) for delay, some in late.items()}
        logs = {delay: one.log_posterior for delay, one in found.items()}
        if (delay := surest(logs, best.log_posterior, limits)) is not None:
            trials = late[delay]
            best = _reading(trials, limits)
    delays = {trial.name: trial.delay.seconds for trial in trials if trial.delay.seconds}
    drifts = {trial.name: trial.drift_s for trial in trials if trial.drift_s}
    return replace(best, delays_s=delays, drifts_s=drifts)


def _reading(trials: Sequence[TrialSamples], limits: GateLimits) -> SessionReading:
    is_mirrored = Handedness.of_all([trial.hands for trial in trials]).sign < 0
    changes = MIRRORS if is_mirrored else (FrameChange(), *FORCES_MOVED)
    repeats = repeated_plates([one.sources for one in trials], [one.smooth for one in trials])
    trials = [trial.without(repeats) for trial in trials if trial.sources]
    if not trials:
        return SessionReading(changes[0])
    hypotheses = [Hypothesis.as_stated(change, trials, limits) for change in changes]
    if (turn := hypotheses[0].odd_turn()) is not None:
        hypotheses.append(Hypothesis.as_stated(turn, trials, limits))
    chosen = _corrected(hypotheses)
    verdicts = {name: _verdict(hypotheses[0].fits[name], chosen, name) for name in chosen.of.fits}
    repeated = {name: Verdict(repeats=others) for name, others in repeats.items()}
    if chosen.is_no_person and (found := _without_others_loads(trials, verdicts, limits)):
        return replace(found, plates={**found.plates, **repeated})
    return SessionReading(
        chosen.of.frame,
        verdicts | repeated,
        paces=chosen.of.paces(limits.corrected_percent),
        maybe_paces=chosen.of.paces(100 - limits.believed_percent),
        log_posterior=chosen.of.log_posterior + sum(one.delay.log_posterior for one in trials),
        of_paces=tuple(one.tolist() for one in chosen.of.of_paces.values()),
    )


def _without_others_loads(
    trials: Sequence[TrialSamples], verdicts: Mapping[str, Verdict], limits: GateLimits
) -> SessionReading | None:
    """Where some plates' loads lie beside the feet, which all stand on the others: a thing or
    another person on a plate says nothing against those. None where these make no person either."""
    beside = {name: one for name, one in verdicts.items() if one.refusal not in ("", AGAINST)}
    rest = [trial.without(beside) for trial in trials]
    rest = [trial for trial in rest if trial.sources]
    if not beside or not rest or not all(trial.bears_all_feet() for trial in rest):
        return None
    found = _reading(rest, limits)
    if any(one.refusal for one in found.plates.values()):
        return None
    log_posterior = found.log_posterior + _UNKNOWN
    return replace(found, plates={**found.plates, **beside}, log_posterior=log_posterior)


# --- the choice -------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Choice:
    """The hypothesis that is believed; and, where the trials cannot distinguish it from others, the
    repairs of each plate that would do, in words, and what of it is in doubt, if it is believed
    all the same; or none makes a person."""

    of: Hypothesis
    alternatives: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    doubted: Doubted = ""
    is_no_person: bool = False


def _corrected(stated: Sequence[Hypothesis]) -> _Choice:
    """The readings after every repair that is sure, one after the other.

    Repairs in other axes are tried only where the files cannot be taken as they are.
    """
    now, others = stated[0], stated[1:]
    for _ in range(len(now.fits) + 2):
        tried = [now, *others, *now.with_one_more()]
        choice = _surest(tried)
        is_sure = not (choice.alternatives or choice.is_no_person)
        if others and not (choice.of is now and is_sure and not now.frame.moved):
            choice = _surest([*tried, *(one for o in others for one in o.with_one_more())])
        if choice.of is now:
            break
        now, others = choice.of, ()
    return choice


def _surest(tried: Sequence[Hypothesis]) -> _Choice:
    """The surest; the first, with alternatives, if none is sure."""
    now, limits = tried[0], tried[0].limits
    believed, corrected = limits.believed_percent / 100, limits.corrected_percent / 100
    logs = np.array([one.log_posterior for one in tried])
    leans = sum(np.isfinite(fit.found[:, -1]).sum() for fit in now.fits.values())
    seen = leans + sum(1 + len(trial.sources) for trial in now.trials)
    likeliest = int(np.argmax(logs))
    if likeliest:  # a gain makes other repairs look likely
        logs[[0, likeliest]] = [tried[k].log_posterior_of_gains() for k in (0, likeliest)]
    best = tried[int(np.argmax(logs))]
    # A fault that no reading mends; that the file's moments have no lever is none.
    nobody = sum(fit.log_likelihood_of_nobody() for fit in now.fits.values())
    unknown = _UNKNOWN + _UNKNOWN_EACH * seen + nobody
    # Forces that go with the motion may still lie beside the feet.
    goes = max(best.balance.drive_log_likelihood(), 0.0)
    if unknown + goes - logsumexp([*logs, unknown + goes]) > np.log(_SURELY_NOBODY):
        return _Choice(now, is_no_person=True)
    logs -= logsumexp([*logs, unknown])
    likely = [k for k in range(len(tried)) if logs[k] > _LEAST_LIKELY]
    like_now = {0, *(k for k in likely if now.is_alike(tried[k]))}
    if np.exp(logsumexp(logs[list(like_now)])) >= (corrected if now.frame.moved else believed):
        return _Choice(now)
    same = [k for k in likely if best.is_alike(tried[k])]
    # A further fault that the trials do not show is no more likely here than in a sound file.
    unlikely = [k for k in likely if logs[k] < np.log(1 - corrected) and tried[k].goes_beyond(best)]
    if np.exp(logsumexp(logs[sorted({*same, *unlikely})])) >= corrected:
        return _Choice(best)
    some = [now, *(tried[k] for k in likely if logs[k] > np.log(1 - corrected))]
    words = {name: dict.fromkeys(one.words(name, now) for one in some) for name in now.fits}
    alternatives = {name: tuple(all_) for name, all_ in words.items() if set(all_) != {AS_IT_IS}}
    if all(now.is_alike(one, torque=False) for one in some):
        return _Choice(now, alternatives, "vertical moment")
    return _Choice(now, alternatives, _ALL if best is now and not now.frame.moved else "")


# --- what is said of it -----------------------------------------------------------------------


def _verdict(stated: PlateFit, chosen: _Choice, name: str) -> Verdict:
    fit, alternatives = chosen.of.fits[name], chosen.alternatives.get(name, ())
    before, after = stated.evidence(), fit.evidence()
    fault = _fault(after)
    if not fault and not chosen.doubted:
        fault = _UNTOLD if alternatives else AGAINST if chosen.is_no_person else ""
    if fault:
        return Verdict(fit.reading, before, after, refusal=fault, alternatives=alternatives)
    is_loaded = np.isfinite([after.distance_m, after.outside_m]).any()
    doubted: Doubted = chosen.doubted if alternatives and is_loaded else ""
    return Verdict(_with_outline(fit), before, after, alternatives=alternatives, doubted=doubted)


def _fault(found: Evidence) -> str:
    """Why this is no force under a foot, as a clause; empty if it may be one."""
    if found.distance_m > BESIDE_M:
        return f"its centre of pressure lies {found.distance_m:.2f} m beside the feet on the ground"
    if not np.isfinite(found.distance_m) and found.outside_m > BESIDE_M:
        return f"its centre of pressure lies {found.outside_m:.2f} m outside the plate"
    if found.rolls_m < STAYS_M:
        spread = f"its centre of pressure spreads by {1e3 * found.rolls_m:.1f} mm only"
        return f"{spread} while the body passes over it, as if its moments were too small"
    if np.isfinite(found.above_m) and not is_on_surface(found.above_m):
        way = "below" if found.above_m > 0 else "above"
        return f"its surface lies {abs(found.above_m):.2f} m {way} the foot's lowest marker on it"
    return ""


def _with_outline(fit: PlateFit) -> PlateReading:
    """With a wider outline where the load lies under a foot but beside the stated one."""
    plates = [one.source.plate(fit.reading) for one in fit.trials]
    offsets = [
        outline(plate.cop_m(one.source.floor_m(fit.reading)), plate.corners_m)
        for one, plate in zip(fit.trials, plates, strict=True)
        if plate.corners_m is not None
    ]
    along = np.concatenate([each for each, _ in offsets] or [np.zeros((0, 2))])
    if not len(along) or (along > (half := offsets[0][1])).any(axis=1).mean() < _MOSTLY_OUTSIDE:
        return fit.reading
    x, y = np.maximum(np.nanpercentile(along, 99, axis=0) + _RIM_M, half).tolist()
    return replace(fit.reading, half_size_m=(x, y))
