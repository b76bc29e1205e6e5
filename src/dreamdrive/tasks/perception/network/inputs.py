"""Input of a Cross-View Transformer, from the pictures and poses of cameras."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, UInt8
from PIL import Image
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.tasks.perception.options import ImageSize
from dreamdrive.tasks.perception.raster import BevLabels, flat_pose
from dreamdrive.tasks.perception.training.batch import BevBatch, as_truth


@dataclass(frozen=True)
class BevSample:
    """One time of a drive, by n cameras in any order; nuScenes' is front left, front, front right, and back.

    Attributes:
        pictures: RGB, as ``prepare_picture`` makes them.
        pixel_from_camera: Intrinsics in pixels of these pictures.
        camera_from_ego: Extrinsics, see ``camera_from_level_ego``.
        labels: What is around the car.
    """

    pictures: UInt8[np.ndarray, "n 3 h w"]
    pixel_from_camera: Float[np.ndarray, "n 3 3"]
    camera_from_ego: Float[np.ndarray, "n 4 4"]
    labels: BevLabels


def prepare_picture(
    picture: UInt8[np.ndarray, "h w 3"], pixel_from_camera: Float[np.ndarray, "3 3"], size: ImageSize
) -> tuple[UInt8[np.ndarray, "3 y x"], Float[np.ndarray, "3 3"]]:
    """Resize a picture by antialiased bilinear, cut its top off, and do the same to its intrinsics.

    Args:
        picture: RGB of any size.
        pixel_from_camera: In pixels of this picture.
        size: Wanted. Resizing stretches the picture where its shape is another.

    Returns:
        The picture, and intrinsics in its pixels in float32.
    """
    whole = size.width_px, size.height_px + size.cropped_px
    resized = np.asarray(Image.fromarray(picture).resize(whole, Image.Resampling.BILINEAR))
    scaled = pixel_from_camera.astype(np.float32)
    scaled[0] *= size.width_px / picture.shape[1]
    scaled[1] *= (size.height_px + size.cropped_px) / picture.shape[0]
    scaled[1, 2] -= size.cropped_px
    return np.ascontiguousarray(resized[size.cropped_px :].transpose(2, 0, 1)), scaled


def camera_from_level_ego(
    world_from_camera: Float[np.ndarray, "4 4"], world_from_ego: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "4 4"]:
    """Extrinsics in float32: from the ego frame, made level, to a camera.

    Args:
        world_from_camera: At the time of the picture; x right, y down, z ahead.
        world_from_ego: At the time of the labels; it may be tilted.
    """
    return (np.linalg.inv(world_from_camera) @ flat_pose(world_from_ego)).astype(np.float32)


def as_batch(samples: Sequence[BevSample]) -> BevBatch:
    """Samples in one batch; all have the same number of cameras.

    Raises:
        InputError: There are none, or their shapes differ.
    """
    shapes = {each.pictures.shape for each in samples}
    if len(shapes) != 1:
        raise InputError(
            f"samples whose pictures are of {sorted(shapes)}; expected one shape, of all of them"
        )
    return BevBatch(
        pictures=_stacked([each.pictures for each in samples]),
        pixel_from_camera=_stacked([each.pixel_from_camera for each in samples]),
        camera_from_ego=_stacked([each.camera_from_ego for each in samples]),
        truth=as_truth([each.labels for each in samples]),
    )


def _stacked(arrays: Sequence[np.ndarray]) -> Tensor:
    return torch.from_numpy(np.stack(arrays))
