"""Input and output of a network that sees many frames at once, whoever made it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.geometry.resize import ResizeCrop, prepare
from dreamdrive.scene.camera import Camera

METRE_SPREAD = 0.15
"""How far the metre of a network that claims it may be off. Assumed: the authors give errors on data sets of
their own, none for drives; it is as much as an assumed height of the camera."""
_PATCH_PX = 14
_MEAN = (0.485, 0.456, 0.406)
_DEVIATION = (0.229, 0.224, 0.225)


@dataclass(frozen=True)
class Views:
    """What a network is shown, and what is known of it."""

    pictures: Float[Tensor, "n 3 h w"]  # RGB in [0, 1], both sides multiples of 14
    camera: Camera | None = None  # of the pictures, where it is calibrated
    world_from_camera: Float[np.ndarray, "n 4 4"] | None = None
    metric: bool = True  # the unit of these poses


@dataclass(frozen=True)
class FeedforwardResult:
    """What it sees in them, in a world and a unit of its own."""

    world_from_camera: Float[np.ndarray, "n 4 4"]  # rigid; x right, y down, z forward
    intrinsics: Float[np.ndarray, "n 3 3"]  # in pixels; the centre of the top-left one is at (0.5, 0.5)
    depth: Float[np.ndarray, "n h w"]  # along z in the unit of the poses; 0 where there is none
    confidence: Float[np.ndarray, "n h w"]  # grows with trust, on any scale that all calls share


@dataclass(frozen=True)
class Network:
    """A network with its weights."""

    predict: Callable[[Views], FeedforwardResult]
    unit: str | None = None  # what says that it is the metre, in words
    unit_spread: float = 0.0  # how far that metre may be off, as a fraction


def fit_patches(width_px: int, height_px: int, long_side_px: int) -> ResizeCrop:
    """How frames are resized to whole patches: a little stretched, nothing cut off.

    The long side, a multiple of 14, is given; the other takes the nearest multiple.
    """
    longest = max(width_px, height_px)
    width, height = (
        max(_PATCH_PX, round(side * long_side_px / longest / _PATCH_PX) * _PATCH_PX)
        for side in (width_px, height_px)
    )
    return ResizeCrop((width_px, height_px), (width, height), 0, 0, (width, height), longest > long_side_px)


def show(frames: UInt8[np.ndarray, "n h w 3"], how: ResizeCrop) -> Float[Tensor, "n 3 u v"]:
    """The pictures, in [0, 1], of frames."""
    pictures = np.stack([prepare(frame, how) for frame in frames])
    return torch.from_numpy(pictures).permute(0, 3, 1, 2).float().div(255)


def standardise(pictures: Float[Tensor, "n 3 h w"]) -> Float[Tensor, "n 3 h w"]:
    """Pictures in [0, 1] with mean and deviation of ImageNet's taken out, as DINOv2 was trained."""
    mean, deviation = (pictures.new_tensor(values)[:, None, None] for values in (_MEAN, _DEVIATION))
    return (pictures - mean) / deviation


def world_from_camera(camera_from_world: Float[Tensor, "n _ 4"]) -> Float[np.ndarray, "n 4 4"]:
    """The inverses of transforms from world to camera, made rigid."""
    rigid = nearest_rigid(camera_from_world)
    inverse = rigid.copy()
    inverse[:, :3, :3] = turned = np.swapaxes(rigid[:, :3, :3], 1, 2)
    inverse[:, :3, 3:] = -turned @ rigid[:, :3, 3:]
    return inverse


def nearest_rigid(matrices: Float[Tensor, "n _ 4"]) -> Float[np.ndarray, "n 4 4"]:
    """Transforms with the rotations nearest to theirs, in float64.

    Low precision and regressed quaternions leave rotations a little off.
    """
    given = matrices.detach().cpu().double().numpy()
    if not np.isfinite(given).all():
        raise InputError("the network gives poses that are not finite: its weights are not what it expects")
    left, _, right = np.linalg.svd(given[:, :3, :3])
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
    rigid = np.tile(np.eye(4), (len(given), 1, 1))
    rigid[:, :3, :3] = left @ right
    rigid[:, :3, 3] = given[:, :3, 3]
    return rigid
