"""One line of the cohort's results: a test, or a description, with all its numbers."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from math import isnan, nan
from typing import Literal

from bsip_cli.statistics.cohort_values import Topic
from bsip_cli.statistics.samples import adjusted_p_values


@dataclass(frozen=True)
class Comparison:
    """A test of method_a against method_b over n participants; differences are a - b.

    What cannot be computed is nan, and `reason` says why. `p_holm` corrects for all rows of the
    same test with the same method_b in the same table. `count_a` and `count_b` are the participants
    in whom the one or the other method is better, for tests that count.
    """

    topic: Topic
    test: str
    origin: Literal["published", "added"]
    method_a: str
    method_b: str = ""
    n: int = 0
    mean_a: float = nan
    sd_a: float = nan
    mean_b: float = nan
    sd_b: float = nan
    difference: float = nan
    ci_low: float = nan
    ci_high: float = nan
    bound: float = nan
    statistic: float = nan
    df1: float = nan
    df2: float = nan
    p_value: float = nan
    p_holm: float = nan
    effect_size: float = nan
    effect_size_name: str = ""
    epsilon: float = nan
    lilliefors_p: float = nan
    count_a: float = nan
    count_b: float = nan
    reason: str = ""

    def as_row(self) -> dict[str, str | float]:
        """The fields by name, the topic's among them."""
        everything = asdict(self)
        return everything.pop("topic") | everything

    @classmethod
    def from_row(cls, row: Mapping) -> Comparison:
        """The comparison that `as_row` wrote down."""
        of_topic = {field.name for field in fields(Topic)}
        topic = Topic(**{name: row[name] for name in of_topic})
        return cls(topic, **{name: row[name] for name in row if name not in of_topic})


def joined(*reasons: str) -> str:
    """Every reason once, in order."""
    return " ".join(dict.fromkeys(filter(None, reasons)))


HOLM_FAMILIES = ("paired_t", "wilcoxon")


def with_holm(comparisons: Sequence[Comparison]) -> tuple[Comparison, ...]:
    """The same comparisons, p_holm filled in where a table asks one question many times."""
    families: dict[tuple[str, str, str], list[int]] = defaultdict(list)
    for place, row in enumerate(comparisons):
        if row.test in HOLM_FAMILIES and not isnan(row.p_value):
            families[row.topic.table, row.test, row.method_b].append(place)
    corrected = list(comparisons)
    for places in families.values():
        adjusted = adjusted_p_values([comparisons[place].p_value for place in places], "holm")
        for place, p in zip(places, adjusted, strict=True):
            corrected[place] = replace(comparisons[place], p_holm=p)
    return tuple(corrected)
