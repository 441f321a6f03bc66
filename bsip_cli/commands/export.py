"""The command ``bsip export``: people, trials and recordings as files that other software reads."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.ndimage import binary_erosion

from bsip_cli import __version__
from bsip_cli.artifacts import held_alone, is_made_from, remove, write_bytes
from bsip_cli.body.exports import FORMATS, bids_motion, osim
from bsip_cli.body.exports.identified import IdentifiedPerson
from bsip_cli.body.exports.opensim_motion import coordinates, loads, loads_xml, mot_text, setup_xml
from bsip_cli.body.inertia import from_readable
from bsip_cli.body.skeleton import Skeleton, load_skeleton
from bsip_cli.commands.export_recording import export_recordings
from bsip_cli.errors import BadDataError, BsipError, UsageError
from bsip_cli.files.fingerprints import file_hash
from bsip_cli.files.regular import check_regular
from bsip_cli.pipeline import READERS
from bsip_cli.recordings.analog import runs
from bsip_cli.recordings.contacts import SIDES
from bsip_cli.report.errors import use_sentence
from bsip_cli.report.words import TEXTS
from bsip_cli.running.runner import Outcome, attempt, lacking
from bsip_cli.running.session import follow, open_study
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import bsip_names
from bsip_cli.stages.frames import (
    coordinates_from,
    markers_from,
    person_from,
    person_of,
    plate_wrenches,
)
from bsip_cli.stages.joints import trial_of
from bsip_cli.study.study import describe_dataset

# --- tables of each trial -------------------------------------------------------------------------

Texts = dict[str, str]  # of a trial: names of files with their content
# Frames at the ends of a motion: OpenSim's spline (degree 5) makes other accelerations of them.
_EDGE = 5


def _export_tables(unit: Unit, asked: Request, model: str) -> list[str]:
    folder = asked.folder_of(unit)
    with held_alone(unit.out / unit.person.id):
        texts = _TABLES[asked.what](unit, model)
        for name, text in texts.items():
            write_bytes(folder / name, text.encode())
    return [f"{folder}: {', '.join(Path(name).name for name in texts)}"]


def _joints(unit: Unit, _: str) -> Texts:
    table = unit.read("joint-moments")
    return {f"{unit.name}_joint-moments.csv": table.to_csv(index=False, float_format="%.9g")}


def _bids(unit: Unit, _: str) -> Texts:
    trial, skeleton = unit.own_trial, load_skeleton(unit.config.skeleton)
    kinematics, wrench = unit.read("kinematics"), unit.read("wrench")
    times, labels, places = markers_from(unit.read("markers"))
    q = coordinates_from(kinematics, skeleton)[0]
    plates = plate_wrenches(wrench)
    determined = kinematics["determined"].to_numpy()
    columns = bids_motion.channels(labels, places, skeleton, q, determined, plates)
    session = f"ses-{trial.session}" if trial.session else ""
    run = f"run-{trial.run}" if trial.run is not None else ""
    task = (f"task-{trial.task}", f"tracksys-{bids_motion.TRACKSYS}", run)
    stem = "_".join(filter(None, (trial.participant_id, session, *task)))
    place = "/".join(filter(None, (session, "motion", stem)))
    rate_hz = 1.0 / float(np.median(np.diff(times)))
    return {
        f"{place}_motion.tsv": bids_motion.motion_tsv(columns),
        f"{place}_motion.json": bids_motion.motion_json(columns, trial.task, rate_hz, __version__),
        f"{place}_channels.tsv": bids_motion.channels_tsv(columns),
        f"{place}_channels.json": bids_motion.channels_json(),
    }


def _opensim(unit: Unit, model: str) -> Texts:
    """For the model in that file: motion where the markers determine it; loads in the longest time
    in which the plates measure what acts on each foot, and on nothing else."""
    person = person_of(unit)
    trial, name = trial_of(unit, person), unit.name
    known = trial.determined
    if known.sum() < 2:
        raise BadDataError("the markers determine no pose", file=name)
    said = [f"bsip {__version__} export: {name}, for {model}; SI units, Y up"]
    motion = coordinates(person.skeleton, trial.q[known])
    texts = {f"{name}_motion.mot": mot_text(name, trial.times_s[known], motion, said)}
    wrenches = {f"foot_{s}": w for s, w in trial.ground(trial.readings)[0].wrench.items()}
    whole = binary_erosion(known, iterations=_EDGE) & trial.measured & bool(trial.readings)
    for side in SIDES:
        whole &= np.isfinite(wrenches[f"foot_{side}"]).all(axis=1)
    found = max(runs(whole), key=lambda run: run[1] - run[0], default=(0, 0))
    if found[1] - found[0] < 2:
        unit.say("no loads: the plates do not measure what acts on each foot alone")
        return texts
    frames = slice(*found)
    times = trial.times_s[frames]
    acting = loads({foot: w[frames] for foot, w in wrenches.items()})
    files = {"model_file": model, "coordinates_file": f"{name}_motion.mot"}
    files |= {"external_loads_file": f"{name}_loads.xml"}
    texts[f"{name}_loads.mot"] = mot_text(name, times, acting, said)
    texts[f"{name}_loads.xml"] = loads_xml([*wrenches], f"{name}_loads.mot", said)
    setup = setup_xml(f"{name}_inverse-dynamics", files, times[0], times[-1], said)
    texts[f"{name}_inverse-dynamics.xml"] = setup
    note = f"forces of each foot are known from {times[0]:.2f} to {times[-1]:.2f} s"
    unit.say(note + "; known loads are not in the model" * bool(unit.loads()))
    return texts


# By what is asked for, who writes it.
_TABLES = {"joints": _joints, "bids": _bids, "opensim": _opensim}

_READER = READERS["export", "model"]
_OF_TRIALS = ("recording", "bids", "joints")
_FILE_NAME = re.compile(r"[A-Za-z0-9_+-]+")


@dataclass(frozen=True)
class Request:
    """What the user asks for; no ``formats`` are all of them, no ``method`` is the person's choice.

    ``model_file`` is an OpenSim model to be given the inertias, ``model_bodies`` names its map;
    ``repair`` replaces tensors that no body can have by the nearest possible ones. ``what`` is
    written into ``to``, or next to the results.
    """

    method: str | None = None
    formats: tuple[str, ...] = ()
    model_file: Path | None = None
    model_bodies: str | None = None
    repair: bool = False
    what: str = "model"
    to: Path | None = None

    def folder_of(self, unit: Unit) -> Path:
        """Where a participant's files go."""
        person = unit.person.id
        return unit.out / person / "export" if self.to is None else self.to / person


# Of an identified person: the text of the file, and what else the user should know of it.
Writer = Callable[[IdentifiedPerson], tuple[str, str]]


def export_session(
    study: Path, out: Path, chosen: tuple[str, ...], config_file: Path | None, **asked: Any
) -> int:
    """Export a study's participants and return the exit code; ``asked`` is a `Request`."""
    request = Request(**asked)
    _check(request)
    opened = open_study(study, out, chosen, config_file)
    skeleton, people = load_skeleton(opened.config.skeleton), opened.study.participants
    to, what = request.to, request.what
    if what == "recording":
        assert to is not None
        return export_recordings(opened, out, to)
    formats = {"model": request.formats, "opensim": ("osim",)}
    models = replace(request, formats=formats.get(what, ()))
    writers = _writers(models, skeleton) if what in formats else {}
    trials = {one.id: one.trials if what in _TABLES else () for one in people}

    def running() -> Generator[Outcome, None, None]:
        for participant in people:
            model, whole = "", (opened.study, out, opened.config, participant)
            if writers:
                model, outcome = _export(Unit(_READER, *whole), skeleton, request, writers)
                yield outcome
                if outcome.state != "done":
                    continue
            for trial in trials[participant.id]:
                unit = Unit(READERS["export", what], *whole, trial)
                yield attempt(unit, partial(_export_tables, unit, request, model))

    if what == "bids" and to is not None:
        to.mkdir(parents=True, exist_ok=True)
        describe_dataset(to, study)
        shutil.copyfile(study / "participants.tsv", to / "participants.tsv")
    total = sum(bool(writers) + len(own) for own in trials.values())
    return follow("export", opened.refusals, running(), total, to or out)


def _check(request: Request) -> None:
    of_models = request.formats or request.model_file or request.model_bodies
    of_bodies = of_models or request.method or request.repair
    if request.what in ("recording", "bids") and request.to is None:
        raise UsageError(
            f"--what {request.what} makes a folder of its own", remedy="name a new one with --to"
        )
    if (request.what == "opensim" and of_models) or (request.what in _OF_TRIALS and of_bodies):
        raise UsageError(
            f"--what {request.what} knows no --format, --model-file or --model-bodies"
            + (", --method or --repair" if request.what in _OF_TRIALS else ""),
            remedy="leave them out, or leave out --what",
        )


def _writers(request: Request, skeleton: Skeleton) -> dict[str, Writer]:
    formats = dict.fromkeys(request.formats or FORMATS)
    writers: dict[str, Writer] = {
        FORMATS[name][0]: partial(lambda text_of, body: (text_of(body), ""), FORMATS[name][1])
        for name in formats
    }
    if request.model_file is None:
        if request.model_bodies is not None:
            raise UsageError("--model-bodies belongs to --model-file", remedy="give both")
        return writers
    if "osim" not in formats:
        raise UsageError("--model-file belongs to --format osim", remedy="ask for that format")
    model, body_map = _given_model(request.model_file, request.model_bodies, skeleton)

    def given(body: IdentifiedPerson) -> tuple[str, str]:
        result = osim.with_inertias(model, body_map, body)
        return result.text, f"{model.file}, map {body_map.name}: {result.sentence}"

    return {**writers, FORMATS["osim"][0]: given}


def _given_model(
    file: Path, name: str | None, skeleton: Skeleton
) -> tuple[osim.GivenModel, osim.BodyMap]:
    check_regular(file, UsageError)
    try:
        content = file.read_bytes()
    except OSError as error:
        raise UsageError(
            f"cannot be read ({error.strerror})", file=file, remedy="check --model-file"
        ) from None
    model = osim.read_given_model(content, file.name)
    body_map = osim.load_body_map(name) if name else osim.fitting_map(model.masses_kg)
    if body_map is None:
        raise UsageError(
            f"its bodies fit no shipped map ({', '.join(osim.shipped_names())})",
            file=file,
            expected=f"bodies as in one of them; it has {', '.join(model.masses_kg) or 'none'}",
            remedy="write a map like configs/opensim/rajagopal.toml and give it with "
            "--model-bodies",
        )
    osim.check_segments(body_map, skeleton)
    osim.check_fits(model, body_map)
    return model, body_map


def _export(
    unit: Unit, skeleton: Skeleton, request: Request, writers: dict[str, Writer]
) -> tuple[str, Outcome]:
    """All files of one participant, and the last one's name; a format that cannot be written does
    not stop the others."""
    if (waiting := lacking(unit, BadDataError.exit_code)) is not None:
        return "", waiting
    folder = request.folder_of(unit)
    written: list[str] = []
    notes: list[str] = []
    errors: list[BsipError] = []
    try:
        with held_alone(unit.out / unit.name):
            method, why = (request.method, "") if request.method else _chosen(unit)
            as_found = _identified(unit, skeleton, method)
            body = as_found.repaired() if request.repair else as_found
            notes += [*([why] if why else []), *body.made_of[len(as_found.made_of) :]]
            for ending, writer in writers.items():
                path = folder / f"{body.name}{ending}"
                try:
                    text, note = writer(body)
                except BadDataError as error:
                    remove(path)  # an older one would pass for this method's
                    errors.append(error)
                    continue
                write_bytes(path, text.encode())
                written.append(path.name)
                notes += [note] if note else []
    except BsipError as error:
        errors.append(error)
    notes += [f"{folder}: {', '.join(written)}"] if written else []
    said = (*(f"{unit.name}: {note}" for note in notes), *dict.fromkeys(map(str, errors)))
    code = max((error.exit_code for error in errors), default=0)
    name = written[-1] if written else ""
    return name, Outcome("export", unit.name, "refused" if errors else "done", said, code)


def _chosen(unit: Unit) -> tuple[str, str]:
    """The method to use, as the report's page says, and why; without a page, the one that
    `bsip choose` found best over all movements."""
    path = unit.path("choice")
    if not path.exists() or not is_made_from(path, unit.path("identification")):
        raise UsageError(
            "is missing, or of an earlier identification",
            file=path,
            expected="the result of `bsip choose`",
            remedy="run `bsip choose` or `bsip run`, or name a method with --method",
        )
    page, choice = unit.path("report-files"), unit.read("choice")
    if page.exists() and is_made_from(page, path):
        facts = unit.facts("report-files")
        return str(facts["method"]), str(facts["said"])
    said = use_sentence(choice, unit.read("identification"), TEXTS["so_far"])
    return str(choice["use"].iloc[0]), said


def _identified(unit: Unit, skeleton: Skeleton, method: str) -> IdentifiedPerson:
    """The participant's geometry and one method's inertias, as the artifacts have them."""
    tables = {kind: unit.read(kind) for kind in _READER.reads}
    rows = tables["bsip"]
    methods = [name for name in dict.fromkeys(rows["method"]) if _FILE_NAME.fullmatch(name)]
    if method not in methods:
        raise UsageError(
            f"has no method {method}",
            file=unit.path("bsip"),
            expected=f"one of {', '.join(methods)}",
            remedy="name one of them, or identify with --estimator",
        )
    rows = _in_order(unit, "bsip", rows[rows["method"] == method], skeleton.body_names)
    geometry = _in_order(unit, "skeleton", tables["skeleton"], skeleton.segments)
    person = person_from(geometry, tables["marker-positions"], skeleton)
    values = rows[list(bsip_names())].to_numpy()
    if not np.isfinite(values).all():
        raise BadDataError(
            f"{method} holds values that are no numbers",
            file=unit.path("bsip"),
            remedy="run `bsip identify` again with --force",
        )
    paths = (unit.path(kind) for kind in _READER.reads)
    head = f"bsip {__version__} export: participant {unit.name}, method {method}"
    made_of = (head, *(f"{path.name} sha256 {file_hash(path)}" for path in paths))
    return IdentifiedPerson(person, tuple(map(from_readable, values)), unit.name, method, made_of)


def _in_order(unit: Unit, kind: str, rows: pd.DataFrame, segments: tuple[str, ...]) -> pd.DataFrame:
    if sorted(rows["segment"]) != sorted(segments):
        raise BadDataError(
            "its segments are not those of the skeleton",
            file=unit.path(kind),
            expected=f"each of {', '.join(segments)} once",
            remedy="name the skeleton that the results were made with, or run the stages again",
        )
    return rows.set_index("segment").loc[list(segments)].reset_index()
