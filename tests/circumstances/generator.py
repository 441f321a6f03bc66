"""Draw circumstances from a seed and write them as study folders."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from tests.circumstances.c3d_export import write_c3d
from tests.circumstances.export import Y_UP, Export
from tests.circumstances.sound import LABORATORIES, PEOPLE, Session, sound_session
from tests.circumstances.text_export import write_mot, write_trc
from tests.circumstances.things import KINDS, THINGS, Thing, pick

SOUND_SHARE = 0.18
COUNTS = (1, 2, 3)
COUNT_SHARES = (0.45, 0.35, 0.20)
# Of the labs, whose origin lies between the feet of who stands: what is about another point, or
# mirrored, or turned, is off by little there.
AT_ORIGIN_SHARE = 0.4
POUND_KG = 0.45359237


@dataclass(frozen=True, eq=False)
class Circumstance:
    """A study as a lab might have exported it, what was done to it, and the truth.

    session : who, where and what happened. truth : the same at the export's rates.
    """

    id: int
    seed: int
    export: Export
    session: Session
    things: tuple[Thing, ...]
    words: tuple[str, ...]

    @cached_property
    def truth(self) -> Session:
        rates = self.export.marker_hz, self.export.analog_per_marker
        return replace(self.session, trials=tuple(t.sampled(*rates) for t in self.session.trials))

    @property
    def is_sound(self) -> bool:
        return not self.things

    @property
    def kinds(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(t.kind for t in self.things)) or ("sound",)

    @property
    def participant(self) -> str:
        return f"sub-{self.id:04d}"

    @property
    def needs_own_table(self) -> bool:
        return any(thing.slot == "table" for thing in self.things)

    def gap_seed(self, trial: int) -> int:
        """Where markers are hidden in a trial."""
        return self.seed * 1_000_000 + 10 * self.id + trial

    def __str__(self) -> str:
        what = "; ".join(self.words) or "sound"
        return f"{self.id} ({self.export.format}, {self.session.laboratory}): {what}"


def draw(seed: int, number: int, only: str = "") -> Circumstance:
    """Circumstance `number` of a seed; only : a kind, or the name of a thing, that it has."""
    rng = np.random.default_rng([seed, number])
    forms = [t.formats for t in THINGS if only in (t.kind, t.id)] if only else []
    if only and only != "sound" and not forms:
        raise ValueError(f"no circumstance {only!r}; kinds: {', '.join(KINDS)}")
    format_ = pick(rng, sorted({f for form in forms for f in form}) or ("c3d", "trc"))
    session = _session(rng)
    export = sound_export(format_)
    export.stated_mass, export.stated_height = rng.random(2) < (0.7, 0.8)
    things = _draw_things(rng, format_, only)
    words = tuple(t.change(export, rng, len(session.plates)) for t in things)
    return Circumstance(number, seed, export, session, things, words)


def _session(rng: np.random.Generator) -> Session:
    laboratory = pick(rng, LABORATORIES)
    session = sound_session(laboratory, int(rng.integers(PEOPLE)))
    session = session.with_movement(pick(rng, LABORATORIES[laboratory][1]))
    turns = tuple(int(k) for k in rng.integers(0, 4, len(session.plates)))
    session = session.with_turned_plates(turns)
    # Half of the labs draw their axes along the walls, the others anyhow.
    along_walls = np.pi / 2 * int(rng.integers(4))
    anyhow = float(rng.uniform(0.0, 2.0 * np.pi))
    session = session.moved(along_walls if rng.random() < 0.5 else anyhow, np.zeros(3))
    shift = np.array([*rng.uniform(-2.0, 2.0, 2), 0.0])
    if rng.random() < AT_ORIGIN_SHARE:
        feet = session.trials[0].markers_m.mean(axis=(0, 1)) * [1.0, 1.0, 0.0]
        shift = 0.02 * shift - feet
    return session.moved(0.0, shift)


def sound_export(format_: str) -> Export:
    """As a lab should export: C3D with Z up in mm, TRC and MOT with Y up."""
    export = Export(format=format_)
    if format_ == "trc":
        export.axes, export.moment_unit, export.reference = Y_UP, "Nm", "point"
    return export


def _draw_things(rng: np.random.Generator, format_: str, only: str) -> tuple[Thing, ...]:
    possible = [t for t in THINGS if format_ in t.formats]
    count = int(rng.choice(COUNTS, p=COUNT_SHARES))
    if only == "sound" or (not only and rng.random() < SOUND_SHARE):
        return ()
    drawn = [pick(rng, [t for t in possible if only in (t.kind, t.id)])] if only else []
    while len(drawn) < count:
        # Kinds are drawn alike, then things within a kind: few-membered kinds are not rare.
        thing = pick(rng, [t for t in possible if t.kind == pick(rng, KINDS)] or possible)
        if thing.slot not in {t.slot for t in drawn}:
            drawn.append(thing)
    order = {t: k for k, t in enumerate(THINGS)}
    return tuple(sorted(drawn, key=order.__getitem__))


def write(circumstances: list[Circumstance], study: Path) -> None:
    """The study folder that a user would hand to bsip, one circumstance to a participant.

    What concerns participants.tsv as a whole (`needs_own_table`) comes alone.
    """
    study.mkdir(parents=True)
    (study / "study.toml").write_text('marker_set = "hansen2017"\n')
    first = circumstances[0].export
    rows = [first.separator.join(["participant_id", "sex", "mass_kg", "height_m"])]
    rows += [_row(circumstance) for circumstance in circumstances]
    text = "\n".join([*rows, *[""] * first.trailing_lines]) + "\n"
    (study / "participants.tsv").write_text(text, encoding=first.encoding)
    for circumstance in circumstances:
        _write_recordings(circumstance, study / circumstance.participant)


def _write_recordings(circumstance: Circumstance, folder: Path) -> None:
    folder.mkdir()
    export, truth = circumstance.export, circumstance.truth
    centres = np.array([plate.corners_m.mean(axis=0) for plate in truth.plates])
    for k, true in enumerate(truth.trials):
        stem, seed = f"{folder.name}_{true.name}", circumstance.gap_seed(k)
        read = truth.trials[(k + export.of_another) % len(truth.trials)]
        trial = true.with_forces(read, export.late_s, export.tared)
        if export.format == "c3d":
            write_c3d(folder / f"{stem}.c3d", truth, trial, export, seed)
        else:
            write_trc(folder / f"{stem}.trc", truth, trial, export, seed)
            write_mot(folder / f"{stem}{export.mot_suffix}", trial, export, centres)


def _row(circumstance: Circumstance) -> str:
    export, truth = circumstance.export, circumstance.truth
    # A circumstance of the mass or the height needs one that is stated.
    pounds, other = export.mass_unit != "kg", export.height_unit != "m"
    size = {"m": 1.0, "cm": 100.0, "mm": 1000.0, "in": 1 / 0.0254}[export.height_unit]
    mass = truth.mass_kg / (POUND_KG if pounds else 1.0)
    height = f"{truth.height_m * size:.{0 if other else 2}f}"
    cells = [
        circumstance.participant,
        export.sex[truth.sex],
        f"{mass:.1f}" if export.stated_mass or pounds else "n/a",
        height if export.stated_height or other else "n/a",
    ]
    return export.separator.join(cells)
