"""How often the mass that the plates measure is right: simulated trials of every kind, none stated.

Each trial is of another person, alone in its session: no static trial, no stature. "Covered" is
the share of the told masses whose 95 % interval holds the true one.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.measure import markdown
from bsip_cli.config import load_config
from bsip_cli.errors import NumericalError
from bsip_cli.pipeline import STAGES
from bsip_cli.recordings.measured_mass import MeasuredMass, measured_mass
from bsip_cli.recordings.momentum_mass import Interval
from bsip_cli.running.unit import Unit
from bsip_cli.simulate.balance import balanced
from bsip_cli.simulate.effects.base import Target, body_of
from bsip_cli.simulate.effects.loads import Support, UnmeasuredContact
from bsip_cli.simulate.numerics import window
from bsip_cli.simulate.options import Laboratory, Rates, Richness
from bsip_cli.simulate.people import Person, draw_person
from bsip_cli.simulate.plan import Plan, add_squat, moved_a_little, plate_under, sketch_for
from bsip_cli.simulate.recording import (
    THIN,
    Trial,
    measure_trial,
    simulate_trial,
    trial_of,
    write_trial,
)
from bsip_cli.stages import ingest, survey
from bsip_cli.study.study import load_study

STEM = "sub-01_task-any_run-1"
G = 9.81
MOST_DRAWS = 8


@dataclass(frozen=True, eq=False)
class Case:
    """One recording: what is simulated, in which laboratory, and which plates are read."""

    trial: Trial
    laboratory: Laboratory = field(default_factory=Laboratory)
    plates: tuple[str, ...] = ()


def _plain(
    task: str, low_s: float, high_s: float, person: Person, rng: np.random.Generator
) -> Case:
    return Case(simulate_trial(person, task, rng, float(rng.uniform(low_s, high_s))))


def _gait(task: str, duration_s: float, person: Person, rng: np.random.Generator) -> Case:
    """Two plates, short ones to long ones: 0.3 to 1.6 s with all contacts on them."""
    length = float(rng.uniform(0.5, 1.1))
    return Case(
        simulate_trial(person, task, rng, duration_s),
        Laboratory(plates=2, plate_size_m=(length, 1.2)),
    )


def _belt(person: Person, rng: np.random.Generator) -> Case:
    """Walking in a row of plates: what a treadmill measures, but for the moving frame."""
    duration = float(rng.uniform(2.0, 4.0))
    laboratory = Laboratory(plates=14, plate_size_m=(0.6, 1.2))
    return Case(simulate_trial(person, "walking", rng, duration), laboratory)


def _rail(person: Person, rng: np.random.Generator) -> Case:
    """A hand on a rail, for a part of the trial or all of it, that bears 30 to 200 N."""
    task = str(rng.choice(["static", "squat", "hops"]))
    duration = float(rng.uniform(3.0, 6.0))
    size = float(rng.uniform(30.0, 200.0))
    hand = UnmeasuredContact.draw(size, _target(rng, duration), rng)
    return Case(simulate_trial(person, task, rng, duration, effects=(hand,)))


def _target(rng: np.random.Generator, duration_s: float) -> Target:
    settings = {"start_s": -1.0, "end_s": duration_s + 1.0} if rng.uniform() < 0.5 else {}
    return Target(str(rng.choice(["hand_l", "hand_r"])), settings)


def _seat(person: Person, rng: np.random.Generator) -> Case:
    """Sit down on a seat that nothing measures, and perhaps get up; or sit all the time."""
    duration = float(rng.uniform(3.0, 6.0))
    start = -2.0 if rng.uniform() < 0.4 else float(rng.uniform(0.8, 1.2))
    end = duration + 2.0 if rng.uniform() < 0.5 else duration - float(rng.uniform(0.7, 1.0))
    plan = sitting(person, rng, duration, start, end)
    return Case(trial_of(person, plan, balanced(person, plan, THIN)))


def sitting(
    person: Person, rng: np.random.Generator, duration_s: float, start_s: float, end_s: float
) -> Plan:
    """Low from start to end, the seat bearing 60 to 85 % of the weight there."""
    sketch = sketch_for(person, duration_s)
    down = window(sketch.t_s, start_s, end_s, 0.9)
    add_squat(sketch, down, 0.24 * person.stature_m)
    moved_a_little(sketch, rng, 0.3, 0.4)
    borne = window(sketch.t_s, start_s + 0.6, end_s - 0.6, 0.3) * rng.uniform(0.6, 0.85)
    force = person.mass_kg * G * borne[:, None] * np.array([0.0, 1.0, 0.0])
    seat = Support(body_of("lower_torso"), np.zeros(3), force)
    return sketch.plan(plate_centre_m=plate_under(sketch, rng), sway_share=0.3, loads=(seat,))


def _beside(person: Person, rng: np.random.Generator) -> Case:
    """A foot on a plate that is read and a foot on one that is not."""
    case = _plain("static", 2.0, 5.0, person, rng)
    laboratory = Laboratory(plate_per_foot=True)
    return replace(case, laboratory=laboratory, plates=(str(rng.choice(["1", "2"])),))


KINDS: dict[str, Callable[[Person, np.random.Generator], Case]] = {
    "static": partial(_plain, "static", 1.0, 6.0),
    "squats": partial(_plain, "squat", 3.0, 8.0),
    "steps": partial(_plain, "steps", 3.5, 7.0),
    "walking, two plates": partial(_gait, "walking", 2.0),
    "running steps": partial(_gait, "running", 0.8),
    "jumps": partial(_plain, "hops", 3.0, 6.0),
    "throws": partial(_plain, "throwing", 2.0, 3.5),
    "sitting down": _seat,
    "hand on a rail": _rail,
    "treadmill": _belt,
    "one foot beside": _beside,
}


@dataclass(frozen=True)
class Answer:
    kind: str
    truth_kg: float
    told: MeasuredMass

    @property
    def error_percent(self) -> float:
        return 100.0 * (self.told.mass_kg / self.truth_kg - 1.0)

    @property
    def is_covered(self) -> bool:
        return abs(self.told.mass_kg - self.truth_kg) <= (
            0.01 * self.told.half_width_percent * self.told.mass_kg
        )


def drawn(kind: str, rng: np.random.Generator, sex: str) -> tuple[Person, Case]:
    """A person and a recording; drawn again where the legs do not reach."""
    for _ in range(MOST_DRAWS):
        person = draw_person(rng, Richness(), sex)
        try:
            return person, KINDS[kind](person, rng)
        except NumericalError as error:
            refused = error
    raise refused


def stretches_of_case(kind: str, seed: int, folder: Path) -> tuple[float, list[Interval]]:
    """Simulate one recording, ingest it without a stated mass: true mass and stretches."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    person, case = drawn(kind, rng, "MF"[seed % 2])
    study = folder / "study"
    (study / "sub-01").mkdir(parents=True)
    (study / "participants.tsv").write_text(
        f"participant_id\tsex\tmass_kg\theight_m\nsub-01\t{person.sex}\tn/a\tn/a\n"
    )
    plates = f"[ingest]\nplates = [{', '.join(case.plates)}]\n" if case.plates else ""
    (study / "study.toml").write_text(f'marker_set = "hansen2017"\n{plates}')
    path = study / "sub-01" / f"{STEM}.c3d"
    rates, richness = Rates(), Richness()
    measured = measure_trial(case.trial, person, rates, case.laboratory, richness, rng)
    write_trial(path, measured, richness.quantised)
    config = load_config([study / "study.toml"])
    found, _ = load_study(study, config.roles.model_dump())
    participant = found.participants[0]
    session, trial = (stage for stage in STAGES if stage.name == "ingest")
    survey.run(Unit(session, found, folder / "out", config, participant))
    unit = Unit(trial, found, folder / "out", config, participant, participant.trials[0])
    ingest.run(unit)
    records = unit.facts("wrench")["mass_stretches"]
    return person.mass_kg, [Interval.of(record) for record in records]


def answer(kind: str, seed: int) -> Answer:
    with tempfile.TemporaryDirectory() as folder:
        truth, stretches = stretches_of_case(kind, seed, Path(folder))
    most = load_config([]).ingest.mass_half_width_percent
    return Answer(kind, truth, measured_mass({STEM: stretches}, most))


HEADER = (
    "kind",
    "trials",
    "told",
    "covered [%]",
    "half of the interval, median [%]",
    "largest error [%]",
    "not known [%]",
)


def rows_of(answers: list[Answer]) -> list[list[str]]:
    by_kind = {kind: [one for one in answers if one.kind == kind] for kind in KINDS}
    return [_row(kind, some) for kind, some in (by_kind | {"all": answers}).items()]


def _row(kind: str, answers: list[Answer]) -> list[str]:
    known = [one for one in answers if one.told.is_known]
    cells = ["-"] * 3
    if known:
        covered = 100 * np.mean([one.is_covered for one in known])
        width = np.median([one.told.half_width_percent for one in known])
        worst = max(abs(one.error_percent) for one in known)
        cells = [f"{covered:.0f}", f"{width:.1f}", f"{worst:.1f}"]
    unknown = 100 * (1 - len(known) / len(answers))
    return [kind, f"{len(answers)}", f"{len(known)}", *cells, f"{unknown:.0f}"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--each", type=int, default=28, help="trials of each kind")
    parser.add_argument("--seed", type=int, default=36_000)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    wanted = [(kind, given.seed + k) for kind in KINDS for k in range(given.each)]
    with ProcessPoolExecutor(given.jobs) as pool:
        answers = list(pool.map(answer, *zip(*wanted, strict=True)))
    print(markdown(HEADER, rows_of(answers)))


if __name__ == "__main__":
    main()
