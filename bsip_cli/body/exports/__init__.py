"""The formats by name: how the file ends and who writes it.

A model file is made by a template (``templates``), which has the person's tree and markers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from bsip_cli.body.exports.identified import IdentifiedPerson, rendered
from bsip_cli.body.exports.opensim_motion import COORDINATES
from bsip_cli.body.exports.visual3d_csv import visual3d_csv_text
from bsip_cli.body.gravity import GRAVITY_M_S2

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def model_text(kind: str, body: IdentifiedPerson) -> str:
    """A model for Pinocchio and other robotics (urdf), MuJoCo (mjcf), OpenSim 4 (osim), or biorbd
    and bioptim (biomod). Errors as of `check_bodies` and `markers`."""
    body.check_bodies()
    known = {"said": body.said(kind), "gravity": GRAVITY_M_S2, "quarter_turn": np.pi / 2}
    return rendered(f"{kind}.j2", body=body, axes=_AXES, coordinates=COORDINATES, **known)


FORMATS: dict[str, tuple[str, Callable[[IdentifiedPerson], str]]] = {
    "urdf": (".urdf", partial(model_text, "urdf")),
    "mjcf": (".xml", partial(model_text, "mjcf")),
    "osim": (".osim", partial(model_text, "osim")),
    "biomod": (".bioMod", partial(model_text, "biomod")),
    "csv": (".csv", visual3d_csv_text),
}
