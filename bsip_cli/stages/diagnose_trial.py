"""diagnose (trial): of what is wrong in a person's trials, what concerns this one; RM's errors."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.inertia import Inertia, from_readable
from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.diagnosis.attribution import (
    GROUPS,
    Attribution,
    Ground,
    attributions,
    difference,
    parameter_steps,
    sentence,
    whose,
)
from bsip_cli.dynamics.lowpass import lowpass_operator
from bsip_cli.dynamics.pinocchio_model import pinocchio_model
from bsip_cli.dynamics.regressor import predicted_wrench
from bsip_cli.report.words import component_label
from bsip_cli.schemas import bsip_names
from bsip_cli.stages.diagnosis_rows import nothing
from bsip_cli.stages.frames import WRENCH, coordinates_from, person_from
from bsip_cli.unit import Unit

_SHORTEST_HELD_OUT_S = 0.5
_NEEDED = (
    "reconstruction",
    "bsip",
    "kinematics",
    "plates",
    "skeleton",
    "marker-positions",
    "person",
)


def run(unit: Unit) -> None:
    """Read the person's diagnosis, motion and both methods; write what concerns this trial."""
    _write_diagnosis(unit)
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
    concerned = [stem in trials.split(", ") for trials in overall["trials"]]
    rows = overall[np.array(concerned, dtype=bool) & (overall["effect"] != "none")]
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
    bsip, simulated = unit.read("bsip"), unit.read("reconstruction")
    if not {"RM", "OM"} <= set(bsip["method"]):
        return empty_table("attribution")
    rm, om = (_bodies(bsip, method, person) for method in ("RM", "OM"))
    rows = simulated[simulated["method"] == "measured"]
    valid, used = rows["valid"].to_numpy(), rows["used"].to_numpy()
    times = rows["time_s"].to_numpy()
    steps = _wrench_steps(unit, person, parameter_steps(rm, om), valid, times)
    judged, data = _judged(valid, used, times)
    measured, table = (
        simulated.loc[simulated["method"] == method, WRENCH].to_numpy()
        for method in ("measured", "RM")
    )
    found = attributions(measured, table, steps, judged, _ground(unit))
    lines = [line for one in found for line in _lines(one, person, rm, om, data)]
    return pd.DataFrame(lines) if lines else empty_table("attribution")


def _bodies(bsip: pd.DataFrame, method: str, person: Person) -> tuple[Inertia, ...]:
    """The segments of one method about their joint centres."""
    rows = bsip[bsip["method"] == method].set_index("segment")
    values = rows.loc[list(person.skeleton.segments), list(bsip_names())].to_numpy()
    return tuple(
        from_readable(row).moved(-origin)
        for row, origin in zip(values, person.origin_in_joint_m, strict=True)
    )


def _wrench_steps(
    unit: Unit, person: Person, steps: np.ndarray, valid: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """(N, 6, k) wrench of each step, through the low-pass of ``reconstruct``; NaN elsewhere."""
    q, v, a = coordinates_from(unit.read("kinematics"), person.skeleton)
    raw = predicted_wrench(pinocchio_model(person), q, v, a, steps, np.zeros(3))
    rate = 1.0 / float(np.median(np.diff(times)))
    operator, frames = lowpass_operator(valid, rate, unit.config.reconstruct.cutoff_hz)
    filtered = np.full(raw.shape, np.nan)
    flat = np.nan_to_num(raw).reshape(len(raw), -1)
    filtered[frames] = (operator @ flat).reshape(-1, *raw.shape[1:])
    return filtered


def _judged(valid: np.ndarray, used: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, str]:
    """Frames that OM has not seen, or all where none are left: those that ``fit`` judges by."""
    fresh = valid & ~used
    if used.any() and fresh.sum() * float(np.median(np.diff(times))) < _SHORTEST_HELD_OUT_S:
        return valid, "identification"
    return fresh, "held_out"


def _ground(unit: Unit) -> Ground:
    facts, corners = unit.read("person").iloc[0], unit.read("plates")["z_m"].to_numpy()
    height = float(corners.mean()) if len(corners) else 0.0
    anterior = facts[["anterior_x", "anterior_y"]].to_numpy(dtype=float)
    share = unit.config.reconstruct.cop_min_force_percent_bw / 100
    return Ground(height, anterior, share * float(facts["mass_kg"]) * GRAVITY_M_S2)


def _lines(
    one: Attribution, person: Person, rm: tuple[Inertia, ...], om: tuple[Inertia, ...], data: str
) -> list[dict]:
    is_cop, is_moment = one.component.startswith("cop"), one.component.startswith("m")
    error = component_label(one.component)
    lines = []
    for i, segment in enumerate(person.skeleton.segments):
        for group, share in zip(GROUPS, one.shares[i].tolist(), strict=True):
            size, unit = difference(group, rm[i], om[i])
            source = whose(segment, group, rm[i], om[i])
            said = sentence(share, error, source)
            lines.append(_line(segment, group, share, size, unit, source, said))
    rest = f"{100 * one.rest:.0f} % of the squared error in {error} stays with OM's parameters"
    lines.append(_line("", "rest", one.rest, np.nan, "", "", rest))
    common = {
        "component": one.component,
        "rmse": one.rmse * (1000.0 if is_cop else 1.0),
        "rmse_unit": "mm" if is_cop else "N m" if is_moment else "N",
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
