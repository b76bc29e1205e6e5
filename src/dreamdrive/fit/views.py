"""The frames a fit may see, as tensors, at full and at half size."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from dreamdrive.device import CPU
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry


@dataclass(frozen=True)
class View:
    """One reference frame.

    Attributes:
        index: Index in the clip.
        time_s: Its time.
        camera: Its pinhole and pose.
        image: RGB (H, W, 3) in [0, 1].
        mask: Pixels that count: valid and not fixed to the camera (H, W).
        sky: Sky (H, W).
        depth_m: Depth from multi-view stereo (H, W), 0 where there is none.
        depth_weight: Trust in it (H, W) in [0, 1]; 0 on moving things.
    """

    index: int
    time_s: float
    camera: Camera
    image: Float[Tensor, "h w 3"]
    mask: Bool[Tensor, "h w"]
    sky: Bool[Tensor, "h w"]
    depth_m: Float[Tensor, "h w"]
    depth_weight: Float[Tensor, "h w"]

    def to(self, device: torch.device) -> "View":
        """The same with its tensors on a device."""
        names = ("image", "mask", "sky", "depth_m", "depth_weight")
        return replace(self, **{name: getattr(self, name).to(device) for name in names})


def training_views(clip: Clip, geometry: Geometry, device: torch.device = CPU) -> dict[int, list[View]]:
    """All frames that are not held out, on a device, by how much they are shrunk: 1 and 2."""
    seen = np.flatnonzero(~clip.held_out).tolist()
    return {shrink: [_view(clip, geometry, i, shrink).to(device) for i in seen] for shrink in (1, 2)}


def _view(clip: Clip, geometry: Geometry, index: int, shrink: int) -> View:
    width, height = clip.size[0] // shrink, clip.size[1] // shrink

    def area(values: np.ndarray) -> np.ndarray:
        values = np.ascontiguousarray(values, dtype=np.float32)
        return values if shrink == 1 else cv2.resize(values, (width, height), interpolation=cv2.INTER_AREA)

    def nearest(values: np.ndarray) -> np.ndarray:
        values = np.ascontiguousarray(values, dtype=np.float32)
        return values if shrink == 1 else cv2.resize(values, (width, height), interpolation=cv2.INTER_NEAREST)

    street = geometry.fixed_regions[clip.camera[index]] == 0
    trust = geometry.confidence[index] * (geometry.moving[index] < 0.5) * (geometry.depth_m[index] > 0)
    return View(
        index=index,
        time_s=float(clip.times_s[index]),
        camera=geometry.cameras[index].resized(width, height),
        image=torch.from_numpy(area(clip.frames[index] / np.float32(255))),
        mask=torch.from_numpy(area(clip.valid[index] & street) > 0.99),
        sky=torch.from_numpy(area(geometry.sky[index]) > 0.99),
        depth_m=torch.from_numpy(nearest(geometry.depth_m[index])),
        depth_weight=torch.from_numpy(nearest(trust)),
    )
