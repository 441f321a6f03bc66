import pytest

from bsip_cli.body.markersets import load_marker_set, shipped_names
from bsip_cli.errors import UsageError
from bsip_cli.segments import LANDMARKS, SEGMENTS
from tests.body.standing_person import standing_markers

SHIPPED = (
    "biobuddy_ech",
    "hamner_other",
    "hansen2017",
    "helen_hayes",
    "opencap_subject4",
    "plugin_gait",
    "return11_static",
    "sprinter_ja1",
    "van_sint_jan",
)
HANSEN = """RTEM LTEM FHEAD C7 T10 XIPH IJ RSCAP RASIS LASIS RPSIS LPSIS RAC LAC RUA LUA RELB LELB
RFA LFA RWRR RWRU LWRR LWRU RHAND LHAND RKNEL RKNEM LKNEL LKNEM RMALL RMALM LMALL LMALM RCAL LCAL
RMT2 LMT2"""


def written(tmp_path, text):
    file = tmp_path / "mine.toml"
    file.write_text(text, encoding="utf-8")
    return str(file)


def test_shipped_sets_are_these():
    assert set(SHIPPED) <= set(shipped_names())


@pytest.mark.parametrize(
    ("other", "name"),
    [
        ("opencap", "opencap_subject4"),
        ("ezc3d_rehazenter_qualisys", "van_sint_jan"),
        ("motionanalysis_helenhayes", "helen_hayes"),
    ],
)
def test_a_set_answers_to_its_other_names(other, name):
    assert load_marker_set(other) == load_marker_set(name)


@pytest.mark.parametrize("name", shipped_names())
def test_every_shipped_set_loads(name):
    marker_set = load_marker_set(name)
    labels = [marker.label for marker in marker_set.markers]
    assert len(labels) == len(set(labels)) > 20
    assert marker_set.description != name
    assert {marker.segment for marker in marker_set.markers} <= set(SEGMENTS)
    assert {marker.landmark for marker in marker_set.markers} - {""} <= LANDMARKS
    assert all(0 < marker.weight <= 1 for marker in marker_set.markers)
    sides = [m for m in marker_set.markers if m.landmark.endswith(("_l", "_r"))]
    centred = {"upper_torso", "lower_torso", "head"}
    assert all(m.segment[-2:] == m.landmark[-2:] for m in sides if m.segment not in centred)


def test_hansen2017_has_the_labels_of_the_contract():
    labels = [marker.label for marker in load_marker_set("hansen2017").markers]
    assert sorted(labels) == sorted(HANSEN.split())
    assert len(labels) == 38
    assert set(standing_markers()) == set(labels)


def test_a_set_of_ones_own(tmp_path):
    text = """description = "Mine"
[segments]
head = { TOP = "vertex", SIDE = "" }
foot_r = { "HEEL.R" = "calcaneus_r" }
[weights]
SIDE = 0.25
[optional]
markers = ["SIDE"]
[aliases]
TOP = ["HEAD1", "HV"]
"""
    mine = load_marker_set(written(tmp_path, text))
    assert mine.name == "mine"
    top, side, heel = mine.markers
    assert (top.landmark, top.weight, top.optional, top.aliases) == (
        "vertex",
        1.0,
        False,
        ("HEAD1", "HV"),
    )
    assert (side.landmark, side.weight, side.optional) == ("", 0.25, True)
    assert (heel.label, heel.segment) == ("HEEL.R", "foot_r")


def test_all_faults_at_once_with_the_nearest_names(tmp_path):
    text = """[segments]
heda = { TOP = "vertex" }
foot_r = { HEEL = "calcaneous_r", TOE = "metatarsal_2_r" }
foot_l = { TOE = "metatarsal_2_l", OUT = "qqqq" }
[weigths]
TOP = 0.5
[weights]
LOST = 0.5
[aliases]
GONE = ["G"]
[optional]
markers = ["AWAY"]
"""
    with pytest.raises(UsageError) as caught:
        load_marker_set(written(tmp_path, text))
    found = str(caught.value)
    for fault in (
        "unknown segment heda (did you mean head?)",
        "HEEL: unknown landmark calcaneous_r (did you mean calcaneus_r?)",
        "OUT: unknown landmark qqqq",
        "TOE stands twice",
        "unknown table weigths (did you mean weights?)",
        "LOST has options but no segment",
        "GONE has options but no segment",
        "AWAY has options but no segment",
    ):
        assert fault in found
    assert "mine.toml" in found


HEAD = 'head = { TOP = "vertex" }\n'
WRONG_TYPES = {
    "segment is no table": ('[segments]\nhead = "TOP"\n', "head"),
    "landmark is a number": ("[segments]\nhead = { TOP = 3 }\n", "TOP"),
    "weight is a word": (f'[segments]\n{HEAD}[weights]\nTOP = "half"\n', "TOP"),
    "weight is negative": (f"[segments]\n{HEAD}[weights]\nTOP = -1\n", "TOP"),
    "aliases are one word": (f'[segments]\n{HEAD}[aliases]\nTOP = "HV"\n', "TOP"),
    "weights are a number": (f"weights = 3\n[segments]\n{HEAD}", "weights"),
    "optional is a list": (f'optional = ["TOP"]\n[segments]\n{HEAD}', "optional"),
    "optional markers are a word": (
        f'[segments]\n{HEAD}[optional]\nmarkers = "TOP"\n',
        "optional markers",
    ),
    "other names are a word": (f'also_called = "x"\n[segments]\n{HEAD}', "also_called"),
    "no segments": ('description = "x"\n', "segments"),
    "not TOML": ("[segments\n", "TOML"),
}


@pytest.mark.parametrize(("text", "named"), WRONG_TYPES.values(), ids=WRONG_TYPES.keys())
def test_wrong_types_are_usage_errors(tmp_path, text, named):
    with pytest.raises(UsageError) as caught:
        load_marker_set(written(tmp_path, text))
    assert named in caught.value.found


def test_an_unknown_set_names_the_known_ones():
    with pytest.raises(UsageError, match="hansen2017, helen_hayes, opencap_subject4"):
        load_marker_set("hansen")
