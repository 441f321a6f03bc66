"""Cohort: every participant's numbers in one tidy table, the tests between the methods, and of both
the papers' six tables with the published values next to them, as CSV, Markdown and LaTeX."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import hypot
from pathlib import Path
from typing import Any

import pandas as pd

from bsip_cli.artifacts import file_rows, write_bytes
from bsip_cli.errors import BadDataError
from bsip_cli.pipeline import STAGES, producer
from bsip_cli.report.tables.build import RENDERERS, build_tables, folder
from bsip_cli.report.words import listing
from bsip_cli.running.unit import Unit
from bsip_cli.statistics.cohort import (
    DATA_SHARE,
    DIFFERENCE,
    PAIR,
    Comparison,
    Criteria,
    PersonTests,
    Topic,
    Value,
    counted,
    line_of,
    person_tests,
    tests_of,
    with_holm,
)
from bsip_cli.statistics.methods import MEASURED, METHODS, OM, RM
from bsip_cli.study.study import Participant, Trial

# Kinds of a trial, and the numbers of the tables that each is in.
IN_SEQUENCE = {"fit": (2, 4, 5, 6), "posturography": (3,), "correlation-difference": (5,)}
IN_OTHERS = {"fit": (4, 5), "posturography": (), "correlation-difference": (5,)}
ROWS_AT_ONCE = 50_000
COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
MEASURES = ("rmse", "pearson_r", "schwer_m", "schwer_p", "schwer_c")
"""Columns of ``fit`` in table 5."""

SWAY = {"mean_velocity": "mm/s", "sway_length": "mm", "ellipse_area": "mm2"}
SWAY |= {"rms_ap": "mm", "rms_ml": "mm", "rms_ap_origin": "m", "rms_ml_origin": "m"}
"""Units of what of ``posturography`` is in table 3."""


def run_tests(unit: Unit) -> None:
    """Read every trial; write the values of each participant and how methods compare."""
    cohort = _Cohort(unit)
    unit.write_in_parts("values", cohort.parts(), cohort.facts)
    unit.write("comparisons", cohort.comparisons(), cohort.facts())


class _Cohort:
    """Lets the participants pass by once, and keeps what the tests and the tables' notes need."""

    def __init__(self, unit: Unit) -> None:
        self._unit = unit
        self._missing: list[dict[str, str | list[str]]] = []
        trials = (trial for person in unit.study.participants for trial in person.trials)
        self._has_sequences = any(trial.role == "sequence" for trial in trials)
        self._lines: dict[Topic, None] = {}
        self._tests: PersonTests = {}
        self._participants = 0
        self._fitted: dict[tuple[str, str, str], dict[str, int]] = defaultdict(
            lambda: {"identification": 0, "everyone": 0}
        )

    # --- participants to values -------------------------------------------------------------

    def parts(self) -> Iterator[pd.DataFrame]:
        """The rows of ``values``, some thousands at a time.

        BadDataError: nobody has any.
        """
        for name, why in self._unit.left_out.items():
            self._lacks(f"{name} is left out, since {why}", 1, 2, 3, 4, 5, 6, is_reported=True)
        waiting: list[Value] = []
        for participant in self._unit.study.participants:
            waiting += self._values_of(participant)
            if len(waiting) >= ROWS_AT_ONCE:
                yield pd.DataFrame(waiting)
                waiting = []
        if not self._participants:
            raise BadDataError(
                "no participant has results of RM and OM",
                file=self._unit.out,
                remedy="run `bsip identify` and `bsip reconstruct`, and read why they refused",
            )
        yield pd.DataFrame(waiting, columns=list(Value._fields))

    def facts(self) -> dict[str, Any]:
        """Who is missing where, and what each task's data were to OM."""
        fitted = [
            {"table": table, "task": task, "role": role, **counts}
            for (table, task, role), counts in self._fitted.items()
        ]
        return {"missing": self._missing, "participants": self._participants, "fitted_on": fitted}

    def _values_of(self, participant: Participant) -> list[Value]:
        before = STAGES[: max(STAGES.index(producer(kind)) for kind in self._unit.stage.reads)]
        home = self._unit.out / participant.id / f"{participant.id}_refusal-"
        of_persons = (stage.name for stage in before if stage.level == "participant")
        if refused := next((s for s in of_persons if Path(f"{home}{s}.parquet").exists()), ""):
            # whose results are all stale
            self._lacks(f"{participant.id} was refused by {refused}", 1, 2, 3, 4, 5, 6)
            return []
        bsip = self._inertias(participant)
        recordings = list(self._recordings(participant))
        if recordings and not any(recording.role == "sequence" for recording in recordings):
            self._lacks(f"{participant.id} has no identification trial", 2, 3, 6)
        runs = (run for recording in recordings for run in _correlations(recording))
        tests = person_tests(participant.id, runs)
        for test in tests:
            test.add_to(self._tests)
        masses, centres = _of_parameters(participant, bsip) if bsip is not None else ([], [])
        of_trials = [value for recording in recordings for value in _of_recording(recording)]
        values = [*masses, *of_trials, *centres, *(v for test in tests for v in test.values())]
        self._participants += bool(values)
        self._lines |= {line_of(value): None for value in values if value.method != PAIR}
        data = defaultdict(set)
        for value in values:
            if value.method == OM and value.data:
                data[value.table, value.task, value.role].add(value.data)
        for place, found in data.items():
            self._fitted[place]["identification"] += "identification" in found
            self._fitted[place]["everyone"] += 1
        return values

    def _lacks(self, what: str, *numbers: int, is_reported: bool = False) -> None:
        """`what` ("sub-02 has no ...") is not in the tables with these numbers."""
        if not is_reported:
            tables = f"table{'s' * (len(numbers) > 1)} {listing([*map(str, numbers)])}"
            self._unit.warn(f"{what}: not in {tables}")
        self._missing.append({"sentence": what, "tables": [f"table{k}" for k in numbers]})

    def _inertias(self, participant: Participant) -> pd.DataFrame | None:
        if not self._unit.path("bsip", participant=participant).exists():
            self._lacks(f"{participant.id} has no identified parameters", 1, 6)
            return None
        frame = self._unit.read("bsip", participant=participant)
        if lacking := [method for method in (OM, RM) if method not in set(frame["method"])]:
            self._lacks(f"{participant.id} has no parameters of {' and '.join(lacking)}", 1, 6)
        return frame

    def _recordings(self, participant: Participant) -> Iterator[Recording]:
        """Trials with results; in a study without sequences those that identified OM stand in."""
        for trial in participant.trials:
            if trial.role == "static":
                continue
            there = [k for k in IN_OTHERS if self._unit.stands(k, trial, participant)]
            lacking = [kind for kind in IN_OTHERS if kind not in there]
            numbers = IN_SEQUENCE if trial.role == "sequence" else IN_OTHERS
            tables = sorted({number for kind in lacking for number in numbers[kind]})
            if tables:
                self._lacks(f"{trial.stem} has no {', no '.join(lacking)}", *tables)
            if there:
                frames = {kind: self._unit.read(kind, trial, participant) for kind in there}
                said = [row["data"] for row in _rows(frames["fit"], OM)] if "fit" in there else []
                # what the trial was to OM
                data = "identification" if "identification" in said else "held_out" * bool(said)
                stands_in = not self._has_sequences and data == "identification"
                yield Recording(trial, "sequence" if stands_in else trial.role, data, frames)

    # --- values to tests --------------------------------------------------------------------

    def comparisons(self) -> list[dict[str, Any]]:
        """All tests, from the written values, a variable at a time."""
        options = self._unit.config.stats
        criteria = Criteria(options.alpha, options.equivalence_percent)
        places = {line: k for k, line in enumerate(self._lines)}
        tests: list[Comparison] = []
        for table, variable in dict.fromkeys((line.table, line.variable) for line in self._lines):
            rows = self._unit.read("values", table=[table], variable=[variable])
            tests += tests_of((Value(*row) for row in rows.itertuples(index=False)), criteria)
        tests.sort(key=lambda test: places[line_of(test.topic)])
        found = with_holm([*tests, *counted(self._tests, criteria.alpha)])
        return [test.as_row() for test in found]


# --- one participant's results as tidy values -------------------------------------------------


@dataclass(frozen=True, eq=False)
class Recording:
    """A trial with what ``reconstruct`` said of it, and its part in this study."""

    trial: Trial
    role: str
    data: str
    frames: dict[str, pd.DataFrame]

    def value(self, table: str, variable: str, method: str, value: float, unit: str) -> Value:
        t = self.trial
        place = (t.participant_id, t.stem, t.task, self.role, self.data, table)
        return Value(*place, variable, method, float(value), unit)


def _rows(frame: pd.DataFrame, *methods: str) -> list[dict[Any, Any]]:
    return frame[frame["method"].isin(methods)].to_dict("records")


def _of_parameters(participant: Participant, bsip: pd.DataFrame) -> tuple[list[Value], list[Value]]:
    """Masses by method; and how far OM's centres of mass lie from RM's along the segments, as
    Robert 2017's table 1."""
    place = (participant.id, "", "all", "", "")
    masses, apart = [], pd.Series(dtype=float)
    for row in _rows(bsip, *METHODS):
        segment, method = row["segment"], row["method"]
        masses.append(Value(*place, "table1", segment, method, row["mass_kg"], "kg"))
        if method == OM:
            share = f"{segment}{DATA_SHARE}"
            masses.append(Value(*place, "table1", share, OM, row["mass_data_share"], "1"))
    along = bsip.pivot_table(index="segment", columns="method", values="com_y_m", sort=False)
    if {OM, RM} <= set(along.columns):
        apart = (along[OM] - along[RM]).abs() * 1000
    summary = {"mean": apart.mean(), "median": apart.median(), "max": apart.max()}
    named = [(name, float(x)) for name, x in (*apart.items(), *summary.items()) if len(apart)]
    centres = [Value(*place, "table6", f"com_{name}", DIFFERENCE, x, "mm") for name, x in named]
    return masses, centres


def _of_recording(recording: Recording) -> list[Value]:
    values: list[Value] = []
    if "fit" in recording.frames:
        rows = _rows(recording.frames["fit"], *METHODS)
        for method in METHODS:
            fits = {row["component"]: row for row in rows if row["method"] == method}
            values += _of_fit(recording, method, fits)
    if "posturography" in recording.frames and recording.role == "sequence":
        for row in _rows(recording.frames["posturography"], MEASURED, *METHODS):
            for name, unit in SWAY.items():
                value = row[f"{name}_{unit.replace('/', '_')}"]
                values.append(recording.value("table3", name, row["method"], value, unit))
    return values


def _of_fit(recording: Recording, method: str, fits: dict[str, dict[str, Any]]) -> Iterator[Value]:
    """Errors of the centre of pressure, of forces by measure, and as vectors (root mean square);
    of a method, by component."""
    is_sequence = recording.role == "sequence"
    if {"cop_ap", "cop_ml"} <= fits.keys():
        ap, ml = fits["cop_ap"], fits["cop_ml"]
        for table in ("table2", "table4") if is_sequence else ("table4",):
            yield recording.value(table, "cop_ap", method, ap["rmse"], ap["unit"])
            yield recording.value(table, "cop_ml", method, ml["rmse"], ml["unit"])
        both = hypot(ap["rmse"], ml["rmse"])
        yield recording.value("table4", "cop_error", method, both, ap["unit"])
    if "grf_vertical" in fits:
        percent = fits["grf_vertical"]["rmse_percent_bw"]
        yield recording.value("table4", "grf_vertical", method, percent, "% body weight")
    for component, measure in product(COMPONENTS, MEASURES):
        if (row := fits.get(component)) is not None:
            unit = row["unit"] if measure == "rmse" else "1"
            yield recording.value("table5", f"{component}_{measure}", method, row[measure], unit)
    if is_sequence and fits.keys() >= set(COMPONENTS):
        force, moment = (hypot(*(fits[f"{kind}{axis}"]["rmse"] for axis in "xyz")) for kind in "fm")
        yield recording.value("table6", "force_residual", method, force, "N")
        yield recording.value("table6", "moment_residual", method, moment, "N m")


def _correlations(recording: Recording) -> Iterator[tuple[Topic, tuple[float, ...]]]:
    trial, frame = recording.trial, recording.frames.get("correlation-difference", pd.DataFrame())
    for row in frame.to_dict("records"):
        if row["component"] not in COMPONENTS or {row["method_a"], row["method_b"]} != {OM, RM}:
            continue
        om, rm = ("r_a", "r_b") if row["method_a"] == OM else ("r_b", "r_a")
        topic = Topic("table5", f"{row['component']}_r", trial.task, recording.role, "1")
        yield topic, (row[om], row[rm], row["r_ab"], row["n_effective"])


# --- the papers' tables ---------------------------------------------------------------------------


def run_tables(unit: Unit) -> None:
    """Read the comparisons; write each of the papers' tables in every format."""
    options, facts = unit.config.stats, unit.facts("values")
    criteria = Criteria(options.alpha, options.equivalence_percent)
    compared = unit.read("comparisons")
    files = [
        write_bytes(folder(unit.out) / f"{table.name}.{ending}", render(table).encode())
        for table in build_tables(compared, criteria, facts["fitted_on"], facts["missing"])
        for ending, render in RENDERERS.items()
    ]
    unit.write("tables-files", file_rows(unit.out, files))
