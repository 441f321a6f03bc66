"""extend (trial): the extended model, RM and OM, and its gain on data not used to size it."""

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
    corrected_wrench,
    is_of_the_forces,
    method_of,
    unseen_change_by,
)
from bsip_cli.effects.scene import Scene
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import WRENCH, load_phi, person_of
from bsip_cli.stages.reconstruct import (
    Judgement,
    Signals,
    Wrenches,
    fit_rows,
    gain_rows,
    judgement_of,
    over_the_same_frames,
    parameters_of,
    reconstruction_rows,
    scale_of,
)
from bsip_cli.stages.trial_scene import blocks_of, body_beside, causes_of, scene_of
from bsip_cli.statistics.choice import BlockErrors, block_errors
from bsip_cli.statistics.methods import MEASURED, OM, RM, is_extended


def run(unit: Unit) -> None:
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
    judgement = judgement_of(unit, unit.read("kinematics"), measured)
    blocks = blocks_of(unit, unit.own_trial.stem)
    scene, parameters = _scene(unit, person, extended)
    fold = blocks.fold_of(judgement.times_s)
    raw: Wrenches = {MEASURED: measured[WRENCH].to_numpy(), OM: scene.wrench_of(parameters[OM])}
    for place, k in enumerate(own):
        among = [causes[j] for j in own[: place + 1]]
        predicted = scene.wrench_of(parameters[method_of(causes[: k + 1])])
        raw[method_of(among)] = predicted + unseen_change_by(among, scene, fold)
    wrenches, signals = judgement.compared(raw)
    ours = [name for name in signals if is_extended(name)]
    rows = reconstruction_rows(judgement, {name: wrenches[name] for name in ours}, signals)
    unit.amend("reconstruction", rows)
    alike = over_the_same_frames(signals)
    unit.amend("fit", fit_rows(judgement, {name: alike[name] for name in (MEASURED, *ours)}))
    last = list(signals)[-1]
    errors = _errors(judgement, signals, last, blocks)
    rows = gain_rows(errors, last, _held_out(unit, judgement), crc32(unit.name.encode()))
    sums = {  # per block, for the gain over all trials
        component: {name: values.tolist() for name, values in asdict(one).items()}
        for component, one in errors.items()
    }
    unit.write("gain", rows, facts={"method": last, "data": judgement.data, "blocks": sums})
    unit.write("corrected-wrench", _corrected(scene, measured, [causes[k] for k in own]))


def _scene(
    unit: Unit, person: Person, extended: pd.DataFrame
) -> tuple[Scene, dict[str, np.ndarray]]:
    """The trial with the body for which the causes were sized; parameters (10 n,) of OM and of
    each extended model, loads included."""
    methods, phi = parameters_of(pd.concat([unit.read("bsip"), extended]), person)
    scene = scene_of(unit, person, body_beside(unit, phi[:, methods.index(RM)]))
    carried = phi + load_phi(unit, person)[:, None]
    return scene, dict(zip(methods, carried.T, strict=True))


# --- gain -------------------------------------------------------------------------------------


def _errors(
    judgement: Judgement, signals: Signals, method: str, blocks: Blocks
) -> dict[str, BlockErrors]:
    """Per component, in the units that people read."""
    judged, errors = judgement.judged, {}
    numbers = blocks.of(judgement.times_s)[judged]
    for component in signals[MEASURED]:
        scale, _ = scale_of(component)
        compared = (scale * signals[name][component][judged] for name in (MEASURED, OM, method))
        measured, before, after = compared
        errors[component] = block_errors(measured, before, after, numbers)
    return errors


def _held_out(unit: Unit, judgement: Judgement) -> str:
    facts = unit.facts("overall-diagnosis")
    sizes = (
        f"blocks of {facts['block_s']:g} s, in {facts['folds']} folds, each judged with the sizes "
        "of the causes that the other folds gave"
    )
    by = "the trial was held out of the identification"
    if judgement.data != "held_out":
        by = "the trial was used in the identification"
    elif judgement.used.any():
        by = "the judged seconds were held out of the identification, others of the trial not"
    return f"{judgement.data}: {sizes}; {by}"


# --- forces without their errors --------------------------------------------------------------


def _corrected(scene: Scene, measured: pd.DataFrame, causes: list[Cause]) -> pd.DataFrame:
    if not any(is_of_the_forces(cause) for cause in causes):
        return empty_table("corrected-wrench")
    of_the_plates = replace(scene, valid=measured["valid"].to_numpy())
    wrench, valid = corrected_wrench(of_the_plates, measured[WRENCH].to_numpy(), causes)
    table = pd.DataFrame(wrench, columns=WRENCH)
    table.insert(0, "time_s", scene.times_s)
    return table.assign(valid=valid)
