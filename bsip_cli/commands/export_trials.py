"""``bsip export --what opensim``, ``bids`` and ``joints``: tables of each trial."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.ndimage import binary_erosion

from bsip_cli import __version__
from bsip_cli.artifacts import write_atomically
from bsip_cli.body.exports import bids_motion
from bsip_cli.body.exports.opensim_motion import coordinates, loads, loads_xml, mot_text, setup_xml
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.errors import BadDataError, BsipError
from bsip_cli.pipeline import Stage
from bsip_cli.recordings.analog import runs
from bsip_cli.recordings.own_plates import SIDES
from bsip_cli.running.runner import Outcome, held_alone, lacking
from bsip_cli.running.session import OpenedStudy, follow
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import WRENCH, coordinates_from, markers_from, person_from
from bsip_cli.stages.joints import trial_of
from bsip_cli.stages.trial_scene import plate_names
from bsip_cli.study.dataset import describe_dataset

# Of a trial: names of files with their content, and what else the user should know.
Texts = tuple[dict[str, str], str]
_BODY = ("skeleton", "marker-positions")
# Frames at the ends of a motion: OpenSim's spline (degree 5) makes other accelerations of them.
_EDGE = 5


@dataclass(frozen=True)
class Tables:
    """What is asked for. model : name of the exported model's file, for OpenSim."""

    what: str
    to: Path | None
    model: str = ""


def export_trials(opened: OpenedStudy, out: Path, asked: Tables, model: Callable | None) -> int:
    """Write the tables of all trials; the exit code.

    model : of a participant, writes the model and returns its file's name and the outcome.
    """
    study = opened.study

    def running() -> Generator[Outcome, None, None]:
        for participant in study.participants:
            its = asked
            if model is not None:
                name, outcome = model(participant)
                yield outcome
                if outcome.state != "done":
                    continue
                its = replace(asked, model=name)
            for trial in participant.trials:
                unit = Unit(_READERS[asked.what], study, out, opened.config, participant, trial)
                yield _export(unit, its)

    if asked.what == "bids" and asked.to is not None:
        asked.to.mkdir(parents=True, exist_ok=True)
        describe_dataset(asked.to, study.root)
        shutil.copyfile(study.root / "participants.tsv", asked.to / "participants.tsv")
    total = sum(len(one.trials) + (model is not None) for one in study.participants)
    return follow("export", opened.refusals, running(), total, asked.to or out)


def _export(unit: Unit, asked: Tables) -> Outcome:
    waiting = lacking(unit)
    if waiting is not None:
        return replace(waiting, exit_code=waiting.exit_code or BadDataError.exit_code)
    assert unit.participant is not None
    folder = folder_of(unit, asked.to)
    try:
        with held_alone(unit.out / unit.participant.id):
            texts, note = _WRITERS[asked.what](unit, asked)
            for name, text in texts.items():
                write_text(folder / name, text)
    except BsipError as error:
        return Outcome("export", unit.name, "refused", (str(error),), error.exit_code)
    said = (f"{unit.name}: {note}",) if note else ()
    names = ", ".join(Path(name).name for name in texts)
    return Outcome("export", unit.name, "done", (*said, f"{unit.name}: {folder}: {names}"))


def folder_of(unit: Unit, to: Path | None) -> Path:
    """Where a participant's files go."""
    assert unit.participant is not None
    return unit.out / unit.participant.id / "export" if to is None else to / unit.participant.id


def write_text(path: Path, text: str) -> None:
    """All of it, or nothing."""
    write_atomically(path, lambda partial: partial.write_bytes(text.encode()))


def _joints(unit: Unit, _: Tables) -> Texts:
    """The artifact, a row per time, method, joint and axis."""
    table = unit.read("joint-moments")
    return {f"{unit.name}_joint-moments.csv": table.to_csv(index=False, float_format="%.9g")}, ""


def _bids(unit: Unit, _: Tables) -> Texts:
    assert unit.trial is not None
    trial, skeleton = unit.trial, load_skeleton(unit.config.skeleton)
    kinematics, wrench = unit.read("kinematics"), unit.read("wrench")
    times, labels, places = markers_from(unit.read("markers"))
    q = coordinates_from(kinematics, skeleton)[0]
    plates = {n: wrench[[f"plate{n}_{c}" for c in WRENCH]].to_numpy() for n in plate_names(wrench)}
    determined = kinematics["determined"].to_numpy()
    columns = bids_motion.channels(labels, places, skeleton, q, determined, plates)
    session = f"ses-{trial.session}" if trial.session else ""
    parts = (
        trial.participant_id,
        session,
        f"task-{trial.task}",
        f"tracksys-{bids_motion.TRACKSYS}",
    )
    run = f"run-{trial.run}" if trial.run is not None else ""
    stem = "_".join(filter(None, (*parts, run)))
    place = "/".join(filter(None, (session, "motion", stem)))
    rate_hz = 1.0 / float(np.median(np.diff(times)))
    return {
        f"{place}_motion.tsv": bids_motion.motion_tsv(columns),
        f"{place}_motion.json": bids_motion.motion_json(columns, trial.task, rate_hz, __version__),
        f"{place}_channels.tsv": bids_motion.channels_tsv(columns),
        f"{place}_channels.json": bids_motion.channels_json(),
    }, ""


def _opensim(unit: Unit, asked: Tables) -> Texts:
    """Motion where the markers determine it; loads in the longest time in which the plates tell
    what acts on each foot, and on nothing else."""
    skeleton = load_skeleton(unit.config.skeleton)
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    trial, name = trial_of(unit, person), unit.name
    known = trial.determined
    if known.sum() < 2:
        raise BadDataError("the markers determine no pose", file=name)
    said = [f"bsip {__version__} export: {name}, for {asked.model}; SI units, Y up"]
    motion = coordinates(skeleton, trial.q[known])
    texts = {f"{name}_motion.mot": mot_text(name, trial.times_s[known], motion, said)}
    wrenches = {f"foot_{s}": w for s, w in trial.ground(trial.readings).feet.wrench.items()}
    told = binary_erosion(known, iterations=_EDGE) & trial.measured & bool(trial.readings)
    for side in SIDES:
        told &= np.isfinite(wrenches[f"foot_{side}"]).all(axis=1)
    found = max(runs(told), key=lambda run: run[1] - run[0], default=(0, 0))
    if found[1] - found[0] < 2:
        return texts, "no loads: the plates do not tell what acts on each foot alone"
    frames = slice(*found)
    times = trial.times_s[frames]
    acting = loads({foot: w[frames] for foot, w in wrenches.items()})
    files = {
        "model_file": asked.model,
        "coordinates_file": f"{name}_motion.mot",
        "external_loads_file": f"{name}_loads.xml",
    }
    texts[f"{name}_loads.mot"] = mot_text(name, times, acting, said)
    texts[f"{name}_loads.xml"] = loads_xml([*wrenches], f"{name}_loads.mot", said)
    setup = setup_xml(f"{name}_inverse-dynamics", files, times[0], times[-1], said)
    texts[f"{name}_inverse-dynamics.xml"] = setup
    note = f"forces of each foot are known from {times[0]:.2f} to {times[-1]:.2f} s"
    return texts, note + "; known loads are not in the model" * bool(unit.loads())


_WRITERS: dict[str, Callable[[Unit, Tables], Texts]] = {
    "joints": _joints,
    "bids": _bids,
    "opensim": _opensim,
}
_OPENSIM = ("kinematics", "contacts", "wrench", "plates", *_BODY)
_READERS = {
    name: Stage("export", "trial", "Tables of a trial.", reads, (), options)
    for name, reads, options in (
        ("joints", ("joint-moments",), ()),
        ("bids", ("markers", "kinematics", "wrench"), ("skeleton",)),
        ("opensim", _OPENSIM, ("skeleton", "loads", "joints")),
    )
}
