"""A study of invented but whole artifacts: a body that squats and swings its arms on a plate."""

from __future__ import annotations

import base64
import re
from html import unescape
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table, write_artifact
from bsip_cli.body.anthropometry import regress
from bsip_cli.body.skeleton import Skeleton, load_skeleton
from bsip_cli.report.blocks import Document, Picture
from bsip_cli.schemas import SCHEMAS
from bsip_cli.stages.frames import bsip_table
from bsip_cli.stages.joints import peaks_of
from bsip_cli.stages.person_mass import TABLE
from bsip_cli.stages.scale import _marker_table, _skeleton_table
from bsip_cli.statistics.methods import MEASURED, METHODS, OM, RM, RM_MASS
from bsip_cli.study.study import Participant, Study, Trial
from tests.body.standing_person import standing

MASS_KG, GRAVITY = 62.8, 9.80665
LEFT_OUT = {"knee_l": "both feet are on one plate: 3 frames", "elbow_r": ""}
MASS_FACTOR, ONE_NUMBER = 0.96, 0.9  # of RM+mass: its masses, and its errors, over RM's
EVIL = "<script>alert('$x_1$')</script>"
TASKS = {"static": "static", "sequence": "sequence", "basketball": "validation"}
DURATIONS_S = {"static": 2.0, "sequence": 14.0, "basketball": 3.0}
RATE_HZ = 50.0
PERSON = standing().person
SAME = SimpleNamespace(  # calibration and refinement, which changed nothing
    person=PERSON,
    length_sd_m=np.full(15, 0.004),
    poses=SimpleNamespace(residual_m=np.full((1, len(PERSON.markers)), 0.005)),
)
_KINDS = ["fx", "fy", "fz", "mx", "my", "mz"]


def frame(columns: str, *rows: tuple) -> pd.DataFrame:
    """A table with columns of these names."""
    return pd.DataFrame(list(rows), columns=columns.split())


def filled(kind: str, table: pd.DataFrame) -> pd.DataFrame:
    """With all columns of an artifact; what the table does not say is empty."""
    nothing = {"float": np.nan, "int": 0, "bool": False, "text": ""}
    known = {c.name: nothing[c.type] for c in SCHEMAS[kind].columns if "*" not in c.name}
    return table.assign(**{name: x for name, x in known.items() if name not in table})


def participant(name: str = "sub-01") -> Participant:
    runs = {task: "" if task == "static" else "_run-1" for task in TASKS}
    trials = tuple(
        Trial(name, task, f"{name}_task-{task}{runs[task]}", Path(f"{name}_task-{task}.c3d"), role)
        for task, role in TASKS.items()
    )
    return Participant(name, "M", MASS_KG, 1.63, trials)


def study(*names: str) -> Study:
    return Study(Path("study"), tuple(participant(name) for name in names))


def notes(stage: str, *messages: str, facts: dict | None = None) -> dict:
    made_by = {
        "stage": stage,
        "bsip_version": "0",
        "libraries": {"numpy": "2.0"},
        "inputs": {"sub-01_task-static.c3d": "ab" * 32},
        "options": {"ik": {"iterations": 50}, "identify": {"sigma_percent_limit": 5.0}},
    }
    return {"made_by": made_by, "messages": list(messages), "facts": facts or {}}


class Artifacts:
    """Writes one participant's artifacts; ``seed`` makes people differ."""

    def __init__(self, out: Path, person: Participant, seed: int = 0) -> None:
        self.out, self.person = out, person
        self.random = np.random.default_rng(seed)
        self.skeleton = load_skeleton("hansen2017")
        self.better = 0.3 + 0.1 * (seed % 4)

    def path(self, kind: str, trial: Trial | None = None) -> Path:
        owner = trial.stem if trial else self.person.id
        return self.out / self.person.id / f"{owner}_{SCHEMAS[kind].file_name}.parquet"

    def write(self, kind: str, frame: pd.DataFrame, trial: Trial | None = None, *messages) -> None:
        write_artifact(self.path(kind, trial), kind, frame, notes(f"make-{kind}", *messages))

    def write_all(self) -> Artifacts:
        self.write("person", self.facts())
        self.write("regression", empty_table("regression"))
        self.write("skeleton", _skeleton_table(self.skeleton, SAME, SAME))
        self.write("marker-positions", self.markers())
        self.write("bsip", self.bsip())
        self.write("excitation", excitation(self.skeleton))
        self.write("identification", self.identification(), None, f"mind {EVIL}")
        self.write("choice", choice())
        moving = [trial.stem for trial in self.person.trials[1:]]
        self.write("overall-diagnosis", diagnosis(moving))
        self.write("detection", detection(moving))
        self.write("overall-error-budget", error_budget(moving))
        for trial in self.person.trials:
            self.write_trial(trial)
        return self

    def write_trial(self, trial: Trial) -> None:
        tables = {
            "quality": quality(),
            "kinematics": self.kinematics(trial),
            "marker-residuals": self.residuals(trial),
            "marker-events": marker_events(),
            "reconstruction": self.reconstruction(trial),
            "fit": self.fit(trial),
            "posturography": posturography(),
            "correlation-difference": empty_table("correlation-difference"),
        }
        if trial.task != "static":
            moments = self.joint_moments(trial)
            tables |= {"joint-moments": moments}
            tables |= {"joint-peaks": peaks_of(moments, MASS_KG, LEFT_OUT)}
        for kind, table in tables.items():
            self.write(kind, table, trial)

    # --- participant ------------------------------------------------------------------------

    def facts(self) -> pd.DataFrame:
        stem = self.person.trials[0].stem
        return frame(
            "sex mass_kg mass_source plate_mass_kg mass_note height_m height_source height_note "
            "anterior_x anterior_y calibration_trial marker_rms_m",
            ("M", MASS_KG, TABLE, 63.1, "", 1.63, TABLE, "", 1.0, 0.0, stem, 0.0067),
        )

    def markers(self) -> pd.DataFrame:
        """One with a hostile name."""
        table = _marker_table(self.skeleton, SAME, SAME)
        return table.replace({"marker": {"RFA": EVIL}})

    def bsip(self) -> pd.DataFrame:
        readable = np.array([each.readable() for each in regress(PERSON, "M", MASS_KG).inertias])
        share = np.tile(np.minimum(0.07 * (np.arange(15) + 0.5), 1.0)[:, None], 10)
        tables = []
        for method in METHODS:
            values, known = readable.copy(), share * (method == OM)
            if method == RM_MASS:
                values[:, 0] *= MASS_FACTOR
            if method == OM:
                values += self.random.normal(0, 0.08, values.shape) * np.abs(values)
            sd = 0.1 * np.abs(values) * (1 - 0.8 * known)
            tables.append(bsip_table(method, self.skeleton.segments, values, sd, known))
        return pd.concat(tables, ignore_index=True)

    def identification(self) -> pd.DataFrame:
        table = frame(
            "estimator method note",
            ("mass_factor", RM_MASS, "times 0.96"),
            ("hansen2017", OM, "masses kept positive"),
        )
        known = {"trials": self.person.trials[1].stem, "duration_s": 13.5, "samples": 1400}
        known |= {"condition_number": 812.0, "mass_factor": MASS_FACTOR, "mass_factor_sd": 0.002}
        known |= {"rare": False, "farthest": "the head", "rank": 128, "decided": 9.2}
        return filled("identification", table.assign(**known))

    # --- trial ------------------------------------------------------------------------------

    def sizes(self) -> dict[str, float]:
        """Of the methods' errors."""
        return {RM: 1.0, RM_MASS: ONE_NUMBER, OM: self.better}

    def times(self, trial: Trial) -> np.ndarray:
        return np.arange(int(DURATIONS_S[trial.task] * RATE_HZ)) / RATE_HZ

    def valid(self, trial: Trial) -> np.ndarray:
        t = self.times(trial)
        return (t > 0.3) & (t < t[-1] - 0.4)

    def kinematics(self, trial: Trial) -> pd.DataFrame:
        t = self.times(trial)
        still = trial.task == "static"
        squat = 0.0 if still else 0.45 * (1 - np.cos(2 * np.pi * t / 2.5))
        raise_ = 0.1 if still else 1.2 * (1 - np.cos(2 * np.pi * t / 3.7))
        q = pd.DataFrame({f"q_{n}": np.zeros(len(t)) for n in self.skeleton.q_names})
        q["q_root_tz"] = 0.99 - 0.83 * (1 - np.cos(squat))
        q["q_root_qx"] = q["q_root_qw"] = np.sqrt(0.5)
        for start, kind in zip(self.skeleton.q_starts, self.skeleton.joint_types, strict=True):
            if kind == "spherical":
                q.iloc[:, start + 3] = 1.0
        for side, sign in (("l", -1.0), ("r", 1.0)):
            self._turn(q, f"hip_{side}", 2, squat)
            self._turn(q, f"ankle_{side}", 2, squat)
            q[f"q_knee_{side}_angle"] = -2.0 * squat
            self._turn(q, f"shoulder_{side}", 2 if side == "r" else 0, sign * raise_)
        table = {
            "time_s": t,
            "determined": np.ones(len(t), bool),
            "marker_rms_m": 0.006 + 0.001 * np.sin(t),
            "angle_sd_rad": np.full(len(t), 0.01),
            "cutoff_hz": np.full(len(t), 6.0),
        }
        speed = {"v_knee_l": np.gradient(q["q_knee_l_angle"], t)}
        return pd.concat([pd.DataFrame(table), q, pd.DataFrame(speed)], axis=1)

    @staticmethod
    def _turn(q: pd.DataFrame, joint: str, axis: int, angle) -> None:
        q[f"q_{joint}_q{'xyz'[axis]}"] = np.sin(np.asarray(angle) / 2)
        q[f"q_{joint}_qw"] = np.cos(np.asarray(angle) / 2)

    def residuals(self, trial: Trial) -> pd.DataFrame:
        t, names = self.times(trial), self.markers()["marker"]
        size = np.linspace(0.003, 0.012, len(names))
        values = size * (1 + 0.3 * self.random.normal(size=(len(t), len(names))))
        values[3, 4] = np.nan
        rows = {"time_s": np.repeat(t, len(names)), "marker": list(names) * len(t)}
        return pd.DataFrame(rows | {"residual_m": np.abs(values).ravel()})

    def reconstruction(self, trial: Trial) -> pd.DataFrame:
        t, valid = self.times(trial), self.valid(trial)
        slow, fast = np.sin(2 * np.pi * t / 2.5), np.sin(2 * np.pi * t / 0.9)
        signals = {
            "fx_N": 15 * fast,
            "fy_N": 8 * slow,
            "fz_N": MASS_KG * GRAVITY * (1 + 0.12 * slow),
            "mx_Nm": 10 * slow,
            "my_Nm": 12 * fast,
            "mz_Nm": 2 * fast,
            "cop_ap_m": 0.05 + 0.04 * slow + 0.01 * fast,
            "cop_ml_m": 0.02 * fast - 0.03 * slow,
        }
        parts = []
        for method, size in ((MEASURED, 0.0), *self.sizes().items()):
            part_ = {
                name: v * (1 + 0.08 * size) + 0.02 * size * np.ptp(v) * fast
                for name, v in signals.items()
            }
            flags = {"valid": valid, "used": valid & (trial.role == "sequence")}
            parts.append(pd.DataFrame({"time_s": t, "method": method, **part_, **flags}))
        return pd.concat(parts, ignore_index=True)

    def joint_moments(self, trial: Trial) -> pd.DataFrame:
        """Of the left knee and the right elbow; OM and a named fault make both larger."""
        t, valid = self.times(trial), self.valid(trial)
        sizes = {RM: 1.0, OM: 1.1, "OM+plate_rotation": 1.2}
        parts = [
            pd.DataFrame({"time_s": t, "method": method, "joint": joint, "axis": axis}).assign(
                moment_Nm=np.where(valid, size * top * np.sin(2 * np.pi * t / 2.5), np.nan),
                moment_sd_Nm=2.0,
                valid=valid,
            )
            for method, size in sizes.items()
            for joint, axes, top in (
                ("knee_l", ("extension", "adduction"), 80.0),
                ("elbow_r", ("flexion",), 5.0),
            )
            for axis in axes
        ]
        return filled("joint-moments", pd.concat(parts, ignore_index=True))

    def fit(self, trial: Trial) -> pd.DataFrame:
        rows = []
        for method, size in self.sizes().items():
            for k, c in enumerate((*_KINDS, "cop_ap", "cop_ml", "grf_vertical")):
                worse = 1.7 if (method, c, trial.role) == (OM, "mz", "validation") else size
                unit = "mm" if c.startswith("cop") else "N m" if c.startswith("m") else "N"
                force = c.startswith("f") or c == "grf_vertical"
                percent = 0.7 * (1 + k / 10) * worse if force else np.nan
                data = "identification" if trial.role == "sequence" else "held_out"
                schwer = (0.05 * worse, 0.04 * worse, 0.064 * worse)
                errors = (method, c, (4.0 + k) * worse, unit, percent, 1 - 0.03 * worse)
                rows.append((*errors, *schwer, 500, 41.5, data))
        return frame(
            "method component rmse unit rmse_percent_bw pearson_r schwer_m schwer_p schwer_c n "
            "n_effective data",
            *rows,
        )


def choice() -> pd.DataFrame:
    """OM over all, RM in walking."""
    ratios = {"ratio_om": 0.6, "ratio_rm_mass": 0.9, "ratio_om_rm_mass": 0.67}
    known = ratios | {name.replace("ratio", "log_error"): 0.1 for name in ratios}
    known |= {"trials": 2, "data": "whole_trials"}
    return pd.DataFrame(
        [
            {"movement": "all", "use": OM, **known},
            {"movement": "basketball", "use": RM, **known},
        ]
    )


def quality() -> pd.DataFrame:
    return frame(
        "check subject found expected action level",
        ("plate sign", "plate 1", "pushes up", "down", "sign turned", "corrected"),
        ("label", EVIL, "unknown", "", "cut", "excluded"),
        ("rate", "", "50 Hz", "", "", "info"),
    )


def excitation(skeleton: Skeleton) -> pd.DataFrame:
    rows = [("condition_number", "", 812.0, "1", "", ""), ("singular_value", "1", 3.5, "1", "", "")]
    for k, name in enumerate(skeleton.segments):
        rows += [
            ("segment", name, 0.05 * (k + 1), "1", name, ""),
            ("combinations", name, float(k), "1", name, ""),
            ("data_share", name, 0.04 * (k + 1), "1", name, f"mass: data {k} %"),
        ]
    for quantity in ("movement", "next"):
        rows += [
            (quantity, "kicks_l", 3.21, "%", "shank_l", "swing the left shank"),
            (quantity, "head_nods", 1.25, "%", "head", "nod"),
        ]
    rows += [
        ("movement_forces", "head_nods", 7.0, "%", "", "nod"),
        ("movement_forces", "kicks_l", 43.0, "%", "", "swing the left shank"),
    ]
    return frame("quantity name value unit segment text", *rows)


def marker_events() -> pd.DataFrame:
    said = f"RKNEL slips 15 mm on {EVIL}"
    row = ("slip", "RKNEL", said, said)
    return filled("marker-events", frame("kind marker sentence what", row))


def posturography() -> pd.DataFrame:
    numbers = (31.4, 15.9, 0.05, 0.01, 88.8, 1234.5, 4321.0, 13.1)
    return frame(
        "method rms_ap_mm rms_ml_mm rms_ap_origin_m rms_ml_origin_m mean_velocity_mm_s "
        "sway_length_mm ellipse_area_mm2 duration_s",
        *((method, *numbers) for method in (MEASURED, *METHODS)),
    )


def diagnosis(trials: list[str]) -> pd.DataFrame:
    """A turned plate (named), a group of two in the last trial, and a rejected wobbling mass."""
    everywhere, last = ", ".join(trials), trials[-1]
    turned = "plate 1 is turned by +2.0 degrees"
    table = frame(
        "rank effect target parameter estimate unit verdict class_id what trials probability scope",
        (1, "plate_rotation", "1", "yaw", 0.035, "rad", "named", "", turned, everywhere, 0.995,
         "laboratory"),
        (1, "plate_rotation", "1", "tilt", 0.0, "rad", "named", "", turned, everywhere, 0.995,
         "laboratory"),
        (2, "plate_zero", "1 fz", "offset", 9.8, "N", "ambiguous", "B",
         "channel fz has an offset of +9.8 N", last, 0.58, "laboratory"),
        (3, "added_mass", "hand_l", "mass", 1.0, "kg", "ambiguous", "B",
         "1.00 kg more move with the left hand", last, 0.38, "person"),
        (4, "wobbling_mass", "thigh_l", "mass", 0.3, "kg", "rejected", "",
         f"0.3 kg swing on {EVIL}", last, 0.04, "person"),
    )  # fmt: skip
    gain = (8.0 / table["rank"]).where(table["rank"] < 3)
    found = table["verdict"] != "rejected"
    more = table.assign(
        ci_low=(0.9 * table["estimate"] - 0.001).where(found),
        ci_high=(1.1 * table["estimate"] + 0.001).where(found),
        p_value=1 - table["probability"],
        rms_change=12.0 / table["rank"],
        sentence=table["what"] + "; pray",
        is_signed=True,
        gain_percent=gain,
        gain_ci_low=gain / 2,
        gain_ci_high=1.5 * gain,
    )
    return filled("diagnosis", more)


def error_budget(trials: list[str]) -> pd.DataFrame:
    """Mostly the table's parameters; two terms that stand in for each other; 20 % unknown."""
    shares = {
        "inertial_parameters": (70.0, ""),
        "soft_tissue": (25.0, "smoothing"),
        "smoothing": (-18.0, "soft_tissue"),
        "unknown": (20.0, ""),
        "noise": (3.0, ""),
        "total": (100.0, ""),
    }
    rows = [
        (trial, component, unit, term, share, alike)
        for trial in ("", *trials)
        for component, unit in (("fz", "N"), ("cop_ap", "mm"), ("cop_ml", "mm"))
        for term, (share, alike) in shares.items()
    ]
    table = frame("trial component unit term share_percent alike", *rows)
    is_total, share = table["term"] == "total", table["share_percent"]
    gain = {"gain_percent": 40.0, "gain_low": 30.0, "gain_high": 50.0}
    gains = {name: np.where(is_total, x, np.nan) for name, x in gain.items()}
    table = table.assign(rms=0.2 * share.abs(), share_low=share - 5, share_high=share + 5, **gains)
    return filled("error-budget", table)


def detection(trials: list[str]) -> pd.DataFrame:
    """The last trial alone, then all together: those count."""
    rows = [
        ("sync_offset", "", "delay", "s", 0.0025),
        ("plate_translation", "1", "x", "m", 0.004),
        ("plate_translation", "1", "y", "m", 0.006),
        ("plate_rotation", "1", "yaw", "rad", 0.25),
        ("plate_gain", "1 fz", "gain", "1", 0.011),
        ("added_mass", "hand_r", "mass", "kg", 0.93),
        ("added_mass", "hand_l", "mass", "kg", 0.95),
    ]
    table = frame("effect target parameter unit limit", *rows)
    alone = table.assign(trials=trials[-1])
    together = alone.assign(trials=", ".join(trials))
    return pd.concat([alone.assign(limit=9 * alone["limit"]), together], ignore_index=True)


def gains() -> pd.DataFrame:
    """As ``extend`` writes them."""
    table = frame(
        "component unit rmse_before rmse_after gain_percent ci_low ci_high",
        ("cop_ap", "mm", 12.0, 6.0, 50.0, 40.0, 60.0),
        ("fz", "N", 9.0, 9.9, -10.0, -20.0, 0.0),
    )
    return table.assign(method="OM+plate_rotation", data="held_out: sub-01_task-basketball_run-1")


def changes() -> pd.DataFrame:
    """What a cause does to the parameters: much to a thigh, little to a foot."""
    columns = "segment mass_change_kg com_change_m"
    table = frame(columns, ("thigh_l", 1.2, 0.015), ("foot_r", 0.001, 0.0002))
    return filled("bsip-change", table.assign(method="OM+plate_rotation"))


def svgs(html: str) -> list[bytes]:
    """The figures of a page."""
    found = re.findall(r'src="data:image/svg\+xml;base64,([^"]+)"', html)
    return [base64.b64decode(code) for code in found]


def pictures_of(document: Document) -> list[Picture]:
    """All of a report."""
    return [block for block in document.blocks() if isinstance(block, Picture)]


def words_of(html: str) -> str:
    """What a reader sees, with plain spaces."""
    bare = re.sub(r"<style.*?</style>", " ", html, flags=re.S)
    return re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]+>", " ", bare)))
