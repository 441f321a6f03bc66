"""What one person's recordings say of the faults that they share with others.

The plates, the clock and the vertical belong to a laboratory, body and skin to a person. Of the
person's equations only those of the shared faults are kept: of the white normal equations
[G_oo G_os; G_so G_ss] x = [a_o; a_s] what is left when the own coefficients, of covariance R, are
integrated out, G_ss - G_so (G_oo + R^-1)^-1 G_os and the like. These sum over persons. What trials
show in which a person stands still to be calibrated is separate from what motion shows: a plate
that moved between them is no contradiction.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_erosion

from bsip_cli.diagnosis.error_model import Session, TrialErrors, session_of
from bsip_cli.diagnosis.error_terms import FAULT, INERTIA, Term, as_simulated
from bsip_cli.diagnosis.fault_model import Hypothesis, fitted
from bsip_cli.diagnosis.fault_scores import alike_in
from bsip_cli.diagnosis.normal_equations import summed
from bsip_cli.effects.body import StatedMass
from bsip_cli.effects.catalogue import CATALOGUE
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.plates import ALL, Turned
from bsip_cli.effects.scene import Scene

STATED_MASS = StatedMass()
OF_A_LABORATORY: tuple[Effect, ...] = tuple(
    one
    for one in CATALOGUE
    if one.scope == "laboratory" and (one.of_the_forces or isinstance(one, Turned))
)
_MARGIN_S = 0.02  # delays of this size, and the low-pass of 20 Hz before frames are left out


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


def shared_targets(effect: Effect, scene: Scene) -> list[str]:
    """Where a trial has a fault that all have."""
    return [one for one in effect.targets(scene) if effect.is_shared_at(scene, one)]


def inner(scene: Scene) -> Scene:
    """The trial, its valid frames as far from the others as these reach by a delay and a filter."""
    margin = max(1, round(_MARGIN_S * scene.rate_hz))
    return replace(scene, valid=binary_erosion(scene.valid, iterations=margin, border_value=1))


def information_of(trials: Sequence[TrialErrors], standing: Sequence[bool]) -> Information:
    """Scales and noise are the person's own; the equations are linear about no fault.

    About what one person shows alone they would not be: a few steps on two plates fit any fault.
    All forces are as simulated: near the ends of what is valid the measured signal bends as feet
    come and go beside the plates, and its slope would be taken for a delay.

    standing : in which trials the person stands still.
    """
    own = []
    for trial in trials:  # without the ordinary terms that are asked of the laboratory
        kept = tuple(x for x in _own_terms(trial) if x.scale != f"{INERTIA} in all")
        own.append(replace(trial, terms=kept, late_as_measured=False))
    session = session_of(own)
    fit = fitted(session, list(_hypotheses(session, standing)))
    coordinates, parameters, counts = [], [], []
    for one in fit.faults:
        stands = all(standing[t] for t in one.trials)
        for parameter in one.parameters:
            coordinates.append(Coordinate(one.name, one.target, parameter.name, stands))
            parameters.append(parameter)
            counts.append(len(one.trials))
    gram, against = summed(fit.pieces, len(fit.mean))
    mine, shared = np.split(np.arange(len(fit.mean)), [session.count])
    root = fit.root[mine]
    inside = gram[np.ix_(mine, mine)] * np.outer(root, root) + np.eye(len(mine))
    across = root[:, None] * gram[np.ix_(mine, shared)]
    taken = np.linalg.solve(inside, np.column_stack([across, root * against[mine]]))
    precision = gram[np.ix_(shared, shared)] - across.T @ taken[:, :-1]
    pull = against[shared] - across.T @ taken[:, -1]
    precision = (precision + precision.T) / 2
    return Information(tuple(coordinates), tuple(parameters), np.array(counts), precision, pull)


def _hypotheses(session: Session, standing: Sequence[bool]) -> Iterator[Hypothesis]:
    """Every shared fault at every plate, in motion and in quiet stance separately; all plates
    alike are these together."""
    for effect in (*OF_A_LABORATORY, STATED_MASS):
        targets = [shared_targets(effect, one.scene) for one in session.trials]
        for target in dict.fromkeys(name for mine in targets for name in mine):
            if target.split(" ")[0] == ALL:
                continue
            holding = [t for t, mine in enumerate(targets) if target in mine]
            scenes = [one.scene for one in session.trials]
            holding = [*alike_in(effect, target, scenes, holding)]
            separate = [[t for t in holding if standing[t] == stands] for stands in (False, True)]
            for trials in [holding] if effect is STATED_MASS else filter(None, separate):
                count = len(effect.parameters(session.trials[trials[0]].scene, target))
                yield Hypothesis(effect, target, tuple(trials), np.zeros(count), session)


def _own_terms(errors: TrialErrors) -> list[Term]:
    names = {FAULT + effect.name for effect in OF_A_LABORATORY}
    return [one for one in errors.terms if one.term not in names]


def with_known(
    trial: TrialErrors,
    standing: bool,
    coordinates: Sequence[Coordinate],
    mean: np.ndarray,
    root: np.ndarray,
) -> TrialErrors:
    """A trial whose shared faults are known from others, instead of as all laboratories have them.

    standing : whether the person stands still. mean (C,), root (C, K) : of the sizes and of the
    covariance of these [typical].
    """
    scene = as_simulated(trial.scene)
    columns = np.zeros((*trial.residual.shape, len(coordinates)))
    for effect in OF_A_LABORATORY:
        for target in shared_targets(effect, trial.scene):
            parameters = effect.parameters(trial.scene, target)
            mine = [Coordinate(effect.name, target, p.name, standing) for p in parameters]
            if mine[0] in coordinates:  # of a plate's middle other files may say less
                here = [k for k, one in enumerate(mine) if one in coordinates]
                at = [coordinates.index(mine[k]) for k in here]
                slope = effect.signature(scene, target, np.zeros(len(parameters)))
                columns[..., at] = trial.filter(slope[..., here])
    name = f"{FAULT}laboratory"
    term = Term(name, "", name, False, columns, mixing=root)
    residual = trial.residual - columns @ mean
    return replace(trial, residual=residual, terms=(*_own_terms(trial), term))
