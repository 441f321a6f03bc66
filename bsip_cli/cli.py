"""The command line: a few lines per command; heavy imports stay inside them."""

from __future__ import annotations

import io
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import click

from bsip_cli import __version__
from bsip_cli.errors import BsipError, not_readable
from bsip_cli.pipeline import STAGES
from bsip_cli.running.endings import EndedError, endings_kept, ignore_endings, raise_when_ended

# One thread per process: results do not depend on the number of cores, and --jobs decides the load.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="bsip")
def cli() -> None:
    """Find a person's body segment inertial parameters from motion capture and force plates.

    Exit codes: 0 done; 2 usage or configuration, or results cannot be written; 3 bad data (the rest
    is done); 4 numerical failure; 1 a bug (the rest is done); 129, 130 and 143 ended by HUP, INT
    and TERM.
    """


_OUT = click.option(
    "--out", required=True, type=click.Path(path_type=Path), help="Folder for all results."
)
_PARTICIPANT = click.option(
    "--participant",
    "chosen",
    multiple=True,
    metavar="sub-01",
    help="Only this participant (may be repeated).",
)
_CONFIG = click.option(
    "--config",
    "config_file",
    type=click.Path(path_type=Path),
    help="TOML file with options that differ from the study's.",
)
_JOBS = click.option(
    "--jobs", default=1, show_default=True, type=click.IntRange(1), help="Participants at once."
)


def _stage_command(name: str, summary: str) -> click.Command:
    @click.command(name, help=summary)
    @click.argument("study", type=click.Path(path_type=Path))
    @_OUT
    @_PARTICIPANT
    @_CONFIG
    @_JOBS
    @click.option("--force", is_flag=True, help="Redo what is up to date.")
    @click.option(
        "--verify",
        is_flag=True,
        help="Hash every file again, also those whose size and times have not changed.",
    )
    def command(study, out, chosen, config_file, **options):
        from bsip_cli.running.session import run_session

        return run_session(name, study, out, chosen, config_file, **options)

    return command


for _stage in {stage.name: stage for stage in STAGES}.values():
    cli.add_command(_stage_command(_stage.name, _stage.summary))
cli.commands["identify"].params.append(
    click.Option(
        ["--estimator", "estimators"],
        multiple=True,
        metavar="NAME",
        help="Instead of identify.estimators (may be repeated): the first is OM, others appear "
        "under their names.",
    )
)
cli.add_command(_stage_command("run", "All stages, from recordings to the report."))
cli.commands["run"].params.append(
    click.Option(
        ["--until"],
        type=click.Choice(list(dict.fromkeys(stage.name for stage in STAGES))),
        help="Only the stages up to this one.",
    )
)
for _name in ("report", "run"):
    cli.commands[_name].params.append(
        click.Option(["--group"], is_flag=True, help="Only what is about all participants.")
    )


@cli.command()
@click.argument("study", type=click.Path(path_type=Path))
@_PARTICIPANT
@_CONFIG
@_JOBS
def check(study, chosen, config_file, jobs):
    """Say what each recording of a study is taken for, and what fails; nothing is kept.

    Exit codes: those of `bsip ingest`.
    """
    from bsip_cli.commands.check import check_study

    return check_study(study, chosen, config_file, jobs)


@cli.command()
@click.argument("study", type=click.Path(path_type=Path))
def people(study):
    """Print the participants of a study, one in a line, for scripts and job schedulers.

    Exit code 3 with nothing printed: participants.tsv cannot be read.
    """
    from bsip_cli.study.participants import named_in

    for name in named_in(study / "participants.tsv"):
        click.echo(name)


def _effect_options(command: Any) -> Any:
    """What to hide in recordings; matched in the order given."""
    options = (
        click.option(
            "--effect",
            "effects",
            multiple=True,
            metavar="NAME",
            help="Hide this effect (may be repeated, each with its --size).",
        ),
        click.option(
            "--size",
            "sizes",
            multiple=True,
            type=float,
            help="Its size, in the effect's unit.",
        ),
        click.option(
            "--target",
            "targets",
            multiple=True,
            metavar="T",
            help="Where it sits: segment, channel, marker or joint, and settings as key=number, "
            "joined by commas; - for none. Drawn if not given.",
        ),
        click.option(
            "--effect-tasks",
            multiple=True,
            metavar="TASK",
            help="Only in the trials of this task (may be repeated).",
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


@cli.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--preset",
    default="sample",
    show_default=True,
    type=click.Choice(["sample", "cohort", "diagnosis"]),
    help="sample: 6 people, short trials, low rates; cohort: 12 people, 120 s sequences at 100 Hz; "
    "diagnosis: one person, 60 s, with squats, hops and steps onto the plate.",
)
@click.option("--participants", type=click.IntRange(1, 10000), help="How many people.")
@click.option("--seed", type=int, help="Draws other people and movements.")
@click.option(
    "--sequence-s",
    type=click.FloatRange(5, 1200),
    help="Length of the identification sequence [s].",
)
@click.option(
    "--task",
    "tasks",
    multiple=True,
    metavar="TASK",
    help="Only recordings of this task (may be repeated); the others stay what they would be.",
)
@click.option(
    "--run",
    default=1,
    show_default=True,
    type=click.IntRange(1),
    help="Number of the recordings: the same people move once more.",
)
@click.option(
    "--plate-per-foot",
    is_flag=True,
    help="Two plates side by side, one under each foot, instead of one under both.",
)
@click.option(
    "--soft-tissue",
    default="light",
    show_default=True,
    type=click.Choice(["light", "measured"]),
    help="light: skin moves with the sines of the joints; measured: as published of people, larger "
    "on trunk and thighs, curved in the pose, with mass that swings at 5 to 11 Hz.",
)
@click.option(
    "--shoulder-girdle",
    is_flag=True,
    help="Shoulders that move against the trunk, seen by 51 markers; fitted with 17 segments.",
)
@_effect_options
def simulate(study, preset, **options):
    """Make a study of simulated people whose inertial parameters are known.

    With --effect, something is hidden in the recordings that a simulation would get wrong; the
    folder truth/ says what.
    """
    from bsip_cli.simulate.command import simulate_command

    simulate_command(study, preset, **options)


@cli.command()
@click.argument("source", metavar="IN", type=click.Path(path_type=Path))
@click.argument("out", type=click.Path(path_type=Path))
@click.option(
    "--participant",
    "participants",
    multiple=True,
    metavar="sub-01",
    help="Only in this participant's recordings (may be repeated).",
)
@click.option("--seed", default=1, show_default=True, type=int, help="Draws what is left open.")
@_effect_options
def inject(source, out, participants, seed, **effects):
    """Hide effects in measured recordings, where that is physically possible.

    IN is a study folder, a C3D file, or a TRC file with its MOT file beside it; OUT is the copy.
    """
    from bsip_cli.simulate.command import inject_command

    return inject_command(source, out, participants, seed, **effects)


@cli.command()
@click.argument("study", type=click.Path(path_type=Path))
@_OUT
@_PARTICIPANT
@click.option(
    "--method",
    help="Whose inertial parameters: OM, RM+mass, RM or the name of an estimator; without it, what "
    "`bsip choose` found best over all movements.",
)
@click.option(
    "--format",
    "formats",
    multiple=True,
    type=click.Choice(["urdf", "mjcf", "osim", "biomod", "csv"]),
    help="Only this format (may be repeated); without it, all.",
)
@click.option(
    "--model-file",
    type=click.Path(path_type=Path),
    help="An .osim file (OpenSim 4) that gets the inertial parameters, in place of a model of "
    "bsip's own tree.",
)
@click.option(
    "--model-bodies",
    metavar="MAP",
    help="Which bodies of --model-file are which segments: rajagopal, gait2392 or a .toml file; "
    "without it, the shipped map that fits.",
)
@click.option(
    "--repair",
    is_flag=True,
    help="Replace inertia tensors that no body can have by the nearest possible ones, and say so; "
    "without it such a person gets the .csv only.",
)
@click.option(
    "--what",
    type=click.Choice(["model", "recording", "opensim", "bids", "joints"]),
    default="model",
    show_default=True,
    help="model: the person, for other software. recording: a copy of the study with the named "
    "faults of plates, clocks and labels corrected. opensim: model, motion, forces of the feet and "
    "the set-up of InverseDynamicsTool. bids: markers, pose and forces as BIDS-Motion. joints: "
    "joint moments as CSV.",
)
@click.option(
    "--to",
    type=click.Path(path_type=Path),
    help="Folder for the files, instead of OUT/sub-XX/export; recording and bids need one.",
)
@_CONFIG
def export(
    study, out, chosen, method, formats, model_file, model_bodies, repair, what, to, config_file
):
    """Write files to go on with: people as models for Pinocchio, MuJoCo, OpenSim, biorbd and
    Visual3D (OUT/sub-XX/export/sub-XX_METHOD with .urdf, .xml, .osim, .bioMod and .csv), or with
    --what corrected recordings, motion with forces, or joint moments."""
    from bsip_cli.commands.export import Request, export_session

    request = Request(method, formats, model_file, model_bodies, repair, what, to)
    return export_session(study, out, chosen, config_file, request)


@cli.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--marker-set",
    default="auto",
    show_default=True,
    metavar="NAME",
    help="Compare with this shipped set, or with a .toml file; auto guesses.",
)
@click.option(
    "--prefix",
    default="",
    metavar="Subject:",
    help="Whose markers count, where the file holds several people.",
)
@click.option(
    "--write",
    type=click.Path(path_type=Path),
    help="Write a first marker set of the file's labels here, also where a set fits.",
)
def markers(file, marker_set, prefix, write):
    """Print a recording's labels, the marker set they fit, and what is missing on which segment.

    FILE is a C3D or TRC file. Where no shipped set fits, a first one is written to
    FILE_markers.toml in the current folder (or to --write), to be corrected.

    Exit codes: 0 the set has all that a skeleton needs; 2 usage, an unknown set, or the file to be
    written is there; 3 the recording cannot be read, no set fits, or markers are missing that a
    skeleton cannot do without.
    """
    from bsip_cli.commands.markers import Request, markers_command

    return markers_command(Request(file, marker_set, prefix, write))


@cli.command()
@click.argument(
    "given",
    metavar="FILES_OR_FOLDERS...",
    nargs=-1,
    required=True,
    type=click.Path(path_type=Path),
)
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    help="The study's folder: new, or empty. Nothing is ever written over.",
)
@click.option(
    "--participant",
    default="",
    metavar="sub-01",
    help="Whose all these recordings are; without it, folders, the files' subjects and the names "
    "of files distinguish people.",
)
@click.option("--link", is_flag=True, help="Symbolic links instead of copies.")
def init(given, out, participant, link):
    """Make a study of recordings: C3D files, and TRC files with their MOT or STO.

    Files get the names that a study needs (sub-01_task-walking_run-1); static trials are told by
    name and stillness; participants.tsv gets the mass, height and sex that files state, study.toml
    the roles and the marker set, where no shipped one fits a first one made from the labels;
    sources.tsv says what came from where, and what was not used and why.

    Exit codes: 0 done; 2 usage, or the study's folder is not empty; 3 a recording cannot be used
    (the others are).
    """
    from bsip_cli.commands.init import Request, init_command

    return init_command(Request(given, out, participant, link))


@cli.command("compare-loads")
@click.argument("study", type=click.Path(path_type=Path))
@_OUT
@click.option("--participant", required=True, metavar="sub-01", help="Whose recordings.")
@_CONFIG
@click.option(
    "--with",
    "heavy",
    default="",
    metavar="TASK[,TASK]",
    help="Tasks, or recordings as squat_run-2, that carry the load; without it, all that move and "
    "carry a declared one.",
)
@click.option(
    "--without",
    "plain",
    default="",
    metavar="TASK[,TASK]",
    help="Those to compare with; without it, all that move and carry none.",
)
def compare_loads(study, out, participant, config_file, heavy, plain):
    """Find a load that is known, to see how far its mass can be trusted.

    Two sets of a person's recordings, with and without a load of [[loads]] in study.toml, are
    identified each on its own with the load left in the forces; printed is what that adds to each
    segment, with its interval, beside the declared load. Needs the results of `bsip regress` and
    `bsip ik`; writes sub-XX_load-comparison.parquet.
    """
    from bsip_cli.commands.compare_loads import compare_loads as compare

    return compare(study, out, participant, config_file, (heavy, plain))


@cli.command()
@click.argument("out", type=click.Path(path_type=Path))
@click.option("--full", is_flag=True, help="Everything: tables, causes with all their numbers.")
def show(out, full):
    """Print what a finished run found: the most important first, a line per finding, and where the
    reports lie."""
    from bsip_cli.commands.show import shown

    for part in shown(out, full):
        click.echo(part)


@cli.command()
@click.argument("what", type=click.Choice(["show", "audit"]))
@click.argument("paper", required=False)
def published(what, paper):
    """The tables of the papers that the method comes from.

    `show` prints them as they are in print; `audit` recomputes intervals, t, p, d, F and sums from
    the printed means and standard deviations, and lists what cannot be true, with the likely
    reading. PAPER is hansen2014, hansen2017 or robert2017; without it, all.
    """
    from bsip_cli.commands.published import shown

    for part in shown(what, paper):
        click.echo(part)


@cli.command()
@click.argument("out", type=click.Path(path_type=Path))
def methods(out) -> None:
    """What was done with a study's data, with versions, options and references, in words to paste
    into a paper."""
    from bsip_cli.commands.methods import methods_text

    click.echo(methods_text(out))


@cli.command()
@click.argument("artifact", required=False, type=click.Path(path_type=Path))
def info(artifact) -> None:
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
    _end(sentence, exit_code)


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


def _end(sentence: str, exit_code: int) -> None:
    """Say the last sentence, if somebody listens still, and leave."""
    with suppress(OSError):
        if sentence:
            click.echo(f"bsip: {sentence}", err=True)
    with suppress(OSError):  # what stands in its buffer cannot be written either
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(exit_code)
