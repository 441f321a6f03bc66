"""What each recording of a study is taken for, whether it is a person, and what fails."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import click
import numpy as np

from bsip_cli.errors import printable
from bsip_cli.pipeline import producer, stages_named
from bsip_cli.report.words import count
from bsip_cli.running.runner import run_stages
from bsip_cli.running.session import follow, open_study
from bsip_cli.running.unit import Unit
from bsip_cli.study.study import Participant, Trial


def check_study(
    study: Path, chosen: tuple[str, ...], config_file: Path | None, jobs: int, **voice: bool
) -> int:
    """Read a study's recordings and build each person's skeleton, say what is wrong and what each
    recording is; the exit code of `ingest` and `scale`.

    ``voice`` as `follow` takes it.
    """
    stages = stages_named("ingest") + stages_named("scale")
    with TemporaryDirectory(prefix="bsip-check-") as folder:
        out = Path(folder) / "results"
        opened = open_study(study, out, chosen, config_file)
        running = run_stages(stages, opened.study, out, opened.config, jobs=jobs)
        total = sum(2 + len(person.trials) for person in opened.study.participants)
        code = follow("check", opened.refusals, running, total, None, **voice)
        for person in opened.study.participants:
            unit = Unit(producer("markers"), opened.study, out, opened.config, person)
            for line in _about(unit, person):
                click.echo(printable(line))
    return code


def _about(unit: Unit, person: Participant) -> Iterator[str]:
    stated = [
        {"M": "man", "F": "woman"}.get(person.sex, "sex other or not stated"),
        "mass not stated" if person.mass_kg is None else f"{person.mass_kg:g} kg",
        "height not stated" if person.height_m is None else f"{person.height_m:g} m",
    ]
    yield f"{person.id}: {', '.join(stated)}"
    width = max(len(trial.path.name) for trial in person.trials)
    for trial in person.trials:
        yield f"  {trial.path.name:{width}}  {trial.role:10}  {_trial(unit, trial)}"


def _trial(unit: Unit, trial: Trial) -> str:
    if not unit.stands("contacts", trial, unit.participant):
        return "refused, see above"
    facts, contacts = unit.facts("markers", trial), unit.read("contacts", trial)
    markers, rate_hz = unit.read("markers", trial), facts["marker_rate_hz"]
    seen = markers.loc[np.isfinite(markers["x_m"]), "marker"].nunique()
    plates = sum(name.endswith("_fz_N") for name in unit.read("wrench", trial).columns)
    measured = f"every contact measured for {contacts['valid'].sum() / rate_hz:.1f} s"
    forces = f"{count(plates, 'plate')}, {measured}" if plates else "no forces"
    time = f"{len(contacts) / rate_hz:.1f} s at {rate_hz:g} Hz"
    return f"{time}, {seen} markers ({facts['marker_set']}), {forces}"
