"""What is hidden where: cases drawn from a seed, and the sessions that hold them.

Only names, sizes and places of the simulator stand here and in `blind_cases.csv`. Sizes are in the
effects' units; those of a changed rate end where ingest sees it.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

SESSION = "session"  # the effect is in every recording of the person
NOTHING = "none"
SESSION_TASKS = ("static", "sequence", "squat", "hops", "stepon")
HOST_TASKS = ("static", "sequence", "squat")
TRIALS_PER_HOST = 5


@dataclass(frozen=True)
class Hidden:
    """One effect as `bsip simulate` takes it. target : as on the command line, - for drawn."""

    effect: str
    size: float
    target: str = "-"


@dataclass(frozen=True)
class Case:
    """One question to the diagnosis.

    kind : null, single, double or outside. place : SESSION, or the task of the one trial that
    holds the effects.
    """

    name: str
    kind: str
    place: str
    hidden: tuple[Hidden, ...] = ()


@dataclass(frozen=True)
class Session:
    """One person and day: either one case in all recordings, or a case in each of some trials.

    In the second, static, sequence and one squat are clean. plate_per_foot : whether the lab has
    two plates, side by side; else one under both feet.
    """

    name: str
    seed: int
    sequence_s: float
    cases: tuple[Case, ...]
    plate_per_foot: bool = False

    @property
    def whole(self) -> Case | None:
        """The case that all recordings share, if there is one."""
        return self.cases[0] if self.cases[0].place == SESSION else None


@dataclass(frozen=True)
class Range:
    """Sizes that labs meet, where the effect may sit, and where it is hidden, in turn."""

    least: float
    most: float
    targets: tuple[str, ...]
    places: tuple[str, ...]
    signed: bool = False


def _range(row: dict[str, str]) -> Range:
    targets, places = (tuple(row[name].split()) for name in ("targets", "places"))
    return Range(float(row["least"]), float(row["most"]), targets, places, row["signed"] == "yes")


_ROWS = csv.DictReader(Path(__file__).with_suffix(".csv").read_text("utf-8").splitlines())
_RANGES = {row["effect"]: _range(row) for row in _ROWS}
CATALOGUE = {name: one for name, one in _RANGES.items() if not name.startswith("outside_")}
OUTSIDE = {name: one for name, one in _RANGES.items() if name not in CATALOGUE}
# Two of these at once can be told apart in any trial that holds both.
DOUBLES: tuple[tuple[str, str], ...] = (
    ("sync_offset", "plate_translation"),
    ("plate_rotation", "unmeasured_contact"),
    ("sync_offset", "released_object"),
    ("plate_crosstalk", "marker_shift"),
    ("gravity_tilt", "sync_offset"),
    ("plate_translation", "added_mass"),
    ("over_smoothing", "plate_translation"),
    ("plate_drift", "unmeasured_contact"),
    ("sync_offset", "plate_rotation"),
    ("missing_joint", "plate_translation"),
)


def draws(ranges: dict[str, Range], each: int, seed: int, kind: str) -> Iterator[Case]:
    """``each`` cases of every effect, sizes spread evenly over its range."""
    for number, (effect, allowed) in enumerate(ranges.items()):
        rng = np.random.default_rng([seed, number, len(ranges)])
        strata = rng.permutation(each)
        for k in range(each):
            place = allowed.places[k % len(allowed.places)]
            share = (strata[k] + rng.uniform()) / each
            yield Case(f"{effect}-{k + 1:02d}", kind, place, (one(effect, allowed, share, rng),))


def one(effect: str, allowed: Range, share: float, rng: np.random.Generator) -> Hidden:
    """An effect whose size is the part ``share`` of its range."""
    size = allowed.least + share * (allowed.most - allowed.least)
    sign = float(rng.choice([-1.0, 1.0])) if allowed.signed else 1.0
    return Hidden(effect, float(f"{sign * size:.4g}"), str(rng.choice(allowed.targets)))


def doubles(count: int, seed: int) -> Iterator[Case]:
    """Two effects at once, in turn in a whole session and in a squat."""
    rng = np.random.default_rng([seed, 2])
    for k in range(count):
        pair = DOUBLES[k % len(DOUBLES)]
        place = "squat" if (k + k // len(DOUBLES)) % 2 else SESSION
        hidden = tuple(one(name, CATALOGUE[name], rng.uniform(), rng) for name in pair)
        yield Case(f"double-{k + 1:02d}", "double", place, hidden)


def nulls(count: int) -> list[Case]:
    return [Case(f"null-{k + 1:02d}", "null", SESSION) for k in range(count)]


def sessions_of(cases: Sequence[Case], seed: int, sequence_s: float) -> list[Session]:
    """Each case of a whole session with a person of its own, the others five to a person.

    Half of the sessions are in a lab with a plate per foot, of which one has the plates' errors.
    """
    rng = np.random.default_rng([seed, 3])
    whole = [(case,) for case in cases if case.place == SESSION]
    single = [case for case in cases if case.place != SESSION]
    single = [single[k] for k in rng.permutation(len(single))]
    starts = range(0, len(single), TRIALS_PER_HOST)
    hosts = [tuple(single[k : k + TRIALS_PER_HOST]) for k in starts]
    groups = whole + hosts
    groups = [groups[k] for k in rng.permutation(len(groups))]
    seeds = rng.choice(1_000_000, len(groups), replace=False)
    apart = rng.permutation(len(groups)) < len(groups) // 2
    sessions = [
        Session(f"session-{k + 1:03d}", int(seeds[k]), sequence_s, group, bool(apart[k]))
        for k, group in enumerate(groups)
    ]
    return [on_one_plate(one, rng) if one.plate_per_foot else one for one in sessions]


def on_one_plate(session: Session, rng: np.random.Generator) -> Session:
    """With the errors of plates in one of two, drawn for each case."""
    cases = []
    for case in session.cases:
        plate = rng.integers(1, 3)
        hidden = (
            replace(one, target=f"{one.target},plate={plate}".removeprefix("-,"))
            if one.effect.startswith("plate_")
            else one
            for one in case.hidden
        )
        cases.append(replace(case, hidden=tuple(hidden)))
    return replace(session, cases=tuple(cases))


def long_suite(
    each: int,
    null_count: int,
    pairs: int,
    outside: int,
    seed: int,
    effects: Sequence[str] = tuple(CATALOGUE),
) -> list[Session]:
    """Effects, nulls, pairs, and each kind that the catalogue lacks ``outside`` times."""
    cases = [
        *draws({name: CATALOGUE[name] for name in effects}, each, seed, "single"),
        *nulls(null_count),
        *doubles(pairs, seed),
        *draws(OUTSIDE, outside, seed, "outside"),
    ]
    return sessions_of(cases, seed, sequence_s=60.0)


EASY_PLACES = {  # where not in the first of the effect's own
    "plate_gain": "stepon",
    **dict.fromkeys(("plate_rotation", "plate_crosstalk", "plate_zero", "gravity_tilt"), "squat"),
    **dict.fromkeys(("missing_joint", "over_smoothing"), "squat"),
}


def short_suite(seed: int) -> list[Session]:
    """One easy case of every effect, three nulls, two doubles, two outside the catalogue."""
    rng = np.random.default_rng([seed, 4])
    easy = {"over_smoothing": 0.0}  # a lower cut-off takes more
    cases = [
        Case(
            f"{name}-01",
            "single",
            EASY_PLACES.get(name, allowed.places[0]),
            (one(name, allowed, easy.get(name, 1.0), rng),),
        )
        for name, allowed in CATALOGUE.items()
    ]
    for k, place in enumerate((SESSION, "squat")):
        hidden = tuple(one(name, CATALOGUE[name], 1.0, rng) for name in DOUBLES[k])
        cases.append(Case(f"double-{k + 1:02d}", "double", place, hidden))
    for name in ("outside_belt_vibration", "outside_elastic_tether"):
        cases.append(Case(f"{name}-01", "outside", "squat", (one(name, OUTSIDE[name], 1.0, rng),)))
    return sessions_of([*cases, *nulls(3)], seed, sequence_s=30.0)
