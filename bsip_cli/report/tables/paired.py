"""The tables of paired tests (1, 2, 4 and 6): OM against RM and RM+mass."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from bsip_cli.report.tables import model
from bsip_cli.report.words import segment_label
from bsip_cli.statistics.cohort import DATA_SHARE, DIFFERENCE, Comparison, Criteria, Topic
from bsip_cli.statistics.methods import OM, RM, RM_MASS
from bsip_cli.statistics.published import load_paper

SHORT = {OM: "om", RM: "rm", RM_MASS: "rm_mass"}  # methods in the names of CSV columns
_PREFIX = {RM: "", RM_MASS: "rm_mass_"}
"""Of the CSV columns with tests of OM against another method."""

_P = {RM: "p", RM_MASS: "p OM, RM+mass"}  # headings of the columns that carry the stars
REASON = model.Column(("reason",))
_N = model.column("n", "paired_t.n", "n", model.count)
_LIMBS = (("upper_arm", "forearm", "hand"), ("thigh", "shank", "foot"))
_SEGMENTS = ["lower_torso", "upper_torso", "head"]
_SEGMENTS += [f"{part}_{side}" for limb in _LIMBS for side in "lr" for part in limb]
"""As in table 1 of Hansen 2017; other segments follow."""


def means(test: str = "paired_t") -> tuple[model.Column, ...]:
    """Of the methods; ``test``: the one of OM and RM."""
    numbers = ((OM, test, "a", RM), (RM, test, "b", RM), (RM_MASS, "paired_t", "b", RM_MASS))
    found = []
    for method, name, side, other in numbers:
        fields, of = (
            f"{SHORT[method]}_mean {SHORT[method]}_sd",
            f"{name}.mean_{side} {name}.sd_{side}",
        )
        how = f"{method} M(SD)", model.mean_sd(2), (OM, other)
        found.append(model.column(fields, of, *how, in_row_unit=True))
    return tuple(found)


def _tests(criteria: Criteria) -> tuple[model.Column, ...]:
    """Of OM against RM."""
    confidence = f"{100.0 * (1.0 - criteria.alpha):g}% CI"
    return model.columns("paired", ci=confidence, p=_P[RM])


def against_rm_mass(criteria: Criteria) -> tuple[model.Column, ...]:
    """The same tests with RM+mass, of which only p is printed."""
    found = []
    for one in _tests(criteria):
        fields = tuple(_PREFIX[RM_MASS] + name for name in one.fields)
        heading = _P[RM_MASS] if one.heading == _P[RM] else ""
        of = tuple((test, name, OM, RM_MASS) for test, name, *_ in one.of)
        found.append(replace(one, fields=fields, heading=heading, of=of))
    return tuple(found)


def smaller_error(n: str = "n", of_n: str = "paired_t.n") -> Iterator[model.Column]:
    """How often OM, and how often the other method, errs less, with share and p of the sign test."""
    for other, before in _PREFIX.items():
        counts = f"{before}om_smaller {SHORT[other]}_smaller {before}{n}"
        heading, pair = f"smaller error OM : {other}", (OM, other)
        yield model.column(
            counts, f"sign.count_a sign.count_b {of_n}", heading, model.counts_of, pair
        )
        yield model.column(f"{before}om_smaller_share", "sign.effect_size", pair=pair)
        yield model.column(f"{before}sign_test_p", "sign.p_value", pair=pair)


def stars(results: model.Results, topic: Topic, criteria: Criteria) -> dict[str, str]:
    """Of both p."""
    return {
        heading: model.star(results.find(topic, "paired_t", OM, other), criteria.alpha)
        for other, heading in _P.items()
    }


def task_label(topic: Topic) -> str:
    """The movement; the one that identified OM is named as such."""
    identified = " (identified OM; in the paper: random, 120 s)"
    return topic.task + identified * (topic.role == "sequence")


# --- the tables ---------------------------------------------------------------------------------

_AXES = {"cop_ap": "AP", "cop_ml": "ML"}
_QUANTITIES: dict[str, str] = model.TEXTS["quantities"]
_RESIDUALS = {"force_residual": "force", "moment_residual": "moment"}
_OVER_SEGMENTS = {"mean": "mean", "median": "median", "max": "largest"}
_COM = "com_"


def _paired(
    name: str,
    tests: Sequence[Comparison],
    columns: tuple[Sequence[model.Column], Sequence[model.Column]],
    named: Mapping[Topic, str],
    row: Callable[[Topic], tuple[dict[str, model.Cell], str]],
    given: tuple[model.Results, Criteria],
    **more: str,
) -> model.Table:
    """``tests``: whose number is printed. ``columns``: those before the tests of OM, and after them.
    ``named``: the label of each topic, a row each. ``row``: its own values, and its group."""
    results, criteria = given
    before, after = columns
    every = (*before, *_tests(criteria), *against_rm_mass(criteria), *after, REASON)
    rows = []
    for topic in named:
        own, group = row(topic)
        found = results.values(topic, every) | {"reason": results.reasons(topic)} | own
        rows.append(model.Row(found, topic.unit, group, stars(results, topic, criteria)))
    title, legend = model.texts_of(name, results, tests, criteria, **more)
    notes = (*legend, *model.not_possible(results, named))
    return model.Table(name, title, every, tuple(rows), notes)


def segment_mass(results: model.Results, criteria: Criteria) -> model.Table:
    """Table 1: the masses of the segments."""
    segments = [t for t in results.topics if not t.variable.endswith(DATA_SHARE)]
    segments.sort(key=lambda topic: _segment_rank(topic.variable))
    tests = [results.find(topic, "paired_t") for topic in segments]

    def row(topic: Topic) -> tuple[dict[str, model.Cell], str]:
        of_share = Topic(topic.table, topic.variable + DATA_SHARE, topic.task, topic.role, "1")
        share = results.find(of_share, "description", OM, "")
        own: dict[str, model.Cell] = {"segment": topic.variable, "mass_data_share": share.mean_a}
        return own | {"mass_data_share_sd": share.sd_a}, ""

    segment = model.Column(("segment",), "Segment", segment_label, text=True)
    share = model.Column(("mass_data_share",), "data share", model.number(2))
    after = (*model.columns("equivalence"), share, model.Column(("mass_data_share_sd",)))
    columns = (segment, model.column("n", "paired_t.n"), *means()), after
    named, given = {one: segment_label(one.variable) for one in segments}, (results, criteria)
    return _paired("table1_segment_mass", tests, columns, named, row, given)


def cop_rmse(results: model.Results, criteria: Criteria) -> model.Table:
    """Table 2: error of the centre of pressure in the identification sequence."""
    tests = [results.find(topic, "paired_t") for topic in results.topics]
    differ = len({test.n for test in tests}) > 1
    axis = model.Column(("axis",), "RMSE", _AXES.__getitem__, text=True)
    columns = (axis, *[_N] * differ, *means()), tuple(smaller_error())
    named, given = {topic: _AXES[topic.variable] for topic in results.topics}, (results, criteria)

    def row(topic: Topic) -> tuple[dict[str, model.Cell], str]:
        return {"axis": topic.variable}, ""

    return _paired("table2_cop_rmse", tests, columns, named, row, given)


def cross_validation(results: model.Results, criteria: Criteria) -> model.Table:
    """Table 4: errors of the centre of pressure and of the vertical force by movement."""
    order = list(_QUANTITIES)
    topics = sorted(
        results.topics, key=lambda t: (order.index(t.variable), t.role == "sequence", t.task)
    )
    tests = [results.find(topic, "paired_t") for topic in topics]

    def row(topic: Topic) -> tuple[dict[str, model.Cell], str]:
        own: dict[str, model.Cell] = {"quantity": topic.variable, "task": topic.task}
        own["role"] = topic.role
        group = f"{_QUANTITIES[topic.variable]} [{model.unit_label(topic.unit)}]"
        return own | {"label": task_label(topic)}, group

    label = model.Column(("label",), "Movement", text=True)
    place = [model.Column((name,)) for name in ("quantity", "task", "role")]
    columns = (*place, label, _N, *means()), tuple(smaller_error())
    named = {topic: f"{_QUANTITIES[topic.variable]}, {topic.task}" for topic in topics}
    return _paired("table4_cross_validation", tests, columns, named, row, (results, criteria))


def centres_of_mass(results: model.Results, criteria: Criteria) -> model.Table:
    """Table 6: what identification changes, as Robert 2017 compares it."""
    order = [*_RESIDUALS, *(_COM + name for name in _OVER_SEGMENTS)]

    def rank(topic: Topic) -> tuple[int, int]:
        """Residuals, then over the segments, then segment by segment."""
        place = order.index(topic.variable) if topic.variable in order else len(order)
        return place, _segment_rank(topic.variable.removeprefix(_COM))

    named = {}
    for topic in sorted(results.topics, key=rank):
        name = topic.variable.removeprefix(_COM)
        whose = _RESIDUALS.get(name) or _OVER_SEGMENTS.get(name) or segment_label(name)
        named[topic] = f"{whose} [{model.unit_label(topic.unit)}]"
    tests = [results.find(topic, "paired_t") for topic in named if topic.variable in _RESIDUALS]

    def row(topic: Topic) -> tuple[dict[str, model.Cell], str]:
        own: dict[str, model.Cell] = {"variable": topic.variable, "label": named[topic]}
        if topic.variable in _RESIDUALS:
            return own, "Residual"
        apart = results.find(topic, "description", DIFFERENCE, "")
        return own | {"n": apart.n}, "Centres of mass along the segments"

    both = "description.mean_a description.sd_a"
    apart = "apart_mean apart_sd", both, "|OM - RM| M(SD)", model.mean_sd(2), (DIFFERENCE, ""), True
    label = model.Column(("label",), "Quantity", text=True)
    columns = (model.Column(("variable",)), label, _N, *means(), model.column(*apart)), ()
    name, printed, given = "table6_centres_of_mass", "; ".join(_in_print()), (results, criteria)
    return _paired(name, tests, columns, named, row, given, in_print=printed)


def _in_print() -> Iterator[str]:
    """The published cases: residuals, then mean, median and largest distance."""
    for row in load_paper("robert2017").table(1).rows:
        force, moment, *apart = (cell.text for cell in row.cells.values())
        yield f"{row.name} {force} N, {moment} N m; {', '.join(apart)} m"


def _segment_rank(name: str) -> int:
    return _SEGMENTS.index(name) if name in _SEGMENTS else len(_SEGMENTS)
