"""joints: net forces, moments and powers at the joints, per method, with standard deviations."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import interp1d
from scipy.spatial.transform import Rotation

from bsip_cli.artifacts import table_of
from bsip_cli.body.person import Person
from bsip_cli.diagnosis.cause import Cause, corrected_plates, method_of
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.dynamics.joint_moments import (
    Ground,
    JointLoads,
    Spread,
    axes_of,
    joint_loads,
    of_accelerations,
)
from bsip_cli.dynamics.lowpass import lowpass_operator, noise_left, stride_to
from bsip_cli.dynamics.segment_motion import SegmentMotion, segment_motion
from bsip_cli.effects.body import SegmentInertia
from bsip_cli.effects.loads import UnmeasuredContact
from bsip_cli.effects.plates import GravityTilt, Turned
from bsip_cli.effects.scene import Scene
from bsip_cli.motion.inverse_kinematics import coordinate_information
from bsip_cli.recordings.contacts import SIDES, FootForces, foot_forces, plate_noise
from bsip_cli.recordings.model import Plate
from bsip_cli.report.words import count, listing
from bsip_cli.running.unit import Unit
from bsip_cli.segments import in_words
from bsip_cli.stages.frames import (
    TrialSignals,
    load_phi,
    loads_record,
    parameters_of,
    person_of,
    signals_of,
)
from bsip_cli.stages.trial_scene import causes_of, extended_models, outline
from bsip_cli.statistics.methods import OM, RM, is_extended

_POSES = 40  # in which the response to accelerations is computed; between them it is interpolated
_WEAK_PRIOR = 200.0  # rad/m, as in smoothing: an angle that errs by more is held by the prior
_UNSEEN = "no markers show how the segment moves"
_BORNE = "a hand or another segment bears part of the body"
_HELD = "something that no plate measures may bear the person"
Reasons = dict[str, np.ndarray]  # in words: (N, J) frames and joints that it leaves out
_SHARED = "nothing shows what each of two hands bears of one load"
_NO_POSE = "the markers do not determine the pose"
_SIDES = {"l": "left", "r": "right"}
_FIT = (SegmentInertia, Turned)  # effects with which the motion stays, or is turned as a whole


def run(unit: Unit) -> None:
    """Read motion, plates, contacts and parameters; write joint-moments and joint-peaks."""
    person = person_of(unit)
    trial = trial_of(unit, person)
    methods, phi = parameters_of(unit.read("bsip"), person)
    spread = _spreads(unit, person, methods)
    feet, on_feet = trial.ground(trial.readings)
    reasons = _reasons(unit, trial, feet)
    counts = {words: out.sum(axis=0).tolist() for words, out in reasons.items()}
    _report(unit, trial, counts)
    left_out = {
        joint: "; ".join(f"{words}: {count(n[j], 'frame')}" for words, n in counts.items() if n[j])
        for j, joint in enumerate(person.skeleton.joints[1:])
    }
    noise = _of_accelerations(trial, phi[:, -1])
    known = load_phi(unit, person)[:, None]
    loads = trial.loads(phi + known, on_feet, spread)
    tables = [_table(trial, methods, loads, _left(reasons), noise)]
    for method, its_loads, ok in _extended(unit, trial, methods, spread):
        tables.append(_table(trial, [method], its_loads, ok, noise))
    table = pd.concat(tables, ignore_index=True)
    unit.write("joint-moments", table, facts={"loads": loads_record(unit)})
    mass_kg = float(unit.read("person")["mass_kg"].iloc[0])
    unit.write("joint-peaks", peaks_of(table, mass_kg, left_out))


# --- what was measured ------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Trial(TrialSignals):
    """A trial with its plates, and with the feet by side: points (N, k, 3), contacts (N,)."""

    person: Person
    readings: Mapping[str, Plate]
    feet_m: dict[str, np.ndarray]
    on_ground: dict[str, np.ndarray]
    on_plate: dict[str, np.ndarray]
    cutoff_hz: float

    def loads(self, phi: np.ndarray, touched: Mapping[str, Ground], spread: Spread) -> JointLoads:
        """Of bodies phi (P, k); their errors change no faster than what the low-pass leaves."""
        every = stride_to(self.rate_hz, 2 * self.cutoff_hz)
        motion = (self.q, self.v, self.a)
        return joint_loads(self.person, *motion, phi, touched, spread, every=every)

    def ground(self, by_plate: Mapping[str, Plate]) -> tuple[FootForces, dict[str, Ground]]:
        """Each foot's wrench, and by segment with its noise after the low-pass."""
        readings = tuple(by_plate.values())
        feet = foot_forces(readings, self.feet_m, self.on_ground, self.on_plate, self.rate_hz)
        left = np.sqrt(noise_left(self.rate_hz, self.cutoff_hz))
        on_feet = {}
        for side in SIDES:
            noise, at = np.zeros((len(self.q), 6)), np.zeros(3)
            if feet.plate[side].any():
                plate = readings[feet.plate[side].sum(axis=0).argmax()]
                if plate.corners_m is not None:
                    at = np.asarray(plate.corners_m.mean(axis=0))
                else:  # the middle of its load
                    loaded = np.nan_to_num(plate.lift_N) > 0
                    at = np.append(np.nanmedian(plate.cop_m()[loaded], axis=0), 0.0)
                noise[feet.plate[side].any(axis=1)] = left * plate_noise(plate, at)
            on_feet[f"foot_{side}"] = Ground(feet.wrench[side], noise, at)
        return feet, on_feet


def trial_of(unit: Unit, person: Person) -> _Trial:
    """Motion, plates and feet of the unit's trial."""
    signals, contacts = signals_of(unit, person), unit.read("contacts")
    corners = unit.read("plates")
    motion = segment_motion(pinocchio_model(person), signals.q, signals.v, signals.a)
    return _Trial(
        **vars(signals),
        person=person,
        readings={
            name: Plate(name, one, outline(corners, name), np.isfinite(one).all(axis=1))
            for name, one in signals.plates.items()
        },
        feet_m={side: _foot_points(person, motion, side) for side in SIDES},
        on_ground={s: contacts[f"{name}_on_ground"].to_numpy() for s, name in _SIDES.items()},
        on_plate={s: contacts[f"{name}_on_plate"].to_numpy() for s, name in _SIDES.items()},
        cutoff_hz=unit.config.joints.cutoff_hz,
    )


def _foot_points(person: Person, motion: SegmentMotion, side: str) -> np.ndarray:
    """(N, k, 3) the foot's markers as the pose puts them, and the ankle's centre."""
    i = person.skeleton.index(f"foot_{side}")
    own = person.markers_in_joint_m()[person.marker_segments == i]
    own = np.vstack([np.zeros(3), own])
    if len(own) == 1:
        own = np.vstack([own, [[person.lengths_m[i], 0.0, 0.0]]])
    turned = np.einsum("nij,kj->nki", motion.rotation[:, i], own)
    return motion.position_m[:, i, None] + turned


# --- what is not determined -------------------------------------------------------------------


def _reasons(unit: Unit, trial: _Trial, feet: FootForces) -> Reasons:
    """Why a joint's loads are not determined; J joints, all but the floating base."""
    skeleton, count = trial.person.skeleton, len(trial.q)
    every, unseen = slice(None), np.flatnonzero(trial.person.without_data()[1:])
    parts: list[tuple[str, Any, np.ndarray]]
    parts = [(_NO_POSE, every, ~trial.determined), (_UNSEEN, unseen, np.ones(count, bool))]
    if trial.readings:
        off_plate = np.any([trial.on_ground[s] & ~trial.on_plate[s] for s in SIDES], axis=0)
        parts.append((_HELD, every, ~trial.measured & ~off_plate))
    of_feet = ((f"foot_{side}", *one) for side in SIDES for one in feet.unknown[side].items())
    of_others = ((segment, _BORNE, frames) for segment, frames in _contacts(unit, trial))
    for segment, words, frames in (*of_feet, *of_others):
        parts.append((words, [i - 1 for i in skeleton.way(segment)], frames))
    found: Reasons = {}
    for words, joints, frames in parts:
        out = found.setdefault(words, np.zeros((count, len(skeleton.joints) - 1), bool))
        out[:, joints] |= frames[:, None]
    return found


def _left(reasons: Reasons) -> np.ndarray:
    """(N, J) joints that nothing leaves out."""
    return ~np.logical_or.reduce(list(reasons.values()))


def _contacts(unit: Unit, trial: _Trial) -> Iterator[tuple[str, np.ndarray]]:
    """Segments that touch something no plate measures, and (N,) when, as identify and diagnose
    found them."""
    contact = unit.facts("identification")["external_contacts"].get(unit.own_trial.stem)
    for hand in contact["hands"] if contact else ():
        yield hand, np.ones(len(trial.q), bool)
    for cause in causes_of(unit):
        if isinstance(cause.effect, UnmeasuredContact) and unit.own_trial.stem in cause.trials:
            middle, length = cause.values[3:5]
            yield cause.target, np.abs(trial.times_s - middle) <= length / 2


def _report(unit: Unit, trial: _Trial, counts: Mapping[str, Sequence[int]]) -> None:
    """Say what is left out: joints of one reason and number of frames together."""
    joints, parts = trial.person.skeleton.joints[1:], []
    for words, of_joints in counts.items():
        for frames in sorted(set(of_joints) - {0}, reverse=True):
            alike = [in_words(j) for j, n in zip(joints, of_joints, strict=True) if n == frames]
            which = "all joints" if len(alike) == len(joints) else listing(_legs(alike))
            parts.append(f"{which} in {frames} ({words})")
    if parts:
        all_of_them = count(len(trial.times_s), "frame")
        unit.say(f"joint moments left out of {all_of_them}: {'; '.join(parts)}")


def _legs(joints: list[str]) -> list[str]:
    """A whole leg, or both, by that name."""
    legs = {s: {f"{s} {joint}" for joint in ("hip", "knee", "ankle")} for s in ("left", "right")}
    whole = [side for side, own in legs.items() if own <= set(joints)]
    rest = [name for name in joints if not any(name in legs[side] for side in whole)]
    return [*(["both legs"] if len(whole) == 2 else [f"the {s} leg" for s in whole]), *rest]


# --- how sure ---------------------------------------------------------------------------------


def _spreads(unit: Unit, person: Person, methods: Sequence[str]) -> Spread:
    """Covariances of the parameters by method, the joint centres' error, and the frames'."""
    rows = unit.read("covariance", method=methods)
    names = [c for c in map(str, rows) if c.startswith("root_")]
    roots = {m: part[names].to_numpy() for m, part in rows.groupby("method")}
    covariances = tuple(roots[m] @ roots[m].T for m in methods)
    sd_m = unit.config.joints.centre_sd_m
    turns = turns_of_frames(person, sd_m, unit.config.ik.undetermined_sd_rad)
    return Spread(covariances, sd_m, turns)


def turns_of_frames(person: Person, landmark_sd_m: float, largest_rad: float) -> np.ndarray:
    """(n, 3, 3) covariance of the turn of each segment's frame in its own axes [rad2].

    A frame lies as the segment's markers and the joint centres at its ends do, and each of these
    may be off by ``landmark_sd_m`` in each direction: so a thigh is known worst about its length, a
    foot about the line from heel to toe. ``largest_rad``: where they lie on one line.
    """
    parents, joints_m = np.array(person.skeleton.parents), person.joint_positions_m()
    turns = []
    for i in range(len(parents)):
        own = person.markers_in_joint_m()[person.marker_segments == i]
        places = np.vstack([np.zeros(3), own, joints_m[parents == i]])
        places -= places.mean(axis=0)
        information = (places**2).sum() * np.eye(3) - places.T @ places
        turns.append(np.linalg.inv(information / landmark_sd_m**2 + np.eye(3) / largest_rad**2))
    return np.array(turns)


def _of_accelerations(trial: _Trial, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations (N, J, 3) of forces and moments by the noise of the accelerations: all
    coordinates are smoothed alike, so it is that of the pose, as the markers leave it, times one
    number, which the pelvis shows."""
    person = trial.person
    frames = np.flatnonzero(trial.determined)
    shape = (len(trial.q), len(person.skeleton.joints) - 1, 3)
    if not len(frames):
        return np.full(shape, np.nan), np.full(shape, np.nan)
    some = np.unique(frames[np.linspace(0, len(frames) - 1, _POSES).astype(int)])
    starts = np.array(person.skeleton.v_starts)
    joint = np.searchsorted(starts, range(trial.v.shape[1]), side="right") - 1
    known = ~person.without_data()[joint]
    information = coordinate_information(person, _columns(person, trial.q[some]), _WEAK_PRIOR)
    covariance = np.zeros_like(information)
    inner = np.linalg.inv(information[:, known][:, :, known])
    covariance[:, np.outer(known, known)] = inner.reshape(len(some), -1)
    of_pelvis = np.trace(covariance[:, :3, :3], axis1=1, axis2=2) / 3
    each = of_accelerations(person, trial.q[some], phi, covariance / of_pelvis[:, None, None])
    near = np.clip(np.arange(shape[0]), some[0], some[-1])
    signal = np.stack(each)
    if len(some) > 1:
        signal = interp1d(some, signal, axis=1)(near)
    force, moment = signal * trial.acceleration_noise[:, None, None]
    return force, moment


def _columns(person: Person, q: np.ndarray) -> np.ndarray:
    """(N, m, 3, nv) how the markers move for each unit velocity in poses (N, nq): so a marker of a
    body at rest is accelerated by a unit acceleration. No compiled code is loaded for a few poses.
    """
    model = pinocchio_model(person)
    each = np.tile(np.eye(model.nv), (len(q), 1))
    motion = segment_motion(model, np.repeat(q, model.nv, axis=0), np.zeros_like(each), each)
    places = zip(person.marker_segments, person.markers_in_joint_m(), strict=True)
    moved = np.stack([motion.point(i, place).acceleration_m_s2 for i, place in places], axis=1)
    return moved.reshape(len(q), model.nv, -1, 3).transpose(0, 2, 3, 1)


# --- with the causes that the diagnosis named --------------------------------------------------


def _extended(
    unit: Unit, trial: _Trial, methods: Sequence[str], spread: Spread
) -> Iterator[tuple[str, JointLoads, np.ndarray]]:
    """Method, loads and valid frames (N, J) of the extended models of this trial: forces freed of
    the errors of plates and clock, axes of their tilts; parameters as ``extend`` found them; what
    else a segment carries, as a ball in a hand, loads the joints on its way to the pelvis. OM's
    covariance stands for theirs: they come from the same data."""
    models = extended_models(unit, trial.person)
    if models is None:
        return
    of_om = replace(spread, covariances=(spread.covariances[methods.index(OM)],))
    for among, phi in models.steps:
        others = (one.effect for one in among if not one.effect.of_the_forces)
        fitting = (one.on_its_segment or isinstance(one, _FIT) for one in others)
        if not all(fitting):
            why = "what moves joints or markers would need another motion"
            unit.say(f"no joint moments of {method_of(among)}: {why}")
            return
        forces = [one for one in among if one.effect.of_the_forces]
        corrected = corrected_plates(replace(models.scene, valid=trial.measured), forces)
        freed = {
            name: replace(one, wrench=corrected.get(name, one.wrench))
            for name, one in trial.readings.items()
        }
        feet, on_feet = trial.ground(freed)
        q, upright = in_true_axes(trial.q, on_feet, among)
        touched = other_loads(replace(models.scene, q=q), upright, among)
        loads = replace(trial, q=q).loads(phi[:, None], touched, of_om)
        reasons = _reasons(unit, trial, feet)
        reasons[_SHARED] = np.tile(sharing(trial.person, among), (len(trial.q), 1))
        if reasons[_SHARED].any():
            unit.say(f"{method_of(among)}: joint moments are left out: {_SHARED}")
        yield method_of(among), loads, _left(reasons)


def sharing(person: Person, causes: Sequence[Cause]) -> np.ndarray:
    """(J,) joints on the way of one only of the segments that share a load: where the ways have met
    their sum counts, and that is known."""
    out = np.zeros(len(person.skeleton.joints), bool)
    for cause in causes:
        if cause.effect.on_its_segment:
            ways = [person.skeleton.way(segment) for segment in cause.target.split("+")]
            out[list(set().union(*ways).difference(set(ways[0]).intersection(*ways)))] = True
    return out[1:]


def in_true_axes(
    q: np.ndarray, on_feet: Mapping[str, Ground], causes: Sequence[Cause]
) -> tuple[np.ndarray, Mapping[str, Ground]]:
    """The motion (N, nq), and where the vertical is tilted the ground's wrenches too, turned about
    the world's origin until the axes are upright."""
    for cause in (one for one in causes if isinstance(one.effect, Turned)):
        turn = Rotation.from_rotvec([*-cause.values, 0.0])
        base = (turn * Rotation.from_quat(q[:, 3:7])).as_quat()
        back = turn.as_matrix().T  # Rotation.apply refuses tables of a file, which are read-only
        q = np.hstack([q[:, :3] @ back, base, q[:, 7:]])
        if isinstance(cause.effect, GravityTilt):
            turned = {}
            for foot, one in on_feet.items():
                wrench = np.hstack([x @ back for x in np.hsplit(one.wrench, 2)])
                turned[foot] = Ground(wrench, one.noise, one.noise_at_m @ back)
            on_feet = turned
    return q, on_feet


def other_loads(
    scene: Scene, on_feet: Mapping[str, Ground], causes: Sequence[Cause]
) -> dict[str, Ground]:
    """What acts on each segment: the ground, less what the causes at a segment need."""
    found = dict(on_feet)
    none = np.zeros((len(scene.times_s), 6))
    nothing = Ground(none, none, np.zeros(3))
    for cause in causes:
        if cause.effect.on_its_segment:
            held_by = cause.target.split("+")
            needs = cause.effect.change(scene, cause.target, cause.values) / len(held_by)
            for segment in held_by:
                there = found.get(segment, nothing)
                found[segment] = replace(there, wrench=there.wrench - needs)
    return found


# --- tables -----------------------------------------------------------------------------------


def _table(
    trial: _Trial,
    methods: Sequence[str],
    loads: JointLoads,
    valid: np.ndarray,
    noise: tuple[np.ndarray, np.ndarray],
) -> pd.DataFrame:
    """Rows of ``joint-moments``: forces and moments low-passed in the valid frames."""
    ok = valid[:, :, None, None] & np.isfinite(loads.moment_Nm)
    force, moment = (_lowpassed(trial, x, ok) for x in (loads.force_N, loads.moment_Nm))
    force_sd, moment_sd = (
        np.where(ok, np.hypot(sd, of_motion[..., None]), np.nan)
        for sd, of_motion in zip((loads.force_sd_N, loads.moment_sd_Nm), noise, strict=True)
    )
    power = replace(loads, moment_Nm=moment).power_W
    power_sd = moment_sd * np.abs(loads.rate_rad_s[..., None])
    numbers = {"force_N": force, "force_sd_N": force_sd, "moment_Nm": moment}
    numbers |= {"moment_sd_Nm": moment_sd, "power_W": power, "power_sd_W": power_sd, "valid": ok}
    keys = [(m, joint, axis) for m in methods for joint in loads.joints for axis in axes_of(joint)]
    words = {
        name: pd.Categorical(each, list(dict.fromkeys(each))).repeat(len(trial.times_s))
        for name, each in zip(("method", "joint", "axis"), zip(*keys, strict=True), strict=True)
    }
    # from frames, joints, axes, methods to rows: all frames of an axis, all axes of a joint, ...
    columns = {name: x.transpose(3, 1, 2, 0).ravel() for name, x in numbers.items()}
    times = {"time_s": np.tile(trial.times_s, len(keys))}
    return pd.DataFrame(times | words | columns, copy=False)


def _lowpassed(trial: _Trial, signals: np.ndarray, ok: np.ndarray) -> np.ndarray:
    """Signals (N, ...), each inside its own valid frames; NaN outside."""
    flat, good = signals.reshape(len(signals), -1), ok.reshape(len(ok), -1)
    found = np.full(flat.shape, np.nan)
    packed = np.packbits(good, axis=0)
    _, first, alike = np.unique(packed, axis=1, return_index=True, return_inverse=True)
    for number, column in enumerate(first):
        pattern, mine = good[:, column], np.flatnonzero(alike.ravel() == number)
        operator, frames = lowpass_operator(pattern, trial.rate_hz, trial.cutoff_hz)
        found[np.ix_(frames, mine)] = operator @ np.where(pattern[:, None], flat[:, mine], 0.0)
    return found.reshape(signals.shape)


def peaks_of(moments: pd.DataFrame, mass_kg: float, left_out: Mapping[str, str]) -> pd.DataFrame:
    """``joint-peaks`` of ``joint-moments``: a row per method, joint and axis, how large, how sure,
    and what the method changes; ``left_out`` in words, by joint."""
    columns, names = ["time_s", "moment_Nm", "moment_sd_Nm"], ["method", "joint", "axis"]
    groups = moments.groupby(names, sort=False, observed=True)
    signals: dict[Any, np.ndarray] = {key: rows[columns].to_numpy() for key, rows in groups}
    peaks = {key: _peak(signal) for key, signal in signals.items()}
    methods, rows = list(dict.fromkeys(method for method, *_ in signals)), []
    for (method, joint, axis), signal in signals.items():
        before = [m for m in methods[: methods.index(method)] if is_extended(m)]
        # RM; of an extended model the one with a cause less
        usual = OM if is_extended(method) else RM * (method != RM)
        other = before[-1] if is_extended(method) and before else usual
        time_s, peak, sd = peaks[method, joint, axis]
        row = {"method": method, "joint": joint, "axis": axis, "left_out": left_out[joint]}
        row |= {"peak_Nm": peak, "peak_sd_Nm": sd, "peak_Nm_kg": peak / mass_kg}
        row |= {"peak_at_s": time_s, "frames": int(np.isfinite(signal[:, 1]).sum())}
        row |= dict.fromkeys(("change_Nm", "change_rms_Nm", "change_percent"), np.nan)
        row["compared_with"] = other
        change = signal[:, 1] - signals[other, joint, axis][:, 1] if other else np.empty(0)
        change = change[np.isfinite(change)]
        if len(change):
            most = change[np.abs(change).argmax()]
            largest = np.nanmax([abs(peaks[k][1]) for k in peaks if k[:2] == (other, joint)])
            row |= {"change_Nm": most, "change_rms_Nm": np.sqrt((change**2).mean())}
            row["change_percent"] = 100 * abs(most) / largest
        rows.append(row)
    return table_of("joint-peaks", rows)


def _peak(signal: np.ndarray) -> np.ndarray:
    """The row (3,) of time, moment and standard deviation (N, 3) with the largest moment."""
    known = signal[np.isfinite(signal[:, 1])]
    return known[np.abs(known[:, 1]).argmax()] if len(known) else np.full(3, np.nan)
