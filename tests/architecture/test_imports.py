"""Dependencies point one way; science knows no tables, no logging, no command line."""

from __future__ import annotations

from graphlib import TopologicalSorter

import pytest

from bsip_cli.files.regular import read_toml, shipped
from tests.architecture.imports_of import modules, names_from, package

SCIENCE = ("body", "dynamics", "motion", "recordings", "statistics", "identification")

# What each part of the package may import of the others. A new part needs a line here.
ALLOWED = {
    "__init__": "",
    "errors": "",
    "segments": "",
    "files": "errors",
    "config": "errors files",
    "schemas": "files",
    "artifacts": "errors files schemas",
    "pipeline": "files schemas",
    "stated": "files",
    "study": "__init__ artifacts body errors files schemas stated",
    "running": "__init__ artifacts body config errors files pipeline schemas study",
    "__main__": "cli",
    "library": "__init__ artifacts body config errors pipeline recordings running schemas stages "
    "study",
    "commands": "__init__ artifacts body config diagnosis effects errors files identification "
    "instruments pipeline recordings report running schemas segments stages statistics study",
    "reference": "cli config effects files pipeline report schemas",
    "cli": "__init__ errors files pipeline running",  # and what configs/commands.toml names
    "body": "errors files segments stated",
    "dynamics": "body errors segments",
    "caches": "",
    "motion": "body caches dynamics errors segments",
    "recordings": "body errors files segments stated",
    "statistics": "dynamics errors",
    "identification": "body dynamics errors files segments statistics",
    "effects": "body dynamics errors motion segments",
    "diagnosis": "body dynamics effects errors identification motion segments statistics",
    "report": "body caches dynamics effects errors motion schemas segments statistics",
    "instruments": "errors files",
    "simulate": "body errors files instruments segments",
    "stages": "artifacts body diagnosis dynamics effects errors files identification motion "
    "pipeline recordings report running schemas segments statistics study",
}

FOREIGN_TO_SCIENCE = {"pandas", "pyarrow", "click", "tqdm", "logging", "subprocess", "matplotlib"}

# Single modules of a part that may be imported, where the part as a whole may not.
ONLY = {
    "simulate": {"body": {"body.markersets"}},
    "library": {"running": {"running.unit"}, "stages": {"stages.frames"}},
    "commands": {
        "stages": {
            "stages.frames",
            "stages.identification_problem",
            "stages.joints",
            "stages.survey",
            "stages.trial_scene",
        }
    },
    "running": {"body": {"body.markersets", "body.skeleton"}},
    "stages": {"running": {"running.unit"}},
    "study": {"body": {"body.skeleton"}},
}


def inner(module: str) -> set[str]:
    """The bsip modules that a module imports, without ``bsip_cli.``."""
    found = {name for name in modules()[module] if name.split(".")[0] == "bsip_cli"}
    return {name.removeprefix("bsip_cli").removeprefix(".") or "__init__" for name in found}


def foreign(module: str) -> set[str]:
    return {name for name in modules()[module] if not name.startswith("bsip_cli")}


def test_reads_the_package():
    """The rules below would hold of nothing too."""
    assert "segments" in inner("simulate.people")
    assert {"numpy", "pandas"} <= foreign("artifacts")
    assert "shipped" in names_from("body.skeleton", "bsip_cli.files.regular")
    assert {package(name) for name in modules()} >= {*SCIENCE, "stages", "report", "simulate"}


@pytest.mark.parametrize("module", sorted(modules()))
def test_imports_only_what_its_part_may(module):
    part = package(module)
    assert part in ALLOWED, f"{part} is a new part: say in ALLOWED what it may import"
    allowed = {part, *ALLOWED[part].split()}
    assert {name for name in inner(module) if package(name) not in allowed} == set()


def test_parts_form_no_circle():
    """The rule itself has one direction."""
    order = list(TopologicalSorter({k: v.split() for k, v in ALLOWED.items()}).static_order())
    assert order.index("body") < order.index("dynamics") < order.index("stages")
    assert order.index("study") < order.index("running") < order.index("cli")


def test_modules_form_no_circle():
    graph = {name: inner(name) - {"__init__", name} for name in modules()}
    assert len(list(TopologicalSorter(graph).static_order())) >= len(graph)


@pytest.mark.parametrize("module", [name for name in sorted(modules()) if package(name) in SCIENCE])
def test_science_takes_arrays(module):
    """No tables, no printing."""
    assert not foreign(module) & FOREIGN_TO_SCIENCE


@pytest.mark.parametrize(
    ("module", "part", "known"),
    [
        (module, part, known)
        for module in sorted(modules())
        for part, known in ONLY.get(package(module), {}).items()
    ],
)
def test_imports_of_another_part_only_what_is_shared(module, part, known):
    assert {name for name in inner(module) if package(name) == part} <= known


def test_the_fitted_side_does_not_know_the_simulator():
    """Who finds must not see the truth."""
    users = {name for name in modules() if any(package(m) == "simulate" for m in inner(name))}
    assert {package(name) for name in users} == {"simulate"}
    commands = read_toml(shipped("commands.toml"))["commands"].values()
    named = {one["does"].split()[0] for one in commands}
    assert {name for name in named if package(name) != "commands"} == {
        "simulate.study",
        "study.participants",
    }


def test_stages_do_not_know_each_other():
    """They meet in files."""
    helpers = {
        "stages.frames",
        "stages.identification_problem",
        "stages.known_laboratory",
        "stages.diagnosed_trials",
        "stages.person_mass",
        "stages.reconstruct",
        "stages.survey",
        "stages.trial_scene",
    }
    pairs = {
        (name, other)
        for name in modules()
        for other in inner(name) - helpers
        if package(name) == package(other) == "stages"
    }
    assert pairs == set()
