"""What all answers together say, as tables."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import binomtest, norm

from tests.blind.blind_cases import NOTHING
from tests.blind.blind_running import write_atomically
from tests.blind.blind_scoring import (
    FOUND,
    MISSED,
    RIGHT_CLASS,
    RIGHT_NAME,
    SILENT,
    UNEXPLAINED,
    VERDICTS,
    WRONG_NAME,
    Estimate,
)

HIDDEN_KINDS = ("single", "double", "outside")
ESTIMATED = [field.name for field in fields(Estimate)]


def estimates_frame(scores: pd.DataFrame) -> pd.DataFrame:
    """One row per estimated parameter of a found effect."""
    rows = [
        {"effect": score.effect, "kind": score.kind, "size": abs(score.size), **estimate}
        for score in scores.itertuples()
        for estimate in score.estimates
    ]
    columns = ["effect", "kind", "size", *ESTIMATED]
    return pd.DataFrame(rows, columns=columns)


def verdicts(scores: pd.DataFrame) -> pd.DataFrame:
    """How often each verdict, per hidden effect of the catalogue hidden alone."""
    single = scores[scores["kind"] == "single"]
    table = pd.crosstab(single["effect"], single["verdict"])
    table = table.reindex(columns=[v for v in VERDICTS if v in table], fill_value=0)
    groups = single.groupby("effect")
    table.insert(0, "cases", groups.size())
    table["target right"] = groups["target_right"].apply(_part_true)
    table["wrong names beside"] = groups["wrong"].apply(lambda all_: sum(map(bool, all_)))
    return _with_total(table)


def elsewhere(scores: pd.DataFrame) -> pd.DataFrame:
    """Found effects that are said to sit where they do not."""
    wrong = scores[scores["target_right"].eq(False)]
    said = wrong["targets"].apply(", ".join)
    return pd.DataFrame({"effect": wrong["effect"], "hidden at": wrong["target"], "said at": said})


def confusion(scores: pd.DataFrame) -> pd.DataFrame:
    """Rows: what is hidden, alone; columns: what the answer is."""
    alone = scores[scores["kind"].isin(["null", "single", "outside"])]
    says = alone["says"].where(alone["says"] != "", "no answer")
    return pd.crosstab(alone["effect"], says.rename("answer"))


def detection(scores: pd.DataFrame, parts: int = 3) -> pd.DataFrame:
    """Found (name or class) of all, in as many parts of the sizes with equal counts."""
    rows = []
    for effect, group in scores[scores["kind"] == "single"].groupby("effect"):
        ordered = group.assign(size=group["size"].abs()).sort_values("size")
        for part in np.array_split(np.arange(len(ordered)), parts):
            if len(part):
                chosen = ordered.iloc[part]
                least, most = chosen["size"].min(), chosen["size"].max()
                row = {
                    "effect": effect,
                    "size": f"{least:.3g} to {most:.3g} {chosen['unit'].iloc[0]}",
                }
                row["found"] = _part_true(chosen["verdict"].isin(FOUND))
                row["noticed"] = _part_true(~chosen["verdict"].isin([MISSED, SILENT]))
                rows.append(row)
    return pd.DataFrame(rows)


def by_place(scores: pd.DataFrame) -> pd.DataFrame:
    """Found of all, where the effect is in the whole session or in one trial of a kind."""
    single = scores[scores["kind"] == "single"]
    groups = single["verdict"].isin(FOUND).groupby([single["effect"], single["place"]])
    return groups.apply(_part_true).unstack().fillna("")


def false_positives(scores: pd.DataFrame) -> pd.DataFrame:
    """Recordings with nothing hidden, and in how many of them something is named."""
    quiet = scores[scores["effect"] == NOTHING]
    rows = []
    for kind, group in quiet.groupby("kind"):
        count = (group["verdict"] != RIGHT_NAME).sum()
        low, high = wilson(int(count), len(group))
        certain = (group["verdict"] == WRONG_NAME).sum()
        what = sorted({wrong for case in group["wrong"] for wrong in case})
        rows.append(
            {
                "nothing hidden in": "a whole session" if kind == "null" else "one trial",
                "cases": len(group),
                "false positives": count,
                "of which named": certain,
                "rate": f"{count / len(group):.1%} ({low:.1%} to {high:.1%})",
                "what": ", ".join(what),
            }
        )
    return pd.DataFrame(rows)


def beyond(scores: pd.DataFrame) -> pd.DataFrame:
    """What the catalogue lacks: `unexplained` is right, a name the worst answer."""
    outside = scores[scores["kind"] == "outside"]
    names = {RIGHT_NAME: UNEXPLAINED, MISSED: "none"}
    table = pd.crosstab(outside["effect"], outside["verdict"].replace(names))
    return _with_total(table)


def pairs(scores: pd.DataFrame) -> pd.DataFrame:
    """Two effects at once: how many of the two are found, and cases with a wrong name."""
    double = scores[scores["kind"] == "double"]
    cases = double.groupby("case")
    found = cases["verdict"].apply(lambda v: int(v.isin(FOUND).sum()))
    wrong = cases["wrong"].apply(lambda all_: bool(all_.iloc[0]))
    effects = cases["effect"].apply(" and ".join)
    table = pd.DataFrame({"hidden": effects, "found": found, "wrong": wrong})
    groups = table.groupby("hidden")
    counts = pd.crosstab(table["hidden"], table["found"]).reindex(columns=[2, 1, 0], fill_value=0)
    counts.columns = ["both", "one", "none"]
    counts.insert(0, "cases", groups.size())
    return counts.assign(**{"a wrong name": groups["wrong"].sum()})


def accuracy(estimates: pd.DataFrame) -> pd.DataFrame:
    """Bias and spread of what is found beside its size, and how often the interval holds it."""
    rows = []
    for (effect, parameter), group in estimates.groupby(["effect", "parameter"], sort=False):
        error = group["estimate"] - group["truth"]
        rows.append(
            {
                "effect": effect,
                "parameter": parameter,
                "unit": group["unit"].iloc[0],
                "found": len(group),
                "median size": group["truth"].abs().median(),
                "bias": error.mean(),
                "spread": error.std(ddof=1) if len(error) > 1 else np.nan,
                "median error": error.abs().median(),
                "errors / bound": _beside_bound(error, group["bound"]),
                "95 % CI holds it": _part_true(_inside(group)) or "0 of 0",
            }
        )
    return pd.DataFrame(rows)


def _beside_bound(error: pd.Series, bound: pd.Series) -> float:
    """Median error, each in units of its own bound of Cramér and Rao, beside a normal one's."""
    known = bound.astype(float) > 0
    ratio = error[known].abs() / bound[known].astype(float)
    return float(ratio.median() / norm.ppf(0.75)) if known.any() else np.nan


def coverage(estimates: pd.DataFrame) -> str:
    """One sentence over all parameters with an interval."""
    inside = _inside(estimates)
    if inside.empty:
        return "No estimate has an interval."
    low, high = wilson(int(inside.sum()), len(inside))
    return (
        f"{_part_true(inside)} stated 95 % intervals hold the truth "
        f"({inside.mean():.1%}; {low:.1%} to {high:.1%})."
    )


def _inside(estimates: pd.DataFrame) -> pd.Series:
    """Whether an interval holds the truth, of those that are stated."""
    stated = estimates.dropna(subset=["ci_low", "ci_high"])
    return stated["truth"].between(stated["ci_low"], stated["ci_high"])


def gains(scores: pd.DataFrame) -> pd.DataFrame:
    """Median share of the error that the found effects take away [%]."""
    found = scores[scores["kind"].isin(HIDDEN_KINDS) & scores["verdict"].isin(FOUND)]
    columns = ["gain_percent", "held_out_gain_percent"]
    numbers = found[["effect", *columns]].astype(dict.fromkeys(columns, float))
    table = numbers.groupby("effect")[columns].median()
    table.columns = ["gain in the diagnosis [%]", "gain of `extend` [%]"]
    table.insert(0, "found", numbers.groupby("effect").size())
    return table


def wilson(count: int, total: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson's score interval)."""
    low, high = binomtest(count, total).proportion_ci(method="wilson")
    return float(low), float(high)


def _part_true(values: pd.Series) -> str:
    known = values.dropna()
    return f"{int(known.sum())} of {len(known)}" if len(known) else ""


def _with_total(table: pd.DataFrame) -> pd.DataFrame:
    numbers = table.select_dtypes("number")
    total = numbers.sum().reindex(table.columns).to_frame("all").T
    total[numbers.columns] = total[numbers.columns].astype(int)
    joined = pd.concat([table, total]).fillna("")
    joined.index.name = "hidden"
    return joined


def lead(scores: pd.DataFrame) -> str:
    """In two sentences how many are found."""
    estimates = estimates_frame(scores)
    single = scores[scores["kind"] == "single"]
    found = single["verdict"].isin(FOUND)
    classes = (single["verdict"] == RIGHT_CLASS).sum()
    return (
        f"Of {len(single)} effects hidden alone {found.sum()} are found ({classes} of them as a "
        f"class), {(single['verdict'] == WRONG_NAME).sum()} get a wrong name for certain. "
        f"{coverage(estimates)}"
    )


def tables(scores: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Those that have rows, by the names of their files."""
    all_of_them = {
        "blind_effects": verdicts(scores),
        "blind_wrong_place": elsewhere(scores),
        "blind_false_positives": false_positives(scores),
        "blind_outside": beyond(scores),
        "blind_pairs": pairs(scores),
        "blind_confusion": confusion(scores),
        "blind_sizes": detection(scores),
        "blind_places": by_place(scores),
        "blind_estimates": accuracy(estimates_frame(scores)),
        "blind_gains": gains(scores),
    }
    return {name: table for name, table in all_of_them.items() if len(table)}


def document(scores: pd.DataFrame) -> str:
    """All tables for a terminal."""
    written = [f"{name}\n\n{table.to_string()}" for name, table in tables(scores).items()]
    return "\n\n".join([lead(scores), *written]) + "\n"


def write_csv(folder: Path, name: str, table: pd.DataFrame) -> None:
    """The table as a data file, its index first where that has a name."""
    text = table.to_csv(index=bool(table.index.name), float_format="%.3g", lineterminator="\n")
    write_atomically(folder / f"{name}.csv", text.rstrip("\n"))
