"""diagnose (trial): of what is wrong in a person's trials, what concerns this one; RM's errors."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.body.inertia import Inertia, from_phi
from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.diagnosis.attribution import (
    GROUPS,
    Attribution,
    Ground,
    attributions,
    parameter_steps,
)
from bsip_cli.diagnosis.attribution_words import Bodies, difference, sentence, whose
from bsip_cli.dynamics.pinocchio_model import pinocchio_model
from bsip_cli.dynamics.regressor import predicted_wrench
from bsip_cli.report.words import component_label
from bsip_cli.running.unit import Unit
from bsip_cli.stages.diagnosis_rows import nothing
from bsip_cli.stages.frames import WRENCH, coordinates_from, person_from
from bsip_cli.stages.known_loads import load_phi
from bsip_cli.stages.reconstructed import Judgement, judgement_of, parameters_of, scale_of
from bsip_cli.statistics.methods import OM, RM

_NEEDED = (
    "bsip",
    "used-blocks",
    "kinematics",
    "wrench",
    "plates",
    "skeleton",
    "marker-positions",
    "person",
)
_COM_SD = ["com_x_m_sd", "com_y_m_sd", "com_z_m_sd"]


def run(unit: Unit) -> None:
    """Read the person's diagnosis, motion and both methods; write what concerns this trial."""
    _write_diagnosis(unit)
    assert unit.trial is not None
    budget = unit.read("overall-error-budget")
    unit.write("error-budget", budget[budget["trial"] == unit.trial.stem])
    able = unit.has(*_NEEDED)
    unit.write("attribution", _attribution(unit) if able else empty_table("attribution"))


def _write_diagnosis(unit: Unit) -> None:
    overall = unit.read("overall-diagnosis")
    assert unit.trial is not None
    stem = unit.trial.stem
    looked_at = unit.facts("overall-diagnosis").get("trials", [])
    if stem not in looked_at:
        unit.write("diagnosis", empty_table("diagnosis"))
        return
    concerned = np.array([stem in trials.split(", ") for trials in overall["trials"]], dtype=bool)
    classes = set(overall["class_id"][concerned]) - {""}  # rivals of other trials belong to them
    concerned |= overall["class_id"].isin(classes).to_numpy()
    rows = overall[concerned & (overall["effect"] != "none").to_numpy()]
    if (rows["verdict"] == "rejected").all():
        p_value = float(rows["p_value"].min()) if len(rows) else np.nan
        rows = pd.concat([pd.DataFrame([nothing(p_value, (stem,))]), rows], ignore_index=True)
        order = [1, *(rows["rank"][1:] + 1)]
        rows["rank"] = order
    rows["rank"] = rows["rank"].rank(method="dense").astype(int)
    unit.write("diagnosis", rows)


# --- RM's errors ------------------------------------------------------------------------------


def _attribution(unit: Unit) -> pd.DataFrame:
    skeleton = load_skeleton(unit.config.skeleton)
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    bsip = unit.read("bsip")
    methods, phi = parameters_of(bsip, person)
    if not {RM, OM} <= set(methods):
        return empty_table("attribution")
    table, found = (phi[:, methods.index(name)] for name in (RM, OM))
    rm, om = _bodies(table), _bodies(found)
    kinematics, wrench = unit.read("kinematics"), unit.read("wrench")
    judgement = judgement_of(unit, kinematics, wrench)
    columns = np.column_stack([table + load_phi(unit, person), parameter_steps(rm, om)])
    simulated = _simulated(judgement, person, kinematics, columns)
    ground = Ground(judgement.surface_height_m, judgement.anterior, judgement.min_force_N)
    measured = judgement.filtered(wrench[WRENCH].to_numpy())
    parts = attributions(measured, simulated[..., 0], simulated[..., 1:], judgement.judged, ground)
    bodies = _compared(rm, om, bsip[bsip["method"] == OM].set_index("segment"), person)
    lines = [line for one in parts for line in _lines(one, bodies, judgement.data)]
    return pd.DataFrame(lines) if lines else empty_table("attribution")


def _bodies(phi: np.ndarray) -> tuple[Inertia, ...]:
    """The segments of parameters (10 n,), about their joint centres."""
    return tuple(from_phi(part) for part in phi.reshape(-1, 10))


def _compared(
    rm: tuple[Inertia, ...], om: tuple[Inertia, ...], found: pd.DataFrame, person: Person
) -> list[Bodies]:
    """Every segment by both methods, with the standard deviations of OM's rows by segment."""
    segments = list(person.skeleton.segments)
    masses = found.loc[segments, "mass_kg_sd"].tolist()
    centres = found.loc[segments, _COM_SD].to_numpy(dtype=float)
    return [Bodies(*one) for one in zip(segments, rm, om, masses, centres, strict=True)]


def _simulated(
    judgement: Judgement, person: Person, kinematics: pd.DataFrame, columns: np.ndarray
) -> np.ndarray:
    """(N, 6, k) wrench of parameters (10 n, k), filtered as ``reconstruct`` does."""
    q, v, a = coordinates_from(kinematics, person.skeleton)
    raw = predicted_wrench(pinocchio_model(person), q, v, a, columns, np.zeros(3))
    return judgement.filtered(raw.reshape(len(raw), -1)).reshape(raw.shape)


def _lines(one: Attribution, bodies: list[Bodies], data: str) -> list[dict]:
    factor, rmse_unit = scale_of(one.component)
    error = component_label(one.component)
    lines = []
    for both, shares in zip(bodies, one.shares.tolist(), strict=True):
        for group, share in zip(GROUPS, shares, strict=True):
            size, unit = difference(group, both)
            source = whose(group, both)
            said = sentence(share, error, source)
            lines.append(_line(both.segment, group, share, size, unit, source, said))
    rest = f"{100 * one.rest:.0f} % of the squared error in {error} stays with OM's parameters"
    lines.append(_line("", "rest", one.rest, np.nan, "", "", rest))
    common = {
        "component": one.component,
        "rmse": factor * one.rmse,
        "rmse_unit": rmse_unit,
        "n": one.samples,
        "data": data,
    }
    return [line | common for line in lines]


def _line(
    segment: str, group: str, share: float, size: float, unit: str, source: str, said: str
) -> dict[str, str | float]:
    return {
        "segment": segment,
        "group": group,
        "share_percent": 100 * share,
        "difference": size,
        "unit": unit,
        "source": source,
        "sentence": said,
    }
