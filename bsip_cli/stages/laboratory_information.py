"""laboratory (participant): what a person's sessions show of plates, clock and vertical."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.diagnosis.filtering import slow
from bsip_cli.diagnosis.shared_faults import Information, SharedTrial, information_of, inner
from bsip_cli.effects.scene import Scene
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import column_names
from bsip_cli.stages.diagnosed_trials import STATIC, diagnosed, is_weighed, prior_of, stated_sd
from bsip_cli.stages.frames import person_of
from bsip_cli.stages.trial_scene import scene_of
from bsip_cli.study.study import Trial

_LEAST_SAMPLES = 3  # of the residual, by which an autoregression is defined: 0.3 s on the plates


def run(unit: Unit) -> None:
    """Read motion, wrench, person and RM of all trials; write the information of each session."""
    person = person_of(unit)
    prior = prior_of(unit, person, whatever_mass=True)
    seen: dict[str, list[tuple[Trial, Scene]]] = {}
    for trial in unit.trials("kinematics", "wrench"):
        scene = scene_of(unit, person, prior.phi, trial)
        if trial.role != STATIC:
            scene = inner(scene)
        if scene.valid.any():
            seen.setdefault(trial.session or "", []).append((trial, scene))
    rows, sessions = [], {}
    for session, mine in seen.items():
        found = [diagnosed(unit, prior, *one, _LEAST_SAMPLES) for one in mine]
        usable = [one for one in found if one is not None and one.held is None]
        if any(one.moves for one in usable):
            scenes = [one.scene for one in usable if one.moves]
            moments = np.concatenate([one.times_s[one.valid] - one.times_s[0] for one in scenes])
            trials = [SharedTrial(x.errors, slow(x.scene), not x.moves) for x in usable]
            rows += _rows(session, information_of(trials))
            sessions[session] = {
                "plates": {p.name: p.corners_m.tolist() for _, s in mine for p in s.plates},
                "trials": [one.trial.stem for one in usable],
                # mean and standard deviation of those that show the clock, from each start
                "moments_s": [float(moments.mean()), float(moments.std())],
            }
    if not sessions:
        unit.warn(
            f"{unit.name}: no trial has motion with every contact on a plate; it shows nothing of "
            "the laboratory"
        )
    facts = {"sessions": sessions, "mass_sd": stated_sd(unit) if is_weighed(unit) else None}
    families = [name for row in rows for name in row if name.startswith("precision_")]
    columns = [*column_names("laboratory-information"), *dict.fromkeys(families)]
    unit.write("laboratory-information", pd.DataFrame(rows, columns=columns), facts)


def _rows(session: str, information: Information) -> list[dict]:
    numbers = zip(information.coordinates, information.parameters, information.trials, strict=True)
    return [
        {
            "session": session,
            **vars(one),
            **{name: getattr(parameter, name) for name in ("unit", "typical", "most", "known_to")},
            "trials": int(trials),
            "pull": information.pull[k],
            **{f"precision_{j}": x for j, x in enumerate(information.precision[k])},
        }
        for k, (one, parameter, trials) in enumerate(numbers)
    ]
