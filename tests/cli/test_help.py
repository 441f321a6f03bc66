"""`bsip --help` is instant, names every command, and all stages take the same arguments."""

from __future__ import annotations

import inspect
import subprocess
import sys
from importlib import import_module

import click
import pytest

from bsip_cli import __version__
from bsip_cli.cli import _TABLE, cli
from bsip_cli.pipeline import STAGES

HEAVY = "ezc3d matplotlib numba numpy pandas pinocchio pyarrow pydantic scipy statsmodels"
STAGE_COMMANDS = [*dict.fromkeys(stage.name for stage in STAGES), "run"]
OTHER = "check compare-loads init simulate inject export markers show published info methods people"


@pytest.mark.parametrize(
    "command", ["", "ingest", "init", "simulate", "export", "markers", "published"]
)
def test_imports_nothing_heavy(command):
    arguments = [*command.split(), "--help"]
    code = (
        "import sys; from bsip_cli.cli import cli; "
        f"cli({arguments}, standalone_mode=False); print(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("Usage:")
    loaded = set(done.stderr.split())
    assert "click" in loaded
    assert loaded & set(HEAVY.split()) == set()


def test_lists_every_command(bsip):
    answer = bsip.done("--help")
    listed = [line.split()[0] for line in answer.out.partition("Commands:\n")[2].splitlines()]
    assert sorted(listed) == sorted(STAGE_COMMANDS + OTHER.split())
    assert sorted(cli.commands) == sorted(listed)


@pytest.mark.parametrize("name", STAGE_COMMANDS)
def test_every_stage_takes_the_same_arguments(name):
    params = cli.commands[name].params
    arguments = [each.name for each in params if isinstance(each, click.Argument)]
    options = [each.opts for each in params if isinstance(each, click.Option)]
    assert arguments == ["study"]
    own = {
        "identify": [["--estimator"]],
        "report": [["--group"]],
        "run": [["--until"], ["--group"]],
    }
    common = [["--out"], ["--participant"], ["--config"], ["--jobs"], ["--force"], ["--verify"]]
    common += [["-v", "--verbose"], ["-q", "--quiet"]]
    assert options == [*common, *own.get(name, [])]


@pytest.mark.parametrize("name", OTHER.split())
def test_a_command_gives_its_function_what_that_takes(name):
    module, function = _TABLE["commands"][name]["does"].split()
    answer = getattr(import_module(f"bsip_cli.{module}"), function)
    inspect.signature(answer).bind(**{one.name: None for one in cli.commands[name].params})


def test_version_and_info(bsip):
    assert bsip("--version").out.split() == ["bsip,", "version", __version__]
    lines = bsip("info").out.splitlines()
    assert lines[0] == f"bsip {__version__}"
    assert {"python", "numpy", "pin", "ezc3d"} <= {line.split()[0] for line in lines}


# --- `bsip published` -----------------------------------------------------------------------------


def test_audit_prints_every_paper(bsip):
    answer = bsip.done("published", "audit")
    for name in ("Hansen 2014", "Hansen 2017", "Robert 2017"):
        assert f"**{name}: " in answer.out
    assert "AP RM (12.69(4.82)) and ML OM (88.67(11.03)) are exchanged" in answer.out
    assert "nothing in it can be recomputed from what is printed" in answer.out


def test_show_prints_the_tables_as_they_are(bsip):
    answer = bsip.done("published", "show", "hansen2017")
    assert answer.out.count(", as printed.**") == 4
    assert "3.84(1.49)" in answer.out
    assert "Robert" not in answer.out


@pytest.mark.parametrize("what", ["show", "audit"])
def test_an_unknown_paper_is_told_with_the_known_ones(bsip, what):
    answer = bsip("published", what, "hansen2071")
    assert answer.code == 2
    expected = "there is no paper 'hansen2071'; expected hansen2014, hansen2017, robert2017."
    assert expected in answer.err
