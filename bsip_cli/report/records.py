"""All that is known of one participant, as the reports read it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.person import Person
from bsip_cli.report.blocks import Block, Grid, Heading, Paragraph, Terms, first_of
from bsip_cli.report.causes import Candidate, candidates_of, causes_of
from bsip_cli.report.words import EXTENDED, labelled, method_rank, trial_label
from bsip_cli.statistics.methods import MEASURED, OM, RM, is_extended


@dataclass(frozen=True)
class Origin:
    """Where one artifact comes from: its unit (trial label, or empty), stage and provenance."""

    unit: str
    stage: str
    bsip_version: str
    libraries: dict[str, str]
    options: dict[str, Any]
    inputs: dict[str, str]
    messages: tuple[str, ...]


@dataclass(frozen=True)
class Refusal:
    """What a stage would not do."""

    unit: str
    stage: str
    sentence: str


@dataclass(frozen=True, eq=False)
class TrialRecord:
    """One trial; a table is None where a stage did not make it."""

    stem: str
    task: str
    role: str
    quality: pd.DataFrame | None
    kinematics: pd.DataFrame | None
    residuals: pd.DataFrame | None
    reconstruction: pd.DataFrame | None
    fit: pd.DataFrame | None
    marker_events: pd.DataFrame | None = None
    joint_moments: pd.DataFrame | None = None
    joint_peaks: pd.DataFrame | None = None

    @property
    def label(self) -> str:
        return trial_label(self.stem)

    def markers_mm(self) -> float:
        """Root mean square distance of the markers from the model; NaN where it is not known."""
        frame = self.kinematics
        rms = pd.Series(dtype=float) if frame is None else frame["marker_rms_m"].astype(float)
        return 1e3 * float(np.sqrt((rms**2).mean()))  # of those that are known


@dataclass(frozen=True, eq=False)
class ParticipantRecord:
    """One participant; ``facts`` is the single row of the ``person`` artifact, ``outside`` why the
    table does not hold for this person, if so, ``made_on`` the day
    of the report, ``recorded_on`` those of the recordings as the study states them, ``loads`` the
    known loads as (trial label, words). ``diagnosis``, ``detection``, ``budget``, ``gains`` and
    ``changes`` (of a model extended by what was found), and ``choice`` are None where their stages
    have not run. ``defaults`` : every option's shipped value."""

    id: str
    facts: pd.Series
    bsip: pd.DataFrame
    excitation: pd.DataFrame
    identification: pd.DataFrame
    body: Person
    trials: tuple[TrialRecord, ...]
    refusals: tuple[Refusal, ...]
    origins: tuple[Origin, ...]
    defaults: Mapping[str, Any]
    made_on: str
    outside: str = ""
    recorded_on: tuple[str, ...] = ()
    loads: tuple[tuple[str, str], ...] = ()
    diagnosis: pd.DataFrame | None = None
    detection: pd.DataFrame | None = None
    budget: pd.DataFrame | None = None
    gains: pd.DataFrame | None = None
    changes: pd.DataFrame | None = None
    choice: pd.DataFrame | None = None

    @cached_property
    def causes(self) -> tuple[tuple[Candidate, ...], ...]:
        """What the diagnosis found; nothing where none was made."""
        return () if self.diagnosis is None else causes_of(candidates_of(self.diagnosis))

    def body_weight(self) -> float:
        return float(self.facts["mass_kg"]) * GRAVITY_M_S2

    def method(self, method: str) -> pd.DataFrame:
        """Rows of ``bsip`` of one method, in the skeleton's order of segments."""
        rows = self.bsip[self.bsip["method"] == method].set_index("segment")
        return rows.reindex([s for s in self.body.skeleton.segments if s in rows.index])

    def identification_trials(self) -> tuple[TrialRecord, ...]:
        """Trials whose samples identified the parameters."""
        named = {stem for row in self.identification["trials"] for stem in str(row).split(", ")}
        return tuple(trial for trial in self.trials if trial.stem in named)

    def decided_words(self) -> str:
        """``, data decide 9 of 150 parameters``; empty where that is not known."""
        known = self.identification.query("method == @OM")["decided"].dropna()
        whole = 10 * len(self.method(OM))
        return "".join(f", data decide {n:.0f} of {whole} parameters" for n in known)

    def roles_of(self, trial: TrialRecord) -> tuple[str, ...]:
        """What it served for, whatever its task: keys of the roles in the texts."""
        known = {
            "static": trial.stem == self.facts["calibration_trial"],
            "sequence": trial in self.identification_trials(),
        }
        validates = trial in self.moving_trials() and trial.fit is not None
        return tuple(role for role, is_so in known.items() if is_so) or ("validation",) * validates

    def moving_trials(self) -> tuple[TrialRecord, ...]:
        """Those in which somebody moves: quiet stance distinguishes no methods."""
        return tuple(trial for trial in self.trials if trial.role != "static")

    def use(self, movement: str = "all") -> str:
        """The method whose parameters are to be used, in one movement or mostly; the table's where
        nothing was chosen."""
        if self.choice is None or self.choice.empty:
            return RM
        chosen = dict(zip(self.choice["movement"], self.choice["use"], strict=True))
        return str(chosen.get(movement, self.choice["use"].iloc[0]))

    def option(self, section: str, name: str) -> float:
        """An option that a stage was run with, or as shipped."""
        ran = [o.options[section] for o in self.origins if name in o.options.get(section, {})]
        return float((ran or [self.defaults[section]])[0][name])


def with_all_causes(table: pd.DataFrame) -> pd.DataFrame:
    """Of the methods OM+<effect>... the last, which contains all causes, as `EXTENDED`."""
    names = [name for name in table["method"].unique() if is_extended(name)]
    kept = table[~table["method"].isin(names[:-1])]
    return kept.assign(method=kept["method"].replace(names[-1:], EXTENDED)) if names else kept


def signals_of(reconstruction: pd.DataFrame, column: str) -> dict[str, np.ndarray]:
    """Label of the method -> values over time; ``measured`` first, all on its clock."""
    once = reconstruction.drop_duplicates(["method", "time_s"])
    wide = once.pivot(index="time_s", columns="method", values=column)
    wide = wide.reindex(clock_of(reconstruction))
    return {name: wide[name].to_numpy() for name in sorted(map(str, wide), key=method_rank)}


def measured_of(reconstruction: pd.DataFrame) -> pd.DataFrame:
    """The measured rows, one for each time."""
    return reconstruction[reconstruction["method"] == MEASURED].drop_duplicates("time_s")


def clock_of(reconstruction: pd.DataFrame) -> np.ndarray:
    """Times [s] of the measured rows."""
    return measured_of(reconstruction)["time_s"].to_numpy()


def flags_of(reconstruction: pd.DataFrame, column: str) -> np.ndarray:
    """A flag of the measured rows over time."""
    return measured_of(reconstruction)[column].to_numpy(dtype=bool)


# --- how it was made ------------------------------------------------------------------------------

_HASH_DIGITS = 12
_MOST_WARNINGS = 6


@dataclass(frozen=True)
class HowMade:
    """What made many artifacts, without what they share again and again.

    messages : stage, unit and text. options, versions : name -> all values; files : recordings and the like, name -> SHA-256.
    """

    options: dict[str, set[str]] = field(default_factory=dict)
    versions: dict[str, set[str]] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)
    messages: dict[tuple[str, str, str], None] = field(default_factory=dict)

    @classmethod
    def of(cls, origins: Iterable[Origin]) -> HowMade:
        made = cls()
        for origin in origins:
            for name, value in flat(origin.options):
                made.options.setdefault(name, set()).add(_as_text(value))
            for name, version in {"bsip": origin.bsip_version, **origin.libraries}.items():
                made.versions.setdefault(name, set()).add(version)
            for name, digest in origin.inputs.items():
                if "." in name and not name.endswith(".parquet"):  # no artifact, no person's all
                    made.files[name] = digest
            for text in origin.messages:
                made.messages[origin.stage, origin.unit, text] = None
        return made

    def number(self, option: str, otherwise: float) -> float:
        """An option that was run with."""
        return float(next(iter(self.options.get(option, ())), otherwise))


def how_made(made: HowMade, defaults: Mapping[str, Any]) -> Iterator[Block]:
    """Warnings, versions, options that differ from the shipped ones, and the recordings with the
    start of their hashes."""
    of_the_person_first = sorted(made.messages, key=lambda one: bool(one[1]))
    said = [f"{stage}: {labelled(text)}" for stage, _, text in of_the_person_first]
    yield Heading("Warnings")
    nothing = Paragraph("No stage had anything to warn of.")
    yield first_of(said, _MOST_WARNINGS, "warnings") if said else nothing
    shipped = {name: {_as_text(value)} for name, value in flat(defaults)}
    changed = {n: v for n, v in made.options.items() if n in shipped and v != shipped[n]}
    yield Heading("Options that differ from the shipped ones")
    differ = Terms(tuple((n, " / ".join(sorted(v))) for n, v in sorted(changed.items())))
    yield differ if changed else Paragraph("None.")
    versions = (f"{name} {' / '.join(sorted(v))}" for name, v in sorted(made.versions.items()))
    yield from (Heading("Versions"), Paragraph(", ".join(versions)))
    if made.files:
        rows = tuple((name, made.files[name][:_HASH_DIGITS]) for name in sorted(made.files))
        yield Grid(("file read", "SHA-256 (start)"), rows, words=2)


def flat(options: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Entries of nested options as ``section.name``."""
    for name, value in options.items():
        if isinstance(value, Mapping):
            yield from flat(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", value


def _as_text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
