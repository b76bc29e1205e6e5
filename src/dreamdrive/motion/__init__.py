"""F_deform and its baselines: where the dynamic Gaussians are over time."""

from dreamdrive.motion.deformation import DeformationConfig, DeformationField, Domain, encode
from dreamdrive.motion.hexplane import Bounds, HexPlaneConfig, HexPlaneField
from dreamdrive.motion.protocol import Motion, MotionConfig, Start
from dreamdrive.motion.table import (
    MOTIONS,
    REPRESENTATIONS,
    Representation,
    RepresentationName,
    rebuilt,
    start_motion,
)
from dreamdrive.motion.tracks import Tracks, multiply_quaternions
from dreamdrive.motion.vibration import Vibration, VibrationConfig
