"""reconstruct: ground wrench and COP from motion and inertia, beside the measured ones."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.inertia import from_readable
from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.dynamics.cop import anterior_and_right, centre_of_pressure
from bsip_cli.dynamics.lowpass import lowpass_operator, stretches
from bsip_cli.dynamics.pinocchio_model import pinocchio_model
from bsip_cli.dynamics.regressor import predicted_wrench
from bsip_cli.schemas import bsip_names
from bsip_cli.stages.frames import WRENCH, coordinates_from, person_from
from bsip_cli.stages.known_loads import load_phi, loads_record
from bsip_cli.statistics.correlation_tests import fisher_z_difference, williams_t
from bsip_cli.statistics.effective_samples import effective_samples_of_pair
from bsip_cli.statistics.fit_measures import fit_measures
from bsip_cli.statistics.posturography import posturography
from bsip_cli.unit import Unit

_COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
_SHORTEST_HELD_OUT_S = 0.5


def run(unit: Unit) -> None:
    """Read motion, wrench, person and parameters; write reconstruction and its fit."""
    skeleton = load_skeleton(unit.config.skeleton)
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    facts = unit.read("person").iloc[0]
    kinematics, measured = unit.read("kinematics"), unit.read("wrench")
    times = kinematics["time_s"].to_numpy()
    valid = measured["valid"].to_numpy() & kinematics["determined"].to_numpy()
    wrenches = _wrenches(unit, person, kinematics, measured, valid, times)
    used = _used(unit, times)
    judged, data = _judged(valid, used, times)
    if not judged.any():
        unit.warn(f"{unit.name}: no stretch in which every contact is on a plate; nothing to judge")
    height = _surface_height(unit)
    anterior = facts[["anterior_x", "anterior_y"]].to_numpy(dtype=float)
    weight = facts["mass_kg"] * GRAVITY_M_S2
    min_force = unit.config.reconstruct.cop_min_force_percent_bw / 100 * weight
    signals = {
        name: _signals(wrench, height, anterior, min_force) for name, wrench in wrenches.items()
    }
    unit.write(
        "reconstruction",
        _reconstruction(times, wrenches, signals, valid, used),
        facts={"loads": loads_record(unit)},
    )
    unit.write("fit", _fit(signals, judged, weight, data))
    unit.write("correlation-difference", _correlations(signals, judged))
    unit.write("posturography", _sway(signals, judged, times))


# --- wrenches ---------------------------------------------------------------------------------


def _wrenches(unit: Unit, person: Person, kinematics, measured, valid, times) -> dict:
    """(N, 6) per method, known loads included, all through the same low-pass in valid stretches."""
    methods, phi = _parameters(unit.read("bsip"), person)
    phi = phi + load_phi(unit, person)[:, None]
    q, v, a = coordinates_from(kinematics, person.skeleton)
    simulated = predicted_wrench(pinocchio_model(person), q, v, a, phi, np.zeros(3))
    raw = {"measured": measured[WRENCH].to_numpy()}
    raw |= {name: simulated[..., k] for k, name in enumerate(methods)}
    rate = 1.0 / float(np.median(np.diff(times)))
    operator, frames = lowpass_operator(valid, rate, unit.config.reconstruct.cutoff_hz)
    filtered = {}
    for name, wrench in raw.items():
        filtered[name] = wrench.copy()
        filtered[name][frames] = operator @ np.nan_to_num(wrench)
    return filtered


def _parameters(bsip: pd.DataFrame, person: Person) -> tuple[list[str], np.ndarray]:
    """Methods and their parameters (10 n, k) about the joint centres."""
    methods = list(dict.fromkeys(bsip["method"]))
    columns = []
    for method in methods:
        rows = bsip[bsip["method"] == method].set_index("segment")
        rows = rows.loc[list(person.skeleton.segments), list(bsip_names())].to_numpy()
        columns.append(
            np.concatenate(
                [
                    from_readable(row).moved(-origin).phi()
                    for row, origin in zip(rows, person.origin_in_joint_m, strict=True)
                ]
            )
        )
    return methods, np.stack(columns, axis=1)


def _surface_height(unit: Unit) -> float:
    """Height of the plates' surface [m]; the floor where no outline is known."""
    corners = unit.read("plates")["z_m"].to_numpy()
    return float(corners.mean()) if len(corners) else 0.0


def _signals(wrench, height, anterior, min_force) -> dict[str, np.ndarray]:
    signals = dict(zip(_COMPONENTS, wrench.T, strict=True))
    cop = centre_of_pressure(wrench, height, min_force)
    signals["cop_ap"], signals["cop_ml"] = anterior_and_right(cop, anterior)
    signals["grf_vertical"] = signals["fz"]
    return signals


# --- what is judged ---------------------------------------------------------------------------


def _used(unit: Unit, times: np.ndarray) -> np.ndarray:
    """(N,) frames that helped to identify the parameters."""
    blocks = unit.read("used-blocks")
    used = np.zeros(len(times), dtype=bool)
    assert unit.trial is not None
    for row in blocks[blocks["trial"] == unit.trial.stem].itertuples():
        used |= (times >= row.start_s) & (times <= row.end_s)
    return used


def _judged(valid: np.ndarray, used: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, str]:
    """Frames to judge by: those not used to identify, or all where none are left."""
    fresh = valid & ~used
    if used.any() and fresh.sum() * float(np.median(np.diff(times))) < _SHORTEST_HELD_OUT_S:
        return valid, "identification"
    return fresh, "held_out"


# --- tables -----------------------------------------------------------------------------------


def _reconstruction(times, wrenches, signals, valid, used) -> pd.DataFrame:
    parts = []
    for name, wrench in wrenches.items():
        part = pd.DataFrame(wrench, columns=WRENCH)
        part.insert(0, "time_s", times)
        part.insert(1, "method", name)
        part["cop_ap_m"], part["cop_ml_m"] = signals[name]["cop_ap"], signals[name]["cop_ml"]
        part["valid"], part["used"] = valid, used
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def _scale(component: str) -> tuple[float, str]:
    if component.startswith("cop"):
        return 1000.0, "mm"
    return 1.0, "N m" if component.startswith("m") else "N"


def _fit(signals, judged, body_weight_N, data) -> pd.DataFrame:
    rows = []
    for method, computed in signals.items():
        if method == "measured":
            continue
        for component, values in computed.items():
            scale, unit = _scale(component)
            weight = body_weight_N if unit == "N" else None
            fit = fit_measures(
                signals["measured"][component] * scale, values * scale, stretches(judged), weight
            )
            rows.append(
                {
                    "method": method,
                    "component": component,
                    "rmse": fit.rmse,
                    "unit": unit,
                    "rmse_percent_bw": fit.rmse_percent_bw,
                    "pearson_r": fit.pearson_r,
                    "schwer_m": fit.schwer_m,
                    "schwer_p": fit.schwer_p,
                    "schwer_c": fit.schwer_c,
                    "n": fit.n,
                    "n_effective": fit.n_effective,
                    "data": data,
                }
            )
    return pd.DataFrame(rows)


def _correlations(signals, judged) -> pd.DataFrame:
    rows = []
    methods = [name for name in signals if name != "measured"]
    spans = stretches(judged)
    for a, b in combinations(methods, 2):
        for component in signals["measured"]:
            x, y, z = (signals[name][component] for name in ("measured", a, b))
            r_a, r_b, r_ab = (
                fit_measures(p, q, spans).pearson_r for p, q in ((x, y), (x, z), (y, z))
            )
            n = min(effective_samples_of_pair(x, y, spans), effective_samples_of_pair(x, z, spans))
            williams = williams_t(r_a, r_b, r_ab, n)
            fisher = fisher_z_difference(r_a, n, r_b, n)
            rows.append(
                {
                    "component": component,
                    "method_a": a,
                    "method_b": b,
                    "r_a": r_a,
                    "r_b": r_b,
                    "r_ab": r_ab,
                    "n_effective": n,
                    "williams_t": williams.t,
                    "df": williams.df,
                    "williams_p": williams.p,
                    "fisher_z": fisher.z,
                    "fisher_p": fisher.p,
                    "reason": williams.reason,
                }
            )
    columns = [
        "component",
        "method_a",
        "method_b",
        "r_a",
        "r_b",
        "r_ab",
        "n_effective",
        "williams_t",
        "df",
        "williams_p",
        "fisher_z",
        "fisher_p",
        "reason",
    ]
    return pd.DataFrame(rows, columns=columns)


def _sway(signals, judged, times) -> pd.DataFrame:
    rate = 1.0 / float(np.median(np.diff(times)))
    rows = []
    for method, values in signals.items():
        sway = posturography(values["cop_ap"], values["cop_ml"], rate, stretches(judged))
        rows.append(
            {
                "method": method,
                "rms_ap_mm": sway.rms_ap_mm,
                "rms_ml_mm": sway.rms_ml_mm,
                "rms_ap_origin_m": sway.rms_ap_origin_m,
                "rms_ml_origin_m": sway.rms_ml_origin_m,
                "mean_velocity_mm_s": sway.mean_velocity_mm_s,
                "sway_length_mm": sway.sway_length_mm,
                "ellipse_area_mm2": sway.ellipse_area_mm2,
                "duration_s": sway.duration_s,
            }
        )
    return pd.DataFrame(rows)
