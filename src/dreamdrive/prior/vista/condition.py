"""Conditions of the network: the first frame and the action. Importing this loads diffusers.

Units and signs of the actions are those of nuScenes' CAN bus, on which Vista was trained. Its code states
none of them, so some are [inferred]: from nuScenes' documentation and from what similar code does.
"""

from collections.abc import Mapping, Sequence
from math import degrees

import torch
from diffusers.models.embeddings import get_timestep_embedding
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional

from dreamdrive.prior.vista.kinds import ACTION_COLUMNS
from dreamdrive.scene.control import Action, Command, Goal, Steering, Waypoints

NUMBERS = {"command": 1, "trajectory": 8, "speed": 4, "angle": 4, "goal": 2}
"""Kinds of action in the order of their columns, and how many numbers each has."""
_COLUMNS = 128
_CLASSES = {"right": 0, "left": 1, "forward": 2, "stop": 3}
_WHEEL_RANGE_DEG = 780.0
_MEAN = (0.48145466, 0.4578275, 0.40821073)
_DEVIATION = (0.26862954, 0.26130258, 0.27577711)


def numbers_of(action: Action) -> dict[str, list[float]]:
    """The numbers that Vista takes, from SI units.

    * A command is the index of right, left, forward, stop [inferred: the order of ST-P3 and UniAD, and stop].
    * Waypoints are (x, y) in metres at 0.5, 1, 1.5 and 2 s; x to the right, y ahead [inferred: the axes of
      nuScenes' lidar, with whose pose the authors' annotations are made].
    * Speed is in km/h (nuScenes: ``vehicle_speed``); that of the training is raw [inferred: unscaled].
    * The steering wheel is in degrees over 780, the signal's range; to the left is positive [inferred: as in
      nuScenes' ``steeranglefeedback``; the signal of that range has no documented sign].
    * A goal is (u, v) as shares of width and height.
    """
    if isinstance(action, Command):
        return {"command": [_CLASSES[action.direction]]}
    if isinstance(action, Waypoints):
        points = zip(action.right_m, action.ahead_m, strict=True)
        return {"trajectory": [number for point in points for number in point]}
    if isinstance(action, Steering):
        return {
            "speed": [3.6 * speed for speed in action.speed_m_s],
            "angle": [degrees(wheel) / _WHEEL_RANGE_DEG for wheel in action.wheel_rad],
        }
    assert isinstance(action, Goal)
    return {"goal": [action.column, action.row]}


def embed_action(numbers: Mapping[str, Sequence[float]]) -> Float[Tensor, " a"]:
    """The columns (2432,) of the context that hold the action, from numbers by kind.

    A kind that is not given is zeros, which is not the same as the number zero.
    """
    columns = torch.zeros(ACTION_COLUMNS)
    start = 0
    for kind, count in NUMBERS.items():
        if kind in numbers:
            given = torch.tensor(numbers[kind], dtype=torch.float32)
            encoded = get_timestep_embedding(given, _COLUMNS, flip_sin_to_cos=True, downscale_freq_shift=0)
            columns[start : start + _COLUMNS * count] = encoded.flatten()
        start += _COLUMNS * count
    return columns


def columns_by_round(action: Action | None, count: int) -> list[Float[Tensor, " a"]]:
    """The columns of an action, which each round or window of frames is told anew; zeros without one."""
    free = embed_action({})
    if action is None:
        return [free] * count
    given = embed_action(numbers_of(action))
    # A goal is a point of the first frame, which later rounds no longer see.
    return [given, *[free if isinstance(action, Goal) else given] * (count - 1)]


def clip_pixels(image: Float[Tensor, "1 3 h w"], side_px: int = 224) -> Float[Tensor, "1 3 s s"]:
    """A frame in [-1, 1] as CLIP sees it: squeezed to a square, with CLIP's mean and deviation.

    Each side is blurred by as much as it shrinks, then sampled bicubically with the corners in the corners.
    Diffusers' pipeline of SVD has the same, but to import it asks for torchvision.
    """
    for axis in (3, 2):
        image = _blur(image, max((image.shape[axis] / side_px - 1) / 2, 1e-3), axis)
    small = functional.interpolate(image, (side_px, side_px), mode="bicubic", align_corners=True)
    small = (small + 1) / 2
    mean, deviation = (small.new_tensor(values).reshape(1, 3, 1, 1) for values in (_MEAN, _DEVIATION))
    return (small - mean) / deviation


def _blur(image: Float[Tensor, "1 3 h w"], deviation_px: float, axis: int) -> Float[Tensor, "1 3 h w"]:
    """A Gaussian along one axis, cut off at twice its deviation; edges are mirrored."""
    reach = int(max(4 * deviation_px, 3)) // 2
    place = torch.arange(-reach, reach + 1, dtype=image.dtype, device=image.device)
    weights = torch.exp(-(place**2) / (2 * deviation_px**2))
    shape = [1, 1, 1, 1]
    shape[axis] = len(weights)
    kernel = (weights / weights.sum()).reshape(shape).expand(3, -1, -1, -1)
    edges = (reach, reach, 0, 0) if axis == 3 else (0, 0, reach, reach)
    return functional.conv2d(functional.pad(image, edges, mode="reflect"), kernel, groups=3)
