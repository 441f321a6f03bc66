"""`bsip export --what recording`: faults of known size are taken off a recording, and nothing else.

The diagnosis is written by hand with the sizes that were hidden, so what is compared is the writer.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import ezc3d
import numpy as np
import pandas as pd
import pytest
from scipy.ndimage import uniform_filter1d

from bsip_cli import __version__
from bsip_cli.artifacts import empty_table, write_artifact
from bsip_cli.commands.export import export_session
from bsip_cli.commands.export_recording import why_left
from bsip_cli.effects.effect import Number
from bsip_cli.instruments.c3d_file import wired_plates
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.read import read_recording
from bsip_cli.running.session import run_session
from bsip_cli.running.unit import file_hash
from bsip_cli.simulate.options import Asked, Laboratory, StudyOptions
from bsip_cli.simulate.study import inject_study, simulate_study
from bsip_cli.stages.diagnose import nothing, rows_of
from bsip_cli.stages.trial_scene import causes_here
from tests.exports.test_export_command import NOTES, Results, write_person
from tests.simulate.test_inject import check_parameters
from tests.small_study import small

STEM, STATIC = "sub-01_task-squat_run-1", "sub-01_task-static"
OPTIONS = replace(small("M", 8, static=1.0, squat=3.0), laboratory=Laboratory(plate_per_foot=True))
PAIR, SWAPS = ("RKNEL", "RKNEM"), ((0.5, 0.9), (1.0, 2.0))

# What is hidden, and the same as a diagnosis says it: the file's y and z are the plate's reversed.
Fault = tuple[Asked, tuple[str, str, list[float]]]


def fault(effect: str, size: float, hidden: str, target: str, *values: float) -> Fault:
    return Asked(effect, size, hidden), (effect, target, list(values))


GAIN = fault("plate_gain", 0.06, "fz,plate=1", "1 fz", 0.06)
ZERO = fault("plate_zero", 20.0, "fz,plate=2", "2 fz", -20.0)
LEAK = fault("plate_crosstalk", 0.04, "fz:fx,plate=2", "2 fz>fx", -0.04)
TURNED = fault("plate_rotation", 0.08, "yaw,plate=1", "1", 0.0, 0.0, 0.08)
ASIDE = fault("plate_translation", 0.03, "x,plate=2", "2", 0.03, 0.0, 0.0)
LATE = fault("sync_offset", 0.03, "-", "", 0.03)
SLOW = fault("clock_drift", 0.002, "-", "", 0.002)
TILTED = fault("gravity_tilt", 0.02, "y", "", 0.0, 0.02)
TURNED_CAMERAS = fault("camera_frame", 0.02, "x", "", 0.02, 0.0)
LEVER_NM = 1.2  # 4 % of what is on plate 2, at the depth of its sensor under its surface


def _cause(
    effect: str, target: str, values: list[float], trials: Sequence[str], verdict: str = "named"
) -> dict:
    """As in the facts of a diagnosis."""
    known = {"effect": effect, "target": target, "trials": [*trials], "verdict": verdict}
    return known | {"values": values, "folds": [values] * 5}


@dataclass(frozen=True)
class Study:
    """As it was, with something hidden in it, and what is known of the latter."""

    plain: Path
    made: Results

    def diagnosed_as(
        self,
        *causes: tuple[str, str, list[float]],
        alike: Sequence = (),
        numbers: tuple[Number, ...] = (),
        rejected: Sequence[Number] = (),
        looked_at: Sequence[str] = (STEM, STATIC),
        concerned: Sequence[str] = (STEM,),
    ) -> None:
        """``alike``: effect and target of what cannot be told from the causes. ``numbers`` and
        ``rejected``: sizes of them that are named and rejected, one of each."""
        verdict, none = "ambiguous" if alike else "named", nothing(0.01, (STEM,))
        of_causes = [replace(none, effect=effect, target=target) for effect, target, _ in causes]
        others = [replace(none, effect=effect, target=target) for effect, target in alike]
        group = [replace(one, class_id="A") for one in (*of_causes, *others)] if alike else []
        sizes = [(one, (x,)) for one, x in zip(of_causes, numbers, strict=False)]
        sized = [replace(one, numbers=x) for one, x in sizes]
        less = [(one, (x,)) for one, x in zip(of_causes, rejected, strict=False)]
        hardly = [replace(one, numbers=x, verdict="rejected") for one, x in less]
        table = rows_of((*group, *sized, *hardly), ())
        facts = [_cause(*one, concerned, verdict) for one in causes]
        wrenches = (self.made.out / "sub-01").glob("*_wrench.parquet")
        made_by = {"inputs": {path.name: file_hash(path) for path in wrenches}}
        notes = NOTES | {"made_by": made_by, "facts": {"causes": facts, "trials": [*looked_at]}}
        path = self.made.artifact("diagnosis")
        write_artifact(path, "overall-diagnosis", table, notes)

    def exported(self, code: int = 0) -> Path:
        to = self.made.study.with_name("corrected")
        asked = {"what": "recording", "to": to}
        assert export_session(self.made.study, self.made.out, (), None, **asked) == code
        return to / "sub-01" / f"{STEM}.c3d"


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("plain") / "study"
    simulate_study(folder, OPTIONS)
    return folder


@pytest.fixture
def hide(tmp_path, plain):
    def hidden(*asked: Asked, change: Callable[[Path], None] | None = None) -> Study:
        made = Results(tmp_path / "study", tmp_path / "out")
        if asked:
            hiding = StudyOptions(effects=asked, effect_tasks=("squat",))
            inject_study(plain, made.study, hiding)
        else:
            shutil.copytree(plain, made.study)
        for path in made.study.rglob("*.c3d") if change else ():
            change(path)
        assert run_session("ingest", made.study, made.out, (), None, jobs=1, force=False) == 0
        write_person(made, "sub-01")
        nothing = empty_table("marker-events")
        swaps = [
            dict.fromkeys(nothing.columns, 0.0)
            | dict.fromkeys(("sentence", "what", "when"), "")
            | {"kind": "swap", "marker": PAIR[0], "partner": PAIR[1]}
            | {"start_s": start, "end_s": end - 0.01, "put_right": True}
            for start, end in SWAPS
            if any(one.name == "marker_swap" for one in asked)
        ]
        for stem, events in ((STEM, pd.DataFrame(swaps) if swaps else nothing), (STATIC, nothing)):
            path = made.out / "sub-01" / f"{stem}_marker-events.parquet"
            write_artifact(path, "marker-events", events, NOTES)
        return Study(plain, made)

    return hidden


@dataclass(frozen=True)
class Corrected:
    """A recording as it was before anything was hidden, with it, and as it is exported; and what
    was said."""

    plain: Path
    spoilt: Path
    path: Path
    said: str

    def both(self) -> tuple[Recording, Recording]:
        """Before anything was hidden, and as exported."""
        return read_recording(self.plain), read_recording(self.path)

    def is_as_it_was(self) -> bool:
        return self.path.read_bytes() == self.spoilt.read_bytes()


@pytest.fixture
def corrected(hide, capsys):
    """Hides faults and corrects what a diagnosis names, ``known`` as of `Study.diagnosed_as`."""

    def of(*asked: Asked, causes: Sequence = (), change=None, **known) -> Corrected:
        study = hide(*asked, change=change)
        study.diagnosed_as(*causes, **known)
        path = study.exported()
        places = (root / "sub-01" / path.name for root in (study.plain, study.made.study))
        return Corrected(*places, path, capsys.readouterr().err)

    return of


def wrenches(recording: Recording) -> np.ndarray:
    """(2, n, 6)."""
    return np.stack([plate.wrench for plate in recording.plates])


@pytest.mark.parametrize("faults", [(GAIN, ZERO), (TURNED, ASIDE), (LEAK,)])
def test_plates_read_what_they_would_have_read(corrected, faults):
    asked, causes = zip(*faults, strict=True)
    one = corrected(*asked, causes=causes)
    before, after = one.both()
    apart = np.abs(wrenches(after) - wrenches(before)).max(axis=(0, 1))
    assert (apart[:3] < 0.05).all() and (apart[3:] < (LEVER_NM if LEAK in faults else 0.02)).all()
    assert np.array_equal(before.markers_m, after.markers_m, equal_nan=True)
    for _, (effect, target, _) in faults:
        assert f"{STEM}: corrected: {effect} {target}: " in one.said


@pytest.mark.long
@pytest.mark.parametrize("faults", [(GAIN, LATE), (ASIDE, SLOW), (LATE, SLOW)])
def test_forces_are_back_at_their_time(corrected, faults):
    """Noise between samples is interpolated twice, so tenths of a second are compared."""
    asked, causes = zip(*faults, strict=True)
    one = corrected(*asked, causes=causes)
    before, after = one.both()
    first = round((after.time0_s - before.time0_s) * before.marker_rate_hz)
    assert 0 < before.n_frames - first - after.n_frames <= 4
    shown = before.markers_m[first : first + after.n_frames]
    assert np.array_equal(shown, after.markers_m, equal_nan=True)
    now, then = wrenches(after), wrenches(before)[:, 5 * first :][:, : 5 * after.n_frames]
    apart = uniform_filter1d(now - then, 25, axis=1)[:, 25:-25]
    assert np.abs(apart[..., :3]).max() < 0.5 and np.abs(apart[..., 3:]).max() < 0.3
    spoilt = wrenches(read_recording(one.spoilt))
    spoilt = spoilt[:, : now.shape[1]] - wrenches(before)[:, 5 * first :][:, : now.shape[1]]
    assert np.abs(uniform_filter1d(spoilt, 25, axis=1)[:, 25:-25]).max() > 3.0
    assert "frames left out at the end, whose forces were not recorded: " in one.said


@pytest.mark.parametrize("turned", [TILTED, TURNED_CAMERAS])
def test_markers_and_forces_are_turned_into_true_axes(corrected, turned):
    one = corrected(turned[0], causes=[turned[1]])
    before, after = one.both()
    spoilt = read_recording(one.spoilt)
    assert np.nanmax(np.abs(spoilt.markers_m - before.markers_m)) > 0.01
    shift = np.nanmedian(after.markers_m - before.markers_m, axis=(0, 1))  # the file's pivot is not
    if turned is TURNED_CAMERAS:  # that of who hid it
        assert np.abs(shift).max() < 1e-6
    assert np.nanmax(np.abs(after.markers_m - before.markers_m - shift)) < 1e-4
    now, then = wrenches(after), wrenches(before)
    then[..., 3:] += np.cross(shift, then[..., :3])
    assert np.abs(now - then).max() < 0.1


@pytest.mark.parametrize(
    ("concerned", "looked_at", "session", "found"),
    [
        ("AB", "AB", "", 1),  # all others of the session have it
        ("A", "A", "", 0),  # one trial does not tell that the session has it
        ("A", "AB", "", 0),  # another one has it not
        ("AB", "ABC", "", 0),  # and this one neither
        ("AB", "AB", "2", 0),  # it was recorded at another time
    ],
)
def test_a_recording_that_nobody_looked_at_has_what_its_session_shares(
    concerned, looked_at, session, found
):
    unit = unit_of_c(_cause("plate_gain", "1 fz", [0.06], concerned), looked_at, session)
    assert len(causes_here(unit, ["1"])) == found
    assert not causes_here(unit, ["2"])


def unit_of_c(cause: dict, looked_at: str, session: str = "") -> SimpleNamespace:
    """The recording C beside A and B, and a diagnosis that looked at some of them."""
    trials = [SimpleNamespace(stem=stem, session=session if stem == "C" else "") for stem in "ABC"]
    return SimpleNamespace(
        name="C",
        own_trial=trials[2],
        person=SimpleNamespace(id="sub-01", trials=trials),
        facts=lambda kind: {"causes": [cause], "trials": [*looked_at]},
        has=lambda kind: False,
    )


def test_what_the_laboratory_has_is_corrected_in_a_recording_that_nobody_looked_at(
    hide, plain, capsys
):
    study = hide(GAIN[0])
    study.diagnosed_as(looked_at=(STATIC,))
    named = {"effect": "plate_gain", "target": "1 fz", "parameter": "gain", "estimate": 0.06}
    rows = pd.DataFrame(
        [
            dict.fromkeys(empty_table("laboratory").columns, "")
            | dict.fromkeys(("ci_low", "ci_high", "probability", "limit"), 0.99)
            | {"persons": 5, "trials": 9, "verdict": verdict, "scope": scope, "laboratory": "1"}
            | named
            | {
                "target": target,
                "who": "sub-01" * (scope == "session"),
                "sentence": f"{target} {scope}",
            }
            for target, verdict, scope in (
                ("1 fz", "named", "laboratory"),
                ("2 fz", "ambiguous", "laboratory"),
                ("2 fz", "named", "session"),
            )
        ]
    )
    path = study.made.out / "group" / "group_laboratory.parquet"
    path.parent.mkdir()
    facts = {"persons": {"1": {"sub-01": "sub-01", "sub-02": "sub-02"}}, "answer": {}}
    write_artifact(path, "laboratory", rows, NOTES | {"facts": facts})
    exported = study.exported()
    before, after = (read_recording(x) for x in (plain / "sub-01" / exported.name, exported))
    assert np.abs(wrenches(after) - wrenches(before)).max() < 0.05
    said = capsys.readouterr().err
    assert f"{STEM}: corrected: plate_gain 1 fz: gain 6 % taken off" in said
    assert "corrected: plate_gain 2 fz" not in said
    for scope in ("laboratory", "session"):
        left = f"not corrected: 2 fz {scope}: no size of it is known for this recording"
        assert f"{STEM}: {left}" in said
    shutil.rmtree(exported.parents[1])
    alone = {"facts": facts | {"persons": {"1": {"sub-01": "sub-01"}}}}
    write_artifact(path, "laboratory", rows, NOTES | alone)  # nobody else was recorded there
    study.exported()
    assert f"export: {STEM}: nothing to correct" in capsys.readouterr().err


def test_plates_that_tell_points_read_what_they_would_have_read(corrected):
    """Force and centre of pressure as channels (TYPE 1)."""
    one = corrected(ZERO[0], TURNED[0], causes=[ZERO[1], TURNED[1]], change=into_points)
    assert "corrected: plate_zero" in one.said
    before, after = one.both()
    assert ezc3d.c3d(str(one.path))["parameters"]["FORCE_PLATFORM"]["TYPE"]["value"][0] == 1
    apart = np.abs(wrenches(after) - wrenches(before)).max(axis=(0, 1))
    assert (apart[:3] < 0.05).all() and (apart[3:] < 0.1).all()


def into_points(path: Path) -> None:
    """Write the plates of a file as force, point [mm] and moment [N mm] at its point."""
    c3d = ezc3d.c3d(str(path), extract_forceplat_data=True)
    analogs, plates = c3d["data"]["analogs"].copy(), c3d["parameters"]["FORCE_PLATFORM"]
    for wired in wired_plates(c3d, path):
        force, moment = wired.plate.lab_wrench(wired.reading(analogs[0]), wired.plate.centre_m)
        force, moment = force @ wired.plate.axes, moment @ wired.plate.axes
        point = np.stack([-moment[:, 1], moment[:, 0], 0 * force[:, 0]], axis=1) / force[:, 2:]
        free = moment - np.cross(point, force)
        sign = np.sign(wired.matrix[0, 0])
        rows = [*(sign * force.T), *(1e3 * point[:, :2].T), sign * 1e3 * free[:, 2]]
        analogs[0, wired.channels] = rows
    c3d["data"]["analogs"] = analogs
    count = len(plates["TYPE"]["value"])
    plates["TYPE"]["value"] = np.ones(count, dtype=int)
    plates["ORIGIN"]["value"] = np.zeros((3, count))
    units = c3d["parameters"]["ANALOG"]["UNITS"]["value"]
    channels = np.asarray(plates["CHANNEL"]["value"]).astype(int)[3:5].ravel() - 1
    c3d["parameters"]["ANALOG"]["UNITS"]["value"] = [
        "mm" if k in channels else unit for k, unit in enumerate(units)
    ]
    c3d.write(str(path))


def test_labels_are_exchanged_back_and_the_file_says_so(corrected):
    one = corrected(
        *(
            Asked("marker_swap", end - start, f"{'+'.join(PAIR)},start_s={start}")
            for start, end in SWAPS
        )
    )
    before, after = one.both()
    assert np.allclose(before.markers_m, after.markers_m, atol=1e-7, equal_nan=True)
    assert np.array_equal(wrenches(before), wrenches(after))
    words = f"labels {' and '.join(PAIR)} exchanged from 1.000 to 1.990 s"
    assert words in one.said
    old, new = (ezc3d.c3d(str(path)) for path in (one.spoilt, one.path))
    entry = " ".join(new["parameters"]["BSIP"]["CORRECTED"]["value"])
    assert words in entry and f"bsip {__version__}: corrected by" in entry
    assert file_hash(one.spoilt) in entry.replace(" ", "")
    check_parameters(old, new)
    labels = old["parameters"]["POINT"]["LABELS"]["value"]
    others = [k for k, label in enumerate(labels) if label not in PAIR]
    pairs = {"points": (slice(None), others), "analogs": ...}
    for part, kept in pairs.items():
        a, b = (c3d["data"][part][kept] for c3d in (old, new))
        assert np.array_equal(a, b, equal_nan=True), part


def test_channels_that_ingest_corrects_are_corrected_in_the_file(corrected):
    """Moments in N mm that are said to be N m, in all trials."""

    def misread(path: Path) -> None:
        c3d = ezc3d.c3d(str(path))
        units = c3d["parameters"]["ANALOG"]["UNITS"]["value"]
        assert "Nmm" in units
        c3d["parameters"]["ANALOG"]["UNITS"]["value"] = ["Nm" if u == "Nmm" else u for u in units]
        c3d.write(str(path))

    one = corrected(change=misread)
    for plate in "12":
        assert f"{STEM}: corrected: plate {plate}: read the moments in N mm" in one.said
    before, after = one.both()
    assert np.abs(wrenches(after) - wrenches(before)).max() < 0.01
    units = ezc3d.c3d(str(one.path))["parameters"]["ANALOG"]["UNITS"]["value"]
    assert "Nm" in units and "Nmm" not in units


def lifted(path: Path) -> None:
    """Nobody on plate 2 in the first second of the squat: it reads an offset alone."""
    if path.stem == STEM:
        c3d = ezc3d.c3d(str(path))
        channels = np.asarray(c3d["parameters"]["FORCE_PLATFORM"]["CHANNEL"]["value"])[:, 1] - 1
        noise = np.random.default_rng(0).normal(0.0, 0.5, (len(channels), 250))
        c3d["data"]["analogs"][0, channels.astype(int), :250] = noise
        c3d["data"]["analogs"][:, int(channels[2])] += 12.0
        c3d.write(str(path))


def test_what_a_plate_reads_without_load_is_taken_off_once(corrected):
    one = corrected(change=lifted)
    assert f"{STEM}: corrected: plate 2: its reading without load, (" in one.said
    assert one.said.count("its reading without load") == 1
    before, after = (wrenches(read_recording(path)) for path in (one.spoilt, one.path))
    taken = before - after
    assert np.allclose(taken[0], 0.0, atol=1e-4)
    assert np.allclose(np.abs(taken[1, :, 2]), 12.0, atol=0.1)
    assert np.abs(np.median(after[1, :250], axis=0)).max() < 0.1


def test_a_zero_is_not_taken_off_for_what_the_others_of_the_session_have():
    unit = unit_of_c(_cause("plate_zero", "1 fz", [9.0], "AB"), "AB")
    assert len(causes_here(unit, ["1", "2"], zeroed=["2"])) == 1
    assert not causes_here(unit, ["1", "2"], zeroed=["1"])


def test_what_is_no_fault_of_the_recording_stays_and_is_said(corrected):
    one = corrected(GAIN[0], causes=[("added_mass", "hand_r", [1.0, 0.0, 0.0, 0.0])])
    assert one.is_as_it_was()
    why = "added_mass hand_r: no fault of the plates, the clocks, the axes or the labels"
    assert f"{STEM}: not corrected: {why}" in one.said
    assert "sub-01_task-static: nothing to correct" in one.said
    assert (one.path.parents[1] / "participants.tsv").exists()


def test_what_cannot_be_told_from_another_cause_stays(corrected):
    one = corrected(GAIN[0], causes=[GAIN[1]], alike=[("added_mass", "hand_r")])
    assert one.is_as_it_was()
    assert "plate_gain 1 fz: it cannot be distinguished from added_mass hand_r here" in one.said


@pytest.mark.parametrize(
    ("effect", "target", "said"),
    [
        ("plate_gain", "all fz", "not corrected: plate_gain all fz: one of several causes"),
        ("unexplained", "", ": its signal is not known exactly"),
        ("marker_shift", "T10", "marker_shift T10: one of several causes"),
    ],
)
def test_what_the_diagnosis_did_not_size_is_said(corrected, effect, target, said):
    assert said in corrected(GAIN[0], alike=[(effect, target)]).said


def test_a_fault_of_no_instrument_is_not_said_to_be_of_unknown_size():
    assert why_left("marker_shift", "unknown").startswith("no fault of the plates")
    assert why_left("marker_swap", "unknown") == why_left("plate_gain", "unknown") == "unknown"


def test_of_faults_of_the_plates_that_look_alike_one_is_taken_off(corrected):
    one = corrected(ZERO[0], causes=[ZERO[1]], alike=[("plate_zero", "1 fz")])
    before, after = one.both()
    assert np.abs(wrenches(after) - wrenches(before)).max() < 0.05
    assert "taken off (as likely plate_zero 1 fz, with the same sum of forces)" in one.said


@pytest.mark.parametrize("rejected", [(), (Number("gain", "1", 0.01, 0.0, 0.1),)])
def test_the_size_is_said_with_its_interval(corrected, rejected):
    """Not a rejected one: what the laboratory has is looked for in each person once more."""
    found = (Number("gain", "1", 0.06, 0.0552, 0.0657),)
    one = corrected(GAIN[0], causes=[GAIN[1]], numbers=found, rejected=rejected)
    said = "plate_gain 1 fz: gain 6.0 % (95 % interval 5.5 to 6.6) taken off"
    assert f"{STEM}: corrected: {said}" in one.said
    entry = ezc3d.c3d(str(one.path))["parameters"]["BSIP"]["CORRECTED"]["value"]
    assert said in entry


def test_what_a_person_has_beside_the_laboratory_is_taken_off_too(corrected):
    """The same fault twice, in the same trials, with two sizes."""
    larger, smaller = (*GAIN[1][:2], [0.04]), (*GAIN[1][:2], [0.02])
    both_sizes = Number("gain", "1", 0.04, 0.03, 0.05), Number("gain", "1", 0.02, 0.01, 0.03)
    said = corrected(GAIN[0], causes=[larger, smaller], numbers=both_sizes).said
    for size in ("4.0 % (95 % interval 3.0 to 5.0)", "2.0 % (95 % interval 1.0 to 3.0)"):
        assert f"{STEM}: corrected: plate_gain 1 fz: gain {size} taken off" in said


def test_the_size_that_is_told_is_taken_off(corrected):
    """``extend`` leaves a person's own recordings out of what the laboratory tells; the sentence
    does not."""
    own, told = (*GAIN[1][:2], [0.07]), Number("gain", "1", 0.06, 0.05, 0.07)
    before, after = corrected(GAIN[0], causes=[own], numbers=(told,)).both()
    assert np.abs(wrenches(after) - wrenches(before))[..., :3].max() < 0.05


def test_a_recording_that_changed_since_is_refused(hide, capsys):
    study = hide(GAIN[0])
    study.diagnosed_as(GAIN[1])
    file = study.made.study / "sub-01" / f"{STEM}.c3d"
    file.write_bytes((study.plain / "sub-01" / file.name).read_bytes())
    study.exported(code=2)
    said = capsys.readouterr().err
    assert f"{file}: has changed since it was read or diagnosed" in said


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--what", "recording"), "makes a folder of its own"),
        (("--what", "bids"), "makes a folder of its own"),
        (("--what", "recording", "--to", "{study}/new"), "lies in the study or its results"),
        (("--what", "recording", "--to", "{study}/.."), "lies in the study or its results"),
        (("--what", "joints", "--method", "OM"), "knows no --format, --model-file"),
        (("--what", "opensim", "--format", "osim"), "knows no --format, --model-file"),
    ],
)
def test_options_that_do_not_fit_are_one_sentence(tmp_path, plain, options, words):
    results = Results(plain, tmp_path / "out")
    done = results.call(*(one.format(study=plain) for one in options))
    assert done.code == 2
    assert words in done.err and len(done.err.strip().splitlines()) == 1
