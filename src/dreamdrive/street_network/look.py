"""Looks of the street network at single frames."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from math import log
from pathlib import Path

import cv2
import numpy as np
import torch
from jaxtyping import Float, Int, Shaped, UInt8, UInt16
from torch import Tensor

from dreamdrive.compute.device import CPU, chosen_device
from dreamdrive.compute.machine import available_cores
from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.errors import InputError
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.street.look import Look, RoadUser
from dreamdrive.scene.street.street_class import FLAT, StreetClass
from dreamdrive.street_network.cameras import camera_of, common_camera
from dreamdrive.street_network.grouping import GroupingOptions, group
from dreamdrive.street_network.joining import JoiningOptions, joined
from dreamdrive.street_network.prediction import Prediction
from dreamdrive.street_network.resize import ResizePad, within_regions
from dreamdrive.street_network.shipped import SHIPPED, load_knowledge

Network = Callable[[Float[Tensor, "n 3 h w"]], Prediction]
"""From RGB pictures in [0, 1], whose sides are multiples of 32 pixels; it is where ``chosen_device`` says."""
_AT_ONCE = 8
"""Frames that another device than the CPU sees at once."""
_WITHIN_68 = -log(1 - 0.6827)
"""Half width of the interval that holds 68 % of a Laplace distribution of scale 1."""


@dataclass(frozen=True)
class LookOptions:
    """How the network is applied."""

    width_px: int = 512
    """Width of the pictures that it takes, a multiple of 32: at 512 those of 16:9 are 288 high."""
    grouping: GroupingOptions = field(default_factory=GroupingOptions)
    joining: JoiningOptions = field(default_factory=JoiningOptions)
    features: bool = False
    """Whether what the network computes its answers from is kept."""


@dataclass(frozen=True)
class _Seen:
    """One frame, as ``Look`` has it; the camera as ``Prediction`` does."""

    maps: dict[str, Shaped[np.ndarray, "h w"]]
    road_users: tuple[RoadUser, ...]
    camera: Float[np.ndarray, " 7"]
    features: Float[np.ndarray, "c h2 w2"] | None


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
    resize = ResizePad.choose(width, height, options.width_px)
    maps = {name: np.zeros((count, height, width), kind) for name, kind in _KINDS.items()}
    seen: list[_Seen] = []
    for each in _see_all(frames, network, resize, options):
        for name, values in each.maps.items():
            maps[name][len(seen)] = values
        seen.append(replace(each, maps={}))
        tell(len(seen), count)
    cameras = tuple(camera_of(each.camera, resize) for each in seen)
    camera = common_camera(cameras)
    if focal_px is not None:
        maps["depth"] *= np.float32(focal_px / camera.focal_px)
        known = {"focal_px": focal_px, "focal_spread": 0.0}
        camera, cameras = replace(camera, **known), tuple(replace(each, **known) for each in cameras)
    kept = [each.features for each in seen if each.features is not None]
    return Look(
        **maps,
        road_users=tuple(each.road_users for each in seen),
        cameras=cameras,
        camera=camera,
        camera_height_m=camera_height_m,
        features=np.stack(kept) if kept else None,
    )


_KINDS = {
    "depth": np.float32,
    # Three digits of trust are enough, and a frame takes 11 bytes a pixel.
    "spread": np.float16,
    "classes": np.uint8,
    "confidence": np.float16,
    "instances": np.uint16,
}


def _see_all(
    frames: UInt8[np.ndarray, "f h w 3"], network: Network, resize: ResizePad, options: LookOptions
) -> Iterator[_Seen]:
    """What is seen in each frame, on every core at once.

    Each thread has a frame to itself. Threads of torch wait for each other after every operation, and beside
    other work on the machine a frame then took two seconds. Another device answers of many frames at once.
    """
    device = chosen_device()
    with one_torch_thread(), ThreadPoolExecutor(available_cores()) as pool:
        if device == CPU:
            answers = (partial(_answer, frame[None], network, resize, CPU) for frame in frames)
        else:
            answers = _answers_of(frames, network, resize, device)
        try:
            yield from pool.map(partial(_see, resize=resize, options=options), answers)
        finally:
            pool.shutdown(cancel_futures=True)


@torch.inference_mode()
def _answer(
    frames: UInt8[np.ndarray, "f h w 3"], network: Network, resize: ResizePad, device: torch.device
) -> Prediction:
    """What the network says, on the CPU."""
    return network(resize.taken(frames).to(device)).to(CPU)


def _answers_of(
    frames: UInt8[np.ndarray, "f h w 3"], network: Network, resize: ResizePad, device: torch.device
) -> Iterator[Callable[[], Prediction]]:
    """What it says of each frame, found for many at once."""
    for first in range(0, len(frames), _AT_ONCE):
        some = frames[first : first + _AT_ONCE]
        said = _answer(some, network, resize, device)
        yield from (partial(said.of, k) for k in range(len(some)))


@torch.inference_mode()
def _see(answer: Callable[[], Prediction], resize: ResizePad, options: LookOptions) -> _Seen:
    """What the network says of one frame, on the frame's pixels."""
    said = answer()
    chance, classes = _classes(torch.softmax(resize.on_pixels(said.classes[0]), dim=0))
    peaks = torch.sigmoid(resize.shown(said.centre[0]))
    # Between two road users a mean of their offsets would point to neither.
    offset_px = resize.on_pixels(said.offset[0], "nearest-exact") / resize.scale
    parts, road_users = group(classes, chance, peaks, offset_px, options.grouping)
    classes = _with_road_users(classes, parts, road_users)
    depth, spread = _depth(said, resize, _regions(classes, parts))
    instances, road_users = joined(
        parts, road_users, depth.numpy(), classes.numpy(), options.joining, options.grouping.closing
    )
    classes = _with_road_users(classes, instances, road_users)
    sky = classes == StreetClass.SKY
    maps = {
        "depth": depth.masked_fill(sky, 0),
        "spread": spread.masked_fill(sky, 0),
        "classes": classes.byte(),
        "confidence": chance,
    }
    kept = resize.shown(said.features)[0].numpy() if options.features and said.features is not None else None
    return _Seen(
        maps={"instances": instances, **{name: values.numpy() for name, values in maps.items()}},
        road_users=road_users,
        camera=said.camera[0].double().numpy(),
        features=kept,
    )


def _with_road_users(
    classes: Int[Tensor, "h w"], instances: UInt16[np.ndarray, "h w"], road_users: tuple[RoadUser, ...]
) -> Int[Tensor, "h w"]:
    """Classes of pixels, where road users are those of the users."""
    kinds = torch.tensor([0, *(user.kind for user in road_users)])[
        torch.from_numpy(instances.astype(np.int64))
    ]
    return torch.where(torch.from_numpy(instances > 0), kinds, classes)


def _classes(chances: Float[Tensor, "c h w"]) -> tuple[Float[Tensor, "h w"], Int[Tensor, "h w"]]:
    """The class of each pixel and its probability.

    The own car is fixed to the camera and comes in from the picture's border: what is taken for it and hangs
    together with none of the border has the second most likely class.
    """
    chance, classes = chances.max(dim=0)
    count, found = cv2.connectedComponents((classes == StreetClass.OWN_CAR).byte().numpy())
    parts = np.asarray(found, np.int32)
    inside = np.ones(count, bool)
    inside[np.concatenate([[0], parts[0], parts[-1], parts[:, 0], parts[:, -1]])] = False
    if inside.any():
        island = torch.from_numpy(np.flatnonzero(inside[parts]))
        others = chances.flatten(1)[:, island]
        others[StreetClass.OWN_CAR] = 0
        chance.view(-1)[island], classes.view(-1)[island] = others.max(dim=0)
    return chance, classes


def _depth(
    said: Prediction, resize: ResizePad, regions: Int[Tensor, "h w"]
) -> tuple[Float[Tensor, "h w"], Float[Tensor, "h w"]]:
    """Depth in camera heights and its relative spread.

    What lies between two surfaces is unsure, and counts less.
    """
    scale = resize.shown(said.log_spread[0])
    logs = torch.stack([resize.shown(said.log_depth[0]), scale])
    log_depth, log_spread = within_regions(logs, torch.exp(-scale), regions)
    return log_depth.exp(), torch.expm1(_WITHIN_68 * log_spread.exp())


def _regions(classes: Int[Tensor, "h w"], instances: UInt16[np.ndarray, "h w"]) -> Int[Tensor, "h w"]:
    """A number for each surface within which depth is smooth."""
    surface = torch.arange(len(StreetClass))
    surface[list(FLAT)] = int(FLAT[0])
    return surface[classes] + len(StreetClass) * torch.from_numpy(instances.astype(np.int64))
