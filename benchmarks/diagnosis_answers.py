"""What a diagnosis answered, read from its artifacts into plain numbers and text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

NOTHING = "none"
GRAVITY_M_S2 = 9.81
COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass(frozen=True)
class Found:
    """One cause that is named or in a class.

    values : by parameter its estimate, and the ends of its interval.
    """

    effect: str
    target: str
    class_id: str
    trials: tuple[str, ...]
    p_value: float
    gain_percent: float
    values: dict[str, tuple[float, float, float]]
    sentence: str

    @property
    def key(self) -> tuple[str, str]:
        return self.effect, self.target

    def estimates(self) -> dict[str, float]:
        return {name: value[0] for name, value in self.values.items()}


@dataclass(frozen=True)
class Balance:
    """Mean force in a trial's valid frames, measured and simulated by RM, and for how long."""

    trial: str
    seconds: float
    force_N: tuple[float, float, float]
    plates_kg: float
    simulated_N: tuple[float, float, float]


@dataclass(frozen=True)
class Answer:
    """Of one case. refused : why nothing could be injected or diagnosed. place : the target of
    the injected cause as the diagnosis should print it.

    swaps : pairs of labels that ``ik`` corrected. gains : per component what ``extend`` gained on
    data held out, with its interval [%]. limits : by effect, target and parameter (parted by bars)
    the least size that some trial would show. said : warnings of the stages.
    """

    refused: str = ""
    place: str = ""
    cpu_s: float = 0.0
    found: tuple[Found, ...] = ()
    swaps: tuple[str, ...] = ()
    gains: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    balances: tuple[Balance, ...] = ()
    limits: dict[str, float] = field(default_factory=dict)
    said: tuple[str, ...] = ()

    @classmethod
    def read(cls, stored: Mapping[str, Any]) -> Answer:
        """From JSON."""
        found = tuple(Found(**{**one, "trials": tuple(one["trials"])}) for one in stored["found"])
        balances = tuple(Balance(**one) for one in stored["balances"])
        others = {"found": found, "balances": balances}
        for name in ("swaps", "said"):
            others[name] = tuple(stored[name])
        return cls(**{**stored, **others})

    def limit(self, effect: str, target: str, parameter: str) -> float:
        """Least size that would be seen; NaN where that is not stated."""
        return self.limits.get(f"{effect}|{target}|{parameter}", float("nan"))

    def mean_gain_percent(self) -> float:
        """Mean of the gains of the six components; NaN where nothing was extended."""
        gains = [self.gains[c][0] for c in COMPONENTS if c in self.gains]
        return float(np.mean(gains)) if gains else float("nan")

    def classes(self) -> list[list[Found]]:
        """Causes that stand together, in the order of the diagnosis."""
        groups: dict[str, list[Found]] = {}
        for number, one in enumerate(self.found):
            groups.setdefault(one.class_id or f"#{number}", []).append(one)
        return list(groups.values())


def answer_of(folder: Path, cpu_s: float, said: list[str]) -> Answer:
    """Everything that one participant's artifacts say."""
    file = folder / f"{folder.name}_diagnosis.parquet"
    if not file.exists():
        return Answer(refused=said[0] if said else "no diagnosis", cpu_s=cpu_s, said=tuple(said))
    rows = pd.read_parquet(file)
    refused = ""
    if "no movement can be diagnosed" in " ".join(said) and set(rows["effect"]) <= {NOTHING}:
        refused = "no trial has motion with every contact on a plate"
    return Answer(
        refused=refused,
        cpu_s=cpu_s,
        found=_found(rows),
        swaps=_swaps(folder),
        gains=_gains(folder / f"{folder.name}_gain.parquet"),
        balances=_balances(folder),
        limits=_limits(folder / f"{folder.name}_detection.parquet"),
        said=tuple(said),
    )


def _found(rows: pd.DataFrame) -> tuple[Found, ...]:
    kept = rows[(rows["verdict"] != "rejected") & (rows["effect"] != NOTHING)]
    return tuple(_one(group) for _, group in kept.groupby("rank", sort=True))


def _one(rows: pd.DataFrame) -> Found:
    first = rows.iloc[0]
    numbers = zip(
        rows["parameter"], rows[["estimate", "ci_low", "ci_high"]].to_numpy(), strict=True
    )
    return Found(
        effect=str(first["effect"]),
        target=str(first["target"] or ""),
        class_id=str(first["class_id"] or ""),
        trials=tuple(_task(stem) for stem in str(first["trials"]).split(", ")),
        p_value=float(first["p_value"]),
        gain_percent=float(first["gain_percent"]),
        values={str(name): (float(a), float(b), float(c)) for name, (a, b, c) in numbers},
        sentence=str(first["sentence"]),
    )


def _task(stem: str) -> str:
    return stem.partition("_task-")[2]


def _swaps(folder: Path) -> tuple[str, ...]:
    pairs = []
    for path in sorted(folder.glob("*_marker-events.parquet")):
        events = pd.read_parquet(path)
        swaps = events[(events["kind"] == "swap") & events["put_right"]]
        pairs += [f"{one.marker}+{one.partner}" for one in swaps.itertuples()]
    return tuple(pairs)


def _gains(file: Path) -> dict[str, tuple[float, float, float]]:
    if not file.exists():
        return {}
    table = pd.read_parquet(file)
    numbers = table[["gain_percent", "ci_low", "ci_high"]].to_numpy(dtype=float)
    return {
        str(name): (float(a), float(b), float(c))
        for name, (a, b, c) in zip(table["component"], numbers, strict=True)
    }


def _limits(file: Path) -> dict[str, float]:
    table = pd.read_parquet(file)
    least = table.groupby(["effect", "target", "parameter"])["limit"].min()
    return {"|".join(key): float(limit) for key, limit in least.items()}


def _balances(folder: Path) -> tuple[Balance, ...]:
    return tuple(
        one
        for path in sorted(folder.glob("*_reconstruction.parquet"))
        if (one := _balance(path)) is not None
    )


def _balance(path: Path) -> Balance | None:
    """Mean forces over the valid frames: measured, and simulated by RM."""
    table = pd.read_parquet(path)
    table = table[table["valid"]]
    forces = {
        method: rows[["fx_N", "fy_N", "fz_N"]].to_numpy()
        for method, rows in table.groupby("method")
    }
    if "measured" not in forces or not len(forces["measured"]):
        return None
    times = table.loc[table["method"] == "measured", "time_s"].to_numpy()
    measured = np.nanmean(forces["measured"], axis=0)
    simulated = np.nanmean(forces.get("RM", forces["measured"]), axis=0)
    return Balance(
        _task(path.name.removesuffix("_reconstruction.parquet")),
        float(len(times) * np.median(np.diff(times))),
        _triple(measured),
        float(measured[2]) / GRAVITY_M_S2,
        _triple(simulated),
    )


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
