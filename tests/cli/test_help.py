"""`bsip --help` is instant, names every command, and all stages take the same arguments."""

from __future__ import annotations

import subprocess
import sys

import click
import pytest

from bsip_cli import __version__
from bsip_cli.cli import cli
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
    answer = bsip("--help")
    assert answer.code == 0
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


def test_version_and_info(bsip):
    assert bsip("--version").out.split() == ["bsip,", "version", __version__]
    lines = bsip("info").out.splitlines()
    assert lines[0] == f"bsip {__version__}"
    assert {"python", "numpy", "pin", "ezc3d"} <= {line.split()[0] for line in lines}
