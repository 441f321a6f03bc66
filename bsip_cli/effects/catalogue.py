"""All effects that a diagnosis considers; a new one is a file and a line here."""

from __future__ import annotations

from bsip_cli.effects.added_mass import AddedMass
from bsip_cli.effects.breathing import Breathing
from bsip_cli.effects.camera_frame import CameraFrame
from bsip_cli.effects.clock_drift import ClockDrift
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.external_force import ExternalForce
from bsip_cli.effects.gravity_tilt import GravityTilt
from bsip_cli.effects.implement import Implement
from bsip_cli.effects.joint_centre import JointCentre
from bsip_cli.effects.marker_shift import MarkerShift
from bsip_cli.effects.marker_slide import MarkerSlide
from bsip_cli.effects.marker_swap import MarkerSwap
from bsip_cli.effects.missing_joint import MissingJoint
from bsip_cli.effects.object_handled import ObjectHandled
from bsip_cli.effects.over_smoothing import OverSmoothing
from bsip_cli.effects.plate_crosstalk import PlateCrosstalk
from bsip_cli.effects.plate_drift import PlateDrift
from bsip_cli.effects.plate_gain import PlateGain
from bsip_cli.effects.plate_rotation import PlateRotation
from bsip_cli.effects.plate_translation import PlateTranslation
from bsip_cli.effects.plate_zero import PlateZero
from bsip_cli.effects.released_object import ReleasedObject
from bsip_cli.effects.segment_inertia import SegmentInertia
from bsip_cli.effects.sync_offset import SyncOffset
from bsip_cli.effects.unmeasured_contact import UnmeasuredContact
from bsip_cli.effects.wobbling_mass import WobblingMass

CATALOGUE: tuple[Effect, ...] = (
    SyncOffset(),
    ClockDrift(),
    PlateTranslation(),
    PlateRotation(),
    PlateGain(),
    PlateCrosstalk(),
    PlateZero(),
    PlateDrift(),
    GravityTilt(),
    AddedMass(),
    ReleasedObject(),
    WobblingMass(),
    Breathing(),
    UnmeasuredContact(),
    JointCentre(),
    MissingJoint(),
    MarkerShift(),
    MarkerSwap(),
    OverSmoothing(),
    SegmentInertia(),
    Implement(),
    CameraFrame(),
    ExternalForce(),
    ObjectHandled(),
    MarkerSlide(),
)
EFFECTS = {effect.name: effect for effect in CATALOGUE}
