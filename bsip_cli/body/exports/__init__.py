"""The formats by name: how the file ends and who writes it."""

from __future__ import annotations

from collections.abc import Callable

from bsip_cli.body.exports.biomod import biomod_text
from bsip_cli.body.exports.identified import IdentifiedPerson
from bsip_cli.body.exports.mjcf import mjcf_text
from bsip_cli.body.exports.osim import osim_text
from bsip_cli.body.exports.urdf import urdf_text
from bsip_cli.body.exports.visual3d_csv import visual3d_csv_text

FORMATS: dict[str, tuple[str, Callable[[IdentifiedPerson], str]]] = {
    "urdf": (".urdf", urdf_text),
    "mjcf": (".xml", mjcf_text),
    "osim": (".osim", osim_text),
    "biomod": (".bioMod", biomod_text),
    "csv": (".csv", visual3d_csv_text),
}
