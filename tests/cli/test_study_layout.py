"""Participants and recordings as they lie in a study folder."""

import json
from pathlib import Path

import pytest

from bsip_cli.config import load_config
from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.pipeline import STAGES
from bsip_cli.running.unit import Unit
from bsip_cli.study.participants import named_in
from bsip_cli.study.study import load_study
from tests.cli.conftest import COLUMNS, make_people, write_table

ROLES = {"static": ("static",), "sequence": ("sequence", "dance")}
HEADER = f"{COLUMNS}\n"


def load(root: Path):
    study, refusals = load_study(root, ROLES)
    return study, [str(refusal) for refusal in refusals]


def test_roles_by_task_in_one_order(empty_study):
    """Whatever the file system says: results must not depend on it."""
    folder = empty_study / "sub-01"
    for task in ("throwing_run-2", "dance_run-1", "throwing_run-10"):
        (folder / f"sub-01_task-{task}.c3d").write_bytes(b"")
    study, refusals = load(empty_study)
    assert refusals == []
    assert [(t.stem.split("task-")[1], t.role) for t in study.participants[0].trials] == [
        ("dance_run-1", "sequence"),
        ("static", "static"),
        ("throwing_run-10", "validation"),
        ("throwing_run-2", "validation"),
    ]


def test_facts_of_the_participants(empty_study):
    first, second = load(empty_study)[0].participants
    assert (first.sex, first.mass_kg, first.height_m) == ("M", 70.0, 1.8)
    assert (second.sex, second.mass_kg, second.height_m) == ("F", 60.0, None)


def test_only_who_is_chosen_is_looked_at(empty_study):
    write_table(empty_study, "sub-01\tM\t70\t1.8", "sub-02\tX\t60\tn/a", "sub-03\tF\t60\tn/a")
    study, refusals = load_study(empty_study, ROLES, ["sub-01"])
    assert ([p.id for p in study.participants], refusals) == (["sub-01"], [])
    study, refusals = load_study(empty_study, ROLES, ["sub-02"])
    assert study.participants == ()
    assert "sex 'X' of sub-02" in str(refusals[0])


def test_many_participants_are_not_listed_in_a_message(empty_study):
    write_table(empty_study, *(f"sub-{k:03d}\tM\t70\t1.8" for k in range(200)))
    with pytest.raises(UsageError) as error:
        load_study(empty_study, ROLES, ["sub-0123"])
    assert "expected one of sub-123" in str(error.value)
    assert len(str(error.value)) < 300


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("sub-02\tX\t60\t1.7", "sex 'X' of sub-02; expected M, F, other or n/a"),
        ("sub-02\tF\t-60\t1.7", "mass_kg '-60' of sub-02"),
        ("sub-02\tF\tsixty\t1.7", "mass_kg 'sixty' of sub-02"),
        ("sub-02\tF\tnan\t1.7", "mass_kg 'nan' of sub-02"),
        ("sub-02\tF\t60\t17", "height_m '17' of sub-02; expected a number between 0.5 and 2.6"),
        ("sub-03\tF\t60\t1.7", "there is no folder sub-03"),
        ("../sub-02\tF\t60\t1.7", "participant_id '../sub-02'"),
        ("\tF\t60\t1.7", "participant_id ''"),
        ("sub-02", "the line of 'sub-02' has 1 cells; expected 4"),
        ("sub-02\tF\t60\t1.7\t5", "the line of 'sub-02' has 5 cells; expected 4"),
        ("sub-01\tM\t71\t1.81", "sub-01 stands twice"),
        ("SUB-01\tM\t71\t1.81", "sub-01 stands twice"),
        ("sub-02\0\tM\t71\t1.81", "participant_id 'sub-02\\x00'"),
        ('"sub\n-02"\tM\t71\t1.81', "participant_id 'sub\\n-02'"),
        ("sub-" + "0" * 300 + "\tM\t71\t1.81", "there is no folder sub-000"),
        ("sub-02\tF\t60\t1.7" + "\tx" * 100_000, "has 100004 cells"),
    ],
)
def test_bad_line_is_refused_and_the_others_stay(empty_study, line, said):
    write_table(empty_study, "sub-01\tM\t70\t1.80", line)
    study, refusals = load(empty_study)
    assert [(person.id, person.mass_kg) for person in study.participants] == [("sub-01", 70.0)]
    assert len(refusals) == 1
    assert said in refusals[0]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "names no participant"),
        (HEADER.encode(), "names no participant"),
        (b"name\tage\nsub-01\t70\n", "has no column participant_id, sex, mass_kg"),
        (HEADER.encode("utf-16"), "names no participant"),
        (HEADER.encode("utf-16")[:-1], "is not a text table"),
        (HEADER.encode() + b"\xff\x01\x02\n", "is not a text table"),
        (
            b"patricipant_id\tgender\tMass [stamps]\nsub-01\tM\t70\n",
            "column 'Mass .stamps.', whose unit is not known; "
            "has a column 'patricipant_id' and no participant_id;",
        ),
        (b"id\tsex\tmass\tweight lb\nsub-01\tM\t70\t154\n", "2 columns of one meaning"),
        (HEADER.encode() + b"sub-01\t" + b"M" * 200_000, "is not a text table .field larger"),
        (b"\0" * 5000, "names no participant"),
        (HEADER.encode()[:-1] + b"\tx" * 1_000_000 + b"\nsub-01\n", "has 1000004 columns"),
    ],
)
def test_table_that_cannot_be_read(empty_study, content, said):
    (empty_study / "participants.tsv").write_bytes(content)
    with pytest.raises(BadDataError, match=said):
        load(empty_study)


def test_a_folder_whose_only_recording_is_misnamed_names_it(empty_study):
    folder = empty_study / "sub-01"
    (folder / "sub-01_task-static.c3d").rename(folder / "sub-01_task-my-static.c3d")
    study, (misnamed, nobody) = load(empty_study)
    assert [person.id for person in study.participants] == ["sub-02"]
    assert "sub-01_task-my-static.c3d: its name does not say what it is" in misnamed
    assert nobody.startswith(f"{folder}: none of its recordings can be used")


def test_all_faults_of_a_row_are_said_at_once(empty_study):
    write_table(empty_study, "sub-01	2	seventy	17", "sub-02	F	60	1.7")
    study, (refusal,) = load(empty_study)
    assert [person.id for person in study.participants] == ["sub-02"]
    for found in ("sex '2' of sub-01", "mass_kg 'seventy' of sub-01", "height_m '17' of sub-01"):
        assert found in refusal


def test_forces_beside_a_trc_belong_to_its_inputs(empty_study):
    """A changed .mot must count as a changed recording."""
    for name in ("walk.TRC", "walk.mot", "static.mot"):
        (empty_study / "sub-01" / f"sub-01_task-{name}").write_bytes(b"")
    study, _ = load(empty_study)
    person = study.participants[0]
    static, walk = (
        sorted(Unit(STAGES[0], study, Path("out"), load_config([]), person, trial).inputs())
        for trial in person.trials
    )
    assert static == ["sub-01_task-static.c3d"]
    assert walk == ["sub-01_task-walk.TRC", "sub-01_task-walk.mot"]


# --- participants.tsv as laboratories write it: what is read, what is said, what is refused -------


CASES = Path(__file__).parents[3] / "shared" / "cases"


def people(root: Path, table: str | bytes) -> tuple[list[tuple], list[str], list[str]]:
    """Sex, mass and height of each; what is noted; what is refused."""
    raw = table.encode() if isinstance(table, str) else table
    (root / "participants.tsv").write_bytes(raw)
    study, refusals = load(root)
    found = [(p.sex, p.mass_kg, p.height_m) for p in study.participants]
    notes = [note.partition("participants.tsv: ")[2] for note in study.notes]
    return found, [note for note in notes if note], refusals


ONE = ("F", pytest.approx(70.5, abs=0.05), pytest.approx(1.63, abs=0.005))


@pytest.mark.parametrize(
    ("table", "said"),
    [
        # cells
        (f"{COLUMNS}\nsub-01\tF\t70,5\t1,63\n", []),
        (f"{COLUMNS}\n\nsub-01\tF\t70.5\t1.63\n\t\t\t\n   \n\t\t\t\n", []),
        (f"{COLUMNS}\t\t\nsub-01\tF\t70.5\t1.63\t\t\n", []),
        (f'{COLUMNS}\n"sub-01"\t"F"\t"70,5"\t"1,63"\n', []),
        (f"{COLUMNS}\nsub-01 \tF\t 70.5\t1.63 \n", []),
        ("\n\t\nid\tage\tSEX\tmass_kg\theight_m\nsub-01\t30\tF\t70.5\t1.63\n", []),
        (f"{COLUMNS}\n01\tF\t70.5\t1.63\n", []),
        (f"{COLUMNS}\n1\tF\t70.5\t1.63\n", ["1 is sub-01, by their folders"]),
        (f"{COLUMNS}\nSub-01\tF\t70.5\t1.63\n", ["Sub-01 is sub-01, by their folders"]),
        (f"{COLUMNS}\nsub-1\tF\t70.5\t1.63\n", ["sub-1 is sub-01, by their folders"]),
        (f"{COLUMNS}\nsub-01\tF\t70.5 kg\t163 cm\n", []),
        (f"{COLUMNS}\nsub-01\tF\t155.4 lb\t5' 4\"\n", []),
        (f"{COLUMNS}\nsub-01\tF\t11 st 1.4 lb\t5 ft 4.2 in\n", []),
        # separators
        (
            "participant_id;sex;mass_kg;height_m\nsub-01;F;70,5;1,63\n;;;\n",
            ["its cells are separated by semicolons"],
        ),
        (
            'participant_id,sex,mass_kg,height_m\nsub-01,F,"70,5",1.63\n',
            ["its cells are separated by commas"],
        ),
        ("sep=;\nid;sex;mass;height\n01;F;70,5;1,63\n", ["its cells are separated by semicolons"]),
        (
            "participant_id sex  mass_kg height_m\nsub-01   F  70.5 1.63\n",
            ["its cells are separated by blanks"],
        ),
        (
            "subject  sex  Mass [kg]  Height [m]\nsub-01   F    70.5       1.63\n",
            ["its cells are separated by two or more blanks"],
        ),
        # letters
        (f"\ufeff{COLUMNS}\r\nsub-01\tF\t70.5\t1.63\r\n", []),
        (f"{COLUMNS}\nsub-01\tF\t70.5\t1.63\n".encode("utf-16"), []),
        (f"{COLUMNS}\nsub-01\tF\t70.5\t1.63\n".encode("utf-16-be"), []),
        (f"{COLUMNS}\nsub-01\tF\t70.5\t1.63\n".encode("utf-16-le"), []),
        (
            "id\tGeschlecht\tKörpergewicht (kg)\tGröße (cm)\nsub-01\tw\t70,5\t163\n".encode(
                "cp1252"
            ),
            ["it is no UTF-8 and was read as Windows-1252 (Latin-1)"],
        ),
        # columns
        ("Subject\tGender\tweight\tHeight (cm)\nsub-01\tfemale\t70.5\t163\n", []),
        ("Participant ID\tSex\tweight_kg\tstature mm\nsub-01\tF\t70.5\t1630\n", []),
        ("ID\tsex\tBody mass (lbs)\tHeight (in)\nsub-01\tF\t155.4\t64.2\n", []),
        ("ID\tsexe\tPoids (g)\tTaille (cm)\nsub-01\tfemme\t70500\t163\n", []),
        ("ID\tsexo\tweight [N]\taltura\nsub-01\tmujer\t691.4\t1,63\n", []),
        # units that nothing else can be
        (
            f"{COLUMNS}\nsub-01\tF\t70.5\t163\n",
            ["height_m 163 of sub-01 is taken as cm: 1.63 m, since it cannot be in m"],
        ),
        (
            "id\tsex\tmass\theight\nsub-01\tF\t691.4\t64.2\n",
            [
                "mass 691.4 of sub-01 is taken as N: 70.5 kg, since it cannot be in kg",
                "height 64.2 of sub-01 is taken as in: 1.631 m, since it cannot be in m",
            ],
        ),
        (
            "id\tsex\tmass [g]\theight (cm)\nsub-01\tF\t70.5\t1.63\n",
            [
                "mass [g] 70.5 of sub-01 is taken as kg: 70.5 kg, since it cannot be in g",
                "height (cm) 1.63 of sub-01 is taken as m: 1.63 m, since it cannot be in cm",
            ],
        ),
    ],
)
def test_dialects(empty_study, table, said):
    found, notes, refusals = people(empty_study, table)
    assert (found, refusals) == ([ONE], [])
    assert notes == said


@pytest.mark.parametrize(
    ("cells", "taken", "said"),
    [
        (["72.6 5.11"], [1.557528], ["it may also be 1.803 m (ft and in)"]),
        (["72.6 5.1"], [1.55448], ["1.549 m (ft and in) or 1.778 m (ft and in)"]),
        (["102 5.11"], [1.8034], ["as ft and in: 1.803 m, by the body-mass index not 1.558 m"]),
        (["72.6 5.11", "80 5.75"], [1.557528, 1.7526], []),  # decimal feet, as 5.75 shows
        (["72.6 5’11”", "80 5′9″", "70 1m68"], [1.8034, 1.7526, 1.68], []),
        (["72.6 1m6", "80 5-6"], [], []),
    ],
)
def test_feet_and_inches(empty_study, cells, taken, said):
    make_people(empty_study, len(cells))
    rows = [f"sub-{k:02d} M {cell}".replace(" ", "\t") for k, cell in enumerate(cells, 1)]
    table = "\n".join(["id\tsex\tmass_kg\theight (ft)", *rows, ""])
    found, notes, refusals = people(empty_study, table)
    assert [height for *_, height in found] == pytest.approx(taken)
    assert len(notes) == len(said) and all(map(str.__contains__, notes, said))
    assert [r for r in refusals if "5 ft 6 in" not in r] == []
    assert len(found) + len(refusals) == len(cells)


@pytest.mark.parametrize(
    ("sexes", "legend", "read"),
    [
        ("female male woman man", "", "FMFM"),
        ("weiblich männlich Frau Mann", "", "FMFM"),
        ("femme homme F H", "", "FMFM"),
        ("mujer hombre femenino masculino", "", "FMFM"),
        ("donna uomo femmina maschio", "", "FMFM"),
        ("other O n/a", "", ["other"] * 3),
        ("0 1 n/a", " (0=F, 1=M)", ["F", "M", "other"]),
        ("1 2", " [1: male; 2: female]", "MF"),
        ("2 1", " female = 2, male = 1", "FM"),
        ("1.0 2.0", " (1=F; 2=M)", "FM"),
        ("M F", " (M/F)", "MF"),
        ("a b", " (a = weiblich / b = männlich)", "FM"),
        # a letter is the beginning of a word in the language of its column
        ("M Varón", "", "FM"),
        ("Hombre M", "", "MF"),
        ("H M n/a", "", ["M", "F", "other"]),
        ("F M Hombre", "", "FMM"),
        ("F férfi", "", "MM"),
        ("K M", "", "FM"),
        ("K E", "", "FM"),
        ("M Ž", "", "MF"),
        ("m w d", "", ["M", "F", "other"]),
        # of several languages, where all of them agree
        ("M F Mann female", "", "MFMF"),
        ("Homme F Frau M", "", "MFFM"),
        ("uomo M male F", "", "MMMF"),
        ("M F U", "", ["M", "F", "other"]),
    ],
)
def test_sexes(empty_study, sexes, legend, read):
    assert sexes_of(empty_study, sexes, legend) == ([*read], [])


def sexes_of(root: Path, sexes: str, legend: str = "") -> tuple[list[str], list[str]]:
    rows = [f"sub-{k:02d}\t{sex}\t70\t1.7\n" for k, sex in enumerate(sexes.split(), 1)]
    make_people(root, len(rows))
    table = f"participant_id\tsex{legend}\tmass_kg\theight_m\n" + "".join(rows)
    found, _, refusals = people(root, table)
    return [sex for sex, *_ in found], refusals


@pytest.mark.parametrize(
    ("sexes", "remedy"),
    [
        ("0", "say what the numbers mean"),
        ("1 2", "say what the numbers mean"),
        ("V M", "write words in the whole column"),  # vrouw, varón, vyras
        ("M F N", "write words in the whole column"),
        ("Mujer M", "write words in the whole column"),  # mujer or masculino
        ("male mujer M", "write words in the whole column"),
        ("D", "write words in the whole column"),  # donna, divers
    ],
)
def test_sexes_that_may_be_either_are_refused(empty_study, sexes, remedy):
    _, refusals = sexes_of(empty_study, sexes)
    assert remedy in refusals[-1]


@pytest.mark.parametrize(
    "levels",
    [
        {"0": "female", "1": "male"},
        {"0": {"Description": "Assigned female at birth"}, "1": {"Description": "male"}},
        {"F": "0", "M": "1"},
    ],
)
def test_levels_of_bids(empty_study, levels):
    (empty_study / "participants.json").write_text(json.dumps({"sex": {"Levels": levels}}))
    assert sexes_of(empty_study, "0 1") == (["F", "M"], [])


def test_units_of_bids(empty_study):
    sidecar = {"height": {"Units": "cm"}, "weight": {"Units": "lb"}}
    (empty_study / "participants.json").write_text(json.dumps(sidecar))
    table = "participant_id\tsex\tweight\theight\nsub-01\tF\t155.4\t163\n"
    assert people(empty_study, table)[0] == [ONE]
    with pytest.raises(BadDataError, match=r"do not agree: the unit of 'weight \(kg\)' is 'lb'"):
        sidecar |= {"weight (kg)": sidecar["weight"]}
        (empty_study / "participants.json").write_text(json.dumps(sidecar))
        people(empty_study, table.replace("weight", "weight (kg)"))


def test_a_sidecar_that_cannot_be_read_is_said(empty_study):
    (empty_study / "participants.json").write_text("{")
    study, _ = load(empty_study)
    assert "participants.json: is not used: " in study.notes[0]


@pytest.mark.parametrize(
    ("mass", "height", "said"),
    [
        ("163", "1.63", "index of 61.3 kg/m2, people have 12 to 60; in lb the mass would be 73.9"),
        ("11", "1.63", "in st the mass would be 69.9 kg and the index 26.3"),
        ("26", "1.9", "index of 7.2 kg/m2, people have 12 to 60: used as it stands"),
    ],
)
def test_masses_and_heights_of_nobody_are_said_and_kept(empty_study, mass, height, said):
    found, notes, refusals = people(empty_study, f"{COLUMNS}\nsub-01\tF\t{mass}\t{height}\n")
    assert (found, refusals) == ([("F", float(mass), float(height))], [])
    assert said in notes[0]


@pytest.mark.parametrize(
    ("mass", "height"),
    [("20", "1.15"), ("27.7", "1.33"), ("56.8", "1.74"), ("115", "1.70"), ("110.9", "1.63")],
)
def test_ordinary_people_are_not_commented(empty_study, mass, height):
    assert not [
        note
        for note in people(empty_study, f"{COLUMNS}\nsub-01\tF\t{mass}\t{height}\n")[1]
        if "index" in note
    ]


@pytest.mark.parametrize(
    ("header", "row", "said"),
    [
        ("mass\theight", "500\tn/a", "it may be 226.8 kg (lb) or 50.99 kg (N)"),
        ("mass_kg\theight_m", "500\t1.7", "mass_kg '500' of sub-01"),  # a stated unit is no guess
        ("mass_kg\theight_m", "70.000,5\t1.7", "mass_kg '70.000,5' of sub-01"),
        ("mass_kg\theight_m", "60-70\t1.7", "mass_kg '60-70' of sub-01"),
        ("Mass [lb]\theight_m", "1550\t1.7", "a number between 22.05 and 881.8 lb"),
    ],
)
def test_numbers_that_may_be_anything_are_refused(empty_study, header, row, said):
    _, _, (refusal,) = people(empty_study, f"participant_id\tsex\t{header}\nsub-01\tF\t{row}\n")
    assert said in refusal


def test_decimal_commas_between_commas_are_refused_with_the_reason(empty_study):
    table = "participant_id,sex,mass_kg,height_m\nsub-01,F,70,5,1.63\nsub-02,M,80.1,1.8\n"
    found, _, (refusal,) = people(empty_study, table)
    assert found == [("M", 80.1, 1.8)] and "write points for decimal commas" in refusal


def test_names_for_scripts_are_those_of_the_folders(empty_study):
    (empty_study / "participants.tsv").write_text("id;sex;mass\n1;F;70\nsub-02;M;80\n")
    assert named_in(empty_study) == ["sub-01", "sub-02"]
    study, _ = load_study(empty_study, ROLES, ["sub-01"])
    assert [person.mass_kg for person in study.participants] == [70.0]


@pytest.mark.parametrize(
    ("case", "sex"), [("15g-mass-lb", "M"), ("15i-sex-female", "F"), ("15l-trailing-empty", "M")]
)
def test_shared_cases(case, sex):
    found = [*CASES.glob(f"{case}*/study")]
    if not found:
        pytest.skip("shared/cases is not there")
    study, refusals = load(found[0])
    assert ([person.sex for person in study.participants], refusals) == ([sex], [])
    assert not any("index" in note for note in study.notes)  # 15g: what heavy people have, too
