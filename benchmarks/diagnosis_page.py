"""The page about the diagnosis of real recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.diagnosis_answers import COMPONENTS, Answer, Balance, Found
from benchmarks.injected_causes import Cause
from benchmarks.measure import markdown

BELOW = "missed, below what is seen"
RIGHT, IN_CLASS, ALIKE = "right name", "right class", "named as what looks alike"
ELSEWHERE = "right effect, other place"
PUT_RIGHT, MISSED, WRONG, REFUSED = "put right by ik", "missed", "another name", "not possible"
_SIGN = 0.5  # of the injected size: a smaller change of what stood there already is none


def page(
    results: Mapping[str, Mapping[str, Answer]], causes: Sequence[Cause], as_it_is: str
) -> str:
    """Everything, from the stored answers: by recording, and by cause in words."""
    if not results:
        return "No recordings were found.\n"
    plain = {name: answers[as_it_is] for name, answers in results.items() if as_it_is in answers}
    parts = [
        _HEAD,
        "Cases that were not run are not listed.\n",
        "## As they are\n",
        _as_they_are(plain),
        "\n## Balance of forces\n",
        _BALANCE,
        _balances(plain),
        "\n## With one injected cause\n",
        _INJECTED,
    ]
    for name, answers in results.items():
        if len(answers) > 1 and name in plain:
            parts += [f"\n### {name}\n", injected_table(plain[name], answers, causes)]
    parts.append(_ODD)
    return "\n".join(parts) + "\n"


def _as_they_are(plain: Mapping[str, Answer]) -> str:
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
    return markdown(header, rows)


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


def _balances(plain: Mapping[str, Answer]) -> str:
    rows = [
        [name, one.trial, f"{one.seconds:.1f}", *_forces(one), f"{one.plates_kg:.2f}"]
        for name, answer in plain.items()
        for one in answer.balances
    ]
    header = ["recording", "trial", "time [s]", "fx [N]", "fy [N]", "fz [N]", "fz / g [kg]"]
    return markdown(header, rows)


def _forces(one: Balance) -> list[str]:
    pairs = zip(one.force_N, one.simulated_N, strict=True)
    return [f"{measured:.1f} / {simulated:.1f}" for measured, simulated in pairs]


# --- injected causes --------------------------------------------------------------------------


def injected_table(before: Answer, answers: Mapping[str, Answer], causes: Sequence[Cause]) -> str:
    """One row per cause injected into a recording."""
    rows = [
        [cause.words, *_row(cause, before, answers[cause.words])]
        for cause in causes
        if cause.words in answers
    ]
    header = ["injected", "seen from", "answer", "as", "size found (95 % interval)"]
    header += ["beside it", "gone"]
    return markdown([*header, "mean held-out gain by `extend` [%]"], rows)


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


_HEAD = """# Diagnosis of real recordings

Made by `python -m benchmarks.diagnosis_of_recordings ../shared/data --write
docs/diagnosis_of_recordings.md`. The recordings belong to others and are not part of the project.
"""

_ODD = """
## What is odd in them

- `biobuddy_ech`: 4.8 and 5.3 kg between the static and the one-leg trials. Both hands stand still
  (1 to 2 mm) 0.92 m above the floor and 0.84 m apart while the trunk sways by 5 to 16 mm; the mean
  force that the plates miss has hardly a moment along itself, as a single push, and its line runs
  between the hands. In the static trial sideways forces and weight are right. So it is a rail, and
  neither a plate's gain nor a tilted lab.
- `opencap_subject4` and `btk_pig`: the plates read 2.6 to 4.1 % less than the stated mass in quiet
  standing. That is a class: gain, offset, or the stated mass.
- `opencap_subject4`: the vertical forces are late by 5 to 6 ms (5.5 ms in sitstand, 6.1 ms in
  squats, 4.7 to 8.6 ms in quarters of both), by regression of the measured on the simulated force
  and its derivative.
- `figaroh_human`: the forces are late by 7 to 10 ms in every component (9 ms in the vertical one,
  standard error 1 ms; 7, 9, 8, 8 and 10 ms in fifths of the trial), 0.27 of a frame, by regression
  of the measured on the simulated forces and the measured ones' derivative. The diagnosis
  tells clocks that do not agree, but not evenly. A mean horizontal force of 5.2 N beside a weight
  of 925 N is a plate or a lab that tilts by 0.3 degrees. From 45.6 s on RWRA and RWRB bear each
  other's labels: `ik` puts them right. Markers smoothed beforehand smear that exchange, and it is
  told as two that slip.
- `figaroh_human`: the moment about the vertical is off by 11.9 N m throughout, the largest cause
  there; what in the lab makes it is not known.
- `return11_static`: the plates read 3.6 kg more than stated, and its file has markers on a bar (BL,
  BR) whose mass nobody states.
- `hamner_other`: the forces are late by 12 ms in both runs, or follow the motion as tissue that
  swings does: with the delay in the model the vertical force errs by half as much on data held out.
- Recordings that are refused have labels that no shipped marker set knows.
"""

_BALANCE = """Mean force over the frames in which every contact is on a plate: measured / simulated
by RM. Over many seconds the mean horizontal force on a body that goes nowhere is zero, and the
mean vertical one its weight, whatever its inertial parameters are.
"""

_INJECTED = """`bsip inject` hides one cause in a copy: causes of the lab in all moving trials,
those of a plate's vertical channel, of a marker and of a load in the first one only. "Seen from":
the size that `bsip diagnose` says it would find in 95 of 100 recordings like these as they are; it
says none for markers. Where the same cause stood there before, it is that of another one like it,
in other places and trials. "Right class": it is among causes that the recordings cannot tell apart.
Sizes are less what the same cause had before; signs follow the plate's own axes, which may point
down. "Beside it": other causes that are named, "(new)" if they were not before; "gone": what was
named before and is not now.
"""
