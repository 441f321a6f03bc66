"""What the artifacts of a person's diagnosis say beside its rows: facts for ``extend``, limits."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.diagnosis.detection import limits_of
from bsip_cli.diagnosis.evenness import plain
from bsip_cli.diagnosis.fault_scores import Library
from bsip_cli.diagnosis.fault_search import Found, Verdict
from bsip_cli.diagnosis.findings import Finding
from bsip_cli.diagnosis.held_out import BLOCK_S, FOLDS, HeldOut, first_blocks, start_s


def facts_of(found: Found, held: HeldOut, findings: tuple[Finding, ...]) -> dict:
    """The faults in full: their values from all data and from each fold's training blocks, for
    ``extend``, and the standard deviation of what is reported if the error's model is exact."""
    session = found.fit.session
    said = {(f.effect, f.target, f.trials): f.verdict for f in findings if f.verdict != "rejected"}
    causes = []
    for one in found.verdicts:
        fault = found.fit.faults[one.number]
        trials = tuple(session.trials[t].name for t in fault.trials)
        key = plain(fault.effect).name, fault.target, trials
        if key in said:
            causes.append(
                {
                    "effect": key[0],
                    "target": fault.target,
                    "trials": list(trials),
                    "verdict": said[key],
                    "values": fault.values.tolist(),
                    "folds": held.values(one.number).tolist(),
                    "bounds": _bounds(found, one),
                }
            )
    starts = first_blocks(session)
    return {
        "trials": [one.name for one in session.trials],
        "causes": causes,
        "block_s": BLOCK_S,
        "folds": FOLDS,
        "blocks": {
            one.name: {"first": starts[t], "start_s": start_s(session, t)}
            for t, one in enumerate(session.trials)
        },
    }


_STEP = 1e-3  # of the typical size


def _bounds(found: Found, verdict: Verdict) -> dict[str, float]:
    """Standard deviation of all that a fault reports, by the slope of that."""
    fit, one = found.fit, found.fit.faults[verdict.number]
    session, typical = fit.session, one.typical(found.fit.session)
    mine = fit.coefficients(verdict.number)
    slopes = []
    for step in _STEP * np.diag(typical):
        ahead, behind = (
            np.array([x for *_, x in one.with_values(session, v).reported(session)])
            for v in (one.values + step, one.values - step)
        )
        slopes.append((ahead - behind) / (2 * _STEP))
    slope = np.stack(slopes, axis=1)
    spread = np.sqrt(np.einsum("ij,jk,ik->i", slope, fit.covariance[mine, mine], slope))
    names = [name for name, *_ in one.reported(session)]
    return dict(zip(names, spread.tolist(), strict=True))


def detection_rows(found: Found, library: Library, named_from: float) -> pd.DataFrame:
    """The ``detection`` artifact: the smallest size of every fault that would have been named."""
    session = found.fit.session
    rows = [
        {
            "effect": limit.place.candidate.effect.name,
            "target": limit.place.candidate.target,
            "parameter": limit.parameter,
            "unit": limit.unit,
            "limit": limit.size,
            "trials": ", ".join(session.trials[t].name for t in limit.place.trials),
        }
        for limit in limits_of(session, library, found, named_from)
    ]
    return pd.DataFrame(rows)
