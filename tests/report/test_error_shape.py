"""What an error looks like over time, of errors that were put into a recording."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bsip_cli.report.recordings import shape_of
from bsip_cli.report.words import TEXTS

TIMES_S = np.arange(0.0, 10.0, 0.01)
LOAD_N = 600.0 + 200.0 * np.sin(TIMES_S) + 100.0 * np.sign(np.sin(3.0 * TIMES_S))
SWING = np.sin(7.3 * TIMES_S)  # goes along with nothing
FORCE, COP = ("fz_N",), ("cop_ap_m", "cop_ml_m")


def shape(columns, **errors):
    """Of a recording in which RM errs by ``errors`` of the columns so named."""
    measured = pd.DataFrame(
        {"time_s": TIMES_S, "fz_N": LOAD_N, "cop_ap_m": 0.0, "cop_ml_m": 0.0, "valid": True}
    )
    simulated = measured.assign(**{name: measured[name] + by for name, by in errors.items()})
    table = pd.concat([measured.assign(method="measured"), simulated.assign(method="RM")])
    return shape_of(table, "RM", columns)


@pytest.mark.parametrize(
    ("kind", "force_error_N"),
    [
        ("constant", np.full_like(TIMES_S, 30.0) + SWING),
        ("load", 0.1 * (LOAD_N - LOAD_N.mean()) + SWING),
        ("brief", SWING + np.where(np.abs(TIMES_S - 4.0) < 0.1, 80.0, 0.0)),
        ("impact", SWING + np.where(np.abs(np.gradient(LOAD_N)) > 50.0, 80.0, 0.0)),
        ("mixed", 20.0 * SWING),
    ],
)
def test_of_a_force(kind, force_error_N):
    assert shape(FORCE, fz_N=force_error_N).kind == kind


def test_of_a_centre_of_pressure():
    """With the direction in which it errs most."""
    off = shape(COP, cop_ml_m=0.03 + 0.002 * SWING, cop_ap_m=0.01 * SWING)
    assert (off.kind, off.column) == ("shifted", "cop_ml_m")
    light = np.where(np.quantile(LOAD_N, 0.2) > LOAD_N, 0.05 * np.sign(SWING), 0.0)
    assert shape(COP, cop_ap_m=light).kind == "light"


def test_when_it_is_largest_and_where_nothing_is_known():
    at_4_s = SWING + np.where(np.abs(TIMES_S - 4.0) < 0.005, 80.0, 0.0)
    assert shape(FORCE, fz_N=at_4_s).worst_s == pytest.approx(4.0)
    assert shape(FORCE) is None and shape_of(None, "RM", FORCE) is None


def test_every_kind_has_its_words():
    kinds = {"shifted", "constant", "load", "brief", "impact", "light", "mixed"}
    assert {*TEXTS["to_do"]["shapes"]} == kinds
