"""How much of what the true cause would gain the found one gains.

Run from the checkout after the long blind suite with ``--keep``. In every recording in which a
hidden effect was found at its place, the gain on blocks held out, with the sizes that the other
blocks gave, stands beside the gain of the very effect that was hidden, in the same coordinates.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from bsip_cli.diagnosis.cause import Cause
from bsip_cli.diagnosis.explanation import (
    Explanation,
    explanation_of,
    fit_together,
    left_by,
    with_noise_beside,
)
from bsip_cli.diagnosis.held_out import gain_of
from bsip_cli.diagnosis.together import Evidence
from bsip_cli.stages.found_causes import causes_of
from tests.blind.blind_evidence import (
    batches,
    evidence_of_person,
    for_each,
    parser_of_kept,
    unit_of_person,
)
from tests.blind.blind_running import Recorded, write_atomically
from tests.blind.blind_tables import between_marks, markdown
from tests.blind.blind_truth import Expected, expected

MARK = "tests/blind/true_gains.py"


def main(arguments: Sequence[str] | None = None) -> None:
    options = parsed(arguments)
    asked = [
        (batch, name, options.results)
        for batch in batches(options.kept)
        for name in people_of(batch)
    ]
    if not asked:
        raise SystemExit(f"{options.kept} holds no kept person in whom something is hidden")
    for_each(gains_of_person, asked, options.jobs)
    between_marks(options.document, MARK, summary(options.results))


def parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    return parser_of_kept(__doc__, "true_gains").parse_args(arguments)


def recorded_in(batch: Path) -> list[Recorded]:
    return [Recorded.from_record(one) for one in json.loads((batch / "truth.json").read_text())]


def people_of(batch: Path) -> list[str]:
    """In whom something is hidden."""
    return sorted({one.participant for one in recorded_in(batch) if one.truth["effects"]})


def gains_of_person(asked: tuple[Path, str, Path]) -> None:
    """A file with the gains of all causes found in a person."""
    batch, name, results = asked
    path = results / f"{batch.name}-{name}.json"
    if path.exists():
        return
    unit = unit_of_person(batch, name)
    causes = causes_of(unit)
    found = [(cause, true) for cause in causes for true in _hidden(batch, name, cause)]
    gains = list(_gains(evidence_of_person(unit), causes, found)) if found else []
    write_atomically(path, json.dumps(gains))


def _hidden(batch: Path, name: str, cause: Cause) -> Iterator[Expected]:
    """What was hidden in a trial of a cause and is what the cause says, at its place."""
    for one in recorded_in(batch):
        stems = set(one.stems) & set(cause.trials)
        if one.participant != name or not stems:
            continue
        stem = max(stems, key=lambda s: one.truth["trials"][s]["duration_s"])
        for record in one.truth["effects"]:
            true = expected(record, one.truth["trials"][stem])
            if true.effect == cause.effect.name and true.same_target(cause.target):
                yield true
                return


def _gains(
    evidence: Evidence, causes: Sequence[Cause], found: Sequence[tuple[Cause, Expected]]
) -> Iterator[dict]:
    """Percent that each found cause, and the truth in its stead, takes off the squared residual."""
    names = [one.name for one in evidence.trials]
    known = {id(cause): _explanation(evidence, names, cause, cause.values) for cause in causes}
    evidence = with_noise_beside(evidence, tuple(known.values()))
    for cause, true in found:
        names_of = [p.name for p in known[id(cause)].parameters(evidence)]
        if not set(names_of) <= set(true.values):
            continue  # the truth has no such numbers: a phase, a share
        others = tuple(one for key, one in known.items() if key != id(cause))
        before = fit_together(evidence, others)
        after = fit_together(evidence, (*others, known[id(cause)]))
        values = np.array([true.values[name] for name in names_of])
        truth = _explanation(evidence, names, cause, values)
        trials = truth.place.trials
        held_out = gain_of(evidence, trials, before.residual, after.residual, after.tangent)
        saved = before.residual**2 - left_by(evidence, (*others, truth)) ** 2
        best = 100 * sum(float(saved[evidence.rows(t)].sum()) for t in trials) / held_out.before
        yield {"effect": cause.effect.name, "found": held_out.percent, "truth": best}


def _explanation(
    evidence: Evidence, names: Sequence[str], cause: Cause, values: np.ndarray
) -> Explanation:
    trials = tuple(names.index(stem) for stem in cause.trials)
    scene = evidence.trials[trials[0]].scene
    return explanation_of(cause.effect, cause.target, values, scene, trials)


def summary(results: Path) -> str:
    """Per effect: median gains, and of their ratio the median and the least of ten."""
    rows = [row for path in sorted(results.glob("*.json")) for row in json.loads(path.read_text())]
    table = pd.DataFrame(rows, columns=["effect", "found", "truth"])
    table["share"] = table["found"] / table["truth"]
    groups = table.groupby("effect")
    told = groups.median(numeric_only=True)
    told.insert(0, "cases", groups.size())
    told["worst tenth"] = groups["share"].quantile(0.1)
    told.columns = [
        "cases",
        "gain of what was found [%]",
        "gain of the truth [%]",
        "share",
        "share, worst tenth",
    ]
    whole = table["share"].median() if len(table) else np.nan
    return f"{markdown(told)}\n\nAll {len(table)} cases: {whole:.3f} of the truth's gain (median)."


if __name__ == "__main__":
    main()
