"""F_deform and its baselines: where the dynamic Gaussians are over time."""

from dreamdrive.motion.deformation import DeformationConfig, DeformationField, Domain, encode
from dreamdrive.motion.hexplane import Bounds, HexPlaneConfig, HexPlaneField
from dreamdrive.motion.protocol import Motion, MotionConfig, Start
from dreamdrive.motion.table import (
    MOTIONS,
    REPRESENTATIONS,
    Representation,
    choose_representation,
    rebuilt,
    start_motion,
)
from dreamdrive.motion.tracks import Tracks, multiply_quaternions
from dreamdrive.motion.vibration import Vibration, VibrationConfig

__all__ = [
    "MOTIONS",
    "REPRESENTATIONS",
    "Bounds",
    "DeformationConfig",
    "DeformationField",
    "Domain",
    "HexPlaneConfig",
    "HexPlaneField",
    "Motion",
    "MotionConfig",
    "Representation",
    "Start",
    "Tracks",
    "Vibration",
    "VibrationConfig",
    "choose_representation",
    "encode",
    "multiply_quaternions",
    "rebuilt",
    "start_motion",
]
