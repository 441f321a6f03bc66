"""What the diagnosis names in a recording: what can be corrected in it, and what is said of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.diagnosis.cause import Cause
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import Effect, digits_of, readable_unit, with_unit
from bsip_cli.effects.markers import MarkerSwap
from bsip_cli.effects.nameless import UNEXPLAINED
from bsip_cli.effects.plates import ALL, FrameRate, PlateZero, Turned
from bsip_cli.effects.scene import Scene
from bsip_cli.running.unit import Unit
from bsip_cli.stages.trial_scene import causes_of

NO_FAULT_OF_IT = "no fault of the plates, the clocks, the axes or the labels"
_NO_INTERVAL = np.full((1, 2), np.nan)


def called(effect: str, target: str) -> str:
    """A cause by the names of its effect and place, in the same ASCII as its numbers."""
    if effect == UNEXPLAINED:
        return "what acts like it and has no name"
    return f"{effect} {target}".strip()


def is_corrected(effect: Effect) -> bool:
    """Of the plates, the clocks, or the axes of laboratory and cameras."""
    return effect.of_the_forces or isinstance(effect, Turned)


def why_left(effect: str, unknown: str, group: str = "") -> str:
    """Why what has no cause in the facts is not corrected. group : in which it is one of several;
    unknown : what is said of a fault that could be corrected."""
    if group:
        return "one of several causes that look alike"
    known = EFFECTS.get(effect)
    if isinstance(known, FrameRate):
        return "write the rate of the recording into the file, and run again"
    can_be = known is not None and (is_corrected(known) or isinstance(known, MarkerSwap))
    return unknown if can_be else NO_FAULT_OF_IT


def causes_here(unit: Unit, plates: Sequence[str], zeroed: Sequence[str] = ()) -> list[Cause]:
    """What the diagnosis names in a recording, on the plates that it has.

    Where it did not look at it: what it names of the instruments in all others of the session, at
    least two, and what the laboratory of the person is known to have, but for offsets of plates
    whose zero this recording shows (``zeroed``).
    """
    analysed, causes = unit.facts("overall-diagnosis")["trials"], causes_of(unit)
    here = [one for one in causes if unit.name in one.trials]
    if unit.name in analysed:
        return here
    session = {t.stem for t in unit.person.trials if t.session == unit.own_trial.session}
    others = session & set(analysed)
    shared = [
        one
        for one in causes
        if one.effect.scope == "laboratory"
        and is_corrected(one.effect)
        and others <= set(one.trials)
    ]
    shared = shared if len(others) > 1 else []
    known = {(one.effect.name, one.target) for one in shared}
    named = of_the_laboratory(unit, "named")
    named = named[named["scope"] == "laboratory"]
    for (effect, target), sizes in named.groupby(["effect", "target"], sort=False):
        if (effect, target) not in known:
            values = sizes["estimate"].to_numpy()
            cause = Cause(EFFECTS[str(effect)], str(target), (unit.name,), values, values[None])
            shared.append(cause)
    for one in shared:
        gone = zeroed if isinstance(one.effect, PlateZero) else ()
        if one.target.split(" ")[0] in {"", ALL, *plates} - {*gone}:
            here.append(one)
    return here


def of_the_laboratory(unit: Unit, *verdicts: str) -> pd.DataFrame:
    """Rows about the laboratory of a person who was in one only, with others, or about this
    session in it."""
    of_all = unit.facts("laboratory")["persons"].items() if unit.has("laboratory") else ()
    mine = [number for number, persons in of_all if {unit.person.id} < {*persons}]
    if len(mine) != 1:  # alone the person's own diagnosis, which asks more of it, is the answer
        return empty_table("laboratory")
    rows = unit.read("laboratory", laboratory=mine, verdict=verdicts)
    session = "_ses-".join(filter(None, (unit.person.id, unit.own_trial.session)))
    return rows[(rows["scope"] == "laboratory") | (rows["who"] == session)]


def rows_of(cause: Cause, diagnosis: pd.DataFrame) -> pd.DataFrame:
    """What the diagnosis says of a cause, a row for each number; what is known from the laboratory
    may be rejected as this person's own."""
    key = {"effect": cause.effect.name, "target": cause.target, "trials": ", ".join(cause.trials)}
    is_it = (diagnosis[[*key]] == pd.Series(key)).all(axis=1)
    return diagnosis[is_it & (diagnosis["verdict"] != "rejected")]


def alike(cause: Cause, diagnosis: pd.DataFrame) -> list[tuple[str, str]]:
    """Effects and targets that look like a cause in these recordings."""
    groups = set(rows_of(cause, diagnosis)["class_id"]) - {""}
    is_it = (diagnosis["effect"] == cause.effect.name) & (diagnosis["target"] == cause.target)
    others = diagnosis[diagnosis["class_id"].isin(groups) & ~is_it]
    return list(dict.fromkeys(zip(others["effect"], others["target"], strict=True)))


def said_of(trial: str, diagnosis: pd.DataFrame, effects: Sequence[str]) -> pd.DataFrame:
    """Rows of these effects that the diagnosis names, alone or in a group, in a trial."""
    here = np.array([trial in names.split(", ") for names in diagnosis["trials"]], dtype=bool)
    is_named = diagnosis["verdict"] != "rejected"
    return diagnosis[here & diagnosis["effect"].isin(effects) & is_named]


def words_of(cause: Cause, others: str, scene: Scene, diagnosis: pd.DataFrame) -> str:
    """``sync_offset: delay 11.9 ms (95 % interval 11.0 to 12.7) taken off``: in ASCII, which all
    readers of C3D know."""
    values, rows = [], rows_of(cause, diagnosis)
    for name, unit, value in cause.effect.reported(scene, cause.target, cause.values):
        factor, readable = readable_unit(name, unit)
        mine = rows[rows["parameter"] == name]  # two: the laboratory's, and the person's own
        nearest = mine.iloc[(mine["estimate"] - value).abs().argsort()[:1]]
        known = nearest[["ci_low", "ci_high"]].to_numpy() if len(mine) else _NO_INTERVAL
        low, high = factor * known[0]
        size, interval = f"{factor * value:.3g}", ""
        if high > low:
            size, *ends = (f"{x:.{digits_of(high - low)}f}" for x in (factor * value, low, high))
            interval = f" (95 % interval {' to '.join(ends)})"
        values.append(f"{name} {with_unit(size, readable)}{interval}")
    alike = f" (as likely {others}, with the same sum of forces)" if others else ""
    words = called(cause.effect.name, cause.target)
    return f"{words}: {', '.join(values)} taken off{alike}".replace("°", " deg")
