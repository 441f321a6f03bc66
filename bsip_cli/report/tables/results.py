"""The comparisons of one table, found by what they are about."""

from __future__ import annotations

from collections.abc import Iterable

from bsip_cli.statistics.cohort_values import Comparison, Topic, joined
from bsip_cli.statistics.methods import OM, RM


class Results:
    """`topics` in the order in which they were computed."""

    def __init__(self, comparisons: Iterable[Comparison]) -> None:
        rows = tuple(comparisons)
        self.topics = tuple(dict.fromkeys(row.topic for row in rows))
        self._by_topic = {
            topic: tuple(row for row in rows if row.topic == topic) for topic in self.topics
        }
        self._rows = {(row.topic, row.test, row.method_a, row.method_b): row for row in rows}

    def find(self, topic: Topic, test: str, first: str = OM, second: str = RM) -> Comparison:
        """The row, or one without any number if there is none."""
        nothing = Comparison(topic, test, "added", first, second, reason="There are no such data.")
        return self._rows.get((topic, test, first, second), nothing)

    def about(self, topic: Topic) -> tuple[Comparison, ...]:
        """Every row on the topic."""
        return self._by_topic.get(topic, ())

    def reasons(self, topic: Topic) -> str:
        """Why tests on the topic are not possible, each reason once."""
        return joined(*(row.reason for row in self.about(topic)))
