"""The tests of the six tables, from the participants' values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from bsip_cli.statistics.cohort_comparison import Comparison
from bsip_cli.statistics.cohort_correlations import PAIR
from bsip_cli.statistics.cohort_groups import methods_beside_each_other
from bsip_cli.statistics.cohort_pairs import (
    Origin,
    description,
    equivalence,
    pair_description,
    pairs_of,
    smaller_error,
    t_and_rank_tests,
)
from bsip_cli.statistics.cohort_values import DIFFERENCE, Topic, Value, per_participant, topics
from bsip_cli.statistics.methods import MEASURED, OM, RM

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
) -> Iterator[Comparison]:
    if topic.variable.endswith(DATA_SHARE):
        yield description(topic, OM, per_participant(values, (OM,))[:, 0])
        return
    for pair in pairs_of(topic, values, "published"):
        yield from t_and_rank_tests(pair, criteria.alpha)
        yield equivalence(pair, criteria.alpha, criteria.equivalence_percent)


def _errors(
    topic: Topic, values: Sequence[Value], criteria: Criteria, origin: Origin
) -> Iterator[Comparison]:
    for pair in pairs_of(topic, values, origin):
        yield from t_and_rank_tests(pair, criteria.alpha)
        yield smaller_error(pair)


def _cop_rmse(topic: Topic, values: Sequence[Value], criteria: Criteria) -> Iterator[Comparison]:
    yield from _errors(topic, values, criteria, "published")


def _posturography(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> Iterator[Comparison]:
    """The published groups; RM+mass, whose centre of pressure is RM's, is no fourth."""
    methods = (MEASURED, OM, RM)
    table = per_participant(values, methods)
    yield from methods_beside_each_other(topic, table, methods, criteria.alpha)
    for pair in pairs_of(topic, values, "added"):
        if pair.rival != RM:
            yield from t_and_rank_tests(pair, criteria.alpha)


def _cross_validation(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> Iterator[Comparison]:
    yield from _errors(topic, values, criteria, "added")


def _six_components(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> Iterator[Comparison]:
    if topic.variable.endswith("_rmse"):
        yield from _cross_validation(topic, values, criteria)
    else:
        yield from map(pair_description, pairs_of(topic, values, "published"))


def _table_or_identified(
    topic: Topic, values: Sequence[Value], criteria: Criteria
) -> Iterator[Comparison]:
    if all(value.method == DIFFERENCE for value in values):
        yield description(topic, DIFFERENCE, per_participant(values, (DIFFERENCE,))[:, 0])
        return
    for pair in pairs_of(topic, values, "added"):
        yield from t_and_rank_tests(pair, criteria.alpha)


_TABLES: dict[str, Callable[[Topic, Sequence[Value], Criteria], Iterator[Comparison]]] = {
    "table1": _segment_mass,
    "table2": _cop_rmse,
    "table3": _posturography,
    "table4": _cross_validation,
    "table5": _six_components,
    "table6": _table_or_identified,
}
