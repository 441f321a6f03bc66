"""`bsip markers`: labels, the set they fit, what is missing, and a first set of one's own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bsip_cli.artifacts import read_header
from bsip_cli.body.markersets import MarkerSet, load_marker_set
from bsip_cli.commands.markers import markers_command
from bsip_cli.errors import BadDataError, UsageError
from tests.cli.conftest import write_table
from tests.recordings.recording_writers import standing_markers, write_trc

LINE_M = 1.5
HANSEN = [marker.label for marker in load_marker_set("hansen2017").markers]
_OWN = (
    "c7 IJ LAcromion RAcromion LAsis RAsis Sacrum LElbowLat RElbowLat LWrist RWrist LKneeLat "
    "RKneeLat LAnkleLat RAnkleLat LHeel RHeel LMT5 RMT5 Ball#1"
)
OWN = _OWN.split()


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """The current folder, where a first set is written."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def recording(folder: Path, labels: Sequence[str], empty: Sequence[str] = ()) -> Path:
    """A TRC file of two frames with markers at different places, on a line as long as a person."""
    places_m = LINE_M / np.sqrt(3) * np.arange(len(labels)) / len(labels)
    frame = places_m[:, None] + [0.0, 0.001, 0.002]
    frame[np.isin(labels, empty)] = np.nan
    times = np.array([0.0, 0.01])
    return write_trc(folder / "a trial.trc", times, np.stack([frame, frame]), labels)


def told(path: Path, **options) -> int:
    """The exit code of the command."""
    asked = {"file": path, "marker_set": "auto", "prefix": "", "write": None} | options
    return markers_command(**asked)


def test_a_known_set_is_complete(here, capsys):
    assert told(recording(here, HANSEN)) == 0
    said = capsys.readouterr().out
    assert "marker set: hansen2017 (Hansen 2017, full body), guessed: 38 of its 38 markers" in said
    assert "  RTEM   seen 100.0 %  head, right temple\n" in said
    assert "  left hand         3 markers\n" in said
    assert list(here.glob("*.toml")) == []


def test_what_is_missing_on_which_segment(here, capsys):
    gone = {"RTEM", "LTEM", "FHEAD", "LWRU", "RMALL"}
    path = recording(here, [label for label in HANSEN if label not in gone], empty=["C7"])
    assert told(path) == 3
    said = capsys.readouterr().out
    assert "  head              0 markers; missing: RTEM, LTEM, FHEAD; it is held upright" in said
    assert "  left hand         2 markers; missing: LWRU\n" in said
    assert "  C7     seen   0.0 %  labelled, but seen in no frame\n" in said
    assert "a skeleton cannot be built without: malleolus_lateral_r\n" in said


def test_no_trunk_is_refused_as_scale_does(here, capsys):
    on_legs = ("lower_torso", "thigh_l", "thigh_r", "shank_l", "shank_r", "foot_l", "foot_r")
    legs = [m.label for m in load_marker_set("hansen2017").markers if m.segment in on_legs]
    assert told(recording(here, legs)) == 3
    said = capsys.readouterr().out
    assert "refused, unless scale.may_be_held in study.toml names it" in said
    assert "cannot be built" not in said


def test_an_unknown_set_is_written_down_and_serves(here, capsys):
    path = recording(here, [f"P:{label}" for label in OWN])
    assert told(path) == 0
    said = capsys.readouterr().out
    assert "none of the shipped sets fits; of 20 labels the words identify 19" in said
    assert "  P:LWrist     seen 100.0 %  left forearm, left wrist\n" in said
    assert "  P:Ball#1     seen 100.0 %  not in the set\n" in said
    starter = here / "a_trial_markers.toml"
    assert "# Ball#1\n" in starter.read_text(encoding="utf-8")
    landmarks = {m.label: m.landmark for m in load_marker_set(str(starter)).markers}
    assert landmarks["RKneeLat"] == "knee_lateral_r" and landmarks["IJ"] == "suprasternale"
    assert len(landmarks) == len(OWN) - 1
    assert told(path, marker_set=str(starter)) == 0
    assert "marker set: a_trial_markers" in capsys.readouterr().out


def test_labels_without_sense_give_a_template(here):
    assert told(recording(here, ["0001", 'a "b" \\', "0003"])) == 3
    starter = here / "a_trial_markers.toml"
    with pytest.raises(UsageError, match="expected lines like head"):
        load_marker_set(str(starter))
    written = starter.read_text(encoding="utf-8")
    assert '# forearm_l = { LABEL = "landmark" }' in written
    starter.write_text(written.replace("# head", "head"), encoding="utf-8")
    with pytest.raises(UsageError, match="LABEL: unknown landmark landmark"):
        load_marker_set(str(starter))


def test_nothing_is_written_over(here, capsys):
    path, mine = recording(here, OWN), here / "a_trial_markers.toml"
    mine.write_text("mine", encoding="utf-8")
    assert told(path) == 0
    assert "is there already" in capsys.readouterr().out
    with pytest.raises(UsageError, match="not written over"):
        told(path, write=mine)
    assert mine.read_text(encoding="utf-8") == "mine"
    with pytest.raises(UsageError, match="cannot be written"):
        told(path, write=here / "no" / "folder.toml")


def test_a_first_set_on_request_also_of_a_known_one(here):
    target = here / "mine.toml"
    assert told(recording(here, HANSEN), write=target) == 0
    mine = {m.label: (m.segment, m.landmark) for m in load_marker_set(str(target)).markers}
    assert mine == {m.label: (m.segment, m.landmark) for m in load_marker_set("hansen2017").markers}


def test_two_people(here, capsys):
    path = recording(here, [f"{name}:{label}" for name in ("Anna", "Ben") for label in HANSEN])
    with pytest.raises(BadDataError, match=r"2 people in one file: 'Anna:' .38 markers., 'Ben:'"):
        told(path)
    assert told(path, prefix="Ben") == 0
    said = capsys.readouterr().out
    assert "labels of the person with the prefix 'Ben:'" in said
    assert "  Ben:C7      seen 100.0 %  upper torso, c7\n" in said
    assert "  Anna:C7     seen 100.0 %  not in the set\n" in said


def test_what_is_missing_is_said_of_a_set_of_words(here, capsys):
    path = recording(here, [label for label in OWN if "Heel" not in label])
    assert told(path) == 3
    assert "a skeleton cannot be built without: calcaneus_l, calcaneus_r" in capsys.readouterr().out


def test_the_starter_of_a_near_miss_holds_both(here):
    labels = [label for label in HANSEN if label not in ("RMT2", "LMT2")]
    path = recording(here, [*labels, "RToe", "LToe", "what"])
    assert told(path) == 0
    starter = here / "a_trial_markers.toml"
    landmarks = {m.label: m.landmark for m in load_marker_set(str(starter)).markers}
    assert landmarks["RToe"] == "metatarsal_2_r" and landmarks["RKNEL"] == "knee_lateral_r"
    assert "# what\n" in starter.read_text(encoding="utf-8")


def study_of(folder: Path, labels_of_tasks: dict[str, Sequence[str]]) -> Path:
    """One person with a recording per task."""
    study = study_with(folder, "sub-01\tF\t60\t1.7")
    for task, labels in labels_of_tasks.items():
        recording(folder, labels).rename(study / "sub-01" / f"sub-01_task-{task}.trc")
    return study


def study_with(folder: Path, *people: str) -> Path:
    """Lines of participants.tsv, and a folder for each."""
    study = folder / "study"
    for line in people:
        (study / line.split("\t")[0]).mkdir(parents=True)
    write_table(study, *people)
    return study


def test_ingest_makes_a_set_of_words_and_hands_it_on(bsip, here):
    prefixed = [f"S01_{label}" for label in OWN]
    study = study_of(here, {"static": prefixed, "walking": prefixed[:-2]})
    answer = bsip("ingest", study, "--out", here / "out")
    assert answer.code == 0 and "no shipped set fits well" in answer.err
    assert "RKneeLat = right knee lateral" in answer.err
    assert "not understood: Ball#1" in answer.err
    file = here / "out" / "sub-01" / "sub-01_task-static_markers.parquet"
    facts = read_header(file, "markers")["provenance"]["facts"]
    made = MarkerSet.from_data(facts["marker_set_content"])
    assert made.name == "words" and {m.label for m in made.markers} == {*OWN} - {"Ball#1"}


def test_ingest_refuses_labels_without_feet_and_leads_to_the_starter(bsip, here):
    pelvis, legs = "EIASG EIASD SACRUM", "GENOUG GENOUD CHEVILLEG CHEVILLED"
    labels = f"{pelvis} {legs} C7 EPAULEG EPAULED".split()
    answer = bsip("ingest", study_of(here, {"static": labels}), "--out", here / "out")
    assert answer.code == 3 and "none on the left foot (the heel and a metatarsal)" in answer.err
    command = answer.err.split("`bsip markers ")[1].split("`")[0]
    assert bsip("markers", command.strip("'")).code == 3
    assert (here / "sub-01_task-static_markers.toml").is_file()


def test_exit_codes(bsip, here):
    known = recording(here, HANSEN)
    bsip.done("markers", known)
    assert bsip("markers", known, "--marker-set", "plugin_gait", "--write", known).code == 2
    unknown = bsip("markers", known, "--marker-set", "hansen")
    assert unknown.code == 2 and "there is no such marker set" in unknown.err
    (here / "empty.c3d").touch()
    refused = bsip("markers", here / "empty.c3d")
    assert refused.code == 3 and "the file is empty" in refused.err and refused.out == ""
    gone = bsip("markers", here / "nowhere.c3d")
    assert gone.code == 3 and "Traceback" not in gone.err


def test_two_people_of_one_recording_in_a_study(bsip, here):
    both = [f"{name}:{label}" for name in ("Anna", "Ben") for label in HANSEN]
    source = recording(here, both)
    study = study_with(here, "sub-01\tF\t60\tn/a", "sub-02\tM\t70\tn/a")
    for person in ("sub-01", "sub-02"):
        (study / person / f"{person}_task-static.trc").write_bytes(source.read_bytes())
    refused = bsip("ingest", study, "--out", here / "out")
    assert refused.code == 3 and "2 people in one file: 'Anna:'" in refused.err
    options = study / "study.toml"
    options.write_text('[ingest]\nprefixes = { sub-01 = "Anna:", sub-03 = "Ben:" }\n')
    unknown = bsip("ingest", study, "--out", here / "out")
    assert unknown.code == 2
    assert "ingest.prefixes: there is no sub-03 (did you mean sub-0" in unknown.err
    options.write_text('[ingest]\nprefixes = { sub-01 = "Anna:", sub-02 = "Ben" }\n')
    bsip.done("ingest", study, "--out", here / "out")
    first_y = {}
    for person in ("sub-01", "sub-02"):
        table = pd.read_parquet(here / "out" / person / f"{person}_task-static_markers.parquet")
        first_y[person] = table.loc[0, ["x_m", "y_m", "z_m"]].to_numpy(dtype=float)
        assert list(table["marker"][:3]) == HANSEN[:3]
    apart_m = np.linalg.norm(first_y["sub-02"] - first_y["sub-01"])
    assert apart_m == pytest.approx(LINE_M / 2, abs=1e-5)


def test_two_people_far_apart_are_no_giant(bsip, tmp_path):
    """The size of each counts, not the way from one's feet to the other's head."""
    markers, labels = standing_markers(80)
    study = study_with(tmp_path, "sub-01\tF\t60\t1.7")
    both = np.concatenate([markers, markers + np.array([4.0, 0.0, 0.0])], axis=1)
    names = [f"{name}:{label}" for name in ("Anna", "Ben") for label in labels]
    write_trc(study / "sub-01" / "sub-01_task-static.trc", np.arange(80) / 100.0, both, names)
    refused = bsip("check", study)
    assert refused.code == 3 and " tall" not in refused.err
    assert "sub-01_task-static.trc: 2 people in one file: 'Anna:'" in refused.err
    (study / "study.toml").write_text('[ingest]\nprefixes = { sub-01 = "Ben" }\n')
    chosen = bsip("check", study)
    assert " tall" not in chosen.err and "2 people" not in chosen.err
