"""laboratory: the faults of plates, clock and vertical, by what the sessions of each person show of
them, and by all persons together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass
from typing import Any, cast
from zlib import crc32

import numpy as np

from bsip_cli.artifacts import table_of
from bsip_cli.diagnosis import laboratory_search
from bsip_cli.diagnosis.findings import interval_words
from bsip_cli.diagnosis.laboratory import persons_of
from bsip_cli.diagnosis.shared_faults import (
    STATED_MASS,
    Information,
    information_of,
    inner,
)
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import Effect, Number, digits_of, readable_unit, with_unit
from bsip_cli.effects.plates import ALL
from bsip_cli.effects.scene import Scene
from bsip_cli.report.cohort import named_sentences
from bsip_cli.report.words import count
from bsip_cli.running.unit import Unit
from bsip_cli.stages.diagnosed_trials import STATIC, diagnosed, prior_of, stated_sd
from bsip_cli.stages.frames import person_of
from bsip_cli.stages.known_laboratory import information_in, pooled_rows, session_rows
from bsip_cli.stages.trial_scene import scene_of
from bsip_cli.study.study import Trial

_LEAST_SAMPLES = 3  # of the residual, by which an autoregression is defined: 0.3 s on the plates
_SAME_PLACE_M = 0.02  # of every corner: what laboratories meet of a plate not where it is said
_MOVED = 0.1  # of its standard deviation: less makes no diagnosis untrue
_UNWEIGHED = 0.1  # spread of a mass that nobody stated, part of it
_TEXTS = "effect target parameter unit verdict since sentence laboratory class_id scope who"
_NUMBERS = "estimate ci_low ci_high probability limit"
_NOTHING: dict[str, object] = dict.fromkeys(_TEXTS.split(), "")
_NOTHING |= dict.fromkeys(_NUMBERS.split(), np.nan) | {"persons": 0, "trials": 0}
_NO_SCENE = cast(Scene, None)  # faults of a laboratory speak of no trial


# --- what a person shows --------------------------------------------------------------------------


def run_person(unit: Unit) -> None:
    """Read motion, wrench, person and RM of all trials; write the information of each session."""
    person = person_of(unit)
    prior = prior_of(unit, person, whatever_mass=True)
    seen: dict[str, list[tuple[Trial, Scene]]] = {}
    for trial in unit.trials("kinematics", "wrench"):
        scene = scene_of(unit, person, prior.phi, trial)
        if trial.role != STATIC:
            scene = inner(scene)
        if scene.valid.any():
            seen.setdefault(trial.session or "", []).append((trial, scene))
    rows: list[dict[str, object]] = []
    sessions = {}
    for session, mine in seen.items():
        found = [diagnosed(unit, prior, *one, _LEAST_SAMPLES) for one in mine]
        usable = [one for one in found if one is not None and one.held is None]
        if any(one.moves for one in usable):
            scenes = [one.scene for one in usable if one.moves]
            moments = np.concatenate([one.times_s[one.valid] - one.times_s[0] for one in scenes])
            trials, standing = [x.errors for x in usable], [not x.moves for x in usable]
            rows += session_rows(session, information_of(trials, standing))
            sessions[session] = {
                "plates": {p.name: p.corners_m.tolist() for _, s in mine for p in s.plates},
                "trials": [one.trial.stem for one in usable],
                # mean and standard deviation of those that show the clock, from each start
                "moments_s": [float(moments.mean()), float(moments.std())],
            }
    if not sessions:
        why = "no trial has motion with every contact on a plate"
        unit.say(f"{why}; it shows nothing of the laboratory")
    facts = {"sessions": sessions, "mass_sd": stated_sd(unit)}
    unit.write("laboratory-information", rows, facts)


# --- all together ---------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Session:
    """Of a person. plates : corners (4, 3) in the world by name. moments_s : mean and standard
    deviation of those that show the clock."""

    name: str
    person: str
    information: Information
    mass_sd: float
    plates: Mapping[str, np.ndarray]
    moments_s: tuple[float, float]


def run(unit: Unit) -> None:
    """Read laboratory-information of all who have it, one after the other; write laboratory, and
    laboratory-sums, by which each person's diagnosis knows what the others show."""
    rows: list[dict[str, object]] = []
    laboratories = _laboratories(list(_sessions(unit)))
    sums: list[dict[str, object]] = []
    found: dict[str, laboratory_search.Laboratory] = {}
    for number, sessions in enumerate(laboratories, start=1):
        lab = found[str(number)] = _fitted(unit, sessions)
        rows += _rows(unit, str(number), sessions, lab)
        sums += pooled_rows(str(number), lab.pooled())
    if len(laboratories) > 1:
        people = [len({session.person for session in one}) for one in laboratories]
        counts = ", ".join(f"{n} in laboratory {k}" for k, n in enumerate(people, start=1))
        unit.warn(
            f"the recordings are of {len(laboratories)} laboratories, by the places of their "
            f"plates: persons {counts}; each is judged by itself"
        )
    if not rows:
        sentence = "no recording has motion with every contact on a plate"
        unit.warn(f"laboratory: nothing can be said: {sentence}")
        said = {"effect": "inconclusive", "verdict": "inconclusive", "sentence": sentence}
        rows = [_NOTHING | said]
    numbered = enumerate(laboratories, start=1)
    persons = {str(k): {s.person: s.name for s in one} for k, one in numbered}
    facts = {"persons": persons, "answer": _answer(unit, found)}
    table = table_of("laboratory", rows)
    for sentence in named_sentences(table):
        unit.warn(sentence)
    unit.write("laboratory", table, facts)
    unit.write("laboratory-sums", sums, facts)


def _answer(unit: Unit, found: Mapping[str, laboratory_search.Laboratory]) -> dict[str, Any]:
    """Mean and standard deviation of every number [typical]; those of before where none has moved
    by a tenth of its standard deviation: what was made with them stays true."""
    now = {}
    for number, lab in found.items():
        posterior, coordinates = lab.posterior(), lab.persons.coordinates
        sd = np.sqrt(np.diag(posterior.covariance))
        names = [" ".join(map(str, astuple(x))) for x in coordinates]
        numbers = zip(names, posterior.mean.tolist(), sd.tolist(), strict=True)
        now[number] = {name: [mean, spread] for name, mean, spread in numbers}
    before = unit.said_before("laboratory-sums").get("answer", {})
    if before.keys() != now.keys() or any(before[k].keys() != now[k].keys() for k in now):
        return now
    pairs = [(before[k][name], now[k][name]) for k in now for name in now[k]]
    moved = np.abs(np.array([np.subtract(new, old) for old, new in pairs]))
    spread = np.array([min(old[1], new[1]) for old, new in pairs])
    return before if (moved < _MOVED * spread[:, None]).all() else now


# --- reading ------------------------------------------------------------------------------------


def _sessions(unit: Unit) -> Iterator[_Session]:
    for participant in unit.study.participants:
        if not unit.stands("laboratory-information", None, participant):
            continue
        table = unit.read("laboratory-information", participant=participant)
        facts = unit.facts("laboratory-information", participant=participant)
        for session, rows in table.groupby("session", sort=False):
            name = "_ses-".join(filter(None, (participant.id, str(session))))
            known = facts["sessions"][session]
            plates = {plate: np.array(corners) for plate, corners in known["plates"].items()}
            information, mass_sd = information_in(rows), facts["mass_sd"] or _UNWEIGHED
            whose = name, participant.id, information, mass_sd
            yield _Session(*whose, plates, tuple(known["moments_s"]))


def _laboratories(sessions: Sequence[_Session]) -> list[list[_Session]]:
    """Sessions whose plates have the same names and places, the most first."""

    def are_alike(a: Mapping[str, np.ndarray], b: Mapping[str, np.ndarray]) -> bool:
        near = (np.linalg.norm(a[k] - b[k], axis=1).max() < _SAME_PLACE_M for k in a if k in b)
        return a.keys() == b.keys() and all(near)

    found: list[list[_Session]] = []
    for one in sessions:
        mine = next((lab for lab in found if are_alike(lab[0].plates, one.plates)), None)
        if mine is None:
            found.append(mine := [])
        mine.append(one)
    return sorted(found, key=len, reverse=True)


# --- rows ---------------------------------------------------------------------------------------


def _fitted(unit: Unit, sessions: Sequence[_Session]) -> laboratory_search.Laboratory:
    mine = unit.config.laboratory
    mean_s, sd_s = np.mean([one.moments_s for one in sessions], axis=0).tolist()
    known = [one.information for one in sessions], [one.mass_sd for one in sessions]
    persons = persons_of(*known, mine.between_persons, mine.alike, (mean_s, sd_s))
    centres = {name: x.mean(axis=0) for one in sessions for name, x in one.plates.items()}
    causes = laboratory_search.causes_of(persons, centres)
    return laboratory_search.laboratory_of(persons, causes, unit.config.diagnosis.fault_prior_odds)


def _rows(
    unit: Unit, laboratory: str, sessions: Sequence[_Session], lab: laboratory_search.Laboratory
) -> Iterator[dict[str, object]]:
    options, mine = unit.config.diagnosis, unit.config.laboratory
    rng = np.random.default_rng(crc32(unit.name.encode()))
    for one in laboratory_search.verdicts_of(lab, options.named_from, rng):
        counts = _counts(sessions, one.cause)
        cells = {"laboratory": laboratory, "scope": "laboratory"}
        cells["sentence"] = _sentence(one, counts)
        yield from _rows_of(one, counts, cells)
    dates = mine.recorded_on
    dated = [(dates[s.name], k) for k, s in enumerate(sessions) if s.name in dates]
    order = [k for _, k in sorted(dated)]
    odds, named_from = options.fault_prior_odds, options.named_from
    for deviation in laboratory_search.deviations_of(lab, odds, named_from, order, rng):
        them = [sessions[k] for k in deviation.sessions]
        who = them[0].name if len(them) == 1 else ""
        where = f"in {who}" if who else f"from {them[0].name} on"
        what = f"{where}, unlike the others: {_words(deviation)}"
        scope = "person" if deviation.cause.effect == STATED_MASS.name else "session"
        cells = {"since": "" if who else them[0].name, "sentence": what}
        cells |= {"laboratory": laboratory, "scope": scope, "who": who}
        yield from _rows_of(deviation, _counts(them, deviation.cause), cells)


def _rows_of(
    found: laboratory_search.Verdict, counts: tuple[int, int], cells: Mapping[str, str]
) -> Iterator[dict[str, object]]:
    of_all = {"probability": found.probability, "verdict": found.said, "class_id": found.class_id}
    of_all |= {"persons": counts[0], "trials": counts[1], **cells}
    of_all |= {"effect": found.cause.effect, "target": found.cause.target}
    for x in found.sizes:
        size = {"parameter": x.parameter.name, "estimate": x.value, "unit": x.parameter.unit}
        size |= {"ci_low": x.low, "ci_high": x.high, "limit": x.limit}
        yield _NOTHING | of_all | size


def _counts(sessions: Sequence[_Session], cause: laboratory_search.Cause) -> tuple[int, int]:
    """Persons and trials that show a cause at its plate, or at any for all plates."""
    plate, *channel = cause.target.split(" ")
    persons, trials = set(), 0
    for one in sessions:
        counts: dict[bool, int] = {}  # in motion, and of who stands still
        for c, n in zip(one.information.coordinates, one.information.trials, strict=True):
            mine = c.effect == cause.effect and c.target.split(" ")[1:] == channel
            if mine and plate in (ALL, c.target.split(" ")[0]):
                counts[c.standing] = max(counts.get(c.standing, 0), int(n))
        if counts:
            persons.add(one.person)
            trials += sum(counts.values())
    return len(persons), trials


# --- words --------------------------------------------------------------------------------------


def _effect(cause: laboratory_search.Cause) -> Effect:
    return STATED_MASS if cause.effect == STATED_MASS.name else EFFECTS[cause.effect]


def _words(found: laboratory_search.Verdict) -> str:
    numbers = tuple(
        Number(x.parameter.name, x.parameter.unit, x.value, x.low, x.high) for x in found.sizes
    )
    effect, target = _effect(found.cause), found.cause.target
    said = len(effect.parameters(_NO_SCENE, target))  # without parts that need a trial
    values = np.array([one.value for one in numbers[:said]])
    return effect.words(_NO_SCENE, target, values).what + interval_words(numbers)


def _sentence(found: laboratory_search.Verdict, counts: tuple[int, int]) -> str:
    words, remedy = _words(found), _effect(found.cause).remedy
    shown = f"by {count(counts[0], 'person')} and {count(counts[1], 'recording')}"
    plain = {
        "named": f"{words}, {shown}; to make sure, {remedy}",
        "ambiguous": f"perhaps {words}, {shown}; other causes look alike here: {remedy}",
        "inconclusive": f"inconclusive: {words}; no possible size would have been named {shown}",
    }
    if found.said in plain:
        return plain[found.said]
    best = min(found.sizes, key=lambda one: one.limit / one.parameter.typical)
    factor, unit = readable_unit(best.parameter.name, best.parameter.unit)
    limit = with_unit(f"{factor * best.limit:.{digits_of(factor * best.limit)}f}", unit)
    start = "not so" if found.probability < 0.5 else "not sure"
    return (
        f"{start}: {words}, probability {found.probability:.2g}; "
        f"{best.parameter.name.replace('_', ' ')} {limit} would have been named {shown}"
    )
