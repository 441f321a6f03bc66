"""How a lab might have exported a session: the sound way, and every way to differ from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
SIZES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "inches": 0.0254}
MOMENT_SIZES = {"Nmm": 1e-3, "Nm": 1.0}


@dataclass
class Export:
    """One export of a session; circumstances change what differs from the sound one.

    axes : (3, 3) exported = axes @ lab, of points and forces alike; marker_axes, force_axes: of
        one of them only, after it.
    point_unit, corner_unit, moment_unit : in which the numbers are; stated_* : what the file says.
    channel_signs : (6,) of forces and moments; plate_signs by plate: (6,), after it; exchanged by
        plate: whether the level forces, and the level moments, stand in each other's place;
        sensors_exchanged by plate of type 3: which two of eight.
    plate_gains by plate : of all six. late_s : of the forces. of_another : forces of the session's
        next trial. tared : each trial's plates read zero as it begins.
    plate_rise_m : of the surfaces as stated over the true ones. listed_twice by plate : a channel
        that also stands where another should. plate_order : which plate's readings stand where;
        corner_roll, corner_wound, doubled, summed : see c3d_export. reference : of the moments:
        sensor (C3D), surface; in MOT point, plate_centre, lab_origin.
    """

    format: str = "c3d"
    axes: np.ndarray = field(default_factory=lambda: np.eye(3))
    marker_axes: np.ndarray = field(default_factory=lambda: np.eye(3))
    force_axes: np.ndarray = field(default_factory=lambda: np.eye(3))
    # lengths and moments
    point_unit: str = "mm"
    stated_point_unit: str = "mm"
    corner_unit: str = "mm"
    moment_unit: str = "Nmm"
    stated_moment_unit: str = "Nmm"
    reference: str = "sensor"
    # signs and plates
    channel_signs: np.ndarray = field(default_factory=lambda: np.ones(6))
    plate_signs: dict[int, np.ndarray] = field(default_factory=dict)
    exchanged: dict[int, tuple[bool, bool]] = field(default_factory=dict)
    sensors_exchanged: dict[int, tuple[int, int]] = field(default_factory=dict)
    plate_gains: dict[int, float] = field(default_factory=dict)
    late_s: float = 0.0
    of_another: bool = False
    tared: bool = False
    plate_rise_m: float = 0.0
    listed_twice: dict[int, tuple[int, int]] = field(default_factory=dict)
    plate_order: list[int] | None = None
    corner_roll: dict[int, int] = field(default_factory=dict)
    corner_wound: bool = False
    doubled: bool = False
    summed: bool = False
    plate_type: int = 2
    origin: str = "sensor"  # reversed, place, zero
    # of one plate's channels (n, 6 or 8) as written, at a rate [Hz]
    damage: Callable[[np.ndarray, float, np.random.Generator], np.ndarray] | None = None
    damaged_plate: int = 0
    limit_share: float | None = None  # of its vertical channel: from quiet stance to the largest
    # time
    marker_hz: float = 100.0
    stated_rate: float = 1.0  # over the true one
    mot_rate: float = 1.0  # of the forces alone
    analog_per_marker: int = 10
    time_unit: str = "s"
    time_decimals: int = 6
    trc_start_s: float = 0.0
    mot_start_s: float = 0.0
    # points
    label: Callable[[str], str] = str
    missing: str = "nan"  # zero, held, or a number
    hidden_share: float = 0.0
    residuals: str = "normal"  # negative: of all points
    unnamed: int = 0
    # MOT
    mot_columns: str = "ground_force_{n}_v{a} ground_force_{n}_p{a} ground_torque_{n}_{a}"
    mot_suffix: str = ".mot"
    mot_points: bool = True
    mot_moments: bool = True
    mot_point_unit: str = "m"
    mot_force_N: float = 1.0  # the unit of force
    mot_unloaded: str = "zero"  # nan
    # participants.tsv
    sex: dict[str, str] = field(default_factory=lambda: {"M": "M", "F": "F"})
    mass_unit: str = "kg"
    height_unit: str = "m"
    stated_mass: bool = True
    stated_height: bool = True
    separator: str = "\t"
    encoding: str = "utf-8"
    trailing_lines: int = 0
    byte_order_mark: bool = False

    def channels(self, number: int, six: np.ndarray, level: Sequence[int]) -> np.ndarray:
        """(n, 6) of a plate as they are written, whose forces' axes ``level`` lie in the floor."""
        six = six * self.channel_signs * self.plate_signs.get(number, np.ones(6))
        six *= self.plate_gains.get(number, 1.0)
        for first, is_exchanged in zip((0, 3), self.exchanged.get(number, ()), strict=False):
            if is_exchanged:
                one, other = (first + k for k in level)
                six[:, [one, other]] = six[:, [other, one]]
        return six
