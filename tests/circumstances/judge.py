"""The outcome of a circumstance: right, repaired, refused, said; or wrong, one of three ways."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from tests.circumstances.comparison import Comparison, compare
from tests.circumstances.generator import Circumstance
from tests.circumstances.hidden import hidden
from tests.circumstances.taken import Taken, Word

GRAVITY = 9.81
RIGHT, REPAIRED, REFUSED, SAID = "right", "repaired", "refused", "said"
MISNAMED = "refused, matter not named"
WRONGLY_REPAIRED, WRONG, DISTURBED = "wrongly repaired", "wrong without a word", "sound disturbed"
CRASHED = "crashed"
OUTCOMES = (
    RIGHT, REPAIRED, REFUSED, SAID, MISNAMED, WRONGLY_REPAIRED, WRONG, DISTURBED, CRASHED,
)  # fmt: skip

_PLATES = (
    r"frame.*(plate|force)|(plate|force)s?\b.*\bframe\b|another frame|"
    r"plates? .*(turned|cop(y|ies)\b|\bsum\b|twice|same|virtual|exchange|combined|that of plate)"
)
# What is told first of forces of a wrong size.
_SIZE = r"stated mass and the plates do not agree"
_MOMENT = rf"centre of pressure|moments? (of|in|about|are|with)\b|torque|ORIGIN|corners?|{_PLATES}"
# Words that name a matter, as narrow as leaves the wording free: a sentence on something else has
# none of them.
NAMES = {
    "rate": r"\d ?Hz\b|\b(late|early|delay)\b|\brates?\b|time.?stamps?|\btimes\b|clock|"
    r"\bin ms\b|frame numbers?",
    "labels": r"labels?\b|marker.?set|no marker|markers? .*(missing|twice|double)|unknown marker",
    "scale": r"POINT:UNITS|units? of (the )?(points|lengths?|markers)|unit.points|lengths? in|"
    r"statur|\btall\b|\bheight\b|inch",
    "handedness": r"mirror|handed|wrong side|reversed the . axis",
    "vertical": r"\bvertical (is|axis)|lab's vertical|up.axis|upright",
    "markers": r"(marker|point|traject)\w*\b.*(missing|invalid|held|slip|jump|repeat|frozen|gap)|"
    r"(missing|invalid|held|repeated|frozen|gaps?)\b.*(marker|point|traject)|residual",
    "force": r"\bsigns?\b|vertical force|forces?\b.*(unit|axes|reverse|do not follow)|mirror|"
    rf"never loaded|do not carry|{_PLATES}|{_SIZE}",
    "samples": r"\bsamples?\b",
    "cop": rf"{_MOMENT}|{_SIZE}|points? of (pressure|force)|for the point|no points?|mirror",
    "moment": rf"{_MOMENT}|\bsigns?\b|mirror|none for the moment",
    "mass": r"stated.*\b(kg|mass)|\bmass\b.*(stated|participants)|pound|\blbs?\b",
    "table": r"\bcolumns?\b|force (table|file)|no (ground )?force",
    "person": r"participants|\bsex\b",
    "height": r"\bheight|statur|\btall\b",
}
# What names a kind of circumstance when forces, a trial or a person are refused.
OF_KIND = {
    "length unit": ("scale", "cop"),
    "moment unit": ("moment",),
    "moment reference": ("moment", "cop"),
    "axes": ("vertical", "cop"),
    "mirrored": ("handedness", "cop"),
    "signs": ("force", "moment"),
    "plates": ("force", "cop"),
    "plate type": ("moment",),
    "samples": ("samples",),
    "wrong forces": ("force", "rate", "samples", "mass"),
    "time": ("rate",),
    "labels": ("labels",),
    "missing": ("markers",),
    "force table": ("table",),
    "person": ("person", "mass", "height"),
}
# A foot beside the plates: no word for what is wrong with the numbers.
_CONTACT = re.compile(r"(^|: )contacts\b", re.I)
# A mirror put right, gaps and held markers speak of labels and markers and do nothing to labels.
_CORRECT_LABELS = ("labels", "marker_set")
# What a force table lacks is told as lacking, whatever else was put right.
_IS_LEFT_OUT = re.compile(r"no columns for|took the free torque as zero")
_USUAL = re.compile(r"^(up_axis|marker_set|marker_gaps)|: (up axis|marker gaps)", re.I)


Wrong = dict[tuple[str, str], str]  # by trial and quantity


@dataclass(frozen=True)
class Judgement:
    """wrong : by trial and quantity, what was found. named : the same, the word that names it.

    said : all words that are more than information.
    """

    circumstance: str
    id: int
    kinds: tuple[str, ...]
    things: tuple[str, ...]
    outcome: str
    wrong: dict[str, str]
    named: dict[str, str]
    said: tuple[str, ...]


def judge(circumstance: Circumstance, taken: Taken) -> Judgement:
    """Compare with the truth and read the words."""
    news = [word for word in taken.words if word.level != "info"]
    comparisons = _comparisons(circumstance, taken)
    wrong = {
        (name, quantity): found
        for name, comparison in comparisons.items()
        for quantity, found in comparison.wrong.items()
    }
    trials = {trial.name for trial in circumstance.truth.trials}
    short = {n for n in trials if n not in comparisons or not comparisons[n].is_whole}
    is_whole = not short
    # What must be named: what is wrong in the artifacts, and what these cannot show.
    # A stated mass, and the pace of the frames, show beside forces only.
    has_forces = any(comparison.has_forces for comparison in comparisons.values())
    hidden_matters = [t.name for t in circumstance.things if t.name]
    if not has_forces and circumstance.export.stated_rate != 1.0:
        wrong = {which: found for which, found in wrong.items() if which[1] != "rate"}
    asked = [*wrong, *(("", name) for name in hidden_matters if name != "mass" or has_forces)]
    telling = [w for w in news if not _CONTACT.search(w.text)]
    named = {which: word for which in asked if (word := _naming(*which, telling))}
    all_named = set(asked) == set(named)
    if taken.exit_code == 1:
        outcome = CRASHED
    elif circumstance.is_sound:
        outcome = _of_sound(wrong, is_whole, telling)
    elif wrong:
        # Numbers may be named by what is wrong with them, or by why: a clock that starts elsewhere.
        warned = [w for w in telling if w.level == "warning"]
        unnamed = {trial for trial, quantity in asked if (trial, quantity) not in named}
        all_named = "" not in unnamed and _is_told(circumstance, unnamed, warned)
        is_told = is_whole or _is_told(circumstance, short, telling)
        outcome = _of_wrong(wrong, telling, all_named, is_told)
    elif not is_whole:
        # Who is refused before anything is read is refused for one matter, not for all.
        is_told = _is_told(circumstance, short, telling) and (all_named or not comparisons)
        outcome = REFUSED if is_told else MISNAMED
    elif not all_named:
        outcome = WRONG
    else:
        outcome = REPAIRED if any(not _USUAL.search(w.text) for w in telling) else RIGHT
    return Judgement(
        circumstance=str(circumstance),
        id=circumstance.id,
        kinds=circumstance.kinds,
        things=tuple(thing.id for thing in circumstance.things),
        outcome=outcome,
        wrong={" ".join(which): found for which, found in wrong.items()},
        named={" ".join(which): word for which, word in named.items()},
        said=tuple(dict.fromkeys(f"{w.level}: {w.text}" for w in news)),
    )


def judge_by_conclusion(judgement: Judgement, conclusion: str) -> Judgement:
    """What is wrong without a word when it is read may be found when the forces are explained."""
    unnamed = [which for which in judgement.wrong if which not in judgement.named]
    found = [re.search(NAMES[which.split()[-1]], conclusion, re.I) for which in unnamed]
    if not ("Large error" in conclusion or (found and all(found))):
        return judgement
    named = judgement.named | dict.fromkeys(unnamed, conclusion)
    return replace(judgement, outcome=SAID, named=named, said=(*judgement.said, conclusion))


def _comparisons(circumstance: Circumstance, taken: Taken) -> dict[str, Comparison]:
    truth = circumstance.truth
    found = {}
    for k, trial in enumerate(truth.trials):
        if trial.name in taken.trials:
            lost = hidden(
                trial.markers_m.shape[:2],
                circumstance.export.hidden_share,
                circumstance.gap_seed(k),
            )
            found[trial.name] = compare(
                taken.trials[trial.name], trial, truth.labels, lost, truth.mass_kg * GRAVITY
            )
    return found


def _of_sound(wrong: Wrong, is_whole: bool, telling: list[Word]) -> str:
    is_quiet = all(_USUAL.search(w.text) for w in telling)
    return RIGHT if is_whole and not wrong and is_quiet else DISTURBED


def _of_wrong(wrong: Wrong, telling: list[Word], all_named: bool, is_told: bool) -> str:
    corrected = [w for w in telling if w.level == "corrected"]
    of_labels = [w for w in corrected if w.check in _CORRECT_LABELS]
    left = {
        w for w in wrong if not _naming(*w, [x for x in telling if _IS_LEFT_OUT.search(x.text)])
    }
    warned = [w for w in telling if w.level == "warning"]
    repaired = {w for w in left if _naming(*w, of_labels if w[1] == "labels" else corrected)}
    if any(not _naming(*w, warned) for w in repaired):
        return WRONGLY_REPAIRED
    if not all_named:
        return WRONG
    return SAID if is_told else MISNAMED


def _is_told(circumstance: Circumstance, short: set[str], telling: list[Word]) -> bool:
    """Of each trial of which something is not passed on, a word names it and the matter.

    What is said of the person, or of the table of all persons, is said of each trial.
    """
    matters = {quantity for kind in circumstance.kinds for quantity in OF_KIND[kind]}

    def names(word: Word, trial: str) -> bool:
        whose = word.trial or ("" if _names_file(word, circumstance.participant) else "nobody")
        return whose in ("", trial) and any(_naming("", q, [word]) for q in matters)

    return all(any(names(word, trial) for word in telling) for trial in short)


def _names_file(word: Word, participant: str) -> bool:
    """A row of a participant's table has its file's name; a printed line must say it."""
    return word.level != "printed" or participant in word.text or "participants.tsv" in word.text


def _naming(trial: str, quantity: str, words: list[Word]) -> str:
    """The first word that names a quantity, or nothing.

    Numbers of one trial are not named by what is said of another.
    """
    pattern = re.compile(NAMES[quantity], re.I)
    found = (w.text for w in words if trial in ("", w.trial) or not w.trial)
    found = (text for text in found if pattern.search(text))
    return next((t for t in found if quantity == "vertical" or not _USUAL.search(t)), "")
