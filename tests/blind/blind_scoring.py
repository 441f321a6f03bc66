"""Compare the artifacts of a diagnosis with what was hidden."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq

from tests.blind.blind_cases import NOTHING, SESSION, Case
from tests.blind.blind_running import Recorded
from tests.blind.blind_truth import Expected, Record, equivalents, expected

UNEXPLAINED = "unexplained"
PERSON = "participant"  # the source that is no trial
# From best to worst for a hidden effect of the catalogue.
RIGHT_NAME, RIGHT_CLASS = "right name", "right class"
PUT_RIGHT, MISSED, SILENT = "corrected", "missed", "no answer"
WRONG_CLASS, WRONG_NAME = "wrong class", "wrong name"
VERDICTS = (
    *(RIGHT_NAME, RIGHT_CLASS, PUT_RIGHT, UNEXPLAINED),
    *(MISSED, WRONG_CLASS, WRONG_NAME, SILENT),
)
FOUND = (RIGHT_NAME, RIGHT_CLASS)


@dataclass(frozen=True)
class Answer:
    """What one artifact says.

    source : PERSON or the stem of a trial. named : (effect, target) with verdict named, without
    "none". classes : per class its (effect, target). rows : the artifact.
    """

    source: str
    named: tuple[tuple[str, str], ...]
    classes: tuple[tuple[tuple[str, str], ...], ...]
    rows: pd.DataFrame

    def about(self, effect: str) -> set[str]:
        """Targets at which the effect is named or in a class."""
        pairs = [*self.named, *(pair for members in self.classes for pair in members)]
        return {target for name, target in pairs if name == effect}

    def told(self, effect: str) -> pd.DataFrame:
        """Rows of the effect where it is named or in a class."""
        return self.rows[(self.rows["effect"] == effect) & (self.rows["verdict"] != "rejected")]

    def alarms(self) -> list[str]:
        """Everything that it takes to be wrong."""
        return sorted({name for name, _ in self.named} | {_joined(c) for c in self.classes})


def read_answer(path: Path, source: str) -> Answer:
    rows = pd.read_parquet(path)
    rows["target"] = rows["target"].fillna("").astype(str)
    said = rows[rows["verdict"] == "named"]
    pairs = _pairs(said)
    unsure = rows[rows["verdict"] == "ambiguous"]
    classes = tuple(_pairs(members) for _, members in unsure.groupby("class_id", dropna=False))
    return Answer(source, tuple(p for p in pairs if p[0] != NOTHING), classes, rows)


def _pairs(rows: pd.DataFrame) -> tuple[tuple[str, str], ...]:
    ordered = rows.sort_values("rank", kind="stable")
    return tuple(dict.fromkeys(zip(ordered["effect"], ordered["target"], strict=True)))


def _joined(members: Iterable[tuple[str, str]]) -> str:
    return " or ".join(sorted({name for name, _ in members}))


def answers_of(out: Path, recorded: Recorded) -> list[Answer]:
    """Those that may speak about the case: its trials', and the person's if it is in all of them.

    The person's comes first; an artifact that is not there says nothing.
    """
    folder, name = out / recorded.participant, recorded.participant
    files = {stem: folder / f"{stem}_diagnosis.parquet" for stem in recorded.stems}
    if recorded.case.place == SESSION:
        files = {PERSON: folder / f"{name}_diagnosis.parquet", **files}
    return [read_answer(path, source) for source, path in files.items() if path.is_file()]


@dataclass(frozen=True)
class Estimate:
    """One parameter of a hidden effect as found. Interval NaN where none is stated.

    bound : the least standard deviation in that recording (Cramér and Rao), None where unknown.
    """

    parameter: str
    unit: str
    truth: float
    estimate: float
    ci_low: float
    ci_high: float
    bound: float | None


@dataclass(frozen=True)
class Score:
    """The answer to one hidden effect, or to none.

    effect, size, unit : what is hidden ("none" in nulls).
    verdict : one of VERDICTS; in nulls RIGHT_NAME if nothing is named.
    says : the effect that it is taken for. target_right : None where the effect was not found.
    targets : where it is said to sit. wrong : what is named beside, in whatever artifact.
    gain_percent : of the found effect; held_out_gain_percent : mean of the gain artifact.
    """

    case: str
    kind: str
    place: str
    session: str
    verdict: str
    says: str
    effect: str = NOTHING
    size: float = 0.0
    unit: str = ""
    target: str = ""
    target_right: bool | None = None
    targets: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)
    estimates: list[Estimate] = field(default_factory=list)
    gain_percent: float | None = None
    held_out_gain_percent: float | None = None


def score(out: Path, recorded: Recorded) -> list[Score]:
    """One score per hidden effect of a case; one for a null."""
    answers = answers_of(out, recorded)
    records = recorded.truth["effects"]
    if not records:
        return [_quiet(recorded.case, recorded.session, answers)]
    return [
        _score_of(out, recorded, record, answers, given.size)
        for record, given in zip(records, recorded.case.hidden, strict=True)
    ]


def score_of_clean_trial(out: Path, participant: str, session: str, stem: str) -> Score:
    """A trial without anything hidden, of a person in whose other trials something is."""
    path = out / participant / f"{stem}_diagnosis.parquet"
    answers = [read_answer(path, stem)] if path.is_file() else []
    return _quiet(Case(f"{session}-clean", "clean trial", "squat"), session, answers)


def _quiet(case: Case, session: str, answers: list[Answer]) -> Score:
    """Recordings with nothing hidden: all that is named is a false positive."""
    verdict, says = _verdict(NOTHING, set(), "", answers)
    wrong = [f"{alarm} ({_where(a)})" for a in answers for alarm in a.alarms()]
    if answers and not wrong:
        verdict = RIGHT_NAME
    return Score(case.name, case.kind, case.place, session, verdict, says, wrong=wrong)


def _score_of(
    out: Path, recorded: Recorded, record: Record, answers: list[Answer], size: float
) -> Score:
    case, trials = recorded.case, recorded.truth["trials"]
    sought = {a.source: expected(record, _trial_of(trials, a, record["effect"])) for a in answers}
    aim = expected(record, _longest(trials.values()))
    present = {other["effect"] for other in recorded.truth["effects"]}
    wrong = _wrong(recorded, answers)
    verdict, says = _verdict(aim.effect, present, _twin(record, recorded, answers), answers)
    if wrong and aim.effect == UNEXPLAINED:  # the worst answer of all, whatever stands beside
        verdict, says = WRONG_NAME, wrong[0].partition(" ")[0]
    if verdict == MISSED and _put_right(out, recorded, record["effect"], aim):
        verdict = PUT_RIGHT
    found = [a for a in answers if a.about(aim.effect)]
    right = [a for a in found if any(aim.same_target(t) for t in a.about(aim.effect))]
    best = next(iter(right), None)
    of_the_best = (
        {}
        if best is None
        else {
            "estimates": _estimates(out, recorded, best, sought[best.source]),
            "gain_percent": _mean(best.told(aim.effect)["gain_percent"]),
            "held_out_gain_percent": _held_out_gain(out, recorded, best),
        }
    )
    return Score(
        *(case.name, case.kind, case.place, recorded.session, verdict, says),
        *(record["effect"], size, record["unit"], aim.target),
        target_right=bool(right) if found and aim.effect != UNEXPLAINED else None,
        targets=sorted(set().union(*(a.about(aim.effect) for a in found))),
        wrong=wrong,
        **of_the_best,
    )


def _trial_of(trials: dict[str, Record], answer: Answer, effect: str) -> Record:
    """The trial's own truth; for the person that of the longest recording in which the effect is
    told, as the diagnosis prints numbers that hang on the movement."""
    if answer.source in trials:
        return trials[answer.source]
    told = {stem for text in answer.told(effect)["trials"] for stem in text.split(", ")}
    return _longest([trials[stem] for stem in told & set(trials)] or trials.values())


def _longest(trials: Iterable[Record]) -> Record:
    return max(trials, key=lambda trial: trial["duration_s"])


def _tasks(answer: Answer, recorded: Recorded) -> set[str]:
    """Of the recordings that an answer rests on."""
    stems = recorded.stems if answer.source == PERSON else (answer.source,)
    return {stem.partition("_task-")[2].partition("_")[0] for stem in stems}


def _twin(record: Record, recorded: Recorded, answers: list[Answer]) -> str:
    """What is named where the recordings behind it do not tell it from the hidden effect."""
    return next(
        (
            name
            for answer in answers
            for name, _ in answer.named
            if name in equivalents(record, _tasks(answer, recorded))
        ),
        "",
    )


def _verdict(effect: str, present: set[str], twin: str, answers: list[Answer]) -> tuple[str, str]:
    """The best that any answer says of a hidden effect, and in which words.

    present : all that is hidden. twin : named, and the same in these recordings, or empty.
    """
    if not answers:
        return SILENT, ""
    named = [name for answer in answers for name, _ in answer.named]
    classes = [members for answer in answers for members in answer.classes]
    if effect in named:
        return RIGHT_NAME, effect
    if any(effect in {name for name, _ in members} for members in classes):
        return RIGHT_CLASS, effect
    if twin:
        return RIGHT_CLASS, twin
    if strange := next((n for n in named if n not in present and n != UNEXPLAINED), None):
        return WRONG_NAME, strange
    if foreign := next((m for m in classes if not {name for name, _ in m} & present), None):
        return WRONG_CLASS, _joined(foreign)
    return (UNEXPLAINED, UNEXPLAINED) if UNEXPLAINED in named else (MISSED, NOTHING)


def _wrong(recorded: Recorded, answers: list[Answer]) -> list[str]:
    """Effects named for certain that are not there, with the artifact that says so."""
    records = recorded.truth["effects"]
    found = set()
    for answer in answers:
        twins = (equivalents(record, _tasks(answer, recorded)) for record in records)
        allowed = {UNEXPLAINED, *(record["effect"] for record in records)}.union(*twins)
        found |= {f"{name} ({_where(answer)})" for name, _ in answer.named if name not in allowed}
    return sorted(found)


def _where(answer: Answer) -> str:
    return answer.source.partition("_")[2] or answer.source


def _estimates(out: Path, recorded: Recorded, answer: Answer, sought: Expected) -> list[Estimate]:
    rows = answer.told(sought.effect)
    rows = rows[[sought.same_target(target) for target in rows["target"]]]
    rows = rows.drop_duplicates("parameter").set_index("parameter")
    values = sought.of_the_session() if answer.source == PERSON else sought.values
    bounds = _bounds(out / recorded.participant, answer, sought)
    return [
        Estimate(
            name,
            str(row.unit),
            truth,
            *map(float, (row.estimate, row.ci_low, row.ci_high)),
            bounds.get(name),
        )
        for name, truth in values.items()
        if name in rows.index
        for row in [rows.loc[name]]
    ]


def _bounds(folder: Path, answer: Answer, sought: Expected) -> dict[str, float]:
    """Of the cause as kept, per parameter; nothing of a candidate that was not kept itself."""
    path = folder / f"{folder.name}_diagnosis.parquet"
    if not path.is_file():
        return {}
    header = json.loads(pq.read_schema(path).metadata[b"bsip"])
    for cause in header["provenance"]["facts"].get("causes", []):
        there = answer.source == PERSON or answer.source in cause["trials"]
        if there and cause["effect"] == sought.effect and sought.same_target(cause["target"]):
            return cause["bounds"]
    return {}


def _held_out_gain(out: Path, recorded: Recorded, answer: Answer) -> float | None:
    """Mean over components of the gain artifact beside the answer, where `extend` wrote one."""
    stem = recorded.participant if answer.source == PERSON else answer.source
    path = out / recorded.participant / f"{stem}_gain.parquet"
    return _mean(pd.read_parquet(path)["gain_percent"]) if path.is_file() else None


def _mean(values: pd.Series) -> float | None:
    known = values.dropna()
    return float(known.mean()) if len(known) else None


def _put_right(out: Path, recorded: Recorded, effect: str, aim: Expected) -> bool:
    """Whether an earlier stage says that it has undone the effect: exchanged labels of this pair
    stand right again, frames that repeat the one before are gaps."""
    if effect == "marker_swap":
        events = _tables(out, recorded, "marker-events")
        swaps = (row for table in events for row in table[table["kind"] == "swap"].itertuples())
        return any(x.put_right and aim.same_target(f"{x.marker}+{x.partner}") for x in swaps)
    if effect == "outside_repeated_frames":
        tables = _tables(out, recorded, "quality")
        return any(table["check"].eq("repeated_frames").any() for table in tables)
    return False


def _tables(out: Path, recorded: Recorded, kind: str) -> list[pd.DataFrame]:
    """An artifact of all recordings that hold the effect."""
    folder = out / recorded.participant
    files = (folder / f"{stem}_{kind}.parquet" for stem in recorded.stems)
    return [pd.read_parquet(path) for path in files if path.is_file()]
