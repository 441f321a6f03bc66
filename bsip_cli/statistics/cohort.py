"""The tests of the six tables, from the participants' values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from bsip_cli.statistics.cohort_comparison import Comparison
from bsip_cli.statistics.cohort_correlations import PAIR
from bsip_cli.statistics.cohort_groups import methods_beside_each_other
from bsip_cli.statistics.cohort_pairs import (
    description,
    equivalence,
    pair_description,
    smaller_error,
    t_and_rank_tests,
)
from bsip_cli.statistics.cohort_values import (
    DIFFERENCE,
    MEASURED,
    OM,
    RM,
    Topic,
    Value,
    per_participant,
    topics,
)

DATA_SHARE = "_data_share"
"""Ending of the variable that says how far the data decided a mass."""


@dataclass(frozen=True)
class Criteria:
    """alpha : level of every test. equivalence_percent : of RM's mean, what counts as equal."""

    alpha: float
    equivalence_percent: float


def tests_of(values: Iterable[Value], criteria: Criteria) -> Iterator[Comparison]:
    """Every test of the topics that these values belong to; all of a topic's must be there."""
    for topic, group in topics(v for v in values if v.method != PAIR).items():
        yield from _TABLES[topic.table](topic, group, criteria)


def _segment_mass(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> tuple[Comparison, ...]:
    if topic.variable.endswith(DATA_SHARE):
        return (description(topic, OM, per_participant(values, (OM,))[:, 0]),)
    om, rm = per_participant(values, (OM, RM)).T
    return (
        *t_and_rank_tests(topic, om, rm, criteria.alpha, "published"),
        equivalence(topic, om, rm, criteria.alpha, criteria.equivalence_percent),
    )


def _cop_rmse(topic: Topic, values: Sequence[Value], criteria: Criteria) -> tuple[Comparison, ...]:
    om, rm = per_participant(values, (OM, RM)).T
    return (
        *t_and_rank_tests(topic, om, rm, criteria.alpha, "published"),
        smaller_error(topic, om, rm),
    )


def _posturography(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> tuple[Comparison, ...]:
    methods = (MEASURED, OM, RM)
    table = per_participant(values, methods)
    return methods_beside_each_other(topic, table, methods, criteria.alpha)


def _cross_validation(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> tuple[Comparison, ...]:
    om, rm = per_participant(values, (OM, RM)).T
    return (
        *t_and_rank_tests(topic, om, rm, criteria.alpha, "added"),
        smaller_error(topic, om, rm),
    )


def _six_components(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> tuple[Comparison, ...]:
    om, rm = per_participant(values, (OM, RM)).T
    if topic.variable.endswith("_rmse"):
        return _cross_validation(topic, values, criteria)
    return (pair_description(topic, om, rm),)


def _table_or_identified(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> tuple[Comparison, ...]:
    if all(value.method == DIFFERENCE for value in values):
        return (description(topic, DIFFERENCE, per_participant(values, (DIFFERENCE,))[:, 0]),)
    om, rm = per_participant(values, (OM, RM)).T
    return t_and_rank_tests(topic, om, rm, criteria.alpha, "added")


_TABLES: dict[str, Callable[[Topic, Sequence[Value], Criteria], tuple[Comparison, ...]]] = {
    "table1": _segment_mass,
    "table2": _cop_rmse,
    "table3": _posturography,
    "table4": _cross_validation,
    "table5": _six_components,
    "table6": _table_or_identified,
}
