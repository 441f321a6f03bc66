"""What one person's recordings say of the faults that they share with others.

The plates, the clock and the vertical belong to a laboratory, body and skin to a person. Of the
person's equations only those of the shared faults are kept: of the white normal equations
[G_oo G_os; G_so G_ss] x = [a_o; a_s] what is left when the own coefficients, of covariance R, are
integrated out, G_ss - G_so (G_oo + R^-1)^-1 G_os and the like. These sum over persons. What trials
show in which a person stands still to be calibrated is separate from what motion shows: a plate
that moved between them is no contradiction.
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import binary_erosion

from bsip_cli.diagnosis.error_model import TrialErrors
from bsip_cli.diagnosis.error_terms import FAULT, INERTIA, Term, as_simulated, is_of_instruments
from bsip_cli.diagnosis.fault_model import FaultTrial, Fitted, fitted, session_of, summed
from bsip_cli.diagnosis.hypothesis import Hypothesis
from bsip_cli.effects.body import StatedMass
from bsip_cli.effects.catalogue import CATALOGUE
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.frames import Turned
from bsip_cli.effects.plates import ALL
from bsip_cli.effects.scene import Scene

STATED_MASS = StatedMass()
OF_A_LABORATORY: tuple[Effect, ...] = tuple(
    effect
    for effect in CATALOGUE
    if effect.is_of_laboratory and (is_of_instruments(effect) or isinstance(effect, Turned))
)
_MARGIN_S = 0.02  # delays of this size, and the low-pass of 20 Hz before frames are left out
_ASKED = (*OF_A_LABORATORY, STATED_MASS)


@dataclass(frozen=True, order=True)
class Coordinate:
    """One number of a fault at a plate, or a channel of it; the clock has no target.

    standing : as quiet stance shows it; else all others, or both alike.
    """

    effect: str
    target: str
    parameter: str
    standing: bool = False


@dataclass(frozen=True, eq=False)
class Information:
    """Of C coordinates [typical sizes]: precision (C, C) and pull (C,), so that the likeliest
    sizes of this person alone solve precision @ sizes = pull. trials (C,) : how many show it."""

    coordinates: tuple[Coordinate, ...]
    parameters: tuple[Parameter, ...]
    trials: np.ndarray
    precision: np.ndarray
    pull: np.ndarray


@dataclass(frozen=True, eq=False)
class SharedTrial(FaultTrial):
    """A trial whose forces all are as simulated: near the ends of what is valid the measured signal
    bends as feet come and go beside the plates, and its slope would be taken for a delay."""

    standing: bool

    @cached_property
    def simulated(self) -> Scene:
        return as_simulated(self.scene)


def shared_targets(effect: Effect, scene: Scene) -> list[str]:
    """Where a trial has a fault that all have."""
    return [one for one in effect.targets(scene) if effect.is_shared_at(scene, one)]


def inner(scene: Scene) -> Scene:
    """The trial, its valid frames as far from the others as these reach by a delay and a filter."""
    margin = max(1, round(_MARGIN_S * scene.rate_hz))
    return replace(scene, valid=binary_erosion(scene.valid, iterations=margin, border_value=1))


def information_of(trials: Sequence[SharedTrial]) -> Information:
    """Scales and noise are the person's own; the equations are linear about no fault.

    About what one person shows alone they would not be: a few steps on two plates fit any fault.
    """
    own = []
    for one in trials:  # without the ordinary terms that are asked of the laboratory
        kept = tuple(x for x in _own_terms(one.errors) if x.scale != f"{INERTIA} in all")
        own.append(replace(one, errors=replace(one.errors, terms=kept)))
    session = session_of(own)
    moving = {k for k, one in enumerate(trials) if not one.standing}
    return _marginal(fitted(session, _hypotheses(trials, moving)), moving)


def _own_terms(errors: TrialErrors) -> list[Term]:
    names = {FAULT + effect.name for effect in OF_A_LABORATORY}
    return [one for one in errors.terms if one.term not in names]


def with_known(
    trial: FaultTrial,
    standing: bool,
    coordinates: Sequence[Coordinate],
    mean: np.ndarray,
    root: np.ndarray,
) -> FaultTrial:
    """A trial whose shared faults are known from others, instead of as all laboratories have them.

    standing : whether the person stands still. mean (C,), root (C, K) : of the sizes and of the
    covariance of these [typical].
    """
    scene, filter_ = as_simulated(trial.scene), trial.errors.filter
    columns = np.zeros((*trial.errors.residual.shape, len(coordinates)))
    for effect in OF_A_LABORATORY:
        for target in shared_targets(effect, trial.scene):
            parameters = effect.parameters(trial.scene, target)
            mine = [Coordinate(effect.name, target, p.name, standing) for p in parameters]
            if mine[0] in coordinates:
                at = [coordinates.index(one) for one in mine]
                typical = np.array([one.typical for one in parameters])
                slope = effect.tangent(scene, target, np.zeros(len(typical))) * typical
                columns[..., at] = filter_(slope)
    name = f"{FAULT}laboratory"
    term = Term(name, "", name, False, columns, mixing=root)
    residual = trial.errors.residual - columns @ mean
    terms = (*_own_terms(trial.errors), term)
    return replace(trial, errors=replace(trial.errors, residual=residual, terms=terms))


def _hypotheses(trials: Sequence[FaultTrial], moving: Set[int]) -> list[Hypothesis]:
    """Every shared fault at every plate, in motion and in quiet stance separately; all plates
    alike are these together."""
    found = []
    for effect in _ASKED:
        targets = [shared_targets(effect, one.scene) for one in trials]
        for target in dict.fromkeys(name for mine in targets for name in mine):
            if target.split(" ")[0] == ALL:
                continue
            holding = tuple(t for t, mine in enumerate(targets) if target in mine)
            count = len(effect.parameters(trials[holding[0]].scene, target))
            separate = [
                tuple(t for t in holding if (t in moving) == moves) for moves in (True, False)
            ]
            for mine in [holding] if effect is STATED_MASS else filter(None, separate):
                found.append(Hypothesis(effect, target, mine, np.zeros(count)))
    return found


def _marginal(fit: Fitted, moving: Set[int]) -> Information:
    numbers = [
        (
            Coordinate(one.effect.name, one.target, parameter.name, not moving & {*one.trials}),
            parameter,
            len(one.trials),
        )
        for one in fit.faults
        for parameter in one.parameters(fit.session)
    ]
    coordinates, parameters, trials = zip(*numbers, strict=True)
    gram, against = summed(fit.pieces, len(fit.mean))
    own, shared = np.split(np.arange(len(fit.mean)), [fit.session.count])
    root = fit.root[own]
    inner = gram[np.ix_(own, own)] * np.outer(root, root) + np.eye(len(own))
    across = root[:, None] * gram[np.ix_(own, shared)]
    taken = np.linalg.solve(inner, np.column_stack([across, root * against[own]]))
    precision = gram[np.ix_(shared, shared)] - across.T @ taken[:, :-1]
    pull = against[shared] - across.T @ taken[:, -1]
    precision = (precision + precision.T) / 2
    return Information(coordinates, parameters, np.array(trials), precision, pull)
