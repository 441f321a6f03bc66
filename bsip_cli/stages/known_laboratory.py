"""What a person's diagnosis knows of plates, clock and vertical from the others recorded there, and
the tables that hold what persons and laboratories show."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter

import numpy as np
import pandas as pd

from bsip_cli.diagnosis.error_model import TrialErrors
from bsip_cli.diagnosis.findings import Finding, interval_words
from bsip_cli.diagnosis.laboratory import Pooled
from bsip_cli.diagnosis.shared_faults import (
    OF_A_LABORATORY,
    Coordinate,
    Information,
    shared_targets,
)
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.effect import Number, Parameter
from bsip_cli.effects.plates import ALL, PlateRotation, PlateTranslation
from bsip_cli.running.unit import Unit
from bsip_cli.stages.trial_scene import cause_record
from bsip_cli.statistics.samples import Z95

_KEY = ("effect", "target", "parameter", "standing")
_ROUNDING = 1e-10  # of the largest variance
_FAULTS = {one.name for one in OF_A_LABORATORY}


@dataclass(frozen=True, eq=False)
class Known:
    """coordinates (C,), mean (C,) and root (C, C) of the covariance of the sizes [typical] by all
    other persons; rows : of the ``laboratory`` table, by all; own : size and standard deviation
    [typical] of each by this person's recordings in motion alone."""

    coordinates: tuple[Coordinate, ...]
    mean: np.ndarray
    root: np.ndarray
    rows: pd.DataFrame
    own: Mapping[Coordinate, tuple[float, float]]

    def findings(self, trials: Sequence[TrialErrors]) -> Iterator[Finding]:
        """What the laboratory was found to have, in the trials on whose plates it is."""
        named = self.rows[self.rows["verdict"] == "named"]
        for (name, target), rows in named.groupby(["effect", "target"], sort=False):
            effect, first = EFFECTS[str(name)], rows.iloc[0]
            held = [one for one in trials if str(target) in shared_targets(effect, one.scene)]
            if held:
                columns = ["parameter", "unit", "estimate", "ci_low", "ci_high"]
                numbers = tuple(Number(*one) for one in rows[columns].itertuples(index=False))
                words = effect.words(held[0].scene, str(target), rows["estimate"].to_numpy())
                persons, probability = int(first["persons"]), float(first["probability"])
                known = f"; this is known from the laboratory ({persons} persons)"
                own = self._measured_here(effect.parameters(held[0].scene, str(target)), rows)
                closing = interval_words(numbers) + known + _own_words(own, rows)
                what = effect.name, str(target), tuple(one.name for one in held), numbers, words
                sure, of = (1 - probability, probability), "laboratory"
                yield Finding(*what, *sure, scope=of, persons=persons, own=own, closing=closing)

    def _measured_here(self, parameters: Sequence[Parameter], rows: pd.DataFrame) -> Number | None:
        """A fault's largest number by this person's recordings; None where they say nothing."""
        sizes = dict(zip(rows["parameter"], rows["estimate"], strict=True))
        first = rows.iloc[0]
        known = [
            (abs(sizes[p.name]) / p.typical, p, self.own[at])
            for p in parameters
            if (at := Coordinate(first["effect"], first["target"], p.name)) in self.own
        ]
        if not known:
            return None
        _, parameter, (mean, sd) = max(known, key=itemgetter(0))
        ends = [parameter.typical * x for x in (mean, mean - Z95 * sd, mean + Z95 * sd)]
        return Number(parameter.name, parameter.unit, *ends)

    def causes(self, trials: Sequence[TrialErrors]) -> Iterator[dict[str, object]]:
        """The same for ``extend``: in full, and of the same sizes for every fold; of single plates
        and the clock as the others alone show them, who have no other fault."""
        sizes = dict(zip(self.coordinates, self._given_no_other().tolist(), strict=True))
        for found in self.findings(trials):
            parameters = EFFECTS[found.effect].parameters(trials[0].scene, found.target)
            mine = []
            for p, x in zip(parameters, found.numbers, strict=True):
                at = Coordinate(found.effect, found.target, p.name)
                mine.append(sizes.get(at, x.value / p.typical) * p.typical)
            yield cause_record(found.effect, found.target, found.trials, np.array(mine))

    def _given_no_other(self) -> np.ndarray:
        """(C,) likeliest sizes [typical] where all but what is named is zero: some faults offset
        each other, and one of them alone, of the size that it has beside the rest, is none."""
        named = self.rows[self.rows["verdict"] == "named"]
        faults = set(zip(named["effect"], named["target"], strict=True))
        if (PlateRotation.name, ALL) in faults:  # about a middle, so each plate is shifted too
            faults.add((PlateTranslation.name, ALL))
        of_all = [" ".join([ALL, *x.target.split(" ")[1:]]) for x in self.coordinates]
        pairs = zip(self.coordinates, of_all, strict=True)  # all fz of 1 fz
        kept = np.array([bool(faults & {(x.effect, x.target), (x.effect, a)}) for x, a in pairs])
        covariance = self.root @ self.root.T
        across, rest = covariance[np.ix_(kept, ~kept)], covariance[np.ix_(~kept, ~kept)]
        inverse = np.linalg.pinv(rest, rcond=_ROUNDING, hermitian=True)
        mean = np.where(kept, self.mean, 0.0)
        mean[kept] -= across @ inverse @ self.mean[~kept]
        return mean

    def limits(self, own: pd.DataFrame) -> pd.DataFrame:
        """Of ``detection``, those of the laboratory where all persons would show less."""
        key = ["effect", "target", "parameter"]
        theirs = self.rows.set_index(key)["limit"]
        both = pd.Index(own[key].itertuples(index=False, name=None))
        smaller = np.fmin(own["limit"].to_numpy(), theirs.reindex(both).to_numpy())
        together = own["trials"].str.count(",")
        return own.assign(limit=np.where(together == together.max(), smaller, own["limit"]))


def _own_words(own: Number | None, rows: pd.DataFrame) -> str:
    """Whether this person's recordings show a fault too."""
    if own is None:
        return ""
    (known,) = rows.loc[rows["parameter"] == own.name, "estimate"]
    is_shown = own.low * own.high > 0 and own.value * known > 0
    how = "also show it" if is_shown else "leave it open"
    interval = f"{own.size()}, 95 % interval {own.interval()}"
    return f", and this person's recordings alone {how}: {interval}"


def known_laboratory(unit: Unit) -> Known | None:
    """None where no others were recorded there, or where nobody has asked."""
    if not unit.has("laboratory-information", "laboratory-sums", "laboratory"):
        return None
    everybody = unit.facts("laboratory-sums")["persons"]
    mine = {number: people for number, people in everybody.items() if people.get(unit.name)}
    if len(mine) != 1 or any(len(people) < 2 for people in mine.values()):
        return None  # of several laboratories, or alone
    (number,) = mine
    own = unit.read("laboratory-information").groupby("session", sort=False)
    sessions = [information_in(rows) for _, rows in own]
    pooled = pooled_in(unit.read("laboratory-sums", laboratory=[number]))
    posterior = pooled.without(sessions).posterior()
    at = [k for k, one in enumerate(pooled.coordinates) if one.effect in _FAULTS]
    table = unit.read("laboratory", laboratory=[number], scope=["laboratory"])
    covariance = posterior.covariance[np.ix_(at, at)]
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    coordinates = tuple(pooled.coordinates[k] for k in at)
    return Known(coordinates, posterior.mean[at], root, table, alone(sessions))


def alone(sessions: Sequence[Information]) -> dict[Coordinate, tuple[float, float]]:
    """Size and standard deviation of what a person's sessions say in motion, each as large as
    usual before the data; where the data say nothing there is none."""
    parameters = {
        x: p for one in sessions for x, p in zip(one.coordinates, one.parameters, strict=True)
    }
    known = sorted(x for x in parameters if not x.standing)
    precision, pull = np.eye(len(known)), np.zeros(len(known))
    for one in sessions:
        mine = [k for k, x in enumerate(one.coordinates) if not x.standing]
        at = [known.index(one.coordinates[k]) for k in mine]
        precision[np.ix_(at, at)] += one.precision[np.ix_(mine, mine)]
        pull[at] += one.pull[mine]
    covariance = np.linalg.inv(precision)
    model = np.array([parameters[x].known_to / parameters[x].typical for x in known])
    sd = np.sqrt(np.diagonal(covariance) + model**2)
    sizes = zip(known, covariance @ pull, sd, np.diagonal(precision) > 1.0, strict=True)
    return {one: (float(mean), float(s)) for one, mean, s, is_there in sizes if is_there}


# --- tables ---------------------------------------------------------------------------------------


def coordinates_in(rows: pd.DataFrame) -> tuple[Coordinate, ...]:
    """What each row is about, by its columns ``_KEY``, in the order of the rows."""
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


def session_rows(session: str, information: Information) -> Iterator[dict[str, object]]:
    """Of ``laboratory-information``, one for each number of a fault."""
    numbers = zip(information.coordinates, information.parameters, information.trials, strict=True)
    for k, (one, parameter, trials) in enumerate(numbers):
        row = {"session": session, **vars(one), "trials": int(trials), "pull": information.pull[k]}
        row |= {name: getattr(parameter, name) for name in ("unit", "typical", "most", "known_to")}
        yield row | {f"precision_{j}": x for j, x in enumerate(information.precision[k])}


def pooled_in(rows: pd.DataFrame) -> Pooled:
    """Of one laboratory's rows of ``laboratory-sums``."""
    roots = rows.filter(regex=r"^root_").dropna(axis=1)
    precision = rows[[f"precision_{k}" for k in range(len(rows))]].to_numpy()
    pull, spread = rows["pull"].to_numpy(), rows["spread"].to_numpy()
    return Pooled(coordinates_in(rows), precision, pull, spread, roots.to_numpy())


def pooled_rows(laboratory: str, pooled: Pooled) -> Iterable[dict[str, object]]:
    """Of ``laboratory-sums``, one for each number of a fault."""
    for k, one in enumerate(pooled.coordinates):
        known = {"spread": pooled.spread[k], "pull": pooled.pull[k]}
        for name, row in (("precision", pooled.precision[k]), ("root", pooled.root[k])):
            known |= {f"{name}_{j}": x for j, x in enumerate(row)}
        yield {"laboratory": laboratory, **vars(one), **known}
