"""The frames a fit may see, as tensors."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from dreamdrive.compute.device import CPU
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.vision.windows import grown

_RIM_PX = 3  # around what moves, of a picture that is 480 wide: its own splats reach into it


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
        still: What stands, away from what moves (H, W); nothing where no motion was seen in any frame.
    """

    index: int
    time_s: float
    camera: Camera
    image: Float[Tensor, "h w 3"]
    mask: Bool[Tensor, "h w"]
    sky: Bool[Tensor, "h w"]
    depth_m: Float[Tensor, "h w"]
    depth_weight: Float[Tensor, "h w"]
    still: Bool[Tensor, "h w"]

    def to(self, device: torch.device) -> "View":
        """The same with its tensors on a device."""
        names = ("image", "mask", "sky", "depth_m", "depth_weight", "still")
        return replace(self, **{name: getattr(self, name).to(device) for name in names})


def training_views(clip: Clip, geometry: Geometry, device: torch.device = CPU) -> list[View]:
    """All frames that are not held out, on a device."""
    seen_to_move = bool((geometry.moving >= 0.5).any())
    used = np.flatnonzero(~clip.held_out).tolist()
    return [_view(clip, geometry, index, seen_to_move).to(device) for index in used]


def _view(clip: Clip, geometry: Geometry, index: int, seen_to_move: bool) -> View:
    street = geometry.fixed_regions[clip.camera[index]] == 0
    moves = geometry.moving[index] >= 0.5
    trust = geometry.confidence[index] * ~moves * (geometry.depth_m[index] > 0)
    return View(
        index=index,
        time_s=float(clip.times_s[index]),
        camera=geometry.cameras[index],
        image=torch.from_numpy(clip.frames[index] / np.float32(255)),
        mask=torch.from_numpy(clip.valid[index] & street),
        sky=torch.from_numpy(geometry.sky[index].copy()),
        depth_m=torch.from_numpy(geometry.depth_m[index].astype(np.float32)),
        depth_weight=torch.from_numpy(trust.astype(np.float32)),
        still=torch.from_numpy(~_around(moves) & seen_to_move),
    )


def _around(moves: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """What moves, with a rim."""
    reach = max(1, round(grown(_RIM_PX, moves.shape[1])))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    return cv2.dilate(moves.astype(np.uint8), disc) > 0
