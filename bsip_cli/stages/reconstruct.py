"""reconstruct: ground wrench and COP from motion and inertia, beside the measured ones."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd

from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.dynamics.lowpass import stretches
from bsip_cli.dynamics.pinocchio_model import pinocchio_model
from bsip_cli.dynamics.regressor import predicted_wrench
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import WRENCH, coordinates_from, person_from
from bsip_cli.stages.known_loads import load_phi, loads_record
from bsip_cli.stages.reconstructed import (
    Wrenches,
    fit_rows,
    judgement_of,
    over_the_same_frames,
    parameters_of,
    reconstruction_rows,
)
from bsip_cli.statistics.effective_samples import effective_samples_of_pair
from bsip_cli.statistics.fit_measures import fit_measures, posturography
from bsip_cli.statistics.hypothesis_tests import fisher_z_difference, williams_t
from bsip_cli.statistics.methods import MEASURED


def run(unit: Unit) -> None:
    """Read motion, wrench, person and parameters; write reconstruction and its fit."""
    skeleton = load_skeleton(unit.config.skeleton)
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    kinematics, measured = unit.read("kinematics"), unit.read("wrench")
    judgement = judgement_of(unit, kinematics, measured)
    if not judgement.judged.any():
        unit.warn(
            f"{unit.name}: no interval in which every contact is on a plate; nothing to judge"
        )
    raw = _wrenches(unit, person, kinematics, measured)
    wrenches = {name: judgement.filtered(wrench) for name, wrench in raw.items()}
    signals = {name: judgement.signals(wrench) for name, wrench in wrenches.items()}
    unit.write(
        "reconstruction",
        reconstruction_rows(judgement, wrenches, signals),
        facts={"loads": loads_record(unit)},
    )
    compared = over_the_same_frames(signals)
    unit.write("fit", fit_rows(judgement, compared))
    unit.write("correlation-difference", _correlations(compared, judgement.judged))
    unit.write("posturography", _sway(compared, judgement.judged, judgement.times_s))


def _wrenches(
    unit: Unit, person: Person, kinematics: pd.DataFrame, measured: pd.DataFrame
) -> Wrenches:
    """Measured, and simulated by each method, known loads included."""
    methods, phi = parameters_of(unit.read("bsip"), person)
    phi = phi + load_phi(unit, person)[:, None]
    q, v, a = coordinates_from(kinematics, person.skeleton)
    simulated = predicted_wrench(pinocchio_model(person), q, v, a, phi, np.zeros(3))
    wrenches = {MEASURED: measured[WRENCH].to_numpy()}
    return wrenches | {name: simulated[..., k] for k, name in enumerate(methods)}


# --- tables -----------------------------------------------------------------------------------


def _correlations(signals, judged) -> pd.DataFrame:
    rows = []
    methods = [name for name in signals if name != MEASURED]
    spans = stretches(judged)
    for a, b in combinations(methods, 2):
        for component in signals[MEASURED]:
            x, y, z = (signals[name][component] for name in (MEASURED, a, b))
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
