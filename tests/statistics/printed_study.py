"""Tables of an invented paper, computed from drawn samples and rounded as print rounds."""

from __future__ import annotations

import numpy as np
from scipy import stats

from benchmarks.printed_paper import Cell, Claim, Paper, PrintedTable, Row

N = 12


def cell(values: np.ndarray) -> Cell:
    return Cell.of(f"{values.mean():.2f}({values.std(ddof=1):.2f})")


def cohens_d(x: np.ndarray, y: np.ndarray) -> float:
    return (y.mean() - x.mean()) / np.sqrt((x.var(ddof=1) + y.var(ddof=1)) / 2)


def paired_row(
    name: str, x: np.ndarray, y: np.ndarray, methods: tuple[str, str] = ("A", "B")
) -> Row:
    """As SciPy computes it; d is (y - x) / pooled SD."""
    test = stats.ttest_rel(x, y)
    low, high = test.confidence_interval(0.95)
    tests = {
        "t": f"{test.statistic:.2f}",
        "p": f"{test.pvalue:.3f}".removeprefix("0") + ("*" if test.pvalue < 0.05 else ""),
        "d": f"{cohens_d(x, y):.2f}",
    }
    cells = dict(zip(methods, (cell(x), cell(y)), strict=True))
    return Row(name, name, "kg", cells, tests, ci_text=f"[{low:.2f}, {high:.2f}]")


def paired_table(*rows: Row, claims: tuple[Claim, ...] = ()) -> PrintedTable:
    return PrintedTable("x", 1, "", "paired", ("A", "B"), rows, star="p < alpha", claims=claims)


def drawn_table(seed: int, count: int = 4) -> PrintedTable:
    """A sound table: rows far from each other, small differences."""
    rng = np.random.default_rng(seed)
    rows = []
    for k in range(count):
        x = rng.normal(10.0 + 17.0 * k, 2.0, N)
        rows.append(paired_row(f"row {k}", x, x + rng.normal(1.5 + 0.7 * k, 1.0, N)))
    return paired_table(*rows)


def group_row(name: str, groups: dict[str, np.ndarray], error_of: str = "") -> Row:
    """As SciPy computes it, of samples by method."""
    test = stats.f_oneway(*groups.values())
    cells = {method: cell(values) for method, values in groups.items()}
    tests = {"F": f"{test.statistic:.2f}", "p": f"{test.pvalue:.2f}"}
    return Row(name, name, "mm", cells, tests, error_of=error_of)


def group_table(*rows: Row, errors_in: int = 0) -> PrintedTable:
    return PrintedTable("x", 3, "", "groups", tuple(rows[0].cells), rows, errors_in=errors_in)


def sway_tables(
    *, scale: float = 1.0, from_ml_origin: float = 0.0, seconds: float = 100.0
) -> tuple[PrintedTable, PrintedTable]:
    """Errors [mm] of two methods' paths and the sway of these, its lengths over ``scale``."""
    rng = np.random.default_rng(9)
    ap, ml, speed = (rng.normal(mean, 0.2 * mean, N) for mean in (40.0, 50.0, 30.0))
    ellipse = np.pi * stats.chi2.ppf(0.95, 2) * ap * ml
    methods = {"FP": 1.0, "OM": 1.05, "RM": 1.3}

    def row(name: str, values: np.ndarray, error_of: str = "") -> Row:
        return group_row(name, {m: k * values for m, k in methods.items()}, error_of)

    rows = (
        row("mean_velocity", speed / scale),
        row("sway_length", speed * seconds / scale),
        row("ellipse_area", ellipse / scale**2),
        row("rms_ap", ap / scale, "ap"),
        row("rms_ml", (ml + from_ml_origin) / scale, "ml"),
    )
    small, large = rng.normal(6.0, 1.0, N), rng.normal(25.0, 2.0, N)
    errors = (paired_row(name, small, large, ("OM", "RM")) for name in ("ap", "ml"))
    table = PrintedTable("x", 2, "", "paired", ("OM", "RM"), tuple(errors), star="p < alpha")
    return table, group_table(*rows, errors_in=2)


def paper(*tables: PrintedTable, **more) -> Paper:
    return Paper("x", "X", "nobody, nowhere", "", tables, N, **more)
