"""What a movement prescribes: joint angles, feet, support. Walkway frame: X ahead, Y up, Z right.

The plan leaves the pelvis' horizontal path (and in flight its whole pose) to `balance`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from bsip_cli.simulate.loads import Ball, Load

STEP_S = 0.001


@dataclass(frozen=True, eq=False)
class Foot:
    """One foot over time.

    position_m : (T, 3) ankle joint centre.
    rotation : (T, 3, 3) foot frame in the walkway frame.
    share : (T,) part of the ground force that this foot carries (0 when it is in the air).
    cop_m : (T, 2) centre of pressure under this foot, X and Z.
    on_plate : (T,) whether its contact (if any) is on the plate.
    """

    position_m: np.ndarray
    rotation: np.ndarray
    share: np.ndarray
    cop_m: np.ndarray
    on_plate: np.ndarray


@dataclass(frozen=True, eq=False)
class Plan:
    """A movement before balance. All arrays share one time axis.

    angles_rad : waist, neck (T, 3): flexion about Z, about X, about Y;
        spine (T, 3), if given: the same, of the thorax on the abdomen;
        girdle_* (T, 2), if given: clavicle raised and brought forward beside what the arm's rhythm
        does; shoulder_* (T, 3): flexion, abduction, internal rotation; elbow_* (T,): flexion;
        wrist_* (T, 3): flexion, radial deviation, pronation.
    pelvis_angles_rad : (T, 3) about Z, X, Y in the walkway frame; (nominal in flight).
    pelvis_m : (T, 3) nominal path of the lumbar joint centre.
    feet : by side, "l" and "r".
    com_height_m : (T,) prescribed height of the centre of mass, or None: then the
        pelvis keeps its nominal height.
    flights : (first, last) sample of each phase without contact.
    speed_m_s : mean forward speed.
    sway_share : part of the unbalanced motion's COP excursion that is left standing.
    longest_reach : of a leg, as part of thigh plus shank; keeps knees from locking.
    keep : the part of the samples that is recorded.
    ball : a ball in a hand. loads : what else the body carries or leans on.
    plate_centre_m : X and Z of the first plate's centre, walkway frame.
    """

    step_s: float
    angles_rad: dict[str, np.ndarray]
    pelvis_angles_rad: np.ndarray
    pelvis_m: np.ndarray
    feet: dict[str, Foot]
    keep: slice
    com_height_m: np.ndarray | None = None
    flights: tuple[tuple[int, int], ...] = ()
    speed_m_s: float = 0.0
    sway_share: float = 0.0
    longest_reach: float = 0.9985
    ball: Ball | None = None
    loads: tuple[Load, ...] = ()
    plate_centre_m: tuple[float, float] = (0.0, 0.0)
    notes: dict[str, object] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.pelvis_m)

    def cop_m(self) -> np.ndarray:
        """(T, 2) planned centre of pressure of both feet together."""
        left, right = self.feet["l"], self.feet["r"]
        return left.share[:, None] * left.cop_m + right.share[:, None] * right.cop_m

    def all_loads(self) -> tuple[Load, ...]:
        """The ball and everything else that the body has to move or to lean on."""
        return self.loads if self.ball is None else (self.ball, *self.loads)

    def thinned(self, factor: int) -> Plan:
        """Every `factor`-th sample."""
        s = slice(None, None, factor)
        return replace(
            self,
            step_s=self.step_s * factor,
            angles_rad={name: a[s] for name, a in self.angles_rad.items()},
            pelvis_angles_rad=self.pelvis_angles_rad[s],
            pelvis_m=self.pelvis_m[s],
            feet={side: _thinned_foot(foot, s) for side, foot in self.feet.items()},
            com_height_m=None if self.com_height_m is None else self.com_height_m[s],
            ball=self.ball.thinned(s) if self.ball else None,
            loads=tuple(load.thinned(s) for load in self.loads),
            keep=slice(self.keep.start // factor, -(-self.keep.stop // factor)),
        )


def _thinned_foot(foot: Foot, s: slice) -> Foot:
    return Foot(
        foot.position_m[s], foot.rotation[s], foot.share[s], foot.cop_m[s], foot.on_plate[s]
    )
