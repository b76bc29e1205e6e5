"""The frames that a scene was made of, beside its pictures or over them."""

from dataclasses import dataclass, field

import cv2
import numpy as np
from jaxtyping import UInt8

from dreamdrive.run import is_kept, kept_clip
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.show import Image
from dreamdrive.view.layers import Kept

SHARE = 0.5
"""Of the recorded frame, where it lies over a picture."""


@dataclass
class RecordedFrames:
    """The frames of a scene's first camera, read when they are asked for first."""

    kept: Kept
    scene: Scene
    _frames: UInt8[np.ndarray, "k h w 3"] | None = field(default=None, init=False)

    @property
    def there(self) -> bool:
        """Whether the run keeps frames, as far as can be told without reading them."""
        return is_kept(self.kept.stages, "prior")

    def nearest(self, t_s: float) -> tuple[int, Image]:
        """The view that was recorded next to a time, and its frame; ``InputError`` where it is gone."""
        if self._frames is None:
            clip = kept_clip(self.kept.stages, self.scene)
            frames = np.zeros((0, 1, 1, 3), np.uint8) if clip is None else clip.frames
            self._frames = frames[self.scene.front] if len(frames) else frames
        k = nearest_view(self.scene, t_s)
        return int(self.scene.front[k]), self._frames[k]

    def over(self, picture: Image, camera: Camera, t_s: float) -> Image:
        """A picture with the nearest frame over it, as if both were seen from one place."""
        view, frame = self.nearest(t_s)
        own = self.scene.cameras[view]
        turn = own.world_from_camera[:3, :3].T @ camera.world_from_camera[:3, :3]
        from_picture = own.index_matrix @ turn @ np.linalg.inv(camera.index_matrix)
        size, flags = (camera.width_px, camera.height_px), cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        # Behind the recorded camera the same matrix would mirror it.
        ahead = (camera.rays() @ turn[2]) > 0
        shown = cv2.warpPerspective(np.ones(frame.shape[:2], np.float32), from_picture, size, flags=flags)
        share = (SHARE * (shown > 0.5) * ahead)[..., None]
        warped = cv2.warpPerspective(np.ascontiguousarray(frame), from_picture, size, flags=flags)
        return np.rint((1 - share) * picture + share * warped).astype(np.uint8)


def nearest_view(scene: Scene, t_s: float) -> int:
    """Which view of the drive is next to a time, counted along the drive."""
    return int(np.argmin(np.abs(scene.times_s[scene.front] - t_s)))
