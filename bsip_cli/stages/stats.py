"""Cohort: every participant's numbers in one tidy table, and the tests between the methods.

Reads bsip, fit, posturography, correlation-difference of all who have them. Writes values,
comparisons.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from math import hypot
from typing import Any

import pandas as pd

from bsip_cli.errors import BadDataError
from bsip_cli.pipeline import STAGES, producer
from bsip_cli.schemas import SCHEMAS
from bsip_cli.statistics.cohort import DATA_SHARE, Criteria, compare
from bsip_cli.statistics.cohort_correlations import CorrelationRun, PersonTest, person_tests
from bsip_cli.statistics.cohort_values import DIFFERENCE, MEASURED, OM, RM, Value
from bsip_cli.study import Participant, Trial
from bsip_cli.unit import Unit

COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
MEASURES = ("rmse", "pearson_r", "schwer_m", "schwer_p", "schwer_c")
"""Columns of ``fit`` in table 5."""

SWAY = {
    "mean_velocity": ("mean_velocity_mm_s", "mm/s"),
    "sway_length": ("sway_length_mm", "mm"),
    "ellipse_area": ("ellipse_area_mm2", "mm2"),
    "rms_ap": ("rms_ap_mm", "mm"),
    "rms_ml": ("rms_ml_mm", "mm"),
    "rms_ap_origin": ("rms_ap_origin_m", "m"),
    "rms_ml_origin": ("rms_ml_origin_m", "m"),
}
TRIAL_KINDS = ("fit", "posturography", "correlation-difference")


@dataclass(frozen=True)
class Recording:
    """A trial with what ``reconstruct`` said of it, and its part in this study."""

    trial: Trial
    role: str
    data: str
    frames: dict[str, pd.DataFrame]

    def value(self, table: str, variable: str, method: str, value: float, unit: str) -> Value:
        t = self.trial
        return Value(
            t.participant_id,
            t.stem,
            t.task,
            self.role,
            self.data,
            table,
            variable,
            method,
            float(value),
            unit,
        )


def run(unit: Unit) -> None:
    missing = _Missing(unit)
    people = list(_inertias(unit, missing))
    values = [v for person, bsip in people for v in _masses(person, bsip)]
    recordings = _with_roles(unit, list(_recordings(unit, missing)))
    missing.without_sequence(recordings)
    for recording in recordings:
        values += _values_of(recording)
    values += [v for person, bsip in people for v in _centres(person, bsip)]
    correlations = person_tests("table5", (r for rec in recordings for r in _correlations(rec)))
    values += [value for test in correlations for value in test.values()]
    if not values:
        raise BadDataError(
            "no participant has results of RM and OM",
            file=unit.out,
            remedy="run `bsip identify` and `bsip reconstruct`, and read why they refused",
        )
    facts = {"missing": missing.found, "participants": len({v.participant for v in values})}
    unit.write("values", _frame("values", [asdict(value) for value in values]), facts)
    unit.write("comparisons", _comparisons(unit, values, correlations), facts)


def _comparisons(
    unit: Unit, values: list[Value], correlations: tuple[PersonTest, ...]
) -> pd.DataFrame:
    options = unit.config.stats
    criteria = Criteria(options.alpha, options.equivalence_percent)
    rows = compare(values, correlations, criteria)
    return _frame("comparisons", [row.as_row() for row in rows])


def _frame(kind: str, rows: list[dict]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=[column.name for column in SCHEMAS[kind].columns])


# --- who is there ---------------------------------------------------------------------------


class _Missing:
    """Collects, and tells the user, what is in which tables not."""

    def __init__(self, unit: Unit) -> None:
        self._unit = unit
        self.found: list[dict[str, str | list[str]]] = []

    def add(self, what: str, *numbers: int) -> None:
        """`what` ("sub-02 has no ...") is not in the tables with these numbers."""
        self._unit.warn(f"{what}: not in {_in_words(numbers)}")
        self.found.append({"sentence": what, "tables": [f"table{k}" for k in numbers]})

    def without_sequence(self, recordings: list[Recording]) -> None:
        """Name those whose trials are compared, but none of them is an identification trial."""
        there = {r.trial.participant_id for r in recordings}
        having = {r.trial.participant_id for r in recordings if r.role == "sequence"}
        for name in sorted(there - having):
            self.add(f"{name} has no identification trial", 2, 3, 6)


def _in_words(numbers: tuple[int, ...]) -> str:
    if len(numbers) == 1:
        return f"table {numbers[0]}"
    return f"tables {', '.join(map(str, numbers[:-1]))} and {numbers[-1]}"


def _refused(unit: Unit, participant: Participant) -> str:
    """The stage whose refusal makes all of a participant's results stale, or nothing."""
    folder = unit.path("bsip", participant=participant).parent
    last = max(STAGES.index(producer(kind)) for kind in unit.stage.reads)
    before = [stage.name for stage in STAGES[:last] if stage.level == "participant"]
    names = [s for s in before if (folder / f"{participant.id}_refusal-{s}.parquet").exists()]
    return names[0] if names else ""


def _inertias(unit: Unit, missing: _Missing) -> Iterator[tuple[Participant, pd.DataFrame]]:
    for participant in unit.study.participants:
        refused = _refused(unit, participant)
        if refused:
            missing.add(f"{participant.id} was refused by {refused}", 1, 2, 3, 4, 5, 6)
            continue
        if not unit.path("bsip", participant=participant).exists():
            missing.add(f"{participant.id} has no identified parameters", 1, 6)
            continue
        frame = unit.read("bsip", participant=participant)
        lacking = [method for method in (OM, RM) if method not in set(frame["method"])]
        if lacking:
            missing.add(f"{participant.id} has no parameters of {' and '.join(lacking)}", 1, 6)
        yield participant, frame


def _recordings(unit: Unit, missing: _Missing) -> Iterator[Recording]:
    usable = unit.inputs()
    for participant in unit.study.participants:
        if _refused(unit, participant):
            continue
        for trial in participant.trials:
            if trial.role == "static":
                continue
            paths = {kind: unit.path(kind, trial, participant) for kind in TRIAL_KINDS}
            there = [k for k, path in paths.items() if path.name in usable and path.exists()]
            lacking = [kind for kind in TRIAL_KINDS if kind not in there]
            tables = sorted({number for kind in lacking for number in _tables_of(kind, trial)})
            if tables:
                missing.add(f"{trial.stem} has no {', no '.join(lacking)}", *tables)
            if there:
                frames = {kind: unit.read(kind, trial, participant) for kind in there}
                yield Recording(trial, trial.role, _data(frames.get("fit")), frames)


def _tables_of(kind: str, trial: Trial) -> tuple[int, ...]:
    in_sequence = {"fit": (2, 4, 5, 6), "posturography": (3,), "correlation-difference": (5,)}
    in_others = {"fit": (4, 5), "posturography": (), "correlation-difference": (5,)}
    return (in_sequence if trial.role == "sequence" else in_others)[kind]


def _data(fit: pd.DataFrame | None) -> str:
    """What the trial was to OM."""
    said = set() if fit is None else set(fit.loc[fit["method"] == OM, "data"])
    return "identification" if "identification" in said else "held_out" if said else ""


def _with_roles(unit: Unit, recordings: list[Recording]) -> list[Recording]:
    """Where no trial of the study is a sequence, those that identified OM stand for it."""
    trials = (trial for person in unit.study.participants for trial in person.trials)
    if any(trial.role == "sequence" for trial in trials):
        return recordings
    return [
        Recording(r.trial, "sequence" if r.data == "identification" else r.role, r.data, r.frames)
        for r in recordings
    ]


# --- artifacts to values --------------------------------------------------------------------


def _rows(frame: pd.DataFrame, *methods: str) -> list[dict[str, Any]]:
    """The rows of these methods as plain dictionaries."""
    return frame[frame["method"].isin(methods)].to_dict("records")  # type: ignore[return-value]


def _masses(participant: Participant, bsip: pd.DataFrame) -> Iterator[Value]:
    person = (participant.id, "", "all", "", "", "table1")
    for row in _rows(bsip, OM, RM):
        segment, method = row["segment"], row["method"]
        yield Value(*person, segment, method, row["mass_kg"], "kg")
        if method == OM:
            yield Value(*person, f"{segment}{DATA_SHARE}", OM, row["mass_data_share"], "1")


def _centres(participant: Participant, bsip: pd.DataFrame) -> Iterator[Value]:
    """How far OM's centres of mass lie from RM's along the segments, as Robert 2017's table 1."""
    along = bsip.pivot_table(index="segment", columns="method", values="com_y_m", sort=False)
    if not {OM, RM} <= set(along.columns):
        return
    apart = (along[OM] - along[RM]).abs() * 1000
    summary = {"mean": apart.mean(), "median": apart.median(), "max": apart.max()}
    person = (participant.id, "", "all", "", "", "table6")
    for name, value in (*apart.items(), *summary.items()):
        yield Value(*person, f"com_{name}", DIFFERENCE, float(value), "mm")


def _values_of(recording: Recording) -> list[Value]:
    values: list[Value] = []
    if "fit" in recording.frames:
        rows = _rows(recording.frames["fit"], OM, RM)
        fits = {(row["method"], row["component"]): row for row in rows}
        for method in (OM, RM):
            values += _cop_errors(recording, method, fits)
            values += _force_errors(recording, method, fits)
            values += _residuals(recording, method, fits)
    if "posturography" in recording.frames and recording.role == "sequence":
        values += _sway(recording, recording.frames["posturography"])
    return values


def _cop_errors(recording: Recording, method: str, fits: dict) -> Iterator[Value]:
    if (method, "cop_ap") not in fits or (method, "cop_ml") not in fits:
        return
    ap, ml = fits[method, "cop_ap"], fits[method, "cop_ml"]
    both = hypot(ap["rmse"], ml["rmse"])
    for table in ("table2", "table4") if recording.role == "sequence" else ("table4",):
        yield recording.value(table, "cop_ap", method, ap["rmse"], ap["unit"])
        yield recording.value(table, "cop_ml", method, ml["rmse"], ml["unit"])
    yield recording.value("table4", "cop_error", method, both, ap["unit"])


def _force_errors(recording: Recording, method: str, fits: dict) -> Iterator[Value]:
    if (method, "grf_vertical") in fits:
        percent = fits[method, "grf_vertical"]["rmse_percent_bw"]
        yield recording.value("table4", "grf_vertical", method, percent, "% body weight")
    for component in COMPONENTS:
        row = fits.get((method, component))
        if row is None:
            continue
        for measure in MEASURES:
            unit = row["unit"] if measure == "rmse" else "1"
            yield recording.value("table5", f"{component}_{measure}", method, row[measure], unit)


def _residuals(recording: Recording, method: str, fits: dict) -> Iterator[Value]:
    """Root mean square of the force's and the moment's error as vectors."""
    if recording.role != "sequence" or any((method, c) not in fits for c in COMPONENTS):
        return
    errors = {c: fits[method, c]["rmse"] for c in COMPONENTS}
    force, moment = (hypot(*(errors[f"{kind}{axis}"] for axis in "xyz")) for kind in "fm")
    yield recording.value("table6", "force_residual", method, force, "N")
    yield recording.value("table6", "moment_residual", method, moment, "N m")


def _sway(recording: Recording, frame: pd.DataFrame) -> Iterator[Value]:
    for row in _rows(frame, MEASURED, OM, RM):
        for variable, (column, unit) in SWAY.items():
            yield recording.value("table3", variable, row["method"], row[column], unit)


def _correlations(recording: Recording) -> Iterator[CorrelationRun]:
    trial, frame = recording.trial, recording.frames.get("correlation-difference")
    if frame is None:
        return
    for row in frame.to_dict("records"):
        if row["component"] not in COMPONENTS or {row["method_a"], row["method_b"]} != {OM, RM}:
            continue
        om, rm = ("r_a", "r_b") if row["method_a"] == OM else ("r_b", "r_a")
        yield CorrelationRun(
            trial.participant_id,
            trial.stem,
            trial.task,
            recording.role,
            row["component"],
            row[om],
            row[rm],
            row["r_ab"],
            row["n_effective"],
        )
