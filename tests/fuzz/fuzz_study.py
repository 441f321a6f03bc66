"""A small sound study, its damaged copies, and what bsip makes of them."""

from __future__ import annotations

import re
import shutil
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from bsip_cli.errors import BsipError
from bsip_cli.pipeline import stages_named
from bsip_cli.recordings.plate_wrench import plates_at_marker_rate
from bsip_cli.recordings.read import read_recording
from bsip_cli.running.runner import perform
from bsip_cli.running.session import open_study
from bsip_cli.running.unit import Unit
from tests.fuzz.damage import BINARY, TEXT, Damage

SAMPLE = Path(__file__).parents[2] / "sample_data" / "sub-01"
_TOML = """\
marker_set = "own.toml"

[[loads]]
segment = "shank_r"
mass_kg = 0.05
position_m = [0.0, -0.15, 0.03]
tasks = ["static"]

[roles]
static = ["static"]

[ingest]
max_gap_s = 0.25
plates = []

[identify]
estimators = ["consistent", "hansen2017"]
hold_out_fraction = 0.4
"""
_PARTICIPANTS = "participant_id\tsex\tmass_kg\theight_m\nsub-01\tM\t50.3\t1.63\n"
_TRIAL = "sub-01/sub-01_task-static"

TARGETS = {  # name of the damaged file -> (kinds of damage, bytes that describe the data)
    "c3d": (f"{_TRIAL}.c3d", BINARY),
    "trc": (f"{_TRIAL}.trc", TEXT),
    "mot": (f"{_TRIAL}.mot", TEXT),
    "participants": ("participants.tsv", TEXT),
    "options": ("study.toml", TEXT),
    "markerset": ("own.toml", TEXT),
}
_HEAD_OF_TEXT = 1500
_NUMBER = re.compile(r"[-+]?\d[\d.e+-]*")


REAL = {  # plates of all types and numbers of both processors
    "type1": "c3dorg_plate_types/type1.C3D",
    "type2": "c3dorg_plate_types/TYPE-2.C3D",
    "type3": "type3_running_kistler/Running_0002.c3d",
    "type4": "c3dorg_plate_types/TYPE-4.C3D",
    "treadmill": "edge_nimble/JH_01.c3d",
    "pc": "edge_c3dorg/Eb015pi.c3d",
    "dec": "edge_c3dorg/Eb015vi.c3d",
    "yup": "c3dorg_plate_types/MotionMonitorC3D.c3d",
    "gait": "btk_pig/PiG_Motion-FlatFoot-Full.c3d",
}


@dataclass(frozen=True)
class Answer:
    """What bsip said to a file and what it read from it."""

    state: str  # done, refused
    sentences: tuple[str, ...] = ()
    numbers: dict[str, np.ndarray] = field(default_factory=dict)
    is_users_word: bool = False  # a table of participants in good form: nobody can doubt a cell


@dataclass(frozen=True)
class Case:
    """One damaged file: which, and how."""

    target: str
    index: int

    def rng(self) -> np.random.Generator:
        return np.random.default_rng([[*TARGETS, *REAL].index(self.target), self.index])

    def damage(self) -> Damage:
        kinds = TARGETS[self.target][1] if self.target in TARGETS else BINARY
        return kinds[self.index % len(kinds)]


def make_sound_study(folder: Path, target: str) -> Path:
    """A study of one person with one trial, as C3D or, for targets trc and mot, as TRC and MOT."""
    (folder / "sub-01").mkdir(parents=True)
    (folder / "participants.tsv").write_text(_PARTICIPANTS)
    (folder / "study.toml").write_text(_TOML)
    shipped = Path(__file__).parents[2] / "configs" / "markersets" / "hansen2017.toml"
    shutil.copy(shipped, folder / "own.toml")
    source = SAMPLE / "sub-01_task-static.c3d"
    if target in ("trc", "mot"):
        _write_trc_mot(source, folder / _TRIAL)
    else:
        shutil.copy(source, (folder / _TRIAL).with_suffix(".c3d"))
    return folder


def ask_recording(path: Path) -> Answer:
    """Read a recording alone, whatever its labels mean."""
    try:
        recording = read_recording(path)
        numbers = _read(path)
    except BsipError as error:
        return Answer("refused", (str(error),))
    loud = [f for f in recording.findings if f.level != "info"]
    sentences = [
        recording.forces_note,
        *(f"{f.check} {f.subject} {f.found} {f.action}" for f in loud),
    ]
    return Answer("done", tuple(filter(None, sentences)), numbers)


def damaged(sound: bytes, case: Case) -> bytes:
    is_c3d = case.target == "c3d" or case.target in REAL
    head = 512 * (sound[16] - 1) if is_c3d else min(len(sound), _HEAD_OF_TEXT)
    return case.damage()(sound, head, case.rng())


def ask(study: Path, out: Path) -> Answer:
    """Open the study and ingest its trial in this process; bugs pass through as exceptions."""
    try:
        opened = open_study(study, out, (), None)
    except BsipError as error:
        return Answer("refused", (str(error),))
    sentences = [s for refusal in opened.refusals for s in refusal.sentences]
    if not opened.study.participants:
        return Answer("refused", tuple(sentences))
    participant = opened.study.participants[0]
    numbers = _stated(asdict(participant))
    session, stage = stages_named("ingest")
    first = perform(Unit(session, opened.study, out, opened.config, participant), True)
    sentences += first.sentences
    if first.state != "done":
        return Answer("refused", tuple(sentences))
    for trial in participant.trials:
        outcome = perform(Unit(stage, opened.study, out, opened.config, participant, trial), True)
        sentences += outcome.sentences
        if outcome.state != "done":
            return Answer("refused", tuple(sentences))
        numbers |= _read(trial.path)
        quality = pd.read_parquet(out / participant.id / f"{trial.stem}_quality.parquet")
        loud = quality[quality["level"] != "info"].astype(str).to_numpy()
        sentences += [" ".join(row) for row in loud]
    return Answer("done", tuple(sentences), numbers, _in_good_form(study / "participants.tsv"))


def new_sentences(sound: Answer, answer: Answer) -> list[str]:
    """What was said of the damaged file and not of the sound one; other numbers are not new."""
    known = {_NUMBER.sub("#", sentence) for sentence in sound.sentences}
    return [s for s in answer.sentences if _NUMBER.sub("#", s) not in known]


def silent_changes(sound: Answer, answer: Answer) -> list[str]:
    """Numbers that differ although nothing was said that was not said of the sound file."""
    if answer.state == "refused" or new_sentences(sound, answer):
        return []
    names = sound.numbers.keys() & answer.numbers.keys()
    if answer.is_users_word:
        names -= _STATED
    return sorted(n for n in names if _differ(n, sound.numbers[n], answer.numbers[n]))


def _differ(name: str, sound: np.ndarray, found: np.ndarray) -> bool:
    """Whether most of the values known in both, or any by far, differ."""
    if sound.shape != found.shape:
        return True
    gap = np.abs(sound - found)[np.isfinite(sound) & np.isfinite(found)]
    usual, largest = _TOLERANCES.get(name.split()[0], (0.0, 0.0))
    if name.startswith("wrench"):
        usual = max(usual, _RELATIVE * float(np.nanmax(np.abs(sound), initial=0.0)))
    return bool(gap.size and (np.median(gap) > usual or gap.max() > largest))


_RELATIVE = 0.01
_TOLERANCES = {  # median and largest [m, N, N m]: single samples may be wrong, not absurd
    "marker": (0.002, 200.0),
    "corner": (0.002, 0.002),
    "wrench": (2.0, 1e4),
}
_STATED = {"mass_kg", "height_m", "is_male"}


def _in_good_form(table: Path) -> bool:
    header, *rows = (line.split("\t") for line in table.read_text().splitlines())
    return header == _PARTICIPANTS.splitlines()[0].split("\t") and all(
        len(row) == len(header) for row in rows
    )


def _stated(participant: dict) -> dict[str, np.ndarray]:
    values = {name: participant[name] for name in ("mass_kg", "height_m")}
    known = {name: float("nan") if x is None else x for name, x in values.items()}
    known["is_male"] = float(participant["sex"] == "M")
    return {name: np.array(x) for name, x in known.items()}


def _read(path: Path) -> dict[str, np.ndarray]:
    """The recording's numbers by name."""
    recording = read_recording(path)
    numbers = {
        "rates": np.array([recording.marker_rate_hz, recording.analog_rate_hz]),
        "n_frames": np.array(recording.n_frames),
    }
    for k, label in enumerate(recording.labels):
        numbers[f"marker {label}"] = recording.markers_m[:, k]
    for plate in plates_at_marker_rate(recording):
        numbers[f"wrench {plate.name}"] = np.where(plate.usable[:, None], plate.wrench, np.nan)
        if plate.corners_m is not None:
            numbers[f"corner {plate.name}"] = plate.corners_m
    return numbers


def _write_trc_mot(source: Path, stem: Path) -> None:
    recording = read_recording(source)
    n, k, _ = recording.markers_m.shape
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{stem.name}.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate",
        f"{recording.marker_rate_hz:g}\t{recording.marker_rate_hz:g}\t{n}\t{k}\tmm\t100",
        "Frame#\tTime\t" + "\t\t\t".join(recording.labels),
        "\t\t" + "\t".join(f"{a}{i + 1}" for i in range(k) for a in "XYZ"),
        "",
    ]
    rows = [
        "\t".join([str(i + 1), f"{t:.6f}", *(f"{x:.4f}" for x in 1000 * frame.ravel())])
        for i, (t, frame) in enumerate(zip(recording.time_s(), recording.markers_m, strict=True))
    ]
    stem.with_suffix(".trc").write_text("\n".join([*head, *rows]) + "\n")
    plate = recording.plates[0]
    names = [f"ground_force_1_{c}{a}" for c in "vpm" for a in "xyz"]
    point = np.zeros_like(plate.force_N)
    times = recording.time0_s + np.arange(len(point)) / recording.analog_rate_hz
    table = np.column_stack([times, plate.force_N, point, plate.moment_Nm])
    lines = [stem.name, f"nRows={len(table)}", f"nColumns={table.shape[1]}", "endheader"]
    lines.append("\t".join(["time", *names]))
    lines += ["\t".join(f"{x:.6f}" for x in row) for row in table]
    stem.with_suffix(".mot").write_text("\n".join(lines) + "\n")
