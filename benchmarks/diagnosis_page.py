"""The tables about the diagnosis of real recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.diagnosis_answers import COMPONENTS, Answer, Balance, Found
from benchmarks.injected_causes import Cause

BELOW = "missed, below what is seen"
RIGHT, IN_CLASS, ALIKE = "right name", "right class", "named as what looks alike"
ELSEWHERE = "right effect, other place"
PUT_RIGHT, MISSED, WRONG, REFUSED = "corrected by ik", "missed", "another name", "not possible"
INJECTED = (
    "injected",
    "seen from",
    "answer",
    "as",
    "size found (95 % interval)",
    "beside it",
    "gone",
    "mean held-out gain by `extend` [%]",
)
Table = tuple[Sequence[str], list[list[str]]]  # header and rows
_SIGN = 0.5  # of the injected size: a smaller change of what stood there already is none


def tables(
    results: Mapping[str, Mapping[str, Answer]], causes: Sequence[Cause], as_it_is: str
) -> dict[str, Table]:
    """Everything, from the stored answers: header and rows by name."""
    plain = {name: answers[as_it_is] for name, answers in results.items() if as_it_is in answers}
    injected = [
        [name, *row]
        for name, answers in results.items()
        if name in plain
        for row in injected_rows(plain[name], answers, causes)
    ]
    return {
        "real_diagnosis": _as_they_are(plain),
        "real_balance": _balances(plain),
        "real_injected": (("recording", *INJECTED), injected),
    }


def _as_they_are(plain: Mapping[str, Answer]) -> Table:
    rows = []
    for name, answer in plain.items():
        if answer.refused:
            rows.append([name, f"not diagnosed: {answer.refused}", "", "", "", "", ""])
        elif not answer.found:
            rows.append([name, "nothing wrong above the noise", "", "", "", "", ""])
        for group in answer.classes():
            for k, one in enumerate(group):
                rows.append(
                    [
                        name,
                        ("or " if k else "") + _called(one),
                        _size(one),
                        ", ".join(one.trials),
                        _probability(one.p_value),
                        "" if np.isnan(one.gain_percent) else f"{one.gain_percent:.1f}",
                        "" if k else _all_gains(answer),
                    ]
                )
    header = [
        "recording",
        "cause",
        "size in SI units (95 % interval)",
        "trials",
        "probability",
        "held-out gain of the diagnosis [%]",
        "held-out gain by `extend`, all causes [%]",
    ]
    return header, rows


def _called(one: Found) -> str:
    return f"`{one.effect}`" + (f" {one.target}" if one.target else "")


def _size(one: Found) -> str:
    parts = []
    for name, (value, low, high) in one.values.items():
        interval = "" if np.isnan(low) or low == high else f" ({low:.3g} to {high:.3g})"
        parts.append(f"{name} {value:.3g}{interval}")
    return "; ".join(parts)


def _probability(p: float) -> str:
    return "" if np.isnan(p) else "> 0.999" if p < 1e-3 else f"{1 - p:.3f}"


def _all_gains(answer: Answer) -> str:
    return ", ".join(f"{c} {answer.gains[c][0]:+.0f}" for c in COMPONENTS if c in answer.gains)


# --- balance of forces ------------------------------------------------------------------------


def _balances(plain: Mapping[str, Answer]) -> Table:
    rows = [
        [name, one.trial, f"{one.seconds:.1f}", *_forces(one), f"{one.plates_kg:.2f}"]
        for name, answer in plain.items()
        for one in answer.balances
    ]
    header = ["recording", "trial", "time [s]", "fx [N]", "fy [N]", "fz [N]", "fz / g [kg]"]
    return header, rows


def _forces(one: Balance) -> list[str]:
    pairs = zip(one.force_N, one.simulated_N, strict=True)
    return [f"{measured:.1f} / {simulated:.1f}" for measured, simulated in pairs]


# --- injected causes --------------------------------------------------------------------------


def injected_rows(
    before: Answer, answers: Mapping[str, Answer], causes: Sequence[Cause]
) -> list[list[str]]:
    """One row per cause injected into a recording."""
    return [
        [cause.words, *_row(cause, before, answers[cause.words])]
        for cause in causes
        if cause.words in answers
    ]


def _row(cause: Cause, before: Answer, after: Answer) -> list[str]:
    if after.refused:
        return ["", REFUSED, after.refused, "", "", "", ""]
    verdict, one = verdict_of(cause, before, after)
    seen_from = seen_from_of(cause, before, after.place)
    if verdict == MISSED and seen_from > abs(cause.size * cause.parameter.factor):
        verdict = BELOW
    stood = {found.key for found in before.found}
    now = {found.key for found in after.found}
    beside = [
        _called(x) + ("" if x.key in stood else " (new)") for x in after.found if x is not one
    ]
    gone = [_called(x) for x in before.found if x.key not in now]
    gain = after.mean_gain_percent()
    return [
        "" if np.isnan(seen_from) else f"{seen_from:.3g} {cause.parameter.unit}",
        verdict,
        _called(one) if one else "",
        _found_size(cause, before, one) if one and one.effect == cause.effect else "",
        ", ".join(beside),
        ", ".join(gone),
        "" if np.isnan(gain) else f"{gain:+.0f}",
    ]


def seen_from_of(cause: Cause, before: Answer, place: str) -> float:
    """The least size of the cause that the recordings as they are would show; NaN if not stated."""
    limits = [before.limit(cause.effect, place, name) for name in cause.parameter.names]
    return cause.parameter.factor * min(limits)


def verdict_of(cause: Cause, before: Answer, after: Answer) -> tuple[str, Found | None]:
    """What became of an injected cause, and the row that speaks of it.

    What hardly differs from what stood there before does not count.
    """
    if cause.effect == "marker_swap" and len(after.swaps) > len(before.swaps):
        return PUT_RIGHT, None
    stood = {found.key for found in before.found}
    for group in after.classes():
        for one in group:
            if one.key == (cause.effect, after.place) and _moved(cause, before, one):
                return (IN_CLASS if len(group) > 1 else RIGHT), one
    new = [one for one in after.found if one.key not in stood]
    for effects, verdict in (((cause.effect,), ELSEWHERE), (cause.alike, ALIKE)):
        for one in new:
            if one.effect in effects:
                return verdict, one
    return (WRONG, new[0]) if new else (MISSED, None)


def _moved(cause: Cause, before: Answer, one: Found) -> bool:
    stood = [found for found in before.found if found.key == one.key]
    if not stood:
        return True
    difference = cause.parameter.of(one.estimates()) - cause.parameter.of(stood[0].estimates())
    return abs(difference) > _SIGN * abs(cause.size * cause.parameter.factor)


def _found_size(cause: Cause, before: Answer, one: Found) -> str:
    """The size found, less what stood there before."""
    parameter = cause.parameter
    stood = [found for found in before.found if found.key == one.key]
    base = parameter.of(stood[0].estimates()) if stood else 0.0
    value = parameter.of(one.estimates())
    text = f"{value - base:.3g} {parameter.unit}"
    if len(parameter.names) == 1:
        _, low, high = one.values[parameter.names[0]]
        low, high = parameter.factor * low - base, parameter.factor * high - base
        text += f" ({low:.3g} to {high:.3g})"
    return text + (f", beside {base:.3g} before" if stood else "")
