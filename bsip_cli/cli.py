"""The command line: the commands of configs/commands.toml; what one imports comes with its call."""

from __future__ import annotations

import io
import os
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from bsip_cli import __version__
from bsip_cli.errors import BsipError, not_readable
from bsip_cli.files.regular import read_toml, shipped
from bsip_cli.pipeline import STAGES
from bsip_cli.running.processes import (
    EndedError,
    endings_kept,
    ignore_endings,
    leave,
    raise_when_ended,
)

# One thread per process: results do not depend on the number of cores, and --jobs decides the load.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

_TABLE = read_toml(shipped("commands.toml"))
_STAGES = {stage.name: stage.summary for stage in STAGES}
_OF_A_STAGE = "study --out --participant --config --jobs --force --verify --verbose --quiet"
_MORE = {"identify": " --estimator", "report": " --group", "run": " --until --group"}
_TYPES = {"path": click.Path(path_type=Path), "int": click.INT, "float": click.FLOAT}


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="bsip")
def cli() -> None:
    """Find a person's body segment inertial parameters from motion capture and force plates.

    Exit codes: 0 done; 2 usage or configuration, or results cannot be written; 3 bad data (the rest
    is done); 4 numerical failure; 1 a bug (the rest is done); 129, 130 and 143 ended by HUP, INT
    and TERM.
    """


def _add(command: str, /, does: str, takes: str, help: str, **fixed: str) -> None:
    """A command as the table has it; ``fixed`` goes to its function with what is asked for."""

    def answer(**asked: Any) -> int | None:
        module, function = does.split()
        found = getattr(import_module(f"bsip_cli.{module}"), function)(**fixed, **asked)
        if found is None or isinstance(found, int):
            return found
        for part in [found] if isinstance(found, str) else found:
            click.echo(part)
        return 0

    params = [_parameter(command, name) for name in takes.split()]
    cli.add_command(click.Command(command, callback=answer, params=params, help=help))


def _parameter(command: str, name: str) -> click.Parameter:
    """An argument or option of the table; of its command alone where others differ."""
    said: dict[str, Any] = {"type": "", **_TABLE.get(f"{command} {name}", _TABLE[name])}
    kind = said["type"] = _TYPES.get(said["type"])
    if "choices" in said:
        choices = said.pop("choices")
        said["type"] = click.Choice([*_STAGES] if choices == "stages" else choices)
    if "range" in said:
        of_kind = click.FloatRange if kind is click.FLOAT else click.IntRange
        said["type"] = of_kind(*said.pop("range"))
    if not name.startswith("--"):
        return click.Argument([name], **said)
    names = [said.pop("short", ""), name, said.pop("name", "")]
    return click.Option([*filter(None, names)], show_default=bool(said.get("default")), **said)


for _name, _help in (_STAGES | {"run": "All stages, from recordings to the report."}).items():
    _takes = _OF_A_STAGE + _MORE.get(_name, "")
    _add(_name, "running.session run_session", _takes, _help, command=_name)
for _name, _said in _TABLE["commands"].items():
    _add(_name, **_said)


def main() -> None:
    """Entry point: turns errors into one sentence and a documented exit code."""
    try:
        raise_when_ended()
        with endings_kept():
            sentence, exit_code = _answer()
        ignore_endings()
    except EndedError as ended:
        ignore_endings()
        sentence, exit_code = str(ended), ended.exit_code
    with suppress(OSError):  # somebody may listen no more
        if sentence:
            click.echo(f"bsip: {sentence}", err=True)
    with suppress(OSError):  # what stands in its buffer cannot be written either
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    leave(exit_code)


def _answer() -> tuple[str, int]:
    """Do what was asked; the last sentence, if there is one, and the exit code."""
    if isinstance(sys.stdout, io.TextIOWrapper):  # letters that a terminal of few cannot show
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        exit_code = cli(standalone_mode=False)
        sys.stdout.flush()
    except click.ClickException as error:
        error.show()
        return "", 2
    except click.Abort:
        return "", 130
    except BsipError as error:
        return str(error), error.exit_code
    except (BrokenPipeError, SystemExit):  # who reads the answer, like `head`, has seen enough:
        return "", 0  # click leaves then, and only then, by itself
    except OSError as error:
        return str(not_readable(error)), 2
    return "", exit_code or 0
