"""Logs as components of NVIDIA NCore."""

from typing import TYPE_CHECKING, Literal

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError, installing
from dreamdrive.export.log_parts import stamps
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.log import BoxTrack, Log

if TYPE_CHECKING:
    from ncore.data import CuboidTrackObservation, OpenCVPinholeCameraModelParameters

WORLD, RIG = "world", "rig"
"""Frames that readers ask for; those of sensors have the sensors' names."""
Origin = Literal["GT_SYNTHETIC", "AUTOLABEL", "EXTERNAL"]
"""Where boxes come from: drawn, found by a program, or of a data set."""


def need_ncore() -> None:
    """Raise ``InputError`` where the package of NCore is not installed."""
    try:
        import ncore.data.v4  # noqa: F401
    except ImportError:
        raise InputError(
            f"NCore is written by the package nvidia-ncore, which is not installed; {installing('ncore')}"
        ) from None


def rigid(poses: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n 4 4"]:
    """The same poses, with last rows that are exact, which NCore asks for."""
    exact = poses.copy()
    exact[:, 3] = 0, 0, 0, 1
    return exact


def model_of(pinhole: Camera) -> "OpenCVPinholeCameraModelParameters":
    """The pinhole, as OpenCV's without distortion: gsplat takes no notice of NCore's ideal ones."""
    from ncore.data import OpenCVPinholeCameraModelParameters, ShutterType

    return OpenCVPinholeCameraModelParameters(
        resolution=np.array([pinhole.width_px, pinhole.height_px], np.uint64),
        shutter_type=ShutterType.GLOBAL,
        principal_point=np.array([pinhole.cx_px, pinhole.cy_px], np.float32),
        focal_length=np.array([pinhole.fx_px, pinhole.fy_px], np.float32),
        radial_coeffs=np.zeros(6, np.float32),
        tangential_coeffs=np.zeros(2, np.float32),
        thin_prism_coeffs=np.zeros(4, np.float32),
    )


def cuboids_of(
    log: Log, track: BoxTrack, world_from_log: Float[np.ndarray, "4 4"], origin: Origin
) -> "list[CuboidTrackObservation]":
    """A box at each of its times, in the world."""
    from ncore.data import BBox3, CuboidTrackObservation, LabelSource

    poses = world_from_log @ track.world_from_box
    turns = Rotation.from_matrix(poses[:, :3, :3]).as_euler("xyz")
    return [
        CuboidTrackObservation(
            track_id=track.id,
            class_id=track.category,
            timestamp_us=time_us,
            reference_frame_id=WORLD,
            reference_frame_timestamp_us=time_us,
            bbox3=BBox3(_three(pose[:3, 3]), _three(size_m), _three(turn)),
            source=LabelSource[origin],
        )
        for time_us, pose, size_m, turn in zip(
            stamps(log, track.times_s).tolist(), poses, track.size_lwh_m, turns, strict=True
        )
    ]


def _three(values: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
