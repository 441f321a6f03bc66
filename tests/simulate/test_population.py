"""The mean of many simulated people is the table they come from, read here on its own."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import bsip_cli.body
from bsip_cli.simulate.options import Richness
from bsip_cli.simulate.people import BODIES, Person, draw_person

PEOPLE = 2500
TABLE_2007 = Path(bsip_cli.body.__file__).parent / "tables" / "dumas2007.csv"
ROW_2007 = {"lower_torso": "pelvis", "upper_arm": "arm"}
# Dumas 2015 (J Biomech 48), trunk in two: thorax CJC to TJC from CJC, abdomen TJC to LJC from TJC.
TRUNK_2015 = {
    ("M", "thorax"): "30.4 0.0 -55.5 -0.4 42 33 36 11i 1 3",
    ("F", "thorax"): "26.3 2.1 -52.8 0.1 39 33 35 12i 3i 1",
    ("M", "abdomen"): "2.9 17.3 -36.1 -0.3 54 66 40 11 6i 5i",
    ("F", "abdomen"): "4.1 24.4 -41.5 0.5 67 77 55 20 3i 5i",
}
PELVIS_LENGTH_OVER_TORSO = {"M": 94.0 / 477.0, "F": 107.0 / 429.0}


def gyration(radius: str) -> float:
    """Signed square of a printed radius in percent; i marks a negative entry."""
    return (-1.0 if radius.endswith("i") else 1.0) * (float(radius.rstrip("i")) / 100.0) ** 2


def printed_row(sex: str, body: str) -> np.ndarray:
    """(10,) mass [percent], centre of mass [percent of length], tensor [m L2] of the right side."""
    kind = body.removesuffix("_l").removesuffix("_r")
    if (sex, kind) in TRUNK_2015:
        values = TRUNK_2015[sex, kind].split()
    else:
        lines = [line for line in TABLE_2007.read_text("utf-8").splitlines() if line[0] != "#"]
        wanted = (sex, ROW_2007.get(kind, kind))
        values = next(
            list(row.values())[5:]
            for row in csv.DictReader(lines)
            if (row["sex"], row["segment"]) == wanted
        )
    return np.array([*map(float, values[:4]), *map(gyration, values[4:])])


def in_table_units(person: Person, body: str) -> np.ndarray:
    """(10,) as ``printed_row``, from the row's own origin, left mirrored to the right."""
    part = person.inertias[body]
    length = person.lengths_m.get(body)
    if length is None:  # of the pelvis: the table's share of the trunk
        length = PELVIS_LENGTH_OVER_TORSO[person.sex] * person.lengths_m["upper_torso"]
    mirror = np.array([1.0, 1.0, -1.0 if body.endswith("_l") else 1.0])
    origin = person.joints_m["tjc"] if body == "abdomen" else np.zeros(3)
    com = 100.0 * mirror * (part.com_m - origin) / length
    tensor = part.tensor_kgm2 * np.outer(mirror, mirror) / (part.mass_kg * length**2)
    upper = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return np.array([100.0 * part.mass_kg / person.mass_kg, *com, *upper])


@cache
def population(sex: str) -> list[Person]:
    rng = np.random.default_rng(37)
    return [draw_person(rng, Richness(), sex) for _ in range(PEOPLE)]


def mean_and_error(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return values.mean(axis=0), values.std(axis=0) / np.sqrt(len(values))


def table(sex: str) -> dict[str, np.ndarray]:
    """The printed rows; their masses, which sum to 100.2 or 99.9 percent, normalised."""
    rows = {body: printed_row(sex, body) for body in BODIES}
    total = sum(row[0] for row in rows.values())
    for row in rows.values():
        row[0] *= 100.0 / total
    return rows


@pytest.mark.parametrize("sex", ["M", "F"])
@pytest.mark.parametrize("body", BODIES)
def test_the_mean_of_many_people_is_the_table(sex, body):
    found = np.array([in_table_units(person, body) for person in population(sex)])
    mean, error = mean_and_error(found)
    apart = np.abs(mean - table(sex)[body]) / error
    assert np.all(apart < 4.0)


@pytest.mark.parametrize("sex", ["M", "F"])
def test_the_upper_torso_lies_where_the_table_puts_its_two_parts(sex):
    rows = table(sex)
    thorax, abdomen = rows["thorax"], rows["abdomen"]
    apart = []
    for person in population(sex):
        # In the frame of the 15 segments' upper torso: from CJC, Y up from LJC.
        cjc_to_tjc = -person.joints_m["cjc"]
        chest = person.lengths_m["thorax"] * thorax[1:4] / 100.0
        belly = cjc_to_tjc + person.lengths_m["abdomen"] * abdomen[1:4] / 100.0
        both = (thorax[0] * chest + abdomen[0] * belly) / (thorax[0] + abdomen[0])
        whole = person.segment_inertias()["upper_torso"]
        apart.append(1000.0 * (whole.com_m - both))
    mean, error = mean_and_error(np.array(apart))
    assert np.all(np.abs(mean) < 4.0 * error)
