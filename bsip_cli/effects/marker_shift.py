"""A marker that slips on the skin and stays there."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.effect import Effect, Parameter, explained_share
from bsip_cli.effects.marker_course import during, step, wrench_parts
from bsip_cli.effects.scene import Scene
from bsip_cli.motion.level_change import two_levels

APART_S = 0.5
BEFORE_S = 1.0
ABSORBED = (0.0, 0.5)
SKIN_M, MOMENT_S = 0.0015, 0.03  # to which place and moment are known: skin gives way
ASTRAY_M = 0.006  # a residual that lasts, or changes its level, by this much
OWN_SHARE = 0.3  # of the marker's own squared residual that a shift must take away


class MarkerShift(Effect):
    """A marker sits elsewhere on its segment from a moment on, in the segment's axes.

    The pose follows it in part, which bends the simulated wrench; the rest stays as residual. A
    moment before the trial means throughout. Scaling that used the trial has put the model's marker
    between both places: ``absorbed`` is the part of the shift that it took.
    """

    name = "marker_shift"
    of_the_lab = False
    looks = "the residual of one marker jumps and stays; the segment's pose jumps with it"
    remedy = "put the marker back to its place and record the trial again"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        """Markers whose own residual asks for it."""
        if scene.residual_m is None:
            return scene.person.markers
        residual = scene.residual_m
        return scene.once("astray", lambda: _suspects(scene, residual))

    def agrees(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """Whether the marker's own residual follows."""
        if scene.residual_m is None:
            return True
        m = scene.person.markers.index(target)
        change = self.marker_change(scene, target, values)[:, m : m + 1]
        return explained_share(scene.residual_m[:, m : m + 1], change) > OWN_SHARE

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        first, last = float(scene.times_s[0]), float(scene.times_s[-1])
        return (
            *(Parameter(axis, "m", -0.15, 0.15, 0.02, known_to=SKIN_M) for axis in "xyz"),
            Parameter(
                "from_time",
                "s",
                first - BEFORE_S,
                last,
                APART_S,
                self._moments(scene, target),
                known_to=MOMENT_S,
            ),
            Parameter("absorbed", "1", 0.0, 1.0, 0.25, ABSORBED),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        m = scene.person.markers.index(target)
        parts = scene.once(
            ("of a marker", m), lambda: wrench_parts(scene, self._directions(scene, m), [m])
        )
        return during(self.course(scene, values), parts) @ values[:3]

    def course(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        """(3, N) the part of the shift by which the marker is off, and its derivatives."""
        course = step(scene.times_s, values[3])
        course[0] -= values[4]
        return course

    def marker_change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        m = scene.person.markers.index(target)
        slipped = self.course(scene, values)[0][:, None]
        errors = slipped * (self._directions(scene, m)[:, 0] @ values[:3])
        return scene.pose_response.left(errors[:, None, :, None], [m])[..., 0]

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        """The slip's length and parts; one before the trial counts from its first frame."""
        parts = tuple((f"shift_{c}", "m", float(x)) for c, x in zip("xyz", values, strict=False))
        return (
            ("shift", "m", float(np.linalg.norm(values[:3]))),
            *parts,
            ("from_time", "s", max(float(values[3]), float(scene.times_s[0]))),
        )

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        late = values[3] > scene.times_s[0]
        since = f"from {values[3]:.1f} s on" if late else "throughout"
        size = 1000 * np.linalg.norm(values[:3])
        return f"marker {target} sits {size:.0f} mm from its place {since}"

    @staticmethod
    def _directions(scene: Scene, m: int) -> np.ndarray:
        """(N, 1, 3, 3) the axes of the marker's segment, world."""
        return scene.motion.rotation[:, None, scene.person.marker_segments[m]]

    @staticmethod
    def _moments(scene: Scene, target: str) -> tuple[float, ...]:
        """Throughout, and where the marker's residual changes its level most; else everywhere."""
        first, last = float(scene.times_s[0]), float(scene.times_s[-1])
        throughout = first - BEFORE_S
        residual = scene.residual_m
        if residual is None:
            inside = np.arange(first + APART_S, last, APART_S)
            return (throughout, *(float(t) for t in inside))
        m = scene.person.markers.index(target)
        at = scene.once(("level", m), lambda: _level_change(residual[:, m], scene.rate_hz))
        return (throughout,) if at is None else (throughout, float(scene.times_s[at]))


def _suspects(scene: Scene, residual_m: np.ndarray) -> tuple[str, ...]:
    found = []
    for m, name in enumerate(scene.person.markers):
        own = residual_m[:, m]
        if not np.isfinite(own).all(axis=1).any():
            continue
        lasting = float(np.linalg.norm(np.nanmean(own, axis=0)))
        at = _level_change(own, scene.rate_hz)
        jump = 0.0
        if at is not None:
            after, before = np.nanmean(own[at:], axis=0), np.nanmean(own[:at], axis=0)
            jump = float(np.linalg.norm(after - before))
        if max(lasting, jump) > ASTRAY_M:
            found.append(name)
    return tuple(found)


def _level_change(residual_m: np.ndarray, rate_hz: float) -> int | None:
    """Frame at which a residual (N, 3) splits into the two most different levels, if any can."""
    seen = np.flatnonzero(np.isfinite(residual_m).all(axis=1))
    least = round(APART_S * rate_hz)
    if len(seen) < 2 * least + 1:
        return None
    return int(seen[two_levels(residual_m[seen], least + 1, least)])
