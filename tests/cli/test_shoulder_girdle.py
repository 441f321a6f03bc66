"""Robert 2017's 17 segments from C3D to report and models, on a person whose shoulders move."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

from bsip_cli.segments import LINKS, SEGMENTS

ESTIMATORS = '["consistent", "hansen2017", "robert2017", "base"]'
IDENTIFY = f"[identify]\nhold_out_fraction = 0.4\nestimators = {ESTIMATORS}\n"
SEQUENCE = "sub-01_task-sequence_run-1"


@pytest.fixture(scope="module")
def study(bsip, tmp_path_factory) -> Path:
    """51 markers, the shoulders raised and brought forward by up to 20 degrees."""
    folder = tmp_path_factory.mktemp("girdle") / "study"
    tasks = ("--task", "static", "--task", "sequence", "--sequence-s", 12)
    bsip.done("simulate", folder, "--participants", 1, "--seed", 1, *tasks, "--shoulder-girdle")
    settings = folder / "study.toml"
    settings.write_text(settings.read_text() + IDENTIFY)
    return folder


@pytest.fixture(scope="module")
def out(bsip, study) -> Path:
    folder = study.parent / "out"
    bsip.done("run", study, "--out", folder, "--jobs", 1)
    return folder


def table(out: Path, name: str) -> pd.DataFrame:
    return pd.read_parquet(out / "sub-01" / f"{name}.parquet")


def test_every_stage_has_its_segments(out):
    assert set(table(out, "sub-01_skeleton")["segment"]) == {*SEGMENTS, *LINKS}
    bsip = table(out, "sub-01_bsip")
    assert {*bsip["method"]} == {"RM", "RM+mass", "OM", "hansen2017", "robert2017", "base"}
    for _, rows in bsip.groupby("method"):
        assert set(rows["segment"]) == {*SEGMENTS} and len(rows) == 15
    assert set(table(out, "sub-01_identification")["rank"]) == {130}
    riding = table(out, "sub-01_marker-positions").set_index("marker")["segment"]
    assert len(riding) == 51
    assert dict(riding[["RAC", "LCLA", "RAA", "RSCAP"]]) == {
        "RAC": "clavicle_r",
        "LCLA": "clavicle_l",
        "RAA": "clavicle_r",
        "RSCAP": "upper_torso",
    }


def test_the_clavicles_move_as_they_do(out):
    """Raised and brought forward by 20 degrees at most, and with the arms."""
    kinematics = table(out, f"{SEQUENCE}_kinematics")
    turned = kinematics[[f"q_sternoclavicular_r_q{axis}" for axis in "xyz"]].to_numpy()
    angles = 2 * np.degrees(np.arcsin(np.linalg.norm(turned, axis=1).clip(max=1)))
    assert 10 < np.percentile(angles, 95) < 45


def test_models_of_17_links_weigh_what_the_person_does(bsip, study, out):
    bsip.done("export", study, "--out", out, "--method", "OM")
    files = {path.suffix for path in (out / "sub-01" / "export").iterdir()}
    assert files == {".urdf", ".xml", ".osim", ".bioMod", ".csv"}
    model = pin.buildModelFromUrdf(
        str(out / "sub-01" / "export" / "sub-01_OM.urdf"), pin.JointModelFreeFlyer()
    )
    bsip_rows = table(out, "sub-01_bsip")
    mass = bsip_rows.loc[bsip_rows["method"] == "OM", "mass_kg"].sum()
    assert pin.computeTotalMass(model) == pytest.approx(mass, rel=1e-9)
    assert model.nv == 46
    assert all(name in [frame.name for frame in model.frames] for name in LINKS)


def errors(out: Path) -> tuple[float, float]:
    """Marker residual [m], and OM's error in forces and moments it has not seen, geometric mean."""
    residual = table(out, f"{SEQUENCE}_marker-residuals")["residual_m"]
    fit = table(out, f"{SEQUENCE}_fit")
    rows = fit[
        (fit["method"] == "OM") & fit["component"].isin(["fx", "fy", "fz", "mx", "my", "mz"])
    ]
    assert set(rows["data"]) == {"held_out"}
    return float(np.sqrt((residual**2).mean())), float(np.exp(np.log(rows["rmse"]).mean()))


@pytest.mark.long
def test_both_errors_are_half_of_those_of_fixed_shoulders(bsip, study, out):
    """The same recording and markers on the 15 segments, whose shoulders the trunk carries."""
    plain = study.parent / "plain"
    shutil.copytree(study, plain)
    (plain / "study.toml").write_text('marker_set = "robert17"\n' + IDENTIFY)
    for stage in ("ingest", "scale", "ik", "regress", "identify", "reconstruct"):
        bsip.done(stage, plain, "--out", plain.parent / "plain_out", "--jobs", 1)
    (residual, wrench), (other_residual, other_wrench) = map(
        errors, (out, plain.parent / "plain_out")
    )
    assert residual < 0.003 and residual < 0.5 * other_residual
    assert wrench < 0.7 * other_wrench
