"""F_deform and its baselines: where the dynamic Gaussians are over time."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.motion import deformation as deformation
    from dreamdrive.motion.baselines.hexplane import (
        Bounds as Bounds,
        HexPlaneConfig as HexPlaneConfig,
        HexPlaneField as HexPlaneField,
    )
    from dreamdrive.motion.baselines.vibration import (
        Vibration as Vibration,
        VibrationConfig as VibrationConfig,
    )
    from dreamdrive.motion.deformation import (
        DeformationConfig as DeformationConfig,
        DeformationField as DeformationField,
        Domain as Domain,
        encode as encode,
    )
    from dreamdrive.motion.protocol import Motion as Motion, MotionConfig as MotionConfig, Start as Start
    from dreamdrive.motion.table import (
        MOTIONS as MOTIONS,
        REPRESENTATIONS as REPRESENTATIONS,
        Representation as Representation,
        rebuilt as rebuilt,
        start_motion as start_motion,
    )
    from dreamdrive.motion.tracks import Tracks as Tracks, multiply_quaternions as multiply_quaternions

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
