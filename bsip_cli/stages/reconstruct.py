"""reconstruct: ground wrench and COP from motion and inertia, next to the measured ones.

What extend shares: a trial's wrenches filtered, judged and tabulated alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import combinations

import numpy as np
import pandas as pd
from scipy import sparse

from bsip_cli.artifacts import table_of
from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.dynamics.ground_wrench import (
    anterior_and_right,
    centre_of_pressure,
    pinocchio_model,
    predicted_wrench,
)
from bsip_cli.dynamics.lowpass import lowpass_operator
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import (
    WRENCH,
    load_phi,
    loads_record,
    parameters_of,
    person_of,
    rate_of,
    signals_of,
)
from bsip_cli.statistics.choice import BlockErrors, error_gain
from bsip_cli.statistics.fit_measures import correlation, fit_measures, posturography
from bsip_cli.statistics.hypothesis_tests import fisher_z_difference, williams_t
from bsip_cli.statistics.methods import MEASURED, METHODS
from bsip_cli.statistics.samples import effective_samples_of_pair

_COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
_COP = ("cop_ap", "cop_ml")
_SHORTEST_HELD_OUT_S = 0.5

Signals = dict[str, dict[str, np.ndarray]]  # method: component: (N,) [N, N m, m]


def run(unit: Unit) -> None:
    """Read motion, wrench, person and parameters; write reconstruction and its fit."""
    person = person_of(unit)
    signals = signals_of(unit, person)
    judgement = judgement_of(unit, signals.times_s, signals.valid)
    if not judgement.judged.any():
        unit.say("no interval in which every contact is on a plate; nothing to judge")
    methods, phi = parameters_of(unit.read("bsip"), person)
    phi = phi + load_phi(unit, person)[:, None]  # known loads included
    motion = signals.q, signals.v, signals.a
    simulated = predicted_wrench(pinocchio_model(person), *motion, phi, np.zeros(3))
    raw = {MEASURED: signals.wrench}
    raw |= {name: simulated[..., k] for k, name in enumerate(methods)}
    components = judgement.compared(raw)
    rows = reconstruction_rows(judgement, components)
    unit.write("reconstruction", rows, facts={"loads": loads_record(unit)})
    compared = over_the_same_frames(components, judgement.judged)
    unit.write("fit", fit_rows(judgement, compared))
    unit.write("correlation-difference", _correlations(compared))
    sway = [
        {"method": name} | asdict(posturography(one["cop_ap"], one["cop_ml"], signals.rate_hz))
        for name, one in compared.items()
    ]
    unit.write("posturography", sway)


# --- how a trial is judged ----------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Judgement:
    """By what a trial's wrenches are compared.

    times_s : (N,). valid : (N,) frames with every contact on a plate and a determined pose.
    used : (N,) frames that helped to identify. judged : (N,) frames that count.
    data : held_out, or identification where no other data are left.
    operator, frames : low-pass inside the valid intervals, and the frame of each output.
    """

    times_s: np.ndarray
    valid: np.ndarray
    used: np.ndarray
    judged: np.ndarray
    data: str
    operator: sparse.csr_array
    frames: np.ndarray
    surface_height_m: float
    anterior: np.ndarray
    body_weight_N: float
    min_force_N: float

    def compared(self, wrenches: Mapping[str, np.ndarray]) -> Signals:
        """All judged components of wrenches (N, 6), which are low-passed inside the valid intervals
        and as they were outside."""
        signals: Signals = {}
        for name, wrench in wrenches.items():
            smooth = wrench.copy()
            smooth[self.frames] = self.operator @ np.nan_to_num(wrench)
            one = signals[name] = dict(zip(_COMPONENTS, smooth.T, strict=True))
            cop = centre_of_pressure(smooth, self.surface_height_m, self.min_force_N)
            one["cop_ap"], one["cop_ml"] = anterior_and_right(cop, self.anterior)
            one["grf_vertical"] = one["fz"]
        return signals


def over_the_same_frames(signals: Signals, judged: np.ndarray) -> Signals:
    """The signals in the frames (N,) that count, NaN elsewhere; centres of pressure only where the
    measured force and every method that is compared have one: near take-off a newton decides
    whether there is one, and its error is large.
    """
    compared = [signals[name] for name in (MEASURED, *METHODS) if name in signals]
    known = np.isfinite([one["cop_ap"] for one in compared]).all(axis=0) & judged
    return {
        name: {c: np.where(known if c in _COP else judged, x, np.nan) for c, x in one.items()}
        for name, one in signals.items()
    }


def judgement_of(unit: Unit, times: np.ndarray, valid: np.ndarray) -> Judgement:
    """Of the trial's frames (N,), from its plates, the person and used-blocks."""
    facts, options = unit.read("person").iloc[0], unit.config.reconstruct
    used, blocks = np.zeros(len(times), dtype=bool), unit.read("used-blocks")
    for row in blocks[blocks["trial"] == unit.own_trial.stem].itertuples():
        used |= (times >= row.start_s) & (times <= row.end_s)  # these helped to identify
    judged, data = valid & ~used, "held_out"
    rate = rate_of(times)
    if used.any() and judged.sum() / rate < _SHORTEST_HELD_OUT_S:
        judged, data = valid, "identification"  # nothing else is left to judge by
    frames = (times, valid, used, judged, data, *lowpass_operator(valid, rate, options.cutoff_hz))
    weight, corners = facts["mass_kg"] * GRAVITY_M_S2, unit.read("plates")["z_m"].to_numpy()
    height_m = float(corners.mean()) if len(corners) else 0.0  # the floor: no outline is known
    anterior = facts[["anterior_x", "anterior_y"]].to_numpy(dtype=float)
    least_N = options.cop_min_force_percent_bw / 100 * weight
    return Judgement(*frames, height_m, anterior, weight, least_N)


# --- tables ---------------------------------------------------------------------------------


def reconstruction_rows(judgement: Judgement, signals: Signals) -> pd.DataFrame:
    """Rows of ``reconstruction``, method by method."""
    named = dict(zip(WRENCH, _COMPONENTS, strict=True)) | {f"{c}_m": c for c in _COP}
    used = {"valid": judgement.valid, "used": judgement.used}
    parts = [
        {"time_s": judgement.times_s, "method": name} | {c: one[k] for c, k in named.items()} | used
        for name, one in signals.items()
    ]
    return pd.concat([pd.DataFrame(part) for part in parts], ignore_index=True)


def scale_of(component: str) -> tuple[float, str]:
    """Factor and unit in which people read a component's error."""
    if component.startswith("cop"):
        return 1000.0, "mm"
    return 1.0, "N m" if component.startswith("m") else "N"


def fit_rows(judgement: Judgement, signals: Signals) -> pd.DataFrame:
    """Rows of ``fit``: every method of ``signals``, in the judged frames, against the measured."""
    rows = []
    for method, computed in signals.items():
        for component, values in computed.items() if method != MEASURED else ():
            scale, unit = scale_of(component)
            weight = judgement.body_weight_N if unit == "N" else None
            fit = fit_measures(signals[MEASURED][component] * scale, values * scale, weight)
            known = {"method": method, "component": component, "unit": unit}
            rows.append(known | asdict(fit) | {"data": judgement.data})
    return table_of("fit", rows)


def gain_rows(errors: dict[str, BlockErrors], method: str, data: str, seed: int) -> pd.DataFrame:
    """The gain of an extended model per component; ``errors`` in the units that people read."""
    rng = np.random.default_rng(seed)
    rows = []
    for component, one in errors.items():
        gain = error_gain(one, rng)
        known = {"component": component, "method": method, "unit": scale_of(component)[1]}
        rows.append(known | asdict(gain) | {"gain_percent": gain.percent, "data": data})
    return table_of("gain", rows)


def _correlations(signals: Signals) -> list[dict[str, object]]:
    rows = []
    methods = [name for name in signals if name != MEASURED]
    for a, b in combinations(methods, 2):
        for component in signals[MEASURED]:
            x, y, z = (signals[name][component] for name in (MEASURED, a, b))
            r_a, r_b, r_ab = (correlation(p, q) for p, q in ((x, y), (x, z), (y, z)))
            n = min(effective_samples_of_pair(x, y), effective_samples_of_pair(x, z))
            known: dict[str, object] = {"component": component, "method_a": a, "method_b": b}
            known |= {"r_a": r_a, "r_b": r_b, "r_ab": r_ab, "n_effective": n}
            one, other = williams_t(r_a, r_b, r_ab, n), fisher_z_difference(r_a, r_b, n)
            known |= {"williams_t": one.statistic, "df": one.df1, "williams_p": one.p_value}
            known |= {"fisher_z": other.statistic, "fisher_p": other.p_value}
            rows.append(known | {"reason": one.reason})
    return rows
