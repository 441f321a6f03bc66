"""How often a diagnosis raises an alarm where nothing is wrong: nulls redrawn by the hundred.

Run from the checkout after the long blind suite with ``--keep``. Every person of it with nothing
hidden keeps their movements; what the simulation lacks is drawn anew and diagnosed: the noise with
the spectrum that it has, its phases at random, and parameters, skeleton and skin as far off as the
diagnosis takes for usual. One result file per person; what is there is not done again.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from zlib import crc32

import numpy as np

from bsip_cli.diagnosis.evidence import TrialEvidence
from bsip_cli.diagnosis.findings import findings_of
from bsip_cli.diagnosis.loud_noise import noise_of, with_loud_noise
from bsip_cli.diagnosis.selection import select
from bsip_cli.diagnosis.signatures import Signatures, signatures_of
from bsip_cli.diagnosis.together import together
from bsip_cli.stages.diagnose import ASKED
from tests.blind.blind_evidence import (
    batches,
    evidence_of_person,
    for_each,
    parser_of_kept,
    unit_of_person,
)
from tests.blind.blind_running import Recorded, write_atomically
from tests.blind.blind_tables import between_marks, wilson

MARK = "tests/blind/redrawn_nulls.py"


def main(arguments: Sequence[str] | None = None) -> None:
    options = parsed(arguments)
    people = [(batch, name) for batch in batches(options.kept) for name in nulls_of(batch)]
    if not people:
        raise SystemExit(f"{options.kept} holds no kept person with nothing hidden")
    asked = [(batch, name, options.draws, options.results) for batch, name in people]
    for_each(redraw_person, asked, options.jobs)
    between_marks(options.document, MARK, summary(options.results))


def parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = parser_of_kept(__doc__, "redrawn")
    parser.add_argument("--draws", type=int, default=13, help="redrawn nulls per person")
    return parser.parse_args(arguments)


def nulls_of(batch: Path) -> list[str]:
    recorded = (Recorded.from_record(one) for one in json.loads((batch / "truth.json").read_text()))
    return [one.participant for one in recorded if not one.truth["effects"]]


def redraw_person(asked: tuple[Path, str, int, Path]) -> None:
    """All draws of a person; a file with what each of them names."""
    batch, name, draws, results = asked
    path = results / f"{batch.name}-{name}.json"
    if path.exists():
        return
    signatures = signatures_of_person(batch, name)
    rng = np.random.default_rng(crc32(path.stem.encode()))
    named = [redrawn_alarms(signatures, rng) for _ in range(draws)]
    write_atomically(path, json.dumps(named))


def signatures_of_person(batch: Path, name: str) -> Signatures:
    """Evidence and candidates of all moving trials, as ``bsip diagnose`` has them."""
    return signatures_of(evidence_of_person(unit_of_person(batch, name)), ASKED)


def redrawn_alarms(signatures: Signatures, rng: np.random.Generator) -> list[str]:
    """What is named of a redrawn null, in which trials."""
    trials = signatures.evidence.trials
    shared = rng.standard_normal(trials[0].filtered.shared.shape[2])
    drawn = together(tuple(redrawn(one, shared, rng) for one in trials))
    selection = select(signatures.on(drawn), rng)
    found = findings_of(selection, rng)
    findings = with_loud_noise(selection, found)
    return [
        f"{one.effect} {one.target} ({len(one.trials)} trials)"
        for one in findings
        if one.verdict != "rejected"
    ]


def redrawn(one: TrialEvidence, shared: np.ndarray, rng: np.random.Generator) -> TrialEvidence:
    """The trial with another residual of the same kind; shared (p,) : what all trials err by."""
    filtered, spread = one.filtered, one.whitening.spread
    noise = with_random_phases(noise_of(one) / spread, rng) * spread
    own = filtered.own @ rng.standard_normal(filtered.own.shape[2])
    residual = noise + own + filtered.shared @ shared
    drawn = replace(one, filtered=replace(filtered, residual=residual))
    return drawn.with_noise_beside(np.zeros_like(residual))


def with_random_phases(courses: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Courses (n, c) with the same spectra, and the same phases between the columns."""
    spectrum = np.fft.rfft(courses, axis=0)
    turn = np.exp(2j * np.pi * rng.random(len(spectrum)))
    turn[0] = rng.choice([-1, 1])
    if len(courses) % 2 == 0:
        turn[-1] = rng.choice([-1, 1])
    return np.fft.irfft(spectrum * turn[:, None], len(courses), axis=0)


def summary(results: Path) -> str:
    """How many of all draws named anything, and what."""
    draws = [
        draw for path in sorted(results.glob("*.json")) for draw in json.loads(path.read_text())
    ]
    alarms = [draw for draw in draws if draw]
    low, high = wilson(len(alarms), len(draws))
    what = Counter(one.split(" (")[0] for draw in alarms for one in draw)
    named = "; ".join(f"{name} {count}" for name, count in what.most_common()) or "nothing"
    people = len(list(results.glob("*.json")))
    return (
        f"Of {len(draws)} redrawn nulls ({people} people) {len(alarms)} raise an alarm: "
        f"{len(alarms) / len(draws):.1%} ({low:.1%} to {high:.1%}). Named: {named}."
    )


if __name__ == "__main__":
    main()
