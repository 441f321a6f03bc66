"""What `bsip diagnose` asks of kept recordings: where a black box is not enough."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from tqdm import tqdm

from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.diagnosis.together import Evidence, together
from bsip_cli.pipeline import stages_named
from bsip_cli.running.session import open_study
from bsip_cli.running.unit import Unit
from bsip_cli.stages.frames import person_from
from bsip_cli.stages.moving_trials import moving_trials, prior_of
from tests.blind.blind_running import DOCUMENT, ROOT


def parser_of_kept(description: str | None, results: str) -> argparse.ArgumentParser:
    """Options of every script that asks kept recordings."""
    parser = argparse.ArgumentParser(description=description)
    add = parser.add_argument
    add("--kept", type=Path, default=ROOT / "out" / "blind", help="results of the long suite")
    add("--results", type=Path, default=ROOT / "out" / results, help="folder of results")
    add("--document", type=Path, default=DOCUMENT, help="Markdown file that gets the numbers")
    add("--jobs", type=int, default=2, help="processes at once")
    return parser


def batches(kept: Path) -> list[Path]:
    """Folders of people whose recordings and artifacts were kept."""
    return [path.parent for path in sorted(kept.glob("batch-*/truth.json"))]


def for_each(work: Callable[[Any], None], asked: Sequence[Any], jobs: int) -> None:
    """Ask of every person in a process of its own."""
    with ProcessPoolExecutor(jobs, max_tasks_per_child=1) as pool:
        for _ in tqdm(pool.map(work, asked), total=len(asked), unit="person"):
            pass


def unit_of_person(batch: Path, name: str) -> Unit:
    """The stage that diagnoses a person."""
    opened = open_study(batch / "study", batch / "out", (name,), None)
    (stage,) = (one for one in stages_named("diagnose") if one.level == "participant")
    (participant,) = opened.study.participants
    return Unit(stage, opened.study, batch / "out", opened.config, participant, None)


def evidence_of_person(unit: Unit) -> Evidence:
    """Of all moving trials."""
    skeleton = load_skeleton(unit.config.skeleton)
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    looked_at = moving_trials(unit, person, prior_of(unit, person))
    return together(tuple(one.evidence for one in looked_at if one.evidence is not None))
