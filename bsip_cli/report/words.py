"""Numbers, names and lists as people read them."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bsip_cli.segments import in_words
from bsip_cli.statistics.methods import OM

if TYPE_CHECKING:
    from jinja2 import Environment

TEXTS, _SENTENCES = (
    tomllib.loads(Path(__file__).with_name(name).read_text(encoding="utf-8"))
    for name in ("texts.toml", "sentences.toml")
)
MISSING = "–"
_NEARLY_SURE = 1e-3  # probabilities this near to 0 or 1 are not given in digits
EXTENDED = f"{OM}+causes"  # how reports call OM with every named cause in the model
METHODS: dict[str, str] = TEXTS["methods"]
COMPONENTS: dict[str, str] = TEXTS["components"]
ROLES: dict[str, str] = TEXTS["roles"]
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_STEM = re.compile(
    r"sub-[A-Za-z0-9]+(_ses-(?P<session>[A-Za-z0-9]+))?"
    r"_task-(?P<task>[A-Za-z0-9]+)(_run-(?P<run>[0-9]+))?"
)


def number(value: float | None, digits: int = 1) -> str:
    """A number with fixed decimals and a true minus; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return MISSING
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0 else text.replace("-", "−")


def significant(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits, in powers of ten where needed."""
    if value is None or not math.isfinite(value):
        return MISSING
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = int(exponent)
    if value != 0 and not -4 <= power < 7:
        return f"{mantissa} × 10{str(power).translate(_SUPERSCRIPTS)}".replace("-", "−")
    rounded, decimals = float(f"{mantissa}e{exponent}"), max(0, digits - 1 - power)
    return f"{rounded:,.{decimals}f}".replace(",", "\N{THIN SPACE}").replace("-", "−")


def with_spread(value: float, sd: float, digits: int = 1) -> str:
    """``value ± sd``; the value alone where no spread is known."""
    spread = number(sd, digits)
    return number(value, digits) if spread == MISSING else f"{number(value, digits)} ± {spread}"


def percent(share: float | None, digits: int = 0) -> str:
    """A share of 0..1 in percent."""
    return MISSING if share is None else number(100.0 * share, digits)


def signed(value: float, digits: int = 0) -> str:
    """A number that always shows its sign."""
    text = number(value, digits)
    return f"+{text}" if text != MISSING and value > 0 and float(f"{value:.{digits}f}") else text


def listing(items: Sequence[str], empty: str = "none") -> str:
    """``a, b and c``."""
    if not items:
        return empty
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"


def probability_words(probability: float) -> str:
    """``99.5 %`` or ``over 99.9 %``; empty where there is none."""
    if math.isnan(probability):
        return ""
    if probability > 1 - _NEARLY_SURE:
        return "over 99.9 %"
    return f"{number(100 * probability, 1)} %" if probability >= _NEARLY_SURE else "under 0.1 %"


def findings(numbers: Sequence[int]) -> str:
    """``finding 2``, ``findings 1 and 3`` or ``findings 5 to 8``; empty without any."""
    if not numbers:
        return ""
    return f"finding{'s' if len(numbers) > 1 else ''} {in_a_row(numbers)}"


def in_a_row(numbers: Sequence[int]) -> str:
    """``2``, ``1 and 3`` or ``5 to 8``, of numbers that rise."""
    if len(numbers) > 2 and numbers[-1] - numbers[0] == len(numbers) - 1:
        return f"{numbers[0]} to {numbers[-1]}"
    return listing([str(k) for k in numbers])


def count(n: int, singular: str, plural: str = "") -> str:
    """``1 trial``, ``2 trials``."""
    return f"{n} {singular if n == 1 else plural or singular + 's'}"


def trial_label(stem: str, form: str = "{} ({})") -> str:
    """``sequence (session 2, run 1)`` for sub-01_ses-2_task-sequence_run-1."""
    match = _STEM.fullmatch(stem)
    if match is None:
        return stem
    which = ", ".join(f"{word} {match[word]}" for word in ("session", "run") if match[word])
    return form.format(match["task"], which) if which else match["task"]


def task_of(stem: str) -> str:
    """``sequence`` for sub-01_task-sequence_run-1."""
    match = _STEM.fullmatch(stem)
    return match["task"] if match else stem


def abbreviations(tasks: Iterable[str]) -> str:
    """``DJ: drop jump; STS: sit to stand``, of those in names of tasks; empty without any."""
    found = {short for task in tasks for short in re.findall(r"[A-Z]{2,3}(?![A-Z])", task)}
    return "; ".join(f"{x}: {words}" for x, words in TEXTS["abbreviations"].items() if x in found)


def labelled(text: str) -> str:
    """A text with the stems of recordings in it as their labels."""
    return re.sub(_STEM, lambda found: trial_label(found[0]), text)


def capital(text: str) -> str:
    """A text as the beginning of a sentence."""
    return f"{text[:1].upper()}{text[1:]}"


def true_minus(text: str) -> str:
    """A sentence of the diagnosis with the sign that numbers have here."""
    return re.sub(r"(?<![\w.)])-(?=\d)", "−", text)


segment_label = in_words  # ``left upper arm`` for upper_arm_l


def component_label(component: str) -> str:
    """A component of the wrench or of the centre of pressure in words, where it has some."""
    return COMPONENTS.get(component, component)


def method_rank(method: str) -> tuple[int, str]:
    """By which methods are sorted: measured first, those without a label last."""
    return (list(METHODS).index(method) if method in METHODS else len(METHODS)), method


def say(name: str, **known: Any) -> str:
    """The sentence of ``sentences.toml`` by that name, of what is known."""
    return _sentences().get_template(name).render(known)


@cache
def _sentences() -> Environment:
    """With the functions above as filters."""
    from jinja2 import DictLoader, Environment, StrictUndefined  # heavy

    made = Environment(loader=DictLoader(_SENTENCES), undefined=StrictUndefined)
    numbers = number, signed, percent, probability_words
    for one in (*numbers, listing, capital, component_label):
        made.filters[one.__name__] = one
    made.filters["segment_label"] = segment_label
    return made
