"""extend: the model with the named causes, compared with RM and OM.

Of a person the parameters identified again, of each trial the extended model's wrench and its gain
on data not used to size it, of the person what that gains over all trials that it concerns.
"""

from __future__ import annotations

from dataclasses import asdict, replace
from zlib import crc32

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.body.person import Person
from bsip_cli.diagnosis.cause import (
    Blocks,
    Cause,
    change_by,
    corrected_wrench,
    method_of,
    unseen_change_by,
)
from bsip_cli.effects.joints import AXES, MissingJoint, split_torso
from bsip_cli.effects.scene import Scene
from bsip_cli.identification.uncertainty import readable
from bsip_cli.report.records import with_all_causes
from bsip_cli.report.verdict import change_sentence, gain_sentence
from bsip_cli.report.words import segment_label
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import column_names
from bsip_cli.stages import identification_problem, reconstruct
from bsip_cli.stages.frames import WRENCH, bsip_table, load_phi, person_of
from bsip_cli.stages.trial_scene import blocks_of, body_as_sized, causes_of, scene_of
from bsip_cli.statistics.choice import BlockErrors, block_errors, pooled
from bsip_cli.statistics.methods import MEASURED, OM, RM, is_extended
from bsip_cli.study.study import Trial

_COM = ["com_x_m", "com_y_m", "com_z_m"]
_COM_CHANGE = ["com_x_change_m", "com_y_change_m", "com_z_change_m"]


def run_person(unit: Unit) -> None:
    """Read the diagnosis and what identified OM; write the extended model's parameters."""
    person = person_of(unit)
    causes = causes_of(unit)
    bent = [cause for cause in causes if isinstance(cause.effect, MissingJoint)]
    parts = _torso_rows(person, bent[0]) if bent else empty_table("extended-skeleton")
    unit.write("extended-skeleton", parts)
    bsip, stems = unit.read("bsip"), set(unit.read("used-blocks")["trial"])
    trials = [trial for trial in unit.trials("kinematics", "wrench") if trial.stem in stems]
    if causes and not trials:
        unit.say("nothing was identified, so there is no OM to extend")
    if not causes or not trials:
        unit.write("extended-bsip", ())
        unit.write("bsip-change", ())
        return
    extended = _extended(unit, person, bsip, causes, trials)
    changes = _changes(bsip, extended)
    unit.write("extended-bsip", extended)
    unit.write("bsip-change", changes)
    unit.say(change_sentence(with_all_causes(changes)))


# --- parameters -------------------------------------------------------------------------------


def _extended(
    unit: Unit, person: Person, bsip: pd.DataFrame, causes: tuple[Cause, ...], trials: list[Trial]
) -> pd.DataFrame:
    methods, parameters = reconstruct.parameters_of(bsip, person)
    phi = body_as_sized(unit, parameters[:, methods.index(RM)])
    concerned = {stem for cause in causes for stem in cause.trials}
    scenes = {t.stem: scene_of(unit, person, phi, t) for t in trials if t.stem in concerned}
    rows = bsip[bsip["method"] == OM]
    changes: dict[str, np.ndarray] = {}
    tables = []
    for k, cause in enumerate(causes):
        touched = [stem for stem in cause.trials if stem in scenes]
        for stem in touched:
            known = [one for one in causes[: k + 1] if stem in one.trials]
            changes[stem] = change_by(known, scenes[stem])
        if touched:
            rows = _identified(unit, person, trials, changes)
        tables.append(rows.assign(method=method_of(causes[: k + 1])))
    return pd.concat(tables, ignore_index=True)


def _identified(
    unit: Unit, person: Person, trials: list[Trial], changes: dict[str, np.ndarray]
) -> pd.DataFrame:
    """OM's estimate after ``changes`` are taken off the measured wrench."""
    prior = identification_problem.prior_from(unit, unit.read("regression"), person)
    recordings, _ = identification_problem.recordings_of(unit, person, trials, changes)
    problem, _ = identification_problem.problem_of(unit, person, prior, recordings)
    # the estimator that identified OM, whatever is configured now
    estimator = str(unit.read("identification").set_index("method")["estimator"][OM])
    found = readable(identification_problem.estimate_by(estimator, problem), prior)
    return bsip_table(OM, person.skeleton.body_names, found.values, found.sd, found.share)


# --- what the causes had done -----------------------------------------------------------------


def _changes(bsip: pd.DataFrame, extended: pd.DataFrame) -> pd.DataFrame:
    om = bsip[bsip["method"] == OM].set_index("segment")
    tables = []
    for method in dict.fromkeys(extended["method"]):
        after = extended[extended["method"] == method].set_index("segment")
        shift = (after[["mass_kg", *_COM]] - om.loc[after.index, ["mass_kg", *_COM]]).to_numpy()
        mass, length = shift[:, 0], np.linalg.norm(shift[:, 1:], axis=1)
        table = pd.DataFrame({"method": method, "segment": list(after.index)})
        table[["mass_change_kg", *_COM_CHANGE]] = shift
        table["com_change_m"] = length
        words: list[list[str]] = [[] for _ in mass]
        for name, sizes in (("mass", np.abs(mass)), ("centre of mass", length)):
            if sizes.max() > 0:
                words[int(sizes.argmax())].append(name)
        table["largest"] = [" and ".join(found) for found in words]
        table["sentence"] = [
            f"{segment_label(segment)}: mass {m:+.3f} kg, centre of mass moved by {1000 * x:.1f} mm"
            for segment, m, x in zip(after.index, mass, length, strict=True)
        ]
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


# --- skeleton ---------------------------------------------------------------------------------


def _torso_rows(person: Person, cause: Cause) -> pd.DataFrame:
    """The two parts of the torso, whose second joint was named."""
    split = split_torso(person, cause.target, cause.values)
    skeleton, i = person.skeleton, person.skeleton.index(split.segment)
    below, above = f"{split.segment}_below", f"{split.segment}_above"
    whole = person.origin_in_joint_m[i]
    shares = np.array(split.shares)
    parent = skeleton.segments[skeleton.parents[i]]
    parts = (
        (below, parent, skeleton.joints[i], person.joint_in_parent_m[i], split.below, 1 - shares),
        (above, below, "T12/L1", split.joint_m, 1 - split.below, shares),
    )
    columns = ["segment", "parent", "joint", "joint_x_m", "joint_y_m", "joint_z_m", "mass_share"]
    rows = [(*names, *place, part, *turned) for *names, place, part, turned in parts]
    table = pd.DataFrame(rows, columns=[*columns, *(f"{axis}_share" for axis in AXES)])
    table["length_m"] = table["mass_share"] * float(np.linalg.norm(whole))
    return table[column_names("extended-skeleton")]


# --- a trial: the extended model, RM and OM -----------------------------------------------------


def run_trial(unit: Unit) -> None:
    """Read the causes, motion, wrench and parameters; write the gain, amend the comparison."""
    causes, extended = causes_of(unit), unit.read("extended-bsip")
    own = [k for k, cause in enumerate(causes) if unit.own_trial.stem in cause.trials]
    if not own or extended.empty:
        for kind in ("gain", "corrected-wrench"):
            unit.write(kind, ())
        for kind in ("reconstruction", "fit"):
            unit.amend(kind, empty_table(kind))  # RM and OM stand alone
        return
    person = person_of(unit)
    measured = unit.read("wrench")
    judgement = reconstruct.judgement_of(unit, unit.read("kinematics"), measured)
    blocks = blocks_of(unit, unit.own_trial.stem)
    # the body for which the causes were sized, and those of OM and of each extended model
    methods, phi = reconstruct.parameters_of(pd.concat([unit.read("bsip"), extended]), person)
    scene = scene_of(unit, person, body_as_sized(unit, phi[:, methods.index(RM)]))
    carried = phi + load_phi(unit, person)[:, None]
    parameters = dict(zip(methods, carried.T, strict=True))
    fold = blocks.fold_of(judgement.times_s)
    raw: reconstruct.Wrenches = {
        MEASURED: measured[WRENCH].to_numpy(),
        OM: scene.wrench_of(parameters[OM]),
    }
    for place, k in enumerate(own):
        among = [causes[j] for j in own[: place + 1]]
        predicted = scene.wrench_of(parameters[method_of(causes[: k + 1])])
        raw[method_of(among)] = predicted + unseen_change_by(among, scene, fold)
    wrenches, signals = judgement.compared(raw)
    ours = [name for name in signals if is_extended(name)]
    rows = reconstruct.reconstruction_rows(
        judgement, {name: wrenches[name] for name in ours}, signals
    )
    unit.amend("reconstruction", rows)
    alike = reconstruct.over_the_same_frames(signals)
    unit.amend(
        "fit", reconstruct.fit_rows(judgement, {name: alike[name] for name in (MEASURED, *ours)})
    )
    last = list(signals)[-1]
    errors = _errors(judgement, signals, last, blocks)
    rows = reconstruct.gain_rows(
        errors, last, _held_out(unit, judgement), crc32(unit.name.encode())
    )
    sums = {  # per block, for the gain over all trials
        component: {name: values.tolist() for name, values in asdict(one).items()}
        for component, one in errors.items()
    }
    unit.write("gain", rows, facts={"method": last, "data": judgement.data, "blocks": sums})
    unit.write("corrected-wrench", _corrected(scene, measured, [causes[k] for k in own]))


def _errors(
    judgement: reconstruct.Judgement, signals: reconstruct.Signals, method: str, blocks: Blocks
) -> dict[str, BlockErrors]:
    judged, errors = judgement.judged, {}
    numbers = blocks.of(judgement.times_s)[judged]
    for component in signals[MEASURED]:
        scale, _ = reconstruct.scale_of(component)
        compared = (scale * signals[name][component][judged] for name in (MEASURED, OM, method))
        measured, before, after = compared
        errors[component] = block_errors(measured, before, after, numbers)
    return errors


def _held_out(unit: Unit, judgement: reconstruct.Judgement) -> str:
    facts = unit.facts("overall-diagnosis")
    sizes = f"blocks of {facts['block_s']:g} s, in {facts['folds']} folds, each judged with the "
    sizes += "sizes of the causes that the other folds gave"
    by = "the trial was held out of the identification"
    if judgement.data != "held_out":
        by = "the trial was used in the identification"
    elif judgement.used.any():
        by = "the judged seconds were held out of the identification, others of the trial not"
    return f"{judgement.data}: {sizes}; {by}"


# --- forces without their errors --------------------------------------------------------------


def _corrected(scene: Scene, measured: pd.DataFrame, causes: list[Cause]) -> pd.DataFrame:
    if not any(cause.effect.of_the_forces for cause in causes):
        return empty_table("corrected-wrench")
    of_the_plates = replace(scene, valid=measured["valid"].to_numpy())
    wrench, valid = corrected_wrench(of_the_plates, measured[WRENCH].to_numpy(), causes)
    table = pd.DataFrame(wrench, columns=WRENCH)
    table.insert(0, "time_s", scene.times_s)
    return table.assign(valid=valid)


# --- the gain over all trials ---------------------------------------------------------------------


def run_gain(unit: Unit) -> None:
    """Read the trials' gains with their sums per block; write the person's."""
    facts = {trial.stem: unit.facts("gain", trial) for trial in unit.trials("gain")}
    concerned = {stem: one for stem, one in facts.items() if one}
    if not concerned:
        unit.write("overall-gain", ())
        return
    errors = {}
    for component in next(iter(concerned.values()))["blocks"]:
        sums = [one["blocks"][component].items() for one in concerned.values()]
        each = [BlockErrors(**{name: np.array(x) for name, x in one}) for one in sums]
        errors[component] = pooled(each)
    methods = dict.fromkeys(one["method"] for one in concerned.values())
    seed = crc32(unit.name.encode())
    data = "; ".join(
        f"{kind}: {', '.join(stem for stem, one in concerned.items() if one['data'] == kind)}"
        for kind in dict.fromkeys(one["data"] for one in concerned.values())
    )  # held_out: a, b; identification: c
    rows = reconstruct.gain_rows(errors, ", ".join(methods), data, seed)
    unit.write("overall-gain", rows)
    unit.say(gain_sentence(rows) or "no error could be compared")
