"""What the artifacts of a person's diagnosis say beside its rows: facts for ``extend``, limits."""

from __future__ import annotations

import pandas as pd

from bsip_cli.diagnosis.detection import limits_of
from bsip_cli.diagnosis.findings import Finding
from bsip_cli.diagnosis.held_out import FOLDS, values_without
from bsip_cli.diagnosis.intervals import bounds
from bsip_cli.diagnosis.rounds import Selection
from bsip_cli.diagnosis.together import BLOCK_S


def facts_of(selection: Selection, findings: tuple[Finding, ...]) -> dict:
    """The best score of each round and whether it was a cause, and the causes in full: their
    values from all data and from each fold's training blocks, for ``extend``, and the bound of
    Cramér and Rao on what is reported."""
    evidence = selection.signatures.evidence
    rounds = [
        {"best": max((t.score for t in one.tried), default=0.0), "kept": one.kept is not None}
        for one in selection.rounds
    ]
    verdicts = {
        (one.effect, one.target, one.trials): one.verdict
        for one in findings
        if one.verdict != "rejected"
    }
    causes = []
    unseen = values_without(evidence, selection.fit)
    for number, (one, folds) in enumerate(zip(selection.fit.explanations, unseen, strict=True)):
        trials = tuple(evidence.trials[t].name for t in one.place.trials)
        if (one.effect.name, one.target, trials) not in verdicts:
            continue  # something else in its trials is far louder
        causes.append(
            {
                "effect": one.effect.name,
                "target": one.target,
                "trials": list(trials),
                "verdict": verdicts[one.effect.name, one.target, trials],
                "values": one.values.tolist(),
                "folds": folds,
                "bounds": bounds(evidence, selection.fit, number),
            }
        )
    blocks = {
        one.name: {
            "first": evidence.first_block(t),
            "start_s": float(one.rows_s()[0]),
        }
        for t, one in enumerate(evidence.trials)
    }
    return {
        "trials": [one.name for one in evidence.trials],
        "rounds": rounds,
        "causes": causes,
        "block_s": BLOCK_S,
        "folds": FOLDS,
        "blocks": blocks,
    }


def detection_rows(selection: Selection) -> pd.DataFrame:
    """The ``detection`` artifact: the smallest size of every cause that would have been found."""
    trials = selection.signatures.evidence.trials
    rows = [
        {
            "effect": limit.place.candidate.effect.name,
            "target": limit.place.candidate.target,
            "parameter": limit.parameter,
            "unit": limit.unit,
            "limit": limit.size,
            "trials": ", ".join(trials[t].name for t in limit.place.trials),
        }
        for limit in limits_of(selection)
    ]
    return pd.DataFrame(rows)
