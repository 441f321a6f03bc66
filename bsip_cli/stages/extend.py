"""extend (participant): the parameters identified again with the named causes in the model."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.body.person import Person
from bsip_cli.diagnosis.cause import Cause, change_by, method_of
from bsip_cli.effects.joints import AXES, MissingJoint, split_torso
from bsip_cli.identification.uncertainty import readable
from bsip_cli.report.records import with_all_causes
from bsip_cli.report.verdict import change_sentence
from bsip_cli.report.words import segment_label
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import column_names
from bsip_cli.stages.frames import bsip_table, person_of
from bsip_cli.stages.identification_problem import (
    estimate_by,
    prior_from,
    problem_of,
    recordings_of,
)
from bsip_cli.stages.reconstruct import parameters_of
from bsip_cli.stages.trial_scene import body_beside, causes_of, scene_of
from bsip_cli.statistics.methods import OM, RM
from bsip_cli.study.study import Trial

_COM = ["com_x_m", "com_y_m", "com_z_m"]
_COM_CHANGE = ["com_x_change_m", "com_y_change_m", "com_z_change_m"]


def run(unit: Unit) -> None:
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
    """Rows of ``bsip`` per number of causes in the model."""
    methods, parameters = parameters_of(bsip, person)
    phi = body_beside(unit, parameters[:, methods.index(RM)])
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
    prior = prior_from(unit, unit.read("regression"), person)
    recordings, _ = recordings_of(unit, person, trials, changes)
    problem, _ = problem_of(unit, person, prior, recordings)
    # the estimator that identified OM, whatever is configured now
    estimator = str(unit.read("identification").set_index("method")["estimator"][OM])
    found = readable(estimate_by(estimator, problem), prior)
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
