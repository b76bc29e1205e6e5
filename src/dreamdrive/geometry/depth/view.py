"""The posed frames as the dense steps read them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from dreamdrive.compute.threads import parallel
from dreamdrive.geometry.options import GeometryOptions
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Ground

Tell = Callable[[], None]
"""Called for each step that is done."""

T = TypeVar("T")


def unheard() -> None:
    """For steps that nobody counts."""


@dataclass(frozen=True)
class PosedFrames:
    """Posed frames; a held-out frame is blank here, so that no dense step can see it."""

    rgb: UInt8[np.ndarray, "f h w 3"]
    grey: Float[np.ndarray, "f h w"]  # grey levels, float32
    usable: Bool[np.ndarray, "f h w"]  # pixels that show the street
    used: Bool[np.ndarray, " f"]  # frames that may be looked at
    cameras: tuple[Camera, ...]  # one posed pinhole a frame
    plane_inverse: Float[np.ndarray, "f h w"]  # of the road, in 1/m; 0 above the horizon or without a plane
    ground: Ground | None
    options: GeometryOptions  # of depth and of what moves
    tell: Tell = unheard  # called for each frame of each pass over the frames

    @property
    def positions_m(self) -> Float[np.ndarray, "f 3"]:
        """Camera centres."""
        return np.array([camera.world_from_camera[:3, 3] for camera in self.cameras])

    @property
    def frames(self) -> tuple[int, ...]:
        """Indices of the frames that may be looked at."""
        return tuple(np.flatnonzero(self.used).tolist())


def make_view(
    clip: Clip,
    cameras: tuple[Camera, ...],
    fixed_regions: Int[np.ndarray, "h w"],
    ground: Ground | None,
    options: GeometryOptions = GeometryOptions(),
    tell: Tell = unheard,
) -> PosedFrames:
    """The clip with its poses; frames that are held out are blanked."""
    used = ~clip.held_out
    rgb = np.where(used[:, None, None, None], clip.frames, np.uint8(0))
    grey = np.stack([cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY) for frame in rgb]).astype(np.float32)
    usable = clip.valid & (fixed_regions == 0) & used[:, None, None]
    plane = np.zeros(grey.shape, np.float32)
    if ground is not None:
        plane = np.stack([1.0 / ground.depth_m(camera) for camera in cameras]).astype(np.float32)
    return PosedFrames(rgb, grey, usable, used, cameras, plane, ground, options, tell)


def by_frame(view: PosedFrames, function: Callable[[int], T]) -> dict[int, T]:
    """``function`` of the index of each used frame, by that index."""
    return dict(zip(view.frames, parallel(function, view.frames, view.tell), strict=True))
