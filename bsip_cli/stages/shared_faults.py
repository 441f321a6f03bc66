"""What persons and laboratories tell of shared faults, between tables and arrays."""

from __future__ import annotations

from collections.abc import Iterable

import pandas as pd

from bsip_cli.diagnosis.laboratory import Pooled
from bsip_cli.diagnosis.shared_faults import Coordinate, Information
from bsip_cli.effects.effect import Parameter

_KEY = ("effect", "target", "parameter", "standing")


def coordinates_in(rows: pd.DataFrame) -> tuple[Coordinate, ...]:
    return tuple(Coordinate(*one) for one in rows[[*_KEY]].itertuples(index=False))


def information_in(rows: pd.DataFrame) -> Information:
    """Of one session's rows of ``laboratory-information``."""
    numbers = rows[["parameter", "unit", "most", "typical", "known_to"]].itertuples(index=False)
    return Information(
        coordinates_in(rows),
        tuple(Parameter(n, u, -most, most, t, known_to=k) for n, u, most, t, k in numbers),
        rows["trials"].to_numpy(),
        rows[[f"precision_{k}" for k in range(len(rows))]].to_numpy(),
        rows["pull"].to_numpy(),
    )


def pooled_in(rows: pd.DataFrame) -> Pooled:
    """Of one laboratory's rows of ``laboratory-sums``."""
    roots = rows.filter(regex=r"^root_").dropna(axis=1)
    return Pooled(
        coordinates_in(rows),
        rows[[f"precision_{k}" for k in range(len(rows))]].to_numpy(),
        rows["pull"].to_numpy(),
        rows["spread"].to_numpy(),
        roots.to_numpy(),
    )


def pooled_rows(laboratory: str, pooled: Pooled) -> Iterable[dict]:
    """Of ``laboratory-sums``, one for each number of a fault."""
    for k, one in enumerate(pooled.coordinates):
        yield {
            "laboratory": laboratory,
            "effect": one.effect,
            "target": one.target,
            "parameter": one.parameter,
            "standing": one.standing,
            "spread": pooled.spread[k],
            "pull": pooled.pull[k],
            **{f"precision_{j}": x for j, x in enumerate(pooled.precision[k])},
            **{f"root_{j}": x for j, x in enumerate(pooled.root[k])},
        }
