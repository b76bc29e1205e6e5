"""From the pictures that files describe to the frames of a clip."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.data.lens import Lens
from dreamdrive.data.size import Sizing
from dreamdrive.errors import InputError
from dreamdrive.scene.clip import Clip

_ASPECT_TOLERANCE = 0.01


@dataclass(frozen=True)
class OntoClip:
    """How the frames of a clip were cut out of the source's pictures.

    Files may be for the source's pictures or for the clip's frames, at any size: the aspect tells which.

    Attributes:
        size: Width and height of the clip.
        source: Width and height of the source's pictures.
        scaled: Width and height to which these were scaled.
        offset: Columns and rows that were then cut away at the left and the top.
        lens: The lens that was taken out of the frames, if any.
    """

    size: tuple[int, int]
    source: tuple[int, int]
    scaled: tuple[int, int]
    offset: tuple[int, int]
    lens: Lens | None

    @staticmethod
    def of(clip: Clip) -> "OntoClip":
        """That of a clip; without a recording the frames themselves are the pictures."""
        about = clip.provenance
        lens = Lens.from_json(about["lens"]) if about.get("lens") else None
        if "source_size" not in about:
            return OntoClip(clip.size, clip.size, clip.size, (0, 0), lens)
        source, scaled, offset = (
            (int(about[key][0]), int(about[key][1])) for key in ("source_size", "scaled_size", "crop_offset")
        )
        return OntoClip(clip.size, source, scaled, offset, lens)

    def sizing(self, made_for: tuple[int, int], where: str) -> Sizing:
        """How a picture of the size ``made_for`` becomes a frame.

        Raises:
            InputError: Neither the source's pictures nor the frames have its aspect.
        """
        aspect = made_for[0] / made_for[1]
        off_frame = abs(aspect * self.size[1] / self.size[0] - 1)
        off_source = abs(aspect * self.source[1] / self.source[0] - 1)
        if min(off_frame, off_source) > _ASPECT_TOLERANCE:
            wide, high = self.source
            raise InputError(
                f"{where}: made for {made_for[0]}x{made_for[1]}, but the clip is {wide}x{high}, another "
                "aspect; give the geometry for the clip's picture, or choose --size to match"
            )
        if made_for != self.size and off_source <= off_frame:
            return Sizing(made_for, self.scaled, self.offset, self.size)
        return Sizing(made_for, self.size, (0, 0), self.size)

    def depth(self, depth: Float[np.ndarray, "h w"], bent: bool, where: str) -> Float[np.ndarray, "h2 w2"]:
        """The depth of each pixel of a frame: that of the pixel of the picture in which its centre lies.

        Nothing is averaged: a mean across an edge is a depth at which there is nothing.

        Args:
            depth: Depth of a picture, 0 where unknown.
            bent: Whether the picture still shows the distortion of the clip's lens.
            where: How messages call it.
        """
        high, wide = depth.shape
        sizing = self.sizing((wide, high), where)
        (width, height), (left, top) = sizing.target, sizing.offset
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        if bent and self.lens is not None:
            x, y = _bent(self.lens)
        columns = np.floor((x + left) * (wide / sizing.scaled[0]))
        rows = np.floor((y + top) * (high / sizing.scaled[1]))
        inside = (columns >= 0) & (columns < wide) & (rows >= 0) & (rows < high)
        found = np.zeros((height, width), np.float32)
        found[inside] = depth[rows[inside].astype(int), columns[inside].astype(int)]
        return found


def _bent(lens: Lens) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w"]]:
    """Where the distorted image has each pixel centre of the pinhole, in pixels of the clip's size."""
    camera = lens.camera
    rays = camera.rays()[..., :2].reshape(-1, 2)
    spots = lens.distortion.distort(rays) * (camera.fx_px, camera.fy_px) + (camera.cx_px, camera.cy_px)
    spots[~lens.distortion.unfolded(rays)] = -1e4
    shape = (camera.height_px, camera.width_px)
    spots = np.nan_to_num(spots, nan=-1e4)
    return spots[:, 0].reshape(shape), spots[:, 1].reshape(shape)
