"""`bsip export`: which files, where, what they say, and which exit code."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

from bsip_cli import __version__
from bsip_cli.artifacts import empty_table, write_artifact
from bsip_cli.body.exports import FORMATS
from bsip_cli.body.exports.identified import IdentifiedPerson, plain_names, xml_comment
from bsip_cli.cli import cli
from bsip_cli.errors import BadDataError
from bsip_cli.running.unit import file_hash
from bsip_cli.schemas import column_names
from bsip_cli.stages.frames import bsip_table
from bsip_cli.stages.scale import _marker_table, _skeleton_table
from tests.cli.conftest import make_people, write_table
from tests.exports.exported_person import identified_person
from tests.exports.test_osim_given import draw, inertias_in
from tests.program import Answer, Program

ENDINGS = {".urdf", ".xml", ".osim", ".bioMod", ".csv"}
NOTES = {"made_by": {}, "messages": [], "facts": {}}


@dataclass(frozen=True)
class Results:
    """A study of two participants and what `identify` would have left of it."""

    study: Path
    out: Path

    def call(self, *arguments: object) -> Answer:
        return Program()("export", self.study, "--out", self.out, *arguments)

    def files(self) -> set[str]:
        return {p.relative_to(self.out).as_posix() for p in self.out.glob("*/export/*")}

    def artifact(self, kind: str, participant: str = "sub-01") -> Path:
        return self.out / participant / f"{participant}_{kind}.parquet"

    def write_inertias(self, rows: dict[str, np.ndarray], participant: str = "sub-01") -> None:
        segments = identified_person().person.skeleton.segments
        nothing = np.zeros((15, 10))
        tables = [bsip_table(name, segments, v, nothing, nothing) for name, v in rows.items()]
        path = self.artifact("bsip", participant)
        write_artifact(path, "bsip", pd.concat(tables, ignore_index=True), NOTES)


def readable(body: IdentifiedPerson) -> np.ndarray:
    return np.array([inertia.readable() for inertia in body.inertias])


def write_choice(made: Results, participant: str, use: str = "OM") -> None:
    """As `choose` would, from the identification that is there."""
    source = made.artifact("identification", participant)
    table = empty_table("identification")
    write_artifact(source, "identification", table, NOTES)
    names = column_names("choice")
    row = dict.fromkeys(names, 0.5) | {"movement": "all", "use": use, "trials": 3}
    frame = pd.DataFrame([row | {"data": "whole_trials"}])
    notes = NOTES | {"made_by": {"inputs": {source.name: file_hash(source)}}}
    write_artifact(made.artifact("choice", participant), "choice", frame, notes)


def impossible(values: np.ndarray, segment: int) -> np.ndarray:
    """Izz beyond Ixx + Iyy."""
    changed = values.copy()
    changed[segment, 6] = 1.5 * (changed[segment, 4] + changed[segment, 5])
    return changed


@pytest.fixture
def results(tmp_path) -> Results:
    made, people = Results(tmp_path / "study", tmp_path / "out"), ("sub-01", "sub-02")
    make_people(made.study, len(people))
    write_table(made.study, *(f"{name}\tM\t71.3\t1.77" for name in people))
    for name in people:
        write_person(made, name)
        values = readable(identified_person())
        made.write_inertias({"RM": values, "OM": values * 1.0}, name)
        write_choice(made, name)
    return made


def write_person(made: Results, participant: str) -> None:
    """As `scale` would, of a person whose refinement changed nothing."""
    person = identified_person().person
    poses = SimpleNamespace(residual_m=np.zeros((1, len(person.markers))))
    same = SimpleNamespace(person=person, length_sd_m=np.zeros(15), poses=poses)
    for kind, table_of in (("skeleton", _skeleton_table), ("marker-positions", _marker_table)):
        table = table_of(person.skeleton, same, same)
        write_artifact(made.artifact(kind, participant), kind, table, NOTES)


# --- files --------------------------------------------------------------------------------------


def test_writes_every_format_of_everybody(results):
    done = results.call()
    assert (done.code, done.out) == (0, "")
    wanted = {f"{s}/export/{s}_OM{e}" for s in ("sub-01", "sub-02") for e in ENDINGS}
    assert results.files() == wanted
    why, first, *_, summary = done.err.splitlines()
    assert why.startswith("export: sub-01: By errors so far, OM: in 3")
    assert first.startswith(f"export: sub-01: {results.out / 'sub-01' / 'export'}: sub-01_OM.urdf")
    assert summary == f"bsip export: 2 done; results in {results.out}"


def test_written_model_is_the_person_of_the_tables(results):
    assert results.call("--participant", "sub-02", "--format", "urdf").code == 0
    file = results.out / "sub-02" / "export" / "sub-02_OM.urdf"
    model = pin.buildModelFromUrdf(str(file), pin.JointModelFreeFlyer())
    assert pin.computeTotalMass(model) == pytest.approx(identified_person().mass_kg, rel=1e-12)


def test_every_file_says_what_made_it(results):
    assert results.call("--method", "RM", "--participant", "sub-01").code == 0
    for file in (results.out / "sub-01" / "export").iterdir():
        text = file.read_text(encoding="utf-8")
        assert f"bsip {__version__} export: participant sub-01, method RM" in text
        for kind in ("bsip", "skeleton", "marker-positions"):
            path = results.artifact(kind)
            assert f"{path.name} sha256 {file_hash(path)}" in text


def test_the_choice_is_the_default_and_must_be_of_this_identification(results):
    write_choice(results, "sub-01", use="RM")
    only = ("--participant", "sub-01", "--format", "csv")
    assert results.call(*only).code == 0
    assert results.files() == {"sub-01/export/sub-01_RM.csv"}
    choice = results.artifact("choice")
    notes = {"made_by": {"inputs": {choice.name: file_hash(choice)}}}
    notes["facts"] = {"method": "OM", "said": "Use OM for now."}
    page = empty_table("report-files")
    write_artifact(results.artifact("report-files"), "report-files", page, NOTES | notes)
    done = results.call(*only)  # as the page says
    assert "sub-01: Use OM for now." in done.err and len(results.files()) == 2
    write_artifact(
        results.artifact("identification"),
        "identification",
        empty_table("identification"),
        NOTES | {"facts": {"made": "anew"}},
    )
    done = results.call(*only)
    assert done.code == 2 and "run `bsip choose`" in done.err
    assert results.call(*only, "--method", "OM").code == 0


def test_twice_gives_the_same_bytes_and_no_rest(results):
    assert results.call().code == 0
    before = {name: (results.out / name).read_bytes() for name in results.files()}
    assert results.call().code == 0
    assert {name: (results.out / name).read_bytes() for name in results.files()} == before


def test_only_what_is_asked_for(results):
    done = results.call("--participant", "sub-01", "--format", "csv", "--format", "mjcf")
    assert done.code == 0
    assert results.files() == {"sub-01/export/sub-01_OM.csv", "sub-01/export/sub-01_OM.xml"}


def test_formats_of_the_command_are_those_there_are():
    option = next(each for each in cli.commands["export"].params if each.name == "formats")
    assert list(option.type.choices) == list(FORMATS)
    assert {ending for ending, _ in FORMATS.values()} == ENDINGS


# --- a given model ------------------------------------------------------------------------------


def test_given_model_gets_the_inertias(results, tmp_path):
    given = tmp_path / "given.osim"
    given.write_text(draw(identified_person(), arms=True).text, encoding="utf-8")
    done = results.call("--participant", "sub-01", "--format", "osim", "--model-file", given)
    assert done.code == 0
    assert "sub-01: given.osim, map rajagopal: bodies placed by common joint centres" in done.err
    text = (results.out / "sub-01" / "export" / "sub-01_OM.osim").read_text(encoding="utf-8")
    assert ET.fromstring(text).find("Model").get("name") == "given"
    total = sum(inertia.mass for inertia in inertias_in(text).values())
    assert total == pytest.approx(identified_person().mass_kg + 0.09)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--model-file", "nowhere.osim"], "nowhere.osim: does not exist"),
        (["--model-file", "{table}"], "expected an .osim file of OpenSim 4"),
        (["--model-file", "{odd}"], "its bodies fit no shipped map (gait2392, rajagopal)"),
        (["--model-file", "{odd}", "--model-bodies", "x"], "there is no such map of bodies"),
        (["--model-file", "{odd}", "--format", "urdf"], "--model-file belongs to --format osim"),
        (["--model-bodies", "rajagopal"], "--model-bodies belongs to --model-file"),
        (["--method", "nobody"], "has no method nobody; expected one of RM, OM"),
        (["--format", "pdf"], "'pdf' is not one of"),
    ],
)
def test_usage(results, tmp_path, arguments, said):
    odd = tmp_path / "odd.osim"
    odd.write_text('<OpenSimDocument Version="40000"><Model name="odd"/></OpenSimDocument>')
    places = {"table": results.study / "participants.tsv", "odd": odd}
    done = results.call(*(word.format(**places) for word in arguments))
    assert done.code == 2
    assert said in done.err
    assert "Traceback" not in done.err
    assert results.files() == set()


# --- data that cannot be used -------------------------------------------------------------------


def test_without_results_the_stage_to_run_is_named(results):
    results.artifact("bsip").unlink()
    done = results.call()
    assert done.code == 2
    assert "sub-01: export has no bsip to read; run `bsip identify` first" in done.err
    assert {name.split("/")[0] for name in results.files()} == {"sub-02"}


def test_refused_participant_is_left_out(results):
    """There is no file for somebody who was asked for: bad data, also a command later."""
    results.artifact("bsip").unlink()
    row = pd.DataFrame([{"stage": "scale", "kind": "bad data", "sentence": "no markers."}])
    write_artifact(results.artifact("refusal-scale"), "refusal", row, NOTES)
    done = results.call()
    assert done.code == 3
    assert "sub-01: left out of export, since its input was refused" in done.err
    assert {name.split("/")[0] for name in results.files()} == {"sub-02"}


def test_damaged_table_is_refused_and_the_others_done(results):
    results.artifact("bsip").write_bytes(b"nothing")
    done = results.call()
    assert done.code == 3
    assert f"{results.artifact('bsip')}: is not an artifact of bsip" in done.err
    assert {name.split("/")[0] for name in results.files()} == {"sub-02"}


def test_values_that_are_no_numbers_are_refused(results):
    values = readable(identified_person())
    values[3, 0] = np.nan
    results.write_inertias({"OM": values})
    done = results.call("--participant", "sub-01")
    assert done.code == 3
    assert "OM holds values that are no numbers" in done.err
    assert results.files() == set()


def test_impossible_inertia_goes_into_the_table_only(results):
    """And takes away the model of an earlier identification under the same name."""
    assert results.call("--participant", "sub-01").code == 0
    results.write_inertias({"OM": impossible(readable(identified_person()), 2)})
    done = results.call("--participant", "sub-01")
    assert done.code == 3
    assert done.err.count("OM has an inertia that no body can have at head") == 1
    assert results.files() == {"sub-01/export/sub-01_OM.csv"}


def test_repaired_inertia_is_told_in_the_file(results):
    results.write_inertias({"OM": impossible(readable(identified_person()), 2)})
    done = results.call("--participant", "sub-01", "--repair")
    assert done.code == 0
    said = "head: impossible tensor replaced by the nearest, "
    assert f"export: sub-01: {said}" in done.err
    for name in results.files():
        assert said in (results.out / name).read_text(encoding="utf-8")


def test_no_file_outside_of_the_folder(results):
    """A method's name out of a strange table is no path."""
    values = readable(identified_person())
    results.write_inertias({"RM": values, "../../../evil": values})
    done = results.call("--participant", "sub-01", "--method", "../../../evil")
    assert done.code == 2
    assert "has no method ../../../evil; expected one of RM" in done.err
    assert results.files() == set()
    assert not list(results.out.parent.rglob("*evil*"))


# --- strange names ------------------------------------------------------------------------------


def test_strange_marker_names_become_plain_ones(identified):
    names = ('a<b&"c', "d e//f", *identified.person.markers[2:])
    person = replace(identified.person, markers=names)
    strange = replace(identified, person=person)
    for _, text_of in FORMATS.values():
        text = text_of(strange)
        assert "a<b" not in text
        assert "d e" not in text
    assert plain_names(names)[:2] == ("a_b__c", "d_e__f")
    with pytest.raises(BadDataError, match="more than one marker would be called a_b"):
        plain_names(("a b", "a/b"))


def test_comment_stays_a_comment():
    """Two hyphens would end it."""
    element = ET.Comment(xml_comment(["--><evil/>", "---", "end-"]))
    text = f"<a>{ET.tostring(element, encoding='unicode')}</a>"
    assert len(ET.fromstring(text)) == 0
    assert "evil" in text
