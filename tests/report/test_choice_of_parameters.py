"""`choose` and the places that tell which parameters to use."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bsip_cli.diagnosis.support import Support
from bsip_cli.report.errors import use_sentence
from bsip_cli.stages import choose
from bsip_cli.statistics.choice import COMPONENTS
from bsip_cli.statistics.methods import MEASURED, OM, RM, RM_MASS
from bsip_cli.study.study import Trial

SIGNALS = choose._SIGNALS
ERRORS = {RM: 1.0, RM_MASS: 0.9, OM: 0.5}
RAIL = asdict(
    Support(
        ("hand_l",), 0.001, 0.02, 0.0, 9.0, (0.0, 5.0, 40.0), (1.0, 1.0, 1.0), (60.0, 50.0, 70.0)
    )
)
SEEN, UNSEEN = "sequence", "walking"
IDENTIFIED = pd.DataFrame(
    {"method": [RM_MASS, OM], "rare": False, "mass_factor": 0.96, "mass_factor_sd": 0.02}
)


def fit(errors: dict[str, float], data: str) -> pd.DataFrame:
    rows = [(m, c, e, data) for m, e in errors.items() for c in (*COMPONENTS, "grf_vertical")]
    return pd.DataFrame(rows, columns=["method", "component", "rmse", "data"])


def reconstruction(errors: dict[str, float]) -> pd.DataFrame:
    rng = np.random.default_rng(1)
    parts = [
        pd.DataFrame(size * rng.normal(size=(300, 8)), columns=SIGNALS).assign(method=method)
        for method, size in ({MEASURED: 0.0} | errors).items()
    ]
    return pd.concat(parts, ignore_index=True).assign(valid=True, used=False)


def chosen(trials: dict[str, dict], *, rare=False, contacts=(), identified=True) -> pd.DataFrame:
    """What `choose` writes; of trials ``task_run`` with the error of each method."""
    own = {name: name.split("_")[0] == SEEN for name in trials}
    made = {
        name: Trial("sub-01", name.split("_")[0], name, Path(name), "sequence" if own[name] else "")
        for name in trials
    }
    data = {name: "held_out" if not own[name] or rare is None else "identification" for name in own}
    tables = {
        "identification": IDENTIFIED.assign(rare=[False, bool(rare)]),
        "used-blocks": pd.DataFrame({"trial": [name for name in own if own[name]]}),
    }
    if not identified:
        tables["identification"] = tables["identification"].iloc[:0]
    written: list[pd.DataFrame] = []

    def read(kind, trial=None):
        if trial is None:
            return tables[kind]
        errors = trials[trial.stem]
        return fit(errors, data[trial.stem]) if kind == "fit" else reconstruction(errors)

    unit = SimpleNamespace(
        name="sub-01",
        read=read,
        say=lambda text: None,
        trials=lambda *kinds: tuple(made.values()),
        facts=lambda kind: {"external_contacts": dict.fromkeys(contacts, RAIL)},
        write=lambda kind, frame: written.append(frame),
    )
    choose.run(unit)
    return written[0].set_index("movement", drop=False)


def worse(factor: float) -> dict[str, float]:
    return {RM: 1.0, RM_MASS: 0.9, OM: factor}


def test_a_row_for_all_and_one_per_unseen_movement():
    table = chosen({SEEN: ERRORS, "walking_1": ERRORS, "walking_2": worse(0.55), "squat": ERRORS})
    assert list(table.index) == ["all", UNSEEN, "squat"]
    assert set(table["use"]) == {OM} and set(table["data"]) == {"whole_trials"}
    assert list(table["trials"]) == [3, 2, 1]
    assert table.loc[UNSEEN, "ratio_om"] == pytest.approx(np.sqrt(0.5 * 0.55))
    assert table.loc["squat", "ratio_om"] == pytest.approx(0.5, rel=0.1)
    assert table.loc["squat", "log_error_om"] < 0.1


def test_where_om_fails_another_is_said():
    good, bad = {"steps_1": ERRORS, "steps_2": worse(0.52)}, {"run_1": worse(1.5)}
    table = chosen(good | bad | {"run_2": worse(1.6)})
    assert dict(table["use"]) == {"all": RM_MASS, "steps": OM, "run": RM_MASS}
    said = use_sentence(table, IDENTIFIED)
    assert said.startswith(
        "Use OM for steps, else RM+mass (the table times 0.960 ± 0.04): in 2 other recordings its "
    )


def test_the_numbers_are_of_the_recordings_for_which_the_method_is_to_be_used():
    """Not of the run, where another is."""
    good = {f"{task}_{k}": worse(0.5 + 0.01 * k) for task in ("squats", "steps") for k in (1, 2)}
    table = chosen(good | {"run_1": worse(0.99), "run_2": worse(1.01)})
    assert table.loc["all", "use"] == OM and table.loc["run", "use"] == RM_MASS
    said = use_sentence(table, IDENTIFIED)
    assert "else OM: in 4 other recordings its error is 49 % smaller than RM's" in said
    only = table.assign(use=[OM, RM, RM, RM])
    said = use_sentence(only, IDENTIFIED)
    assert "else OM: in 6 other recordings together OM's" in said


def test_the_trials_that_identified_do_not_judge():
    table = chosen({SEEN: ERRORS})
    assert list(table["use"]) == [RM] and list(table["data"]) == ["none"]


def test_held_out_seconds_count_only_where_there_is_no_other_trial_and_it_is_said():
    alone = chosen({SEEN: ERRORS}, rare=None)
    assert list(alone["data"]) == ["held_out", "held_out"] and set(alone["use"]) == {OM}
    assert "in seconds of 1 recording that were held out" in use_sentence(alone, IDENTIFIED)
    assert list(chosen({SEEN: ERRORS, UNSEEN: ERRORS}, rare=None).index) == ["all", UNSEEN]


def test_a_marked_body_is_never_used_and_it_is_said():
    table = chosen({UNSEEN: ERRORS, "squat": ERRORS}, rare=True)
    assert OM not in set(table["use"])
    assert "fewer than 1 in 100 people" in use_sentence(table, IDENTIFIED.assign(rare=True))


def test_a_hand_on_a_rail_judges_nobody():
    table = chosen({UNSEEN: ERRORS, "rail": worse(9.0)}, contacts=["rail"])
    assert list(table.index) == ["all", UNSEEN]


def test_without_identification_the_table_stands():
    table = chosen({UNSEEN: {RM: 1.0}}, identified=False)
    assert list(table["use"]) == [RM] and table["data"].iloc[0] == "none"
