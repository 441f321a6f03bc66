"""Every number of the five tables, computed again from the artifacts with SciPy alone."""

from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from bsip_cli.segments import SEGMENTS

ALPHA = 0.05
COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
TASKS = ("sequence", "walking", "throwing")
SWAY = {
    "mean_velocity": ("mean_velocity_mm_s", "mm_s"),
    "sway_length": ("sway_length_mm", "mm"),
    "ellipse_area": ("ellipse_area_mm2", "mm2"),
    "rms_ap": ("rms_ap_mm", "mm"),
    "rms_ml": ("rms_ml_mm", "mm"),
    "rms_ap_origin": ("rms_ap_origin_m", "m"),
    "rms_ml_origin": ("rms_ml_origin_m", "m"),
}


def by_person(frame: pd.DataFrame, column: str) -> dict[str, np.ndarray]:
    """Mean over runs, per method, in the order of the participants."""
    means = frame.groupby(["method", "participant"])[column].mean()
    return {method: means[method].to_numpy() for method in ("OM", "RM")}


def check_pair(row, om, rm, unit: str) -> None:
    """Means, t test, effect sizes and Wilcoxon of one CSV row."""
    test = stats.ttest_rel(om, rm)
    interval = test.confidence_interval(1 - ALPHA)
    pooled = np.sqrt((np.var(om, ddof=1) + np.var(rm, ddof=1)) / 2)
    expected = {
        f"om_mean_{unit}": np.mean(om),
        f"om_sd_{unit}": np.std(om, ddof=1),
        f"rm_mean_{unit}": np.mean(rm),
        f"rm_sd_{unit}": np.std(rm, ddof=1),
        f"difference_{unit}": np.mean(om) - np.mean(rm),
        f"ci_low_{unit}": interval.low,
        f"ci_high_{unit}": interval.high,
        "t": test.statistic,
        "df": len(om) - 1,
        "p": test.pvalue,
        "cohens_d_pooled": (np.mean(rm) - np.mean(om)) / pooled,
        "d_z": np.mean(om - rm) / np.std(om - rm, ddof=1),
        "wilcoxon_w": stats.wilcoxon(om, rm).statistic,
        "wilcoxon_p": stats.wilcoxon(om, rm).pvalue,
        "lilliefors_p": lilliefors_p(om - rm),
    }
    assert dict(row[list(expected)]) == pytest.approx(expected)
    assert row["n"] == len(om)
    assert pd.isna(row["reason"])


def lilliefors_p(values) -> float:
    from statsmodels.stats.diagnostic import lilliefors

    return lilliefors(values, pvalmethod="table")[1]


def check_wins(row, om, rm) -> None:
    wins = int(np.sum(om < rm))
    assert (row["om_smaller"], row["rm_smaller"]) == (wins, len(om) - wins)
    assert row["om_smaller_share"] == pytest.approx(wins / len(om))
    assert row["sign_test_p"] == pytest.approx(stats.binomtest(wins, len(om)).pvalue)


def holm(p_values) -> np.ndarray:
    order = np.argsort(p_values)
    m = len(order)
    steps = np.maximum.accumulate([(m - k) * p_values[i] for k, i in enumerate(order)])
    adjusted = np.empty(m)
    adjusted[order] = np.minimum(steps, 1.0)
    return adjusted


def test_table_1(cohort):
    bsip = cohort.all_of("bsip")
    table = cohort.table("table1_segment_mass").set_index("segment")
    assert sorted(table.index) == sorted(SEGMENTS)
    for segment in SEGMENTS:
        of_segment = bsip[bsip["segment"] == segment]
        om, rm = by_person(of_segment, "mass_kg").values()
        row = table.loc[segment]
        check_pair(row, om, rm, "kg")
        bound = 0.10 * np.mean(rm)
        low = stats.ttest_1samp(om - rm, -bound, alternative="greater")
        high = stats.ttest_1samp(om - rm, bound, alternative="less")
        assert row["equivalence_bound_kg"] == pytest.approx(bound)
        assert row["equivalence_p"] == pytest.approx(max(low.pvalue, high.pvalue))
        weaker = low if low.pvalue > high.pvalue else high
        assert row["equivalence_t"] == pytest.approx(weaker.statistic)
        share = of_segment.loc[of_segment["method"] == "OM", "mass_data_share"]
        assert row["mass_data_share"] == pytest.approx(share.mean())
        assert row["mass_data_share_sd"] == pytest.approx(share.std())
    assert table["p_holm"].to_numpy() == pytest.approx(holm(table["p"].to_numpy()))


def test_table_2(cohort):
    fit = cohort.all_of("fit")
    table = cohort.table("table2_cop_rmse").set_index("axis")
    for axis in ("cop_ap", "cop_ml"):
        chosen = fit[(fit["task"] == "sequence") & (fit["component"] == axis)]
        om, rm = by_person(chosen, "rmse").values()
        check_pair(table.loc[axis], om, rm, "mm")
        check_wins(table.loc[axis], om, rm)


def test_table_3(cohort):
    sway = cohort.all_of("posturography").query("task == 'sequence'")
    table = cohort.table("table3_posturography").set_index("variable")
    for variable, (column, unit) in SWAY.items():
        wide = sway.pivot(index="participant", columns="method", values=column)
        x = wide[["measured", "OM", "RM"]].to_numpy()
        row = table.loc[variable]
        for short, values in zip(("fp", "om", "rm"), x.T, strict=True):
            assert row[f"{short}_mean_{unit}"] == pytest.approx(values.mean())
            assert row[f"{short}_sd_{unit}"] == pytest.approx(values.std(ddof=1))
        check_one_way(row, x)
        check_repeated(row, x)
        assert row["lilliefors_p_smallest"] == pytest.approx(min(lilliefors_p(v) for v in x.T))


def test_table_6(cohort):
    table = cohort.table("table6_centres_of_mass").set_index("variable")
    fit = cohort.all_of("fit").query("task == 'sequence'")
    for kind, unit in (("force", "N"), ("moment", "Nm")):
        axes = [f"{kind[0]}{axis}" for axis in "xyz"]
        squares = fit[fit["component"].isin(axes)].assign(rmse=lambda f: f["rmse"] ** 2)
        sums = squares.groupby(["participant", "method"], as_index=False)["rmse"].sum()
        om, rm = (np.sqrt(v) for v in by_person(sums, "rmse").values())
        check_pair(table.loc[f"{kind}_residual"], om, rm, unit)
    bsip = cohort.all_of("bsip")
    places = bsip.pivot(index=["participant", "segment"], columns="method", values="com_y_m")
    apart = (1000 * (places["OM"] - places["RM"]).abs()).unstack("segment")
    for name, values in (("mean", apart.mean(axis=1)), ("max", apart.max(axis=1))):
        assert table.loc[f"com_{name}", "apart_mean_mm"] == pytest.approx(values.mean())
        assert table.loc[f"com_{name}", "apart_sd_mm"] == pytest.approx(values.std())
    assert table.loc["com_median", "apart_mean_mm"] == pytest.approx(apart.median(axis=1).mean())
    for segment in SEGMENTS:
        assert table.loc[f"com_{segment}", "apart_mean_mm"] == pytest.approx(apart[segment].mean())


def check_one_way(row, x) -> None:
    n, k = x.shape
    test = stats.f_oneway(*x.T)
    assert (row["f"], row["p"]) == pytest.approx((test.statistic, test.pvalue))
    assert (row["df1"], row["df2"]) == (k - 1, k * (n - 1))
    f = test.statistic * (k - 1) / (k * (n - 1))
    assert row["eta_squared"] == pytest.approx(f / (1 + f))
    variance = np.mean(np.var(x, axis=0, ddof=1))
    for (a, i), (b, j) in combinations(zip(("fp", "om", "rm"), range(3), strict=True), 2):
        t = (x[:, i].mean() - x[:, j].mean()) / np.sqrt(variance * 2 / n)
        p = min(1.0, 3 * 2 * stats.t.sf(abs(t), k * (n - 1)))
        assert row[f"bonferroni_p_{a}_{b}"] == pytest.approx(p)
        paired = min(1.0, 3 * stats.ttest_rel(x[:, i], x[:, j]).pvalue)
        assert row[f"repeated_bonferroni_p_{a}_{b}"] == pytest.approx(paired)


def check_repeated(row, x) -> None:
    """F of the two contrasts; epsilon from the eigenvalues of their covariance."""
    n, k = x.shape
    contrasts = np.array([[1, -1, 0], [1, 1, -2]]) / np.sqrt([[2], [6]])
    scores = x @ contrasts.T
    between = n * np.sum(scores.mean(axis=0) ** 2) / (k - 1)
    within = np.sum((scores - scores.mean(axis=0)) ** 2) / ((k - 1) * (n - 1))
    eigenvalues = np.linalg.eigvalsh(np.cov(scores.T))
    epsilon = eigenvalues.sum() ** 2 / ((k - 1) * np.sum(eigenvalues**2))
    df = epsilon * (k - 1), epsilon * (k - 1) * (n - 1)
    assert row["repeated_f"] == pytest.approx(between / within)
    assert row["repeated_epsilon"] == pytest.approx(epsilon)
    assert (row["repeated_df1"], row["repeated_df2"]) == pytest.approx(df)
    assert row["repeated_p"] == pytest.approx(stats.f.sf(between / within, *df))


def test_table_4(cohort):
    fit = cohort.all_of("fit")
    table = cohort.table("table4_cross_validation").set_index(["quantity", "task"])
    assert len(table) == 4 * len(TASKS)
    for task in TASKS:
        of_task = fit[fit["task"] == task]
        ap, ml = (of_task[of_task["component"] == c] for c in ("cop_ap", "cop_ml"))
        both = ap.assign(rmse=np.hypot(ap["rmse"].to_numpy(), ml["rmse"].to_numpy()))
        grf = of_task[of_task["component"] == "grf_vertical"]
        for quantity, frame, column, unit in (
            ("cop_error", both, "rmse", "mm"),
            ("cop_ap", ap, "rmse", "mm"),
            ("cop_ml", ml, "rmse", "mm"),
            ("grf_vertical", grf, "rmse_percent_bw", "percent_bw"),
        ):
            om, rm = by_person(frame, column).values()
            row = table.loc[quantity, task]
            check_pair(row, om, rm, unit)
            check_wins(row, om, rm)
            assert row["role"] == ("sequence" if task == "sequence" else "validation")
            other = "percent_bw" if unit == "mm" else "mm"
            assert pd.isna(row[f"om_mean_{other}"])


def test_table_5(cohort):
    fit = cohort.all_of("fit")
    correlations = cohort.all_of("correlation-difference")
    table = cohort.table("table5_six_components").set_index(["task", "component", "method"])
    assert len(table) == len(TASKS) * 6 * 3
    for task in TASKS:
        for component in COMPONENTS:
            chosen = fit[(fit["task"] == task) & (fit["component"] == component)]
            unit = "N" if component[0] == "f" else "Nm"
            columns = {
                "rmse": ("rmse_mean_" + unit, "rmse_sd_" + unit),
                "pearson_r": ("r_mean", "r_sd"),
                "schwer_m": ("m_mean", "m_sd"),
                "schwer_p": ("p_mean", "p_sd"),
                "schwer_c": ("c_mean", "c_sd"),
            }
            for column, (mean, sd) in columns.items():
                for method, values in by_person(chosen, column).items():
                    row = table.loc[task, component, method]
                    assert row[mean] == pytest.approx(values.mean())
                    assert row[sd] == pytest.approx(values.std(ddof=1))
            om, rm = by_person(chosen, "rmse").values()
            row = table.loc[task, component, "OM"]
            check_wins(row, om, rm)
            test = stats.ttest_rel(om, rm)
            assert (row["rmse_t"], row["rmse_t_p"]) == pytest.approx((test.statistic, test.pvalue))
            of_component = correlations[
                (correlations["task"] == task) & (correlations["component"] == component)
            ]
            check_correlations(row, of_component)


def test_rm_mass_stands_beside_rm_in_every_table(cohort):
    """Its mean, and OM tested against it as against RM, in a family of its own."""
    tables = {
        "table1_segment_mass": ("rm_mean_kg", 0.96),
        "table2_cop_rmse": ("rm_mean_mm", 0.7),
        "table3_posturography": ("rm_mean_mm", 1.0),
        "table4_cross_validation": ("rm_mean_percent_bw", 0.7),
        "table6_centres_of_mass": ("rm_mean_N", 0.7),
    }
    for name, (column, factor) in tables.items():
        table = cohort.table(name)
        beside = table[column.replace("rm_", "rm_mass_")]
        assert beside.to_numpy() == pytest.approx(factor * table[column].to_numpy(), nan_ok=True)
        tested = table["rm_mass_p"].dropna()
        assert len(tested) and cohort.text(name).count("RM+mass M(SD)") == 1
        assert table["rm_mass_p_holm"].dropna().to_numpy() == pytest.approx(holm(tested.to_numpy()))
    five = cohort.table("table5_six_components").set_index("method")
    assert five.loc["RM+mass", "rmse_mean_N"].dropna().to_numpy() == pytest.approx(
        0.7 * five.loc["RM", "rmse_mean_N"].dropna().to_numpy()
    )
    fit = cohort.all_of("fit").query("component == 'grf_vertical' and task == 'walking'")
    wide = fit.pivot(index="participant", columns="method", values="rmse_percent_bw")
    row = cohort.table("table4_cross_validation").set_index(["quantity", "task"])
    row = row.loc["grf_vertical", "walking"]
    test = stats.ttest_rel(wide["OM"], wide["RM+mass"])
    assert (row["rm_mass_t"], row["rm_mass_p"]) == pytest.approx((test.statistic, test.pvalue))
    assert row["rm_mass_om_smaller"] == (wide["OM"] < wide["RM+mass"]).sum()


def check_correlations(row, runs: pd.DataFrame) -> None:
    """Williams' t in Steiger's form, and Fisher's z, person by person."""
    williams, fisher = [], []
    for _, person in runs.groupby("participant"):
        first, second, between = (person[name].mean() for name in ("r_a", "r_b", "r_ab"))
        om_first = person["method_a"].iloc[0] == "OM"
        om, rm = (first, second) if om_first else (second, first)
        n = person["n_effective"].sum()
        matrix = np.array([[1, om, rm], [om, 1, between], [rm, between, 1]])
        spread = 2 * (n - 1) / (n - 3) * np.linalg.det(matrix)
        spread += ((om + rm) / 2) ** 2 * (1 - between) ** 3
        t = (om - rm) * np.sqrt((n - 1) * (1 + between) / spread)
        williams.append((t, 2 * stats.t.sf(abs(t), n - 3)))
        z = (np.arctanh(om) - np.arctanh(rm)) / np.sqrt(2 / (n - 3))
        fisher.append((z, 2 * stats.norm.sf(abs(z))))
        if len(person) == 1:  # the test that the trial's artifact already holds
            sign = 1 if om_first else -1
            assert sign * t == pytest.approx(person["williams_t"].item())
            assert sign * z == pytest.approx(person["fisher_z"].item())
    for name, results in (("williams", williams), ("fisher", fisher)):
        statistic, p = np.array(results).T
        letter = "t" if name == "williams" else "z"
        assert row[f"{name}_{letter}_median"] == pytest.approx(np.median(statistic))
        assert row[f"{name}_p_median"] == pytest.approx(np.median(p))
        assert row[f"{name}_om_better"] == np.sum((p < ALPHA) & (statistic > 0))
        assert row[f"{name}_rm_better"] == np.sum((p < ALPHA) & (statistic < 0))
    assert row["williams_n"] == runs["participant"].nunique()


def test_values_hold_every_run_and_only_the_compared_methods(cohort):
    values = cohort.group("values")
    methods = {"OM", "RM", "RM+mass", "measured", "OM-RM", "|OM-RM|"}
    assert set(values["method"]) == methods
    runs = values.query("table == 'table4' and task == 'throwing' and variable == 'cop_ap'")
    assert len(runs) == 8 * 2 * 3
    assert set(runs["data"]) == {"held_out"}
    assert set(values.loc[values["table"].isin(["table2", "table3"]), "role"]) == {"sequence"}
    assert not set(values["task"]) & {"static"}
