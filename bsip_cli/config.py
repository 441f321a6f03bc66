"""The options: defaults, then the study's, then the command line's; all faults named at once."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bsip_cli.errors import UsageError, did_you_mean
from bsip_cli.files.regular import read_toml, shipped

_MOST_FAULTS, _LONGEST_VALUE = 20, 80  # faults and characters that are reported


class Section(BaseModel):
    """A table of options: refuses unknown ones, NaN and infinity, and is never changed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Roles(Section):
    """Tasks that calibrate the skeleton, the first found serves, and those that identify."""

    static: tuple[str, ...]
    sequence: tuple[str, ...]


_MANY = 10_000  # frames, rounds or draws: more take days and change no digit
Count = Annotated[int, Field(ge=1, le=_MANY)]
Metre = Annotated[float, Field(ge=-2, le=2)]


class Load(Section):
    """A mass that is worn or carried, a point in the frame of its segment.

    position_m : in the segment's frame (X anterior, Y up, Z right), from the segment's origin.
    participants, tasks, runs : which trials carry it; empty means all.
    """

    segment: str
    mass_kg: float = Field(gt=0, le=200)
    position_m: tuple[Metre, Metre, Metre]
    participants: tuple[str, ...] = ()
    tasks: tuple[str, ...] = ()
    runs: tuple[int, ...] = ()

    def is_worn_by(self, participant_id: str) -> bool:
        return not self.participants or participant_id in self.participants

    def is_carried_in(self, participant_id: str, task: str, run: int | None) -> bool:
        """Whether a trial carries it; ``run`` is None where the recording has no run number."""
        named = not self.tasks or task in self.tasks
        return self.is_worn_by(participant_id) and named and (not self.runs or run in self.runs)


class Ingest(Section):
    """Which gaps are filled, what of masses and plates is believed, what counts as complete."""

    max_gap_s: float = Field(ge=0)
    max_rigid_gap_s: float = Field(ge=0)
    mass_tolerance_percent: float = Field(gt=0)
    mass_gross_percent: float = Field(gt=0)
    mass_half_width_percent: float = Field(gt=0)
    believed_percent: float = Field(gt=50, lt=100)
    corrected_percent: float = Field(gt=50, lt=100)
    balance_median_m: float = Field(gt=0)
    complete_percent: float = Field(gt=0, lt=100)
    marker_noise_m: float = Field(gt=0)
    independent_numbers: float = Field(ge=1)
    zero_unloaded_plates: bool
    plates: tuple[int, ...]
    prefixes: dict[str, str]


class Scale(Section):
    """Which segments may be held, what is known of a geometry before the data, how it is fitted."""

    may_be_held: tuple[Literal["head", "upper_torso", "upper_arm", "forearm", "hand"], ...]
    joint_centre_sd_m: float = Field(gt=0)
    length_sd: float = Field(gt=0)
    marker_sd_m: float = Field(gt=0)
    hinge_sd_rad: float = Field(gt=0)
    symmetry_sd: float = Field(gt=0)
    mirror_sd_m: float = Field(gt=0)
    frames: Count
    independent_frames: float = Field(gt=0)
    iterations: int = Field(ge=0, le=_MANY)


class Ik(Section):
    """What markers are trusted to, and when a joint angle is not determined."""

    marker_sd_m: float = Field(gt=0)
    robust_limit_m: float = Field(gt=0)
    posture_sd_rad: float = Field(gt=0)
    iterations: Count
    undetermined_sd_rad: float = Field(gt=0)
    held_sd_rad: float = Field(gt=0)


class Smoothing(Section):
    """How poses become velocities and accelerations, and what skin motion adds to the noise."""

    method: Literal["spline", "butterworth"]
    butterworth_cutoff_hz: float = Field(gt=0)
    pace_window_s: float = Field(gt=0)
    skin_factor: float = Field(ge=0)
    skin_from_hz: float = Field(gt=0)
    edge_s: float = Field(ge=0)


class Regress(Section):
    """The anthropometric table of RM."""

    table: Literal["dumas2007", "dumas2015"]


class Prior(Section):
    """How far people differ from the table."""

    com_sd_percent: float = Field(gt=0)
    midline_sd_m: float = Field(gt=0)
    origin_sd_m: float = Field(ge=0)
    other_table_sd: float = Field(ge=0, le=0.7)
    left_right_correlation: float = Field(ge=0, lt=1)
    total_mass_sd_percent: float = Field(gt=0)


class Identify(Section):
    """Estimators, the first of which is OM, and how the data are filtered, held out and weighed."""

    estimators: tuple[Literal["consistent", "hansen2017", "robert2017", "base"], ...] = Field(
        min_length=1
    )
    cutoff_hz: float = Field(gt=0)
    hold_out_fraction: float = Field(ge=0, lt=1)
    block_s: float = Field(gt=0)
    trust_ratio: float = Field(ge=1)
    sigma_percent_limit: float = Field(gt=0)
    plate_place_sd_m: float = Field(gt=0)
    delay_sd_s: float = Field(gt=0)
    spread_weight: float = Field(gt=0)


class Reconstruct(Section):
    """Cut-off of both wrenches, and the least force with a centre of pressure."""

    cutoff_hz: float = Field(gt=0)
    cop_min_force_percent_bw: float = Field(gt=0, lt=100)


class Joints(Section):
    """Cut-off of joint forces and moments, and how well joint centres are known."""

    cutoff_hz: float = Field(gt=0)
    centre_sd_m: float = Field(gt=0)


class Diagnosis(Section):
    """When an error is large, how likely faults are before the data, and when one is named."""

    cutoff_hz: float = Field(gt=0)
    skin_factor: float = Field(ge=0)
    landmark_sd_m: float = Field(gt=0)
    large_cop_error_m: float = Field(gt=0)
    large_force_error_percent: float = Field(gt=0)
    least_correlation: float = Field(gt=0, lt=1)
    fault_prior_odds: float = Field(gt=0)
    named_from: float = Field(gt=0.5, lt=1)
    stated_mass_sd_percent: float = Field(gt=0)


class Laboratory(Section):
    """How persons may differ from their laboratory, and when each was recorded."""

    between_persons: float = Field(gt=0)
    alike: float = Field(ge=0, lt=1)
    recorded_on: dict[str, str]


class Stats(Section):
    """Level of the tests, and below which difference two methods are equivalent."""

    alpha: float = Field(gt=0, lt=1)
    equivalence_percent: float = Field(gt=0)


class Config(Section):
    """All options of a run; sections are named after the stages that read them."""

    marker_set: str
    skeleton: str
    loads: tuple[Load, ...]
    roles: Roles
    ingest: Ingest
    scale: Scale
    ik: Ik
    smoothing: Smoothing
    regress: Regress
    prior: Prior
    identify: Identify
    reconstruct: Reconstruct
    joints: Joints
    diagnosis: Diagnosis
    laboratory: Laboratory
    stats: Stats

    def only(self, names: Iterable[str]) -> Config:
        """These options alone: whoever asks for another one gets an AttributeError."""
        return self.model_construct(**{name: getattr(self, name) for name in names})

    def options(self, names: Iterable[str]) -> dict[str, Any]:
        """The named options as plain values, as they enter an artifact's provenance."""
        everything = self.model_dump(mode="json")
        return {name: everything[name] for name in names}


def load_config(files: Iterable[Path], estimators: Sequence[str] = ()) -> Config:
    """Defaults, then each file that is there in turn; other estimators, in order, where given.

    UsageError: a file is not TOML, or holds unknown options or values out of range: all named at
        once.
    """
    there = [file for file in files if os.path.lexists(file)]
    other = {"identify": {"estimators": list(dict.fromkeys(estimators))}} if estimators else {}
    sources = [*map(str, there), *(["--estimator"] if other else [])]
    return config_of(*map(read_toml, there), other, file=", ".join(sources))


def config_of(*given: Mapping[str, Any], file: str = "the options") -> Config:
    """Defaults, then each of these in turn.

    UsageError: unknown options, or values out of range: all named at once, as those of ``file``.
    """
    merged = read_toml(shipped("default.toml"))
    for options in given:
        merged = _merge(merged, options)
    try:
        text = json.dumps(merged, default=lambda date: {"date": str(date)})  # no option takes that
        return Config.model_validate_json(text, strict=True)
    except ValidationError as error:
        faults = error.errors()
        more = f"; and {len(faults) - _MOST_FAULTS} more" if len(faults) > _MOST_FAULTS else ""
        raise UsageError(
            "; ".join(_fault(e) for e in faults[:_MOST_FAULTS]) + more,
            file=file,
            remedy="configs/default.toml lists every option with its unit",
        ) from None


def _merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in over.items():
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = _merge(merged[key], value) if both else value
    return merged


def _fault(error: Mapping[str, Any]) -> str:
    path = [str(part) for part in error["loc"]]
    name = ".".join(path)
    if error["type"] == "missing":
        return f"{name} is missing"
    if error["type"] != "extra_forbidden":
        return f"{name} = {repr(error['input'])[:_LONGEST_VALUE]}: {error['msg']}"
    model: type[BaseModel] = Config
    for part in path[:-1]:
        if not part.isdigit():
            inner = model.model_fields[part].annotation
            model = (get_args(inner) or (inner,))[0]  # the rows of a [[table]]
    return f"unknown option {name}{did_you_mean(path[-1], model.model_fields)}"
