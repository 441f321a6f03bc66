"""extend: the model with the named causes, compared with RM and OM.

Of a person the parameters identified again, of each trial the extended model's wrench and its gain
on data not used to size it, of the person what that gains over all trials that it concerns.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, replace
from zlib import crc32

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table, table_of
from bsip_cli.body.person import Person
from bsip_cli.diagnosis.cause import (
    Cause,
    change_by,
    corrected_wrench,
    method_of,
    unseen_change_by,
)
from bsip_cli.effects.body import AXES, MissingJoint, split_torso
from bsip_cli.identification.uncertainty import readable
from bsip_cli.report.records import with_all_causes
from bsip_cli.report.verdict import change_sentence, gain_sentence
from bsip_cli.report.words import segment_label
from bsip_cli.running.unit import Unit
from bsip_cli.stages import identification_problem, reconstruct
from bsip_cli.stages.frames import WRENCH, XYZ, bsip_table, columns, parameters_of, person_of
from bsip_cli.stages.trial_scene import (
    blocks_of,
    body_as_sized,
    causes_of,
    extended_models,
    scene_of,
)
from bsip_cli.statistics.choice import BlockErrors, block_errors, pooled
from bsip_cli.statistics.methods import MEASURED, OM, RM, is_extended
from bsip_cli.study.study import Trial


def run_person(unit: Unit) -> None:
    """Read the diagnosis and what identified OM; write the extended model's parameters."""
    person = person_of(unit)
    causes = causes_of(unit)
    bent = [cause for cause in causes if isinstance(cause.effect, MissingJoint)]
    unit.write("extended-skeleton", list(_torso_rows(person, bent[0])) if bent else ())
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
    methods, parameters = parameters_of(bsip, person)
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
    numbers = ["mass_kg", "com_x_m", "com_y_m", "com_z_m"]
    changes = ["mass_change_kg", "com_x_change_m", "com_y_change_m", "com_z_change_m"]
    om = bsip[bsip["method"] == OM].set_index("segment")[numbers]
    rows = []
    for method, after in extended.groupby("method", sort=False):
        after = after.set_index("segment")[numbers]
        shifts = (after - om.loc[after.index]).to_numpy()
        lengths = np.linalg.norm(shifts[:, 1:], axis=1)
        sizes = {"mass": np.abs(shifts[:, 0]), "centre of mass": lengths}
        largest = {name: int(x.argmax()) for name, x in sizes.items() if x.max() > 0}
        for k, segment in enumerate(after.index):
            row = {"method": method, "segment": segment, "com_change_m": lengths[k]}
            row |= dict(zip(changes, shifts[k], strict=True))
            row["largest"] = " and ".join(name for name, at in largest.items() if at == k)
            mass = f"mass {shifts[k, 0]:+.3f} kg"
            moved = f"centre of mass moved by {1000 * lengths[k]:.1f} mm"
            rows.append(row | {"sentence": f"{segment_label(segment)}: {mass}, {moved}"})
    return table_of("bsip-change", rows)


# --- skeleton ---------------------------------------------------------------------------------


def _torso_rows(person: Person, cause: Cause) -> Iterator[dict[str, object]]:
    """The two parts of the torso, whose second joint was named."""
    split = split_torso(person, cause.target, cause.values)
    skeleton, i = person.skeleton, person.skeleton.index(split.segment)
    below, above = f"{split.segment}_below", f"{split.segment}_above"
    length_m = float(np.linalg.norm(person.origin_in_joint_m[i]))
    shares = np.array(split.shares)
    parent = skeleton.segments[skeleton.parents[i]]
    parts = (
        (below, parent, skeleton.joints[i], person.joint_in_parent_m[i], split.below, 1 - shares),
        (above, below, "T12/L1", split.joint_m, 1 - split.below, shares),
    )
    for segment, parent, joint, place, share, turned in parts:
        row = {"segment": segment, "parent": parent, "joint": joint, "mass_share": share}
        row |= dict(zip([f"joint_{name}" for name in XYZ], place, strict=True))
        row |= dict(zip([f"{axis}_share" for axis in AXES], turned, strict=True))
        yield row | {"length_m": share * length_m}


# --- a trial: the extended model, RM and OM -----------------------------------------------------


def run_trial(unit: Unit) -> None:
    """Read the causes, motion, wrench and parameters; write the gain, amend the comparison."""
    models = extended_models(unit, person_of(unit))
    if models is None:
        for kind in ("gain", "corrected-wrench"):
            unit.write(kind, ())
        for kind in ("reconstruction", "fit"):
            unit.amend(kind, empty_table(kind))  # RM and OM stand alone
        return
    scene, blocks = models.scene, blocks_of(unit, unit.own_trial.stem)
    judgement = reconstruct.judgement_of(unit, scene.times_s, scene.valid)
    fold, measured = blocks.fold_of(scene.times_s), unit.read("wrench")
    raw = {MEASURED: measured[WRENCH].to_numpy(), OM: scene.wrench_of(models.om)}
    for causes, phi in models.steps:
        raw[method_of(causes)] = scene.wrench_of(phi) + unseen_change_by(causes, scene, fold)
    signals = judgement.compared(raw)
    ours = [name for name in signals if is_extended(name)]
    rows = reconstruct.reconstruction_rows(judgement, {name: signals[name] for name in ours})
    unit.amend("reconstruction", rows)
    alike = reconstruct.over_the_same_frames(signals, judgement.judged)
    alike = {name: alike[name] for name in (MEASURED, *ours)}
    unit.amend("fit", reconstruct.fit_rows(judgement, alike))
    numbers, errors = blocks.of(scene.times_s)[judgement.judged], {}
    for component in signals[MEASURED]:
        scale, _ = reconstruct.scale_of(component)
        of_all = (scale * signals[name][component] for name in (MEASURED, OM, ours[-1]))
        compared, before, after = (one[judgement.judged] for one in of_all)
        errors[component] = block_errors(compared, before, after, numbers)
    known = ours[-1], _held_out(unit, judgement), crc32(unit.name.encode())
    rows = reconstruct.gain_rows(errors, *known)
    sums = {  # per block, for the gain over all trials
        component: {name: values.tolist() for name, values in asdict(one).items()}
        for component, one in errors.items()
    }
    unit.write("gain", rows, facts={"method": ours[-1], "data": judgement.data, "blocks": sums})
    corrected = empty_table("corrected-wrench")
    if any(cause.effect.of_the_forces for cause in causes):
        of_the_plates = replace(scene, valid=measured["valid"].to_numpy())
        wrench, valid = corrected_wrench(of_the_plates, raw[MEASURED], causes)
        freed = {"time_s": scene.times_s} | columns(WRENCH, wrench) | {"valid": valid}
        corrected = pd.DataFrame(freed)
    unit.write("corrected-wrench", corrected)


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
