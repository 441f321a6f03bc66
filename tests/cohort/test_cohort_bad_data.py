"""Few participants, missing ones, columns that do not vary: said in words, never a crash."""

import numpy as np
import pandas as pd
import pytest

from bsip_cli.artifacts import read_header, write_artifact
from bsip_cli.report.tables.build import IN_PRINT, NAMES, RENDERERS, show
from bsip_cli.report.tables.published import comparison_name
from tests.cohort.conftest import NOTES


def refuse(cohort, participant: str, stage: str, stem: str = "") -> None:
    row = pd.DataFrame([{"stage": stage, "kind": "bad data", "sentence": "no."}])
    path = cohort.out / participant / f"{stem or participant}_refusal-{stage}.parquet"
    write_artifact(path, "refusal", row, NOTES)


@pytest.mark.parametrize("participants", [1, 2])
def test_too_few_participants(make_cohort, participants):
    """Means and SDs are printed, tests are named as not possible."""
    cohort = make_cohort(participants)
    cohort.run()
    for name in NAMES[:4]:
        table = cohort.table(name)
        means = [c for c in table.columns if c.startswith("om_mean")]
        sds = [c for c in table.columns if c.startswith("om_sd")]
        assert (table[means].notna().sum(axis=1) == 1).all()
        assert (table[sds].notna().sum(axis=1) == (1 if participants == 2 else 0)).all()
        tested = name == "table3_posturography" and participants == 2  # a one-way ANOVA needs two
        assert table["p"].notna().all() if tested else table["p"].isna().all()
        assert table["reason"].notna().all()
        assert "Not possible (all rows): " in cohort.text(name)
        word = "participant" if participants == 1 else "participants"
        assert f"n = {participants} {word}." in cohort.text(name)
    assert f"A paired t test needs 3 pairs, there are {participants}." in cohort.text(NAMES[0])
    assert "nan" not in show(cohort.out)
    five = cohort.table("table5_six_components")  # these tests are each participant's own
    assert five.loc[five["method"] == "OM", "williams_t_median"].notna().all()


def test_one_refused_participant_is_named_and_left_out(make_cohort):
    """Its old artifacts are still there, and stale."""
    cohort = make_cohort(8)
    refuse(cohort, "sub-03", "identify")
    outcome = cohort.perform("stats")
    assert outcome.state == "done"
    sentence = "sub-03 was refused by identify"
    assert f"{sentence}: not in tables 1, 2, 3, 4, 5 and 6" in outcome.sentences
    assert cohort.perform("tables").state == "done"
    for name in NAMES:
        assert set(cohort.table(name)["n"]) == {7}, name
        assert f"Missing: {sentence}." in cohort.text(name)
    assert "sub-03" not in set(cohort.group("values")["participant"])


def test_refused_and_missing_trials(make_cohort):
    cohort = make_cohort(8)
    people = {person.id: person for person in cohort.study.participants}
    walking = {name: next(t for t in p.trials if t.task == "walking") for name, p in people.items()}
    refuse(cohort, "sub-02", "reconstruct", walking["sub-02"].stem)
    cohort.path("correlation-difference", "sub-04", walking["sub-04"]).unlink()
    (cohort.out / "sub-05" / "sub-05_bsip.parquet").unlink()
    messages = cohort.perform("stats").sentences
    cohort.perform("tables")
    assert messages == (
        "sub-02_task-walking has no fit, no posturography, no correlation-difference: not in "
        "tables 4 and 5",
        "sub-04_task-walking has no correlation-difference: not in table 5",
        "sub-05 has no identified parameters: not in tables 1 and 6",
    )
    assert set(cohort.table("table1_segment_mass")["n"]) == {7}
    four = cohort.table("table4_cross_validation").set_index(["quantity", "task"])["n"]
    assert four["cop_error"].to_dict() == {"walking": 7, "throwing": 8, "sequence": 8}
    assert "n = 7 to 8 participants" in cohort.text("table4_cross_validation")
    five = cohort.table("table5_six_components").set_index(["task", "component", "method"])
    assert five.loc[("walking", "fx", "OM"), ["n", "williams_n"]].tolist() == [7, 6]
    assert "sub-04_task-walking" in cohort.text("table5_six_components")
    assert "sub-04_task-walking" not in cohort.text("table4_cross_validation")


def test_columns_that_do_not_vary(make_cohort):
    """A massless segment, equal masses, equal errors and sway: no test, and the reason."""
    cohort = make_cohort(8)

    def masses(frame):
        frame.loc[frame["segment"] == "head", "mass_kg"] = 4.0
        frame.loc[frame["segment"] == "hand_l", "mass_kg"] = 0.0
        return frame

    for person in cohort.study.participants:
        cohort.change("bsip", person.id, None, masses)
        for trial in person.trials:
            cohort.change("fit", person.id, trial, lambda f: f.assign(rmse=5.0, pearson_r=np.nan))
            cohort.change("posturography", person.id, trial, lambda f: f.assign(rms_ap_mm=7.0))
    cohort.run()
    one = cohort.table("table1_segment_mass").set_index("segment")
    assert one.loc["head", ["om_mean_kg", "om_sd_kg", "rm_mean_kg"]].tolist() == [4.0, 0.0, 4.0]
    assert one.loc[["head", "hand_l"], ["t", "p", "equivalence_p"]].isna().all(axis=None)
    assert "All differences are equal" in one.loc["head", "reason"]
    assert one.loc["thigh_l", "p"] > 0
    text = cohort.text("table1_segment_mass")
    assert "Not possible (head, left hand): All differences are equal" in text
    assert "Not possible (all rows)" in cohort.text("table2_cop_rmse")
    assert "no finite value" in cohort.text("table3_posturography")
    five = cohort.table("table5_six_components")
    assert five["r_mean"].isna().all()
    assert five.loc[five["method"] == "OM", "om_smaller"].eq(0).all()


def test_runs_count_only_with_both_methods(make_cohort):
    """A run without RM must not shift OM's mean against RM's."""
    cohort = make_cohort(4)
    person = cohort.study.participants[0]
    first, second = (t for t in person.trials if t.task == "throwing")
    cohort.change("fit", person.id, second, lambda f: f[f["method"] != "RM"])
    cohort.run()
    errors = cohort.all_of("fit").query("task == 'throwing' and component == 'grf_vertical'")
    om = errors[errors["method"] == "OM"].groupby("participant")["rmse_percent_bw"].mean()
    fit = pd.read_parquet(cohort.path("fit", person.id, first))
    chosen = fit.query("method == 'OM' and component == 'grf_vertical'")["rmse_percent_bw"]
    om[person.id] = chosen.item()
    table = cohort.table("table4_cross_validation").set_index(["quantity", "task"])
    mean = table.loc[("grf_vertical", "throwing"), "om_mean_percent_bw"]
    assert mean == pytest.approx(om.mean())


def test_correlation_tests_that_are_not_possible(make_cohort):
    cohort = make_cohort(4)
    person = cohort.study.participants[0]
    trial = next(t for t in person.trials if t.task == "walking")
    cohort.change("correlation-difference", person.id, trial, lambda f: f.assign(n_effective=3.0))
    cohort.run()
    five = cohort.table("table5_six_components").set_index(["task", "component", "method"])
    assert five.loc[("walking", "fx", "OM"), "williams_n"] == 3
    reason = "in 1 of 4 participants: The test needs 4 independent samples, there are 3."
    assert reason in five.loc[("walking", "fx", "OM"), "reason"]
    assert reason in cohort.text("table5_six_components")


def test_study_without_sequence(make_cohort):
    """The trial that identified OM takes its place; a trial of the same task stays held out."""
    cohort = make_cohort(4, ("static", "walking", "throwing_run-1", "throwing_run-2"))
    for person in cohort.study.participants:
        trial = next(t for t in person.trials if t.stem.endswith("run-1"))
        cohort.change("fit", person.id, trial, lambda f: f.assign(data="identification"))
    cohort.run()
    two, four = cohort.table("table2_cop_rmse"), cohort.table("table4_cross_validation")
    assert set(two["n"]) == {4}
    roles = four.loc[four["quantity"] == "cop_error", ["task", "role"]].to_records(index=False)
    assert {tuple(pair) for pair in roles} == {
        ("walking", "validation"),
        ("throwing", "validation"),
        ("throwing", "sequence"),
    }
    assert "task: throwing" in cohort.text("table2_cop_rmse")
    assert "throwing (identified OM; in the paper: random, 120 s)" in cohort.text(
        "table4_cross_validation"
    )


def test_no_identification_data_at_all(make_cohort):
    """Neither a sequence nor a trial that identified: tables 2 and 3 are empty, and say so."""
    cohort = make_cohort(3, ("static", "walking"))
    messages = cohort.perform("stats").sentences
    assert "sub-02 has no identification trial: not in tables 2, 3 and 6" in messages
    assert cohort.perform("tables").state == "done"
    assert len(cohort.table("table2_cop_rmse")) == len(cohort.table("table3_posturography")) == 0
    assert "sub-02 has no identification trial" in cohort.text("table3_posturography")


def test_everybody_refused(make_cohort):
    cohort = make_cohort(2)
    for person in cohort.study.participants:
        refuse(cohort, person.id, "scale")
    outcome = cohort.perform("stats")
    assert (outcome.state, outcome.exit_code) == ("refused", 3)
    assert "no participant has results of RM and OM" in outcome.sentences[-1]


def test_freshness_and_files(make_cohort):
    cohort = make_cohort(3)
    cohort.run()
    assert [cohort.perform(name).state for name in ("stats", "tables")] == ["fresh", "fresh"]
    files = sorted(path.name for path in (cohort.out / "group" / "tables").iterdir())
    assert files == sorted(
        f"{name}.{ending}"
        for name in (*NAMES, *map(comparison_name, IN_PRINT))
        for ending in RENDERERS
    )
    listed = cohort.group("tables-files")
    assert sorted(listed["file"]) == [f"group/tables/{file}" for file in files]
    before = {file: (cohort.out / file).read_bytes() for file in listed["file"]}
    assert cohort.perform("tables", force=True).state == "done"
    assert before == {file: (cohort.out / file).read_bytes() for file in listed["file"]}
    stricter = cohort.config.stats.model_copy(update={"alpha": 0.01})
    cohort.config = cohort.config.model_copy(update={"stats": stricter})
    assert [cohort.perform(name).state for name in ("stats", "tables")] == ["done", "done"]
    assert "99% CI" in cohort.text(NAMES[0]) and "99\\% CI" in cohort.text(NAMES[0], "tex")
    assert "significant: p < .01." in cohort.text(NAMES[0])
    facts = read_header(cohort.out / "group" / "group_values.parquet")["provenance"]["facts"]
    assert (facts["missing"], facts["participants"]) == ([], 3)


def test_show_without_tables(tmp_path):
    assert show(tmp_path) == ""
