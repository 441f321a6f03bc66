import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bsip_cli.artifacts import read_artifact, write_artifact
from bsip_cli.config import Config, load_config
from bsip_cli.pipeline import STAGES
from bsip_cli.running.runner import Outcome, perform
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import bsip_names, share_name
from bsip_cli.segments import SEGMENTS
from bsip_cli.statistics.hypothesis_tests import fisher_z_difference, williams_t
from bsip_cli.study.study import Study, Trial, load_study

NOTES = {"made_by": {}, "messages": [], "facts": {}}
FILES = ("static", "sequence", "walking", "throwing_run-1", "throwing_run-2")
UNITS = dict.fromkeys(("fx", "fy", "fz", "grf_vertical"), "N")
UNITS |= dict.fromkeys(("mx", "my", "mz"), "N m") | dict.fromkeys(("cop_ap", "cop_ml"), "mm")
COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")


@pytest.fixture(autouse=True)
def no_warnings():
    """Degenerate data must be refused in words, never met with a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@dataclass
class Cohort:
    """A study on disk whose artifacts up to ``reconstruct`` are made up."""

    study: Study
    out: Path
    config: Config

    def unit(self, name: str) -> Unit:
        stage = next(s for s in STAGES if s.name == name and s.level == "cohort")
        return Unit(stage, self.study, self.out, self.config)

    def perform(self, name: str, force: bool = False) -> Outcome:
        return perform(self.unit(name), force)

    def run(self) -> None:
        for name in ("stats", "tables"):
            assert self.perform(name).state == "done"

    def path(self, kind: str, participant: str, trial: Trial | None = None) -> Path:
        stem = trial.stem if trial else participant
        return self.out / participant / f"{stem}_{kind}.parquet"

    def change(self, kind: str, participant: str, trial: Trial | None, change) -> None:
        """Rewrite an artifact by a function of its table."""
        path = self.path(kind, participant, trial)
        write_artifact(path, kind, change(read_artifact(path, kind)), NOTES)

    def group(self, kind: str) -> pd.DataFrame:
        return read_artifact(self.out / "group" / f"group_{kind}.parquet", kind)

    def table(self, name: str) -> pd.DataFrame:
        path = self.out / "group" / "tables" / f"{name}.csv"
        return pd.read_csv(path)

    def text(self, name: str, ending: str = "md") -> str:
        return (self.out / "group" / "tables" / f"{name}.{ending}").read_text(encoding="utf-8")

    def all_of(self, kind: str) -> pd.DataFrame:
        """The made-up artifacts of everybody, one below the other, straight from the files."""
        frames = []
        for file in sorted(self.out.glob(f"sub-*/*_{kind}.parquet")):
            stem = file.name.removesuffix(f"_{kind}.parquet")
            task = stem.split("_task-")[-1].split("_")[0] if "_task-" in stem else ""
            frames.append(pd.read_parquet(file).assign(participant=file.parent.name, task=task))
        return pd.concat(frames)


@pytest.fixture(scope="session")
def make_cohort(tmp_path_factory):
    def make(participants: int = 8, files: tuple[str, ...] = FILES, seed: int = 1) -> Cohort:
        place = tmp_path_factory.mktemp("cohort")
        root, out = place / "study", place / "out"
        names = [f"sub-{k:02d}" for k in range(1, participants + 1)]
        for name in names:
            (root / name).mkdir(parents=True)
            for file in files:
                (root / name / f"{name}_task-{file}.c3d").touch()
        rows = [f"{name}\tM\t{60 + k}\t1.7" for k, name in enumerate(names)]
        table = "\n".join(["participant_id\tsex\tmass_kg\theight_m", *rows])
        (root / "participants.tsv").write_text(table + "\n", encoding="utf-8")
        config = load_config([root / "study.toml"])
        study, refused = load_study(root, config.roles.model_dump())
        assert not refused
        cohort = Cohort(study, out, config)
        rng = np.random.default_rng(seed)
        for person in study.participants:
            write_artifact(cohort.path("bsip", person.id), "bsip", bsip(rng), NOTES)
            for trial in person.trials:
                for kind, frame in trial_frames(rng, trial).items():
                    write_artifact(cohort.path(kind, person.id, trial), kind, frame, NOTES)
        return cohort

    return make


@pytest.fixture(scope="session")
def cohort(make_cohort):
    """Eight participants after both stages; tests only read it."""
    made = make_cohort()
    made.run()
    return made


def bsip(rng) -> pd.DataFrame:
    rm = rng.normal(1.0, 0.1) * np.linspace(0.5, 20.0, len(SEGMENTS))
    rows = []
    for method in ("RM", "OM", "base"):
        for segment, mass in zip(SEGMENTS, rm, strict=True):
            row = {"method": method, "segment": segment}
            for name in bsip_names():
                row |= {name: rng.normal(), f"{name}_sd": 0.1, share_name(name): rng.random()}
            row["mass_kg"] = mass * (1.0 if method == "RM" else rng.normal(1.02, 0.05))
            rows.append(row)
    return with_rm_mass(pd.DataFrame(rows), {"mass_kg": 0.96})


def with_rm_mass(frame: pd.DataFrame, factors: dict[str, float]) -> pd.DataFrame:
    """Rows of RM+mass beside RM's: some columns times a number."""
    rm = frame[frame["method"] == "RM"]
    more = rm.assign(method="RM+mass", **{name: rm[name] * x for name, x in factors.items()})
    return pd.concat([frame, more], ignore_index=True)


def trial_frames(rng, trial: Trial) -> dict[str, pd.DataFrame]:
    size = {"RM": 20.0, "OM": 8.0, "base": 7.0}
    data = "identification" if trial.role == "sequence" else "held_out"
    fits = [
        {
            "method": method,
            "component": component,
            "rmse": error,
            "unit": unit,
            "rmse_percent_bw": error / 7.0 if unit == "N" else np.nan,
            "pearson_r": 1.0 - error / 500.0,
            "schwer_m": rng.normal(0, 0.01),
            "schwer_p": error / 900.0,
            "schwer_c": error / 800.0,
            "n": 1000,
            "n_effective": rng.uniform(60, 400),
            "data": data,
        }
        for method, mean in size.items()
        for component, unit in UNITS.items()
        for error in [mean * rng.lognormal(0, 0.5)]
    ]
    sway = [
        {
            "method": method,
            "rms_ap_mm": rng.normal(60 if method == "RM" else 50, 3),
            "rms_ml_mm": rng.normal(40, 3),
            "rms_ap_origin_m": rng.normal(0.3, 0.01),
            "rms_ml_origin_m": rng.normal(1.0, 0.01),
            "mean_velocity_mm_s": rng.normal(300, 30),
            "sway_length_mm": rng.normal(36000, 3000),
            "ellipse_area_mm2": rng.normal(9e4, 9e3),
            "duration_s": 120.0,
        }
        for method in ("measured", *size)
    ]
    return {
        "fit": with_rm_mass(pd.DataFrame(fits), {"rmse": 0.7, "rmse_percent_bw": 0.7}),
        "posturography": with_rm_mass(pd.DataFrame(sway), {}),
        "correlation-difference": pd.DataFrame([correlation(rng, c) for c in COMPONENTS]),
    }


def correlation(rng, component: str) -> dict:
    """RM is the first method in forces, OM in moments: either order must do."""
    r = {"RM": 0.9 + rng.normal(0, 0.03), "OM": 0.97}
    a, b = ("RM", "OM") if component.startswith("f") else ("OM", "RM")
    r_ab, n = 0.93, rng.uniform(60, 200)
    test, fisher = williams_t(r[a], r[b], r_ab, n), fisher_z_difference(r[a], r[b], n)
    return {
        "component": component,
        "method_a": a,
        "method_b": b,
        "r_a": r[a],
        "r_b": r[b],
        "r_ab": r_ab,
        "n_effective": n,
        "williams_t": test.statistic,
        "df": test.df1,
        "williams_p": test.p_value,
        "fisher_z": fisher.statistic,
        "fisher_p": fisher.p_value,
        "reason": test.reason,
    }
