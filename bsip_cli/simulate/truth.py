"""What a simulated study knows about itself, as plain data for a JSON file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from bsip_cli.simulate.effects.base import Effect
from bsip_cli.simulate.inertia import Inertia
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.recording import Measurement
from bsip_cli.simulate.trial import Trial


@dataclass(frozen=True)
class ParticipantTruth:
    """A participant of a simulated study: the person and the facts of each trial."""

    participant: str
    person: Person
    trials: dict[str, dict[str, object]]


@dataclass(frozen=True)
class StudyTruth:
    """All participants of a simulated study."""

    participants: tuple[ParticipantTruth, ...]


def person_record(person: Person) -> dict[str, object]:
    """The person in SI units, segment axes."""
    return {
        "sex": person.sex,
        "mass_kg": person.mass_kg,
        "stature_m": person.stature_m,
        "pelvis_width_m": person.pelvis_width_m,
        "thorax_width_m": person.thorax_width_m,
        "ankle_height_m": person.ankle_height_m,
        "trunk_bend": person.trunk_bend,
        "swinging_tissue": {name: asdict(swing) for name, swing in person.tissue.items()},
        "segment_lengths_m": person.lengths_m,
        "joints_in_parent_m": {name: p.tolist() for name, p in person.joints_m.items()},
        "hinge_axes": {name: axis.tolist() for name, axis in person.hinges.items()},
        "segments": {
            name: inertia_record(part) for name, part in person.segment_inertias().items()
        },
        "trunk_parts": {
            name: inertia_record(person.inertias[name]) for name in ("abdomen", "thorax")
        },
        "markers": {
            label: {"body": marker.body, "position_m": marker.position_m.tolist()}
            for label, marker in person.markers.items()
        },
    }


def inertia_record(part: Inertia) -> dict[str, float]:
    """Names and conventions of the inertial-parameter artifact (about the centre of mass)."""
    tensor = part.tensor_kgm2
    record = {"mass_kg": part.mass_kg}
    record |= {f"com_{a}_m": part.com_m[i] for i, a in enumerate("xyz")}
    record |= {f"i{a}{a}_kgm2": tensor[i, i] for i, a in enumerate("xyz")}
    record |= {"ixy_kgm2": tensor[0, 1], "ixz_kgm2": tensor[0, 2], "iyz_kgm2": tensor[1, 2]}
    return {name: float(value) for name, value in record.items()}


def trial_record(
    trial: Trial, measurement: Measurement, effects: Sequence[Effect], seed: list[int]
) -> dict[str, object]:
    """Contacts, ball, effects, plate pose and summary of one trial.

    Times are on the movement's clock, on which the file starts at `recorded_from_s`.
    """
    pose = measurement.pose
    ball = trial.plan.ball
    force, _ = trial.plate_wrench()
    return {
        "seed": seed,
        "duration_s": len(measurement.points_m) / measurement.rates.marker_hz,
        "recorded_from_s": measurement.start_s,
        "effects": [effect.name for effect in effects],
        "ball": None
        if ball is None
        else {
            "segment": ball.body,
            "mass_kg": ball.mass_kg,
            "position_m": ball.position_m.tolist(),
            "release_s": ball.release_s,
        },
        "contacts": [
            {
                "side": contact.side,
                "start_s": contact.start_s,
                "end_s": contact.end_s,
                "on_plate": contact.on_plate,
            }
            for contact in trial.contacts
        ],
        "flights_s": flights_s(trial),
        "all_contacts_measured_share": float(np.mean(trial.all_contacts_measured())),
        "largest_vertical_force_n": float(force[:, 1].max()),
        "walkway_to_lab": {"rotation": pose.rotation.tolist(), "offset_m": pose.offset_m.tolist()},
        **trial.plan.notes,
    }


def flights_s(trial: Trial) -> list[list[float]]:
    """Start and end [s] of the flights that lie within the recording."""
    plan = trial.plan
    spans = [
        ((first - plan.keep.start) * plan.step_s, (last - plan.keep.start) * plan.step_s)
        for first, last in plan.flights
    ]
    length = len(trial.time_s) * plan.step_s
    return [[round(a, 3), round(b, 3)] for a, b in spans if b > 0.0 and a < length]
