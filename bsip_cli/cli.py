"""The command line: a few lines per command, options from a table; heavy imports stay inside."""

from __future__ import annotations

import io
import os
import sys
import tomllib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import click

from bsip_cli import __version__
from bsip_cli.errors import BsipError, not_readable
from bsip_cli.files.regular import shipped
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

_OPTIONS = tomllib.loads(shipped("commands.toml").read_text(encoding="utf-8"))
_PATH = click.Path(path_type=Path)
_STAGES = list(dict.fromkeys(stage.name for stage in STAGES))
_TYPES = {"path": _PATH, "int": click.INT, "float": click.FLOAT}
_OF_STUDY = ("--participant", "--config", "--jobs")
_VOICE = ("--verbose", "--quiet")
_EFFECTS = ("--effect", "--size", "--target", "--effect-tasks")  # matched in the order given


def _option(key: str) -> Any:
    """An option of the table, by its name; behind that of its command where others differ."""
    said = dict(_OPTIONS[key])
    names = [said.pop("short", ""), key.split()[-1], said.pop("name", "")]
    if "type" in said:
        said["type"] = _TYPES[said["type"]]
    if "choices" in said:
        choices = said.pop("choices")
        said["type"] = click.Choice(_STAGES if choices == "stages" else choices)
    if "range" in said:
        kind = click.FloatRange if said.get("type") is click.FLOAT else click.IntRange
        said["type"] = kind(*said.pop("range"))
    return click.option(*filter(None, names), show_default=bool(said.get("default")), **said)


def _with(*keys: str) -> Callable[[Any], Any]:
    """A command with these options, in this order."""

    def decorated(command: Any) -> Any:
        for key in reversed(keys):
            command = _option(key)(command)
        return command

    return decorated


_study = click.argument("study", type=_PATH)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="bsip")
def cli() -> None:
    """Find a person's body segment inertial parameters from motion capture and force plates.

    Exit codes: 0 done; 2 usage or configuration, or results cannot be written; 3 bad data (the rest
    is done); 4 numerical failure; 1 a bug (the rest is done); 129, 130 and 143 ended by HUP, INT
    and TERM.
    """


def _stage_command(name: str, summary: str) -> click.Command:
    own = {"identify": ("--estimator",), "report": ("--group",), "run": ("--until", "--group")}

    @click.command(name, help=summary)
    @_study
    @_with("--out", *_OF_STUDY, "--force", "--verify", *_VOICE, *own.get(name, ()))
    def command(study: Path, **asked: Any) -> int:
        from bsip_cli.running.session import run_session

        return run_session(name, study, **asked)

    return command


for _stage in {stage.name: stage for stage in STAGES}.values():
    cli.add_command(_stage_command(_stage.name, _stage.summary))
cli.add_command(_stage_command("run", "All stages, from recordings to the report."))


@cli.command()
@_study
@_with(*_OF_STUDY, *_VOICE)
def check(**asked: Any) -> int:
    """Say what recordings are taken for, if that is a person, and what fails; nothing is kept.

    Exit codes: those of `bsip run`.
    """
    from bsip_cli.commands.check import check_study

    return check_study(**asked)


@cli.command()
@_study
def people(study: Path) -> None:
    """Print the participants of a study, one in a line, for scripts and job schedulers.

    Exit code 3 with nothing printed: participants.tsv cannot be read.
    """
    from bsip_cli.study.participants import named_in

    for name in named_in(study / "participants.tsv"):
        click.echo(name)


@cli.command()
@_study
@_with("--preset", "--participants", "--seed", "--sequence-s", "--task", "--run")
@_with("--plate-per-foot", "--soft-tissue", "--shoulder-girdle", *_EFFECTS)
def simulate(study: Path, preset: str, **options: Any) -> None:
    """Make a study of simulated people whose inertial parameters are known.

    With --effect, something is hidden in the recordings that a simulation would get wrong; the
    folder truth/ says what.
    """
    from bsip_cli.simulate.study import simulate_command

    simulate_command(study, preset, **options)


@cli.command()
@click.argument("source", metavar="IN", type=_PATH)
@click.argument("out", type=_PATH)
@_with("inject --participant", "inject --seed", *_EFFECTS)
def inject(**asked: Any) -> int:
    """Hide effects in measured recordings, where that is physically possible.

    IN is a study folder, a C3D file, or a TRC file with its MOT file next to it; OUT is the copy.
    """
    from bsip_cli.simulate.study import inject_command

    return inject_command(**asked)


@cli.command()
@_study
@_with("--out", "--participant", "--method", "--format", "--model-file", "--model-bodies")
@_with("--repair", "--what", "--to", "--config")
def export(
    study: Path, out: Path, chosen: tuple[str, ...], config_file: Path | None, **asked: Any
) -> int:
    """Write files to go on with: people as models for Pinocchio, MuJoCo, OpenSim, biorbd and
    Visual3D (OUT/sub-XX/export/sub-XX_METHOD with .urdf, .xml, .osim, .bioMod and .csv), or with
    --what corrected recordings, motion with forces, or joint moments."""
    from bsip_cli.commands.export import Request, export_session

    return export_session(study, out, chosen, config_file, Request(**asked))


@cli.command()
@click.argument("file", type=_PATH)
@_with("--marker-set", "--prefix", "--write")
def markers(**asked: Any) -> int:
    """Print a recording's labels, the marker set they fit, and what is missing on which segment.

    FILE is a C3D or TRC file. Where no shipped set fits, a first one is written to
    FILE_markers.toml in the current folder (or to --write), to be corrected.

    Exit codes: 0 the set has all that a skeleton needs; 2 usage, an unknown set, or the file to be
    written is there; 3 the recording cannot be read, no set fits, or markers are missing that a
    skeleton cannot do without.
    """
    from bsip_cli.commands.markers import markers_command

    return markers_command(**asked)


@cli.command()
@click.argument("given", metavar="FILES_OR_FOLDERS...", nargs=-1, required=True, type=_PATH)
@_with("init --out", "init --participant", "--link")
def init(**asked: Any) -> int:
    """Make a study of recordings: C3D files, and TRC files with their MOT or STO.

    Files get the names that a study needs (sub-01_task-walking_run-1); static trials are recognised
    by name and stillness; participants.tsv gets the mass, height and sex that files state,
    study.toml the roles and the marker set, where no shipped one fits a first one made from the
    labels; sources.tsv says what came from where, and what was not used and why.

    Exit codes: 0 done; 2 usage, or the study's folder is not empty; 3 a recording cannot be used
    (the others are).
    """
    from bsip_cli.commands.init import init_command

    return init_command(**asked)


@cli.command("compare-loads")
@_study
@_with("--out", "compare-loads --participant", "--config", "--with", "--without")
def compare_loads(study: Path, heavy: str, plain: str, **asked: Any) -> int:
    """Find a load that is known, to see how far its mass can be trusted.

    Two sets of a person's recordings, with and without a load of [[loads]] in study.toml, are
    identified each on its own with the load left in the forces; printed is what that adds to each
    segment, with its interval, next to the declared load. Needs the results of `bsip regress` and
    `bsip ik`; writes sub-XX_load-comparison.parquet.
    """
    from bsip_cli.commands.compare_loads import compare_loads as compare

    return compare(study, names=(heavy, plain), **asked)


@cli.command()
@click.argument("out", type=_PATH)
@_with("--full")
def show(out: Path, full: bool) -> None:
    """Print what a finished run found: the most important first, a line per finding, and where the
    reports lie."""
    from bsip_cli.commands.show import shown

    for part in shown(out, full):
        click.echo(part)


@cli.command()
@click.argument("what", type=click.Choice(["show", "audit"]))
@click.argument("paper", required=False)
def published(what: str, paper: str | None) -> None:
    """The tables of the papers that the method comes from.

    `show` prints them as they are in print; `audit` recomputes intervals, t, p, d, F and sums from
    the printed means and standard deviations, and lists what cannot be true, with the likely
    reading. PAPER is hansen2014, hansen2017 or robert2017; without it, all.
    """
    from bsip_cli.commands.info import papers

    for part in papers(what, paper):
        click.echo(part)


@cli.command()
@click.argument("out", type=_PATH)
def methods(out: Path) -> None:
    """What was done with a study's data, with versions, options and references, in words to paste
    into a paper."""
    from bsip_cli.commands.methods import methods_text

    click.echo(methods_text(out))


@cli.command()
@click.argument("artifact", required=False, type=_PATH)
def info(artifact: Path | None) -> None:
    """What an artifact holds and what made it; without one, the versions of bsip and of the
    libraries its numbers depend on (for bug reports)."""
    from bsip_cli.commands.info import artifact_info, versions

    for line in versions() if artifact is None else artifact_info(artifact):
        click.echo(line)


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
