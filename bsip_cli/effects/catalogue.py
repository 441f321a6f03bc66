"""All effects that a diagnosis considers; a new one is a class and a line here."""

from __future__ import annotations

from bsip_cli.effects import body, frames, joints, loads, markers, plates
from bsip_cli.effects.effect import Effect

CATALOGUE: tuple[Effect, ...] = (
    plates.SyncOffset(),
    plates.ClockDrift(),
    plates.FrameRate(),
    plates.PlateTranslation(),
    plates.PlateRotation(),
    plates.PlateGain(),
    plates.PlateCrosstalk(),
    plates.PlateZero(),
    plates.PlateDrift(),
    frames.GravityTilt(),
    loads.AddedMass(),
    loads.ReleasedObject(),
    body.WobblingMass(),
    body.Breathing(),
    loads.UnmeasuredContact(),
    joints.JointCentre(),
    joints.MissingJoint(),
    markers.MarkerShift(),
    markers.MarkerSwap(),
    markers.OverSmoothing(),
    body.SegmentInertia(),
    loads.Implement(),
    frames.CameraFrame(),
    loads.ExternalForce(),
    loads.ObjectHandled(),
    markers.MarkerSlide(),
)
EFFECTS = {effect.name: effect for effect in CATALOGUE}
