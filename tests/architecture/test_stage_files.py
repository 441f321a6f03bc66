"""A stage reads, writes and looks up what the table of stages says: freshness rests on it."""

from __future__ import annotations

import ast
import importlib
import inspect

import pytest

from bsip_cli.config import Config
from bsip_cli.pipeline import STAGES, producer, stages_named
from bsip_cli.schemas import SCHEMAS

LABELS = [stage.label for stage in STAGES]


def tree_of(stage) -> ast.Module:
    """The stage's function, with all of its module that this uses."""
    whole = ast.parse(inspect.getsource(importlib.import_module(stage.module)))
    parts = {n.name: n for n in whole.body if isinstance(n, ast.FunctionDef | ast.ClassDef)}
    used, waiting = {}, [stage.function]
    while waiting:
        name = waiting.pop()
        if name in parts and name not in used:
            used[name] = parts[name]
            waiting += [n.id for n in ast.walk(parts[name]) if isinstance(n, ast.Name)]
    return ast.Module(list(used.values()), [])


def options_used(tree: ast.Module) -> set[str]:
    """X of every ``….config.X``."""
    return {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Attribute)
        and node.value.attr == "config"
    }


def kinds(tree: ast.Module, *methods: str) -> set[str]:
    """Literal kinds handed to these methods of a unit."""
    return {
        word.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr in methods
        for word in node.args
        if isinstance(word, ast.Constant) and isinstance(word.value, str)
    }


def attributes(tree: ast.Module) -> set[str]:
    return {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}


@pytest.mark.parametrize("stage", STAGES, ids=LABELS)
def test_declares_every_option_it_looks_up(stage):
    """An undeclared option would change results without a rerun."""
    tree = tree_of(stage)
    used, looked_at = options_used(tree), attributes(tree)
    used |= {"roles"} if "role" in looked_at else set()
    used |= {"loads"} if {"loads", "load_kg"} & looked_at else set()
    assert used <= set(stage.options)


@pytest.mark.parametrize("stage", STAGES, ids=LABELS)
def test_declares_every_kind_it_reads(stage):
    """Or it has written it itself, a part at a time."""
    own = kinds(tree_of(stage), "write_in_parts")
    assert kinds(tree_of(stage), "read", "facts", "trials", "has") <= {*stage.inputs, *own}


@pytest.mark.parametrize("stage", STAGES, ids=LABELS)
def test_writes_what_it_declares(stage):
    assert kinds(tree_of(stage), "write", "write_in_parts") == set(stage.writes)


@pytest.mark.parametrize("stage", STAGES, ids=LABELS)
def test_amends_what_it_declares(stage):
    """Not what it reads, lest it change its own input; at its own level, after the maker."""
    assert kinds(tree_of(stage), "amend") == set(stage.amends)
    assert set(stage.amends).isdisjoint({*stage.reads, *stage.writes})
    assert {SCHEMAS[kind].level for kind in stage.amends} <= {stage.level}
    before = STAGES[: STAGES.index(stage)]
    assert {kind for kind in stage.amends if producer(kind) not in before} == set()


def test_steps_have_labels_of_their_own():
    assert len(set(LABELS)) == len(LABELS)


@pytest.mark.parametrize("stage", STAGES, ids=LABELS)
def test_reads_only_what_an_earlier_stage_writes(stage):
    before = STAGES[: STAGES.index(stage)]
    assert {kind for kind in stage.inputs if producer(kind) not in before} == set()


@pytest.mark.parametrize("stage", STAGES, ids=LABELS)
def test_writes_at_its_own_level(stage):
    assert {SCHEMAS[kind].level for kind in stage.writes} == {stage.level}
    assert set(stage.options) <= set(Config.model_fields)


def test_every_kind_has_one_writer():
    """Refusals are of every stage, comparisons of loads of a command that is none."""
    written = [kind for stage in STAGES for kind in stage.writes]
    assert sorted(written) == sorted(set(SCHEMAS) - {"refusal", "load-comparison"})


def test_a_command_runs_its_stages_in_order():
    assert stages_named("run") == STAGES
    assert [stage.level for stage in stages_named("report")] == ["participant", "cohort"]


@pytest.mark.parametrize("kind", SCHEMAS)
def test_every_number_has_a_unit_and_every_column_a_meaning(kind):
    for column in SCHEMAS[kind].columns:
        assert column.meaning, column.name
        counts = column.type == "int"
        assert column.unit or column.type in ("text", "bool") or counts, column.name
