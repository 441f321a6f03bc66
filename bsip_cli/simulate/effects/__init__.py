"""Effects hidden in recordings; this table is all that the rest knows of them.

CATALOGUE holds those that a diagnosis should name, OUTSIDE those that it cannot know.
"""

from __future__ import annotations

from bsip_cli.simulate.effects.added_mass import AddedMass
from bsip_cli.simulate.effects.base import Effect
from bsip_cli.simulate.effects.breathing import Breathing
from bsip_cli.simulate.effects.camera_frame import CameraFrame
from bsip_cli.simulate.effects.clocks import ClockDrift, SyncOffset
from bsip_cli.simulate.effects.external_force import ExternalForce
from bsip_cli.simulate.effects.gravity_tilt import GravityTilt
from bsip_cli.simulate.effects.implement import Implement
from bsip_cli.simulate.effects.joint_centre import JointCentre
from bsip_cli.simulate.effects.marker_errors import MarkerShift, MarkerSwap, OverSmoothing
from bsip_cli.simulate.effects.marker_slide import MarkerSlide
from bsip_cli.simulate.effects.missing_joint import MissingJoint
from bsip_cli.simulate.effects.object_handled import ObjectHandled
from bsip_cli.simulate.effects.outside import (
    BeltVibration,
    ClockJump,
    ElasticTether,
    LateChannel,
    LooseConnector,
    PlateHysteresis,
    PlateSaturation,
    RepeatedFrames,
)
from bsip_cli.simulate.effects.plate_channels import (
    PlateCrosstalk,
    PlateDrift,
    PlateGain,
    PlateZero,
)
from bsip_cli.simulate.effects.plate_pose import PlateRotation, PlateTranslation
from bsip_cli.simulate.effects.released_object import ReleasedObject
from bsip_cli.simulate.effects.segment_inertia import SegmentInertia
from bsip_cli.simulate.effects.unmeasured_contact import UnmeasuredContact
from bsip_cli.simulate.effects.wobbling_mass import WobblingMass

CATALOGUE: tuple[type[Effect], ...] = (
    SyncOffset,
    ClockDrift,
    PlateTranslation,
    PlateRotation,
    PlateGain,
    PlateCrosstalk,
    PlateZero,
    PlateDrift,
    GravityTilt,
    AddedMass,
    ReleasedObject,
    WobblingMass,
    Breathing,
    UnmeasuredContact,
    JointCentre,
    MissingJoint,
    MarkerShift,
    MarkerSwap,
    OverSmoothing,
    SegmentInertia,
    Implement,
    CameraFrame,
    ExternalForce,
    ObjectHandled,
    MarkerSlide,
)
OUTSIDE: tuple[type[Effect], ...] = (
    BeltVibration,
    PlateHysteresis,
    PlateSaturation,
    RepeatedFrames,
    ElasticTether,
    LateChannel,
    LooseConnector,
    ClockJump,
)
EFFECTS = {effect.name: effect for effect in (*CATALOGUE, *OUTSIDE)}
