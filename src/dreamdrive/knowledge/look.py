"""What the street network sees in frames."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from math import log
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Int, UInt8, UInt16
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.knowledge.cameras import camera_of, common_camera
from dreamdrive.knowledge.fitting import Fitting, within_regions
from dreamdrive.knowledge.grouping import GroupingOptions, group
from dreamdrive.knowledge.prediction import Prediction
from dreamdrive.knowledge.shipped import SHIPPED, load_knowledge
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.look import Look, RoadUser
from dreamdrive.scene.street_class import StreetClass

Network = Callable[[Float[Tensor, "n 3 h w"]], Prediction]
"""From RGB pictures in [0, 1], whose sides are multiples of 32 pixels."""
_WITHIN_68 = -log(1 - 0.6827)
"""Half width of the interval that holds 68 % of a Laplace distribution of scale 1."""
_FLAT = (StreetClass.ROAD, StreetClass.MARKING, StreetClass.GROUND)
"""One surface, as far as depth goes."""
_EMPTY = (StreetClass.SKY, StreetClass.OWN_CAR)


@dataclass(frozen=True)
class LookOptions:
    """How the network is applied."""

    width_px: int = 512
    """Width of the pictures that it takes, a multiple of 32: at 512 those of 16:9 are 288 high."""
    batch: int = 2
    """Pictures at a time: more take memory and no less time on two cores."""
    grouping: GroupingOptions = field(default_factory=GroupingOptions)
    features: bool = False
    """Whether what the network computes its answers from is kept."""


@dataclass(frozen=True)
class _Seen:
    """One frame, with depth in camera heights as ``Look`` has it."""

    depth: Float[np.ndarray, "h w"]
    spread: Float[np.ndarray, "h w"]
    classes: UInt8[np.ndarray, "h w"]
    confidence: Float[np.ndarray, "h w"]
    instances: UInt16[np.ndarray, "h w"]
    road_users: tuple[RoadUser, ...]


def look(
    frames: UInt8[np.ndarray, "f h w 3"],
    knowledge: Network | str | Path = SHIPPED,
    *,
    focal_px: float | None = None,
    camera_height_m: float | None = None,
    options: LookOptions = LookOptions(),
    tell: Progress = silent,
) -> Look:
    """See depth, classes, road users and the camera in frames of one camera.

    Args:
        frames: RGB, undistorted as far as the lens is known, with the principal point in the middle.
        knowledge: The network, the name of weights that ship, or a file of weights.
        focal_px: Focal length where it is known; depth on the road is proportional to it.
        camera_height_m: Height of the camera above the road, which makes metres of depth.
        options: How the network is applied.
        tell: Told of frames done.
    """
    if not len(frames):
        raise InputError("no frame is given; expected at least one picture")
    for name, value in (("focal length", focal_px), ("camera height", camera_height_m)):
        if value is not None and not 0 < value < float("inf"):
            raise InputError(f"{name} {value:g}: expected a positive number")
    count, height, width = frames.shape[:3]
    network = load_knowledge(knowledge) if isinstance(knowledge, str | Path) else knowledge
    fitting = Fitting.choose(width, height, options.width_px)
    shape = count, height, width
    maps = {name: np.zeros(shape, kind) for name, kind in _KINDS.items()}
    users: list[tuple[RoadUser, ...]] = []
    answers: list[Float[np.ndarray, 7]] = []
    features: list[Float[np.ndarray, "c h w"]] = []
    with torch.inference_mode():
        for said in _answers(frames, fitting, network, options.batch):
            seen = _seen(said, fitting, options.grouping)
            for name, each in maps.items():
                each[len(users)] = getattr(seen, name)
            users.append(seen.road_users)
            answers.append(said.camera[0].double().numpy())
            if options.features and said.features is not None:
                features.append(fitting.shown(said.features)[0].numpy())
            tell(len(users), count)
    cameras = tuple(camera_of(each, fitting) for each in answers)
    camera = common_camera(cameras)
    if focal_px is not None:
        maps["depth"] *= np.float32(focal_px / camera.focal_px)
        known = {"focal_px": focal_px, "focal_spread": 0.0}
        camera, cameras = replace(camera, **known), tuple(replace(each, **known) for each in cameras)
    kept = np.stack(features) if features else None
    return Look(
        **maps,
        road_users=tuple(users),
        cameras=cameras,
        camera=camera,
        camera_height_m=camera_height_m,
        features=kept,
    )


_KINDS = {
    "depth": np.float32,
    # Three digits of trust are enough, and a frame takes 13 bytes a pixel.
    "spread": np.float16,
    "classes": np.uint8,
    "confidence": np.float16,
    "instances": np.uint16,
}


def _answers(
    frames: UInt8[np.ndarray, "f h w 3"], fitting: Fitting, network: Network, batch: int
) -> Iterator[Prediction]:
    """The network's answers, one frame at a time."""
    for first in range(0, len(frames), batch):
        said = network(fitting.taken(frames[first : first + batch]))
        for index in range(len(said.camera)):
            yield said.of(index)


def _seen(said: Prediction, fitting: Fitting, options: GroupingOptions) -> _Seen:
    """What the network says of one frame, on the frame's pixels."""
    chance, classes = torch.softmax(fitting.on_pixels(said.classes[0]), dim=0).max(dim=0)
    peaks = torch.sigmoid(fitting.shown(said.centre[0]))
    # Between two road users a mean of their offsets would point to neither.
    offset_px = fitting.on_pixels(said.offset[0], "nearest-exact") / fitting.scale
    instances, users = group(classes, chance, peaks, offset_px, options)
    depth, spread = _depth(said, fitting, _regions(classes, instances))
    empty = torch.isin(classes, torch.tensor(_EMPTY))
    return _Seen(
        depth=depth.masked_fill(empty, 0).numpy(),
        spread=spread.masked_fill(empty, 0).numpy(),
        classes=classes.byte().numpy(),
        confidence=chance.numpy(),
        instances=instances,
        road_users=users,
    )


def _depth(
    said: Prediction, fitting: Fitting, regions: Int[Tensor, "h w"]
) -> tuple[Float[Tensor, "h w"], Float[Tensor, "h w"]]:
    """Depth in camera heights and its relative spread.

    What lies between two surfaces is unsure, and counts less.
    """
    scale = fitting.shown(said.log_spread[0])
    logs = torch.stack([fitting.shown(said.log_depth[0]), scale])
    log_depth, log_spread = within_regions(logs, torch.exp(-scale), regions)
    return log_depth.exp(), torch.expm1(_WITHIN_68 * log_spread.exp())


def _regions(classes: Int[Tensor, "h w"], instances: UInt16[np.ndarray, "h w"]) -> Int[Tensor, "h w"]:
    """A number for each surface within which depth is smooth."""
    surface = torch.arange(len(StreetClass))
    surface[list(_FLAT)] = int(_FLAT[0])
    return surface[classes] + len(StreetClass) * torch.from_numpy(instances.astype(np.int64))
