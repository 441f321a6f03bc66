"""Errors of the methods: what identification gains over the table's parameters, and over these times
one number; how large they are against yardsticks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
import pandas as pd

from bsip_cli.report.words import COMPONENTS, count, listing, number, say
from bsip_cli.statistics.choice import Difference, between
from bsip_cli.statistics.methods import METHODS, OM, RM, RM_MASS
from bsip_cli.statistics.published import load_paper
from bsip_cli.statistics.samples import Z95

_PAIRS = ("om", "rm_mass", "om_rm_mass")  # of whose ratios the choice is made


@dataclass(frozen=True)
class Gain:
    """Errors (RMSE) of the methods in one component of one trial: of OM, RM, and RM+mass if there.
    held_out : OM had not seen the data."""

    component: str
    unit: str
    of: Mapping[str, float]
    trial: str
    held_out: bool


def gains_of(trial: str, fit: pd.DataFrame) -> tuple[Gain, ...]:
    """The gains of one trial, in the order of the components; the vertical force in % BW."""
    rows = {(row["method"], row["component"]): row for _, row in fit.iterrows()}
    gains = []
    for component in COMPONENTS:
        known = {m: rows[m, component] for m in METHODS if (m, component) in rows}
        if not {RM, OM} <= known.keys():
            continue
        column, unit = "rmse", str(known[OM]["unit"])
        if component == "grf_vertical" and np.isfinite(known[OM]["rmse_percent_bw"]):
            column, unit = "rmse_percent_bw", "% BW"
        errors = {method: float(row[column]) for method, row in known.items()}
        held_out = known[OM]["data"] == "held_out"
        gains.append(Gain(component, unit, errors, trial, held_out))
    return tuple(gains)


# --- which parameters ---------------------------------------------------------------------------


def use_sentence(
    choice: pd.DataFrame | None, identification: pd.DataFrame, lead: str = "Use"
) -> str:
    """Which method, by how much it is better than the others, and in which movements another; from
    the artifacts of these names."""
    if choice is None or choice.empty:
        return f"{lead} {RM}: nothing was compared."
    first = _of_its_movements(choice)
    others = [
        f"{method} for {listing(list(rows['movement']))}"
        for method, rows in choice.iloc[1:].groupby("use")
        if method != first["use"]
    ]
    most = f"{'else ' if others else ''}{first['use']}"
    for row in identification[identification["method"] == first["use"]].itertuples():
        if row.method == RM_MASS:
            error = number(Z95 * row.mass_factor_sd, 2)
            most += f" (the table times {number(row.mass_factor, 3)} ± {error})"
    rare = identification.loc[identification["rare"].astype(bool), "method"].tolist()
    is_of_none = bool(others) and first["movement"] == choice.iloc[0]["movement"]
    compared = _compared(first, is_of_none, is_rare=OM in rare)
    said = f"{lead} {', '.join([*others, most])}{compared}."
    why = "what is wrong in the recordings gave it a body that fewer than 1 in 100 people have"
    return " ".join([said, *(f"Do not use {method}: {why}." for method in rare)])


def _of_its_movements(choice: pd.DataFrame) -> pd.Series:
    """What speaks for the method to use mostly: of the movements alone in which it is to be used, if
    there are some; else of all together."""
    first, own = choice.iloc[0], choice.iloc[1:].query("use == @choice.use.iloc[0]")
    if len(own) < 2:
        return own.iloc[0] if len(own) else first
    logs = {x: between(np.log(own[f"ratio_{x}"])) for x in _PAIRS}
    known = {f"ratio_{x}": one.ratio for x, one in logs.items()}
    known |= {f"log_error_{x}": one.error for x, one in logs.items()}
    return pd.Series({**own.iloc[0], **known, "trials": own["trials"].sum()})


def _compared(first: pd.Series, together: bool, is_rare: bool) -> str:
    """What the choice rests on, to go on with after the method's name; ``together``: over movements
    of which all ask for another method; ``is_rare``: OM is ruled out by its body."""
    changes = {x: _change(first[f"ratio_{x}"], first[f"log_error_{x}"]) for x in _PAIRS}
    known = bool(np.isfinite([first[f"ratio_{name}"] for name in _PAIRS]).all())
    n, all_together = int(first["trials"]), "together " if together else ""
    where = {
        "whole_trials": f"in {count(n, 'other recording')} {all_together}",
        "held_out": f"in seconds of {count(n, 'recording')} that were held out {all_together}",
    }.get(str(first["data"]), "")
    methods = {"use": first["use"], "together": together, "is_rare": is_rare}
    return say("compared", known=known, where=where, **methods, **changes)


def _change(ratio: float, log_error: float) -> str:
    """``31 to 45 % smaller`` or ``5 % smaller to 16 % larger``: one standard error to either
    side."""
    ends = [100 * (end - 1) for end in Difference.of_ratio(ratio, log_error).interval()]
    if not np.isfinite(ends).all():
        ends = [100 * (ratio - 1)] * 2
    words = ["smaller" if end < 0 else "larger" for end in ends]
    if words[0] != words[1]:
        return f"{number(-ends[0], 0)} % smaller to {number(ends[1], 0)} % larger"
    sizes = [number(size, 0) for size in sorted(map(abs, ends))]
    return f"{' to '.join(dict.fromkeys(sizes))} % {words[0]}"


# --- three numbers of a recording against those of good laboratories and the literature -----------

COP, FORCE, MARKERS = "cop_mm", "vertical_force_percent_bw", "markers_mm"
COP_LIMIT_M, FORCE_LIMIT_PERCENT = "large_cop_error_m", "large_force_error_percent"
"""Options of the diagnosis: errors that are called large."""

SOURCES = (
    "RMS of what OM had not seen, usable or not: good to the first mark (Hansen 2017), bad from the "
    "second (Hicks 2015; markers: OpenSim)."
)
ENDS_AT = 2.0  # times the size that is called large, where every scale ends
_MARKER_GOOD_MM, MARKER_LIMIT_MM = 10.0, 20.0
"""RMS of a fitted static pose, and of a movement, in OpenSim's checklist (Simulation with OpenSim,
Best Practices)."""


@dataclass(frozen=True)
class Yardstick:
    """``good`` and ``limit`` in ``unit``: up to the one it is as good as published, beyond the
    other it is large. ``brief``: its title where many stand in a line."""

    name: str
    title: str
    brief: str
    unit: str
    good: float
    limit: float

    def in_sentence(self) -> str:
        return f"{self.title[:1].lower()}{self.title[1:]}"

    def short(self) -> str:
        """Before its size."""
        return self.in_sentence().removesuffix(" error")

    def brief_unit(self) -> str:
        """Without of what."""
        return self.unit.partition(" ")[0]

    def is_large(self, value: float) -> bool:
        return value > self.limit

    def words(self, value: float) -> str:
        if not np.isfinite(value):
            return "not known"
        if self.is_large(value):
            return "bad: large"
        return "good" if value <= self.good else "acceptable"

    def shown(self, value: float) -> str:
        return f"{number(value)} {self.unit}"

    @property
    def end(self) -> float:
        """Of its scale, in every report the same."""
        return ENDS_AT * self.limit

    @property
    def marks(self) -> tuple[tuple[float, str], tuple[float, str]]:
        """Part of the scale, and text, of what is good and of what is large."""
        return (self.good / self.end, f"{self.good:.2g}"), (1 / ENDS_AT, number(self.limit, 0))

    def part(self, value: float) -> float:
        """Of the scale; 0 of what is not known."""
        return min(value / self.end, 1.0) if np.isfinite(value) else 0.0


def yardsticks(cop_limit_m: float, force_limit_percent: float) -> tuple[Yardstick, ...]:
    """Of the centre of pressure, the vertical force and the markers."""
    cop = _published("cop_error"), 1e3 * cop_limit_m
    force = _published("grf_vertical"), force_limit_percent
    return (
        Yardstick(COP, "Centre of pressure (COP) error", "COP", "mm", *cop),
        Yardstick(FORCE, "Vertical force error", "vertical force", "% of body weight", *force),
        Yardstick(MARKERS, "Markers from model", "marker", "mm", _MARKER_GOOD_MM, MARKER_LIMIT_MM),
    )


@cache
def _published(variable: str) -> float:
    """Median over the movements of the mean errors with identified parameters."""
    rows = [r for r in load_paper("hansen2017").table(4).rows if r.compare.startswith(variable)]
    return float(np.median([row.cells[OM].mean for row in rows if OM in row.cells]))


def errors_of(fits: Iterable[pd.DataFrame]) -> dict[str, float]:
    """Errors over trials, from rows of one method of each one's table ``fit``: the root mean square
    of those with held-out data, or of all where there are none; NaN where nothing is known."""
    rows = []
    for fit in fits:
        of = fit.set_index("component")
        rms, percent = of["rmse"].to_dict(), of["rmse_percent_bw"].to_dict()
        cop = float(np.hypot(rms.get("cop_ap", np.nan), rms.get("cop_ml", np.nan)))
        held_out = bool((of["data"] == "held_out").any())
        rows.append((cop, float(percent.get("grf_vertical", np.nan)), held_out))
    table = pd.DataFrame(rows, columns=[COP, FORCE, "held_out"], dtype=float)
    known = table[table[[COP, FORCE]].notna().any(axis=1)]
    chosen = known[known["held_out"] > 0] if known["held_out"].any() else known
    return {name: float(np.sqrt((chosen[name] ** 2).mean())) for name in (COP, FORCE)}
