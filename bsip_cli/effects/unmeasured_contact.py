"""A contact that no plate measures: a hand on a rail, a chair, a foot beside the plate."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bsip_cli.body.names import in_words
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.external_force import missing_wrenches
from bsip_cli.effects.scene import Scene

WINDOWS_S = (0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0, 32.0, 45.0, 64.0)
SHORTEST_S = 0.7
RAMP_S = 0.3  # in which a person leans on something, or lets go
EDGE_S = 0.07  # to which it is known when that begins and ends: nobody does it along a ramp
ALIKE = 21  # windows that differ only where nothing is measured
STEADY_N = 1.0  # to which a mean force is known: nobody leans steadily
MOST_WINDOWS = 30  # side by side; shorter contacts are found in part of a window, and refined


class UnmeasuredContact(Effect):
    """A force on the segment's centre of mass during a window, in which it grows and fades; the
    plates carry as much less. The point where it truly acts is not estimated."""

    name = "unmeasured_contact"
    of_the_lab = False
    on_its_segment = True
    looks = (
        "for some seconds the plates lack a force that the motion needs; the balance over"
        " long times is off too"
    )
    remedy = "record without anything in reach"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        touching = ("lower_torso", "hand_l", "hand_r", "foot_l", "foot_r")
        return tuple(s for s in scene.person.skeleton.segments if s in touching)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        start, end = float(scene.times_s[0]), float(scene.times_s[-1])
        fitting = [w for w in WINDOWS_S if w <= 0.8 * (end - start)]
        longest = fitting[-1] if fitting else end - start  # a short trial is one window
        lengths = tuple(w for w in fitting if (end - start) / w <= MOST_WINDOWS) or (longest,)
        middles = tuple(float(t) for t in np.arange(start, end, min(lengths) / 2))
        return (
            *(
                Parameter(f"force_{axis}", "N", -800.0, 800.0, 40.0, known_to=STEADY_N)
                for axis in "xyz"
            ),
            Parameter("middle", "s", start, end, 0.25, middles, known_to=EDGE_S / np.sqrt(2)),
            Parameter(
                "length",
                "s",
                min(0.2, end - start),
                end - start,
                0.5,
                lengths,
                known_to=EDGE_S * np.sqrt(2),
            ),
        )

    def scans(self, scene: Scene, target: str) -> Iterator[tuple[float, ...]]:
        """Windows that overlap by half."""
        *_, middle, length = self.parameters(scene, target)
        for seconds in length.scan:
            for at in np.arange(middle.least + seconds / 2, middle.most, seconds / 2):
                yield float(at), seconds

    def spacing(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The true window may be half as long again on either side."""
        return np.array([values[4] / 2, values[4]])

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return self.tangent(scene, target, values) @ values[:3]

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The change is linear in the force."""
        middle, length = values[3], values[4]
        ramp = min(RAMP_S, length / 2)
        inside = length / 2 - np.abs(scene.times_s - middle)
        touching = np.clip(inside / ramp, 0.0, 1.0) / (1 - ramp / length)  # 1 on average
        return touching[:, None, None] * missing_wrenches(scene, target)

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        """The window, and the mean force in it: its size and its parts along the lab's axes."""
        start, end = values[3] - values[4] / 2, values[3] + values[4] / 2
        parts = ((f"force_{c}", "N", float(x)) for c, x in zip("xyz", values, strict=False))
        return (
            ("start", "s", max(float(start), float(scene.times_s[0]))),
            ("end", "s", min(float(end), float(scene.times_s[-1]))),
            ("force", "N", float(np.linalg.norm(values[:3]))),
            *parts,
        )

    def alike(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """A touch that is whole when the plates begin to measure may have begun long before; the
        plainest is that it began just then. So with its end."""
        start, end = values[3] - values[4] / 2, values[3] + values[4] / 2
        ramp = min(RAMP_S, values[4] / 2)
        plateau = values[:3] / (1 - ramp / values[4])
        starts = np.linspace(*_unseen(scene, start, ramp), ALIKE)
        ends = -np.linspace(*_unseen(scene, -end, ramp, backwards=True), ALIKE)
        lengths = ends - starts
        forces = plateau * (1 - np.minimum(RAMP_S / lengths, 0.5))[:, None]
        return np.column_stack([forces, (starts + ends) / 2, lengths])

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """A touch that lasts: at the edge of what is measured a step onto the plate looks alike."""
        touching = np.abs(scene.times_s - values[3]) <= values[4] / 2
        seconds = float((touching & scene.valid).sum()) / scene.rate_hz
        return super().possible(scene, target, values) and seconds >= SHORTEST_S

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        start, end = values[3] - values[4] / 2, values[3] + values[4] / 2
        return (
            f"from {start:.2f} to {end:.2f} s something beside the plates pushes on the "
            f"{in_words(target)} "
            f"with {np.linalg.norm(values[:3]):.0f} N"
        )


def _unseen(scene: Scene, edge: float, ramp: float, backwards: bool = False) -> tuple[float, float]:
    """Latest and earliest time at which a touch may have begun that is whole when it is seen.

    Both are the edge itself where the plates measure how it grows. Backwards in time for its end.
    """
    sign = -1 if backwards else 1
    times, valid = sign * scene.times_s[::sign], scene.valid[::sign]
    after, before = valid & (times >= edge), valid & (times < edge)
    first = float(times[after][0]) if after.any() else edge
    last = float(times[before][-1]) if before.any() else float(times[0])
    hidden = edge + ramp <= first
    return (first - ramp, min(last, first - ramp)) if hidden else (edge, edge)
