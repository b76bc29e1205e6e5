"""Images through a lens: undistorting the source once, and giving renders the source's distortion."""

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.data.cameras.distortion import Distortion
from dreamdrive.data.frames.size import Sizing
from dreamdrive.scene.camera import Camera

_MAX_RATIO = 4
"""Source pixels per clip pixel up to which the map goes straight from the source; beyond, an integer area
shrink to about this ratio comes first, so that the maps of an 8000 pixel image stay small."""
_MAX_WIDENING = 2.0
"""Largest width and height of the covering pinhole, over those of the distorted image."""
_MARGIN_PX = 2


@dataclass(frozen=True)
class SourceLens:
    """The source's lens at the clip's size.

    ``camera`` has the source's intrinsics there: those of the clip's pinhole and of the distorted image.
    """

    distortion: Distortion
    camera: Camera

    def covering(self) -> Camera:
        """A pinhole of the same focal length and axis that sees all of the distorted image.

        The image of a barrel lens shows more than the clip's pinhole: render with this camera, then
        ``apply``. It is at most twice as wide and high: the rim of a very wide fisheye is left out (see
        ``covered``).
        """
        ideal = self._ideal_px
        good = np.isfinite(ideal).all(axis=-1)
        size = np.array([self.camera.width_px, self.camera.height_px])
        room = np.ceil(size * (_MAX_WIDENING - 1) / 2)
        low = np.clip(np.floor(ideal[good].min(axis=0)) - _MARGIN_PX, -room, 0)
        high = np.clip(np.ceil(ideal[good].max(axis=0)) + _MARGIN_PX, size, size + room)
        width, height = (high - low).astype(int).tolist()
        cx, cy = self.camera.cx_px - float(low[0]), self.camera.cy_px - float(low[1])
        return replace(self.camera, cx_px=cx, cy_px=cy, width_px=width, height_px=height)

    def apply(
        self, image: Float[np.ndarray, "h w 3"], rendered: Camera | None = None
    ) -> Float[np.ndarray, "h2 w2 3"]:
        """A render in [0, 1] as the source's camera would have shown it, at the clip's size.

        One bicubic lookup, limited to the range of the image; black where the render does not reach.
        ``rendered`` is the pinhole of the image, by default the clip's own; its pose does not matter.
        """
        camera = self.camera if rendered is None else rendered
        if image.shape[:2] != (camera.height_px, camera.width_px):
            raise ValueError(
                f"the image is {image.shape[:2]}, its camera {(camera.height_px, camera.width_px)}"
            )
        spot = self._spots(camera).astype(np.float32) - 0.5
        single = image.astype(np.float32)  # OpenCV 5.0 rounds doubles to whole numbers along the border
        seen = cv2.remap(single, spot[..., 0], spot[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        seen = np.clip(np.asarray(seen), single.min(), single.max())
        return np.where(self.covered(camera)[..., None], seen, np.float32(0)).astype(image.dtype)

    def covered(self, rendered: Camera | None = None) -> Bool[np.ndarray, "h2 w2"]:
        """Where ``apply`` finds a picture: the part of the distorted image that the pinhole sees."""
        camera = self.camera if rendered is None else rendered
        spot = self._spots(camera)
        return np.all((spot >= 0) & (spot <= (camera.width_px, camera.height_px)), axis=-1)

    def to_json(self) -> dict[str, Any]:
        """As JSON values; ``cx`` and ``cy`` count from the edge of the image (pixel centres at +0.5)."""
        c = self.camera
        pinhole = {"fx": c.fx_px, "fy": c.fy_px, "cx": c.cx_px, "cy": c.cy_px}
        distortion = {"model": self.distortion.model, "coefficients": list(self.distortion.coefficients)}
        return {"width": c.width_px, "height": c.height_px, "pinhole": pinhole, "distortion": distortion}

    @staticmethod
    def from_json(values: dict[str, Any]) -> "SourceLens":
        """The lens that ``to_json`` wrote."""
        p, d = values["pinhole"], values["distortion"]
        camera = Camera(p["fx"], p["fy"], p["cx"], p["cy"], values["width"], values["height"])
        return SourceLens(Distortion(d["model"], tuple(d["coefficients"])), camera)

    @cached_property
    def _ideal_px(self) -> Float[np.ndarray, "h w 2"]:
        """Where the clip's pinhole has each pixel of the distorted image; NaN where nowhere."""
        rays = self.camera.rays()[..., :2]
        ideal = self.distortion.undistort(rays.reshape(-1, 2)).reshape(rays.shape)
        c = self.camera
        return ideal * (c.fx_px, c.fy_px) + (c.cx_px, c.cy_px)

    def _spots(self, camera: Camera) -> Float[np.ndarray, "h w 2"]:
        """Where each pixel of the distorted image lies in an image by ``camera``; -1e4 where nowhere."""
        own = self.camera
        ray = (self._ideal_px - (own.cx_px, own.cy_px)) / (own.fx_px, own.fy_px)
        spot = ray * (camera.fx_px, camera.fy_px) + (camera.cx_px, camera.cy_px)
        return np.clip(np.nan_to_num(spot, nan=-1e4), -1e4, 3e4)


@dataclass(frozen=True)
class Undistorter:
    """Takes source images to the clip's pinhole in one resampling.

    Every clip pixel is the mean of n x n bicubic lookups in the source, n being at least the number of source
    pixels per clip pixel: the area average of the undistorted image, without making that image first.
    ``maps`` say where the lookups lie, x and y, in OpenCV's pixel indices; the source is first area-averaged
    to ``shrunk``, its own size up to a ratio of 4. A pixel is valid whose lookups all lie inside the source.
    """

    maps: tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w"]]
    shrunk: tuple[int, int]
    target: tuple[int, int]
    valid: Bool[np.ndarray, "h2 w2"]

    @staticmethod
    def create(lens: SourceLens, source: Camera, sizing: Sizing) -> "Undistorter":
        """Compute the maps from the source's camera to the clip's pinhole, which is ``lens.camera``."""
        first = max(1, round(sizing.shrink / _MAX_RATIO))
        shrunk = (ceil(source.width_px / first), ceil(source.height_px / first))
        per_pixel = max(1, ceil(sizing.shrink / first - 1e-6))
        width, height = sizing.target
        rays = lens.camera.resized(width * per_pixel, height * per_pixel).rays()[..., :2]
        bent = lens.distortion.distort(rays.reshape(-1, 2)).reshape(rays.shape)
        spot = bent * (source.fx_px, source.fy_px) + (source.cx_px, source.cy_px)
        inside = np.all((spot >= 0) & (spot <= (source.width_px, source.height_px)), axis=-1)
        inside &= lens.distortion.unfolded(rays.reshape(-1, 2)).reshape(inside.shape)
        valid = np.all(inside.reshape(height, per_pixel, width, per_pixel), axis=(1, 3))
        spot *= (shrunk[0] / source.width_px, shrunk[1] / source.height_px)
        spot = np.clip(np.nan_to_num(spot, nan=-1e4), -1e4, 3e4).astype(np.float32) - np.float32(0.5)
        return Undistorter((spot[..., 0].copy(), spot[..., 1].copy()), shrunk, sizing.target, valid)

    def apply(self, image: UInt8[np.ndarray, "h w *c"]) -> UInt8[np.ndarray, "h2 w2 *c"]:
        """A source image in the clip's pinhole; black where there is no picture."""
        if self.shrunk != (image.shape[1], image.shape[0]):
            image = np.asarray(cv2.resize(image, self.shrunk, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        dense = cv2.remap(image, *self.maps, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        if self.target != (dense.shape[1], dense.shape[0]):
            dense = cv2.resize(dense, self.target, interpolation=cv2.INTER_AREA)
        result = np.array(dense, dtype=np.uint8)
        result[~self.valid] = 0
        return result
