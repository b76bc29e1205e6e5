"""The frames a fit may see, as tensors."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, Float16, UInt8
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

    @cached_property
    def solid(self) -> Bool[Tensor, "h w"]:
        """Pixels that something should cover (H, W)."""
        return self.mask & ~self.sky

    def whole(self) -> "View":
        """Itself."""
        return self


@dataclass(frozen=True)
class CompactView:
    """A ``View`` in 10 bytes a pixel instead of 23, for the memory of a GPU, which holds all of them.

    Attributes:
        index: As of a view.
        time_s: As of a view.
        camera: As of a view.
        image: The frame as it was read (H, W, 3).
        flags: Bits for the mask, the sky and what stands, the lowest first (H, W).
        depth_m: As of a view.
        depth_weight: As of a view, in half precision.
    """

    index: int
    time_s: float
    camera: Camera
    image: UInt8[Tensor, "h w 3"]
    flags: UInt8[Tensor, "h w"]
    depth_m: Float[Tensor, "h w"]
    depth_weight: Float16[Tensor, "h w"]

    @staticmethod
    def of(view: View, frame: UInt8[np.ndarray, "h w 3"], device: torch.device) -> "CompactView":
        """A view of a frame, on a device."""
        flags = view.mask.to(torch.uint8) | view.sky.to(torch.uint8) << 1 | view.still.to(torch.uint8) << 2
        return CompactView(
            index=view.index,
            time_s=view.time_s,
            camera=view.camera,
            image=torch.from_numpy(frame).to(device),
            flags=flags.to(device),
            depth_m=view.depth_m.to(device),
            depth_weight=view.depth_weight.half().to(device),
        )

    def whole(self) -> View:
        """The view, on the same device."""
        mask, sky, still = (self.flags.bitwise_and(bit).bool() for bit in (1, 2, 4))
        return View(
            index=self.index,
            time_s=self.time_s,
            camera=self.camera,
            image=self.image.float() / 255,
            mask=mask,
            sky=sky,
            depth_m=self.depth_m,
            depth_weight=self.depth_weight.float(),
            still=still,
        )


Views = Sequence[View] | Sequence[CompactView]


def training_views(clip: Clip, geometry: Geometry, device: torch.device = CPU) -> Views:
    """All frames that are not held out, on a device: ready there on the CPU, compact elsewhere."""
    seen_to_move = bool((geometry.moving >= 0.5).any())
    views = (_view(clip, geometry, i, seen_to_move) for i in np.flatnonzero(~clip.held_out).tolist())
    if device.type == "cpu":  # where the memory is larger, and each step would take longer
        return list(views)
    return [CompactView.of(view, clip.frames[view.index], device) for view in views]


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
