"""What NCore's own reader and camera say of a sequence; imported only where the package is there."""

from pathlib import Path

import numpy as np
from ncore.data import CuboidTrackObservation, FrameTimepoint, SequenceLoaderProtocol
from ncore.data.v4 import SequenceComponentGroupsReader, SequenceLoaderV4
from ncore.impl.common.transformations import bbox_pose
from ncore.sensors import CameraModel

from dreamdrive.scene.street.log import box_corners

Sequence = SequenceLoaderProtocol


def read(folder: Path) -> Sequence:
    return SequenceLoaderV4(SequenceComponentGroupsReader([folder / "sequence.json"]))


def world_from_camera(read: Sequence, name: str) -> np.ndarray:
    """Poses of all frames of a camera."""
    sensor = read.get_camera_sensor(name)
    return sensor.get_frames_T_sensor_target("world", np.arange(sensor.frames_count))


def projected(read: Sequence, name: str, frame: int, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where a camera sees points of the world at a frame, and indices of those that it does see."""
    sensor = read.get_camera_sensor(name)
    model = CameraModel.from_parameters(sensor.model_parameters, device="cpu")
    ends = [
        sensor.get_frames_T_source_sensor("world", frame, when).astype(np.float32)
        for when in (FrameTimepoint.START, FrameTimepoint.END)
    ]
    seen = model.world_points_to_image_points_shutter_pose(
        points.astype(np.float32), *ends, return_valid_indices=True
    )
    return seen.image_points.numpy(), seen.valid_indices.numpy()


def corners_of(box: CuboidTrackObservation) -> np.ndarray:
    flat = box.bbox3.to_array().astype(np.float64)
    return box_corners(bbox_pose(flat), flat[3:6])
