"""Frames resized to the pictures that a network takes, and pixels between the two.

Resampling is that of Pillow, with which the published models were trained: windowed sinc where a picture
shrinks, cubic where it grows, both widened by the factor of shrinking. OpenCV has neither of them in a form
that averages over the pixels it leaves out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.sparse import csr_array

from dreamdrive.scene.camera import Camera


@dataclass(frozen=True)
class ResizeCrop:
    """How frames of one size are brought to the size of the network: resized, then the middle cut out.

    Sizes are width and height in pixels. Pixel coordinates have the centre of the top-left pixel at (0.5,
    0.5), in frames and pictures alike.
    """

    frame_size: tuple[int, int]
    resized: tuple[int, int]
    left: int  # columns cut off
    top: int  # rows cut off
    size: tuple[int, int]  # of the picture
    shrinks: bool  # whether resizing counts as shrinking, which takes the sinc instead of the cubic

    def to_picture(self, pixels: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
        """Column and row in the picture of pixels of the frame."""
        return pixels * self._scale - self._corner

    def to_frame(self, pixels: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
        """Column and row in the frame of pixels of the picture."""
        return (pixels + self._corner) / self._scale

    def picture_camera(self, camera: Camera) -> Camera:
        """The camera of the picture, from that of the frame."""
        self._check(camera, self.frame_size)
        wide = camera.resized(*self.resized)
        cx_px, cy_px = wide.cx_px - self.left, wide.cy_px - self.top
        return replace(wide, cx_px=cx_px, cy_px=cy_px, width_px=self.size[0], height_px=self.size[1])

    def frame_camera(self, camera: Camera) -> Camera:
        """The camera of the frame, from that of the picture."""
        self._check(camera, self.size)
        cx_px, cy_px = camera.cx_px + self.left, camera.cy_px + self.top
        wide = replace(camera, cx_px=cx_px, cy_px=cy_px, width_px=self.resized[0], height_px=self.resized[1])
        return wide.resized(*self.frame_size)

    @property
    def _corner(self) -> Float[np.ndarray, "2"]:
        return np.array([self.left, self.top], np.float64)

    @property
    def _scale(self) -> Float[np.ndarray, "2"]:
        return np.divide(self.resized, self.frame_size)

    @staticmethod
    def _check(camera: Camera, size: tuple[int, int]) -> None:
        if (camera.width_px, camera.height_px) != size:
            raise ValueError(
                f"the camera has {camera.width_px}x{camera.height_px} px, not {size[0]}x{size[1]}"
            )


def prepare(frame: UInt8[np.ndarray, "h w 3"], how: ResizeCrop) -> UInt8[np.ndarray, "u v 3"]:
    """The picture (U, V, 3) the network takes, RGB, of a frame (H, W, 3)."""
    if frame.shape[1::-1] != how.frame_size:
        raise ValueError(f"the frame has {frame.shape[1]}x{frame.shape[0]} px, not {how.frame_size}")
    # The order and the rounding between are Pillow's.
    wide = _resample(frame.swapaxes(0, 1), how.resized[0], how.shrinks).swapaxes(0, 1)
    whole = _resample(wide, how.resized[1], how.shrinks)
    width, height = how.size
    return np.ascontiguousarray(whole[how.top : how.top + height, how.left : how.left + width])


def prepare_mask(mask: Bool[np.ndarray, "h w"], how: ResizeCrop) -> Bool[np.ndarray, "u v"]:
    """Pixels (U, V) of the picture that show next to nothing but what the mask (H, W) of the frame allows."""
    return prepare(np.repeat(255 * mask[..., None].astype(np.uint8), 3, 2), how)[..., 0] > 250


def in_frames(pictures: Sequence[np.ndarray], how: ResizeCrop) -> Float[np.ndarray, "f h w"]:
    """Values of the pictures (U, V) at the pixels of the frames; 0 beyond their edge."""
    width, height = how.frame_size
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    at = how.to_picture(np.stack([columns, rows], axis=-1)).astype(np.float32) - np.float32(0.5)
    # Nearest: an average across a depth edge is a depth at which there is nothing.
    return np.stack(
        [
            cv2.remap(values.astype(np.float32), at[..., 0], at[..., 1], cv2.INTER_NEAREST, borderValue=0)
            for values in pictures
        ]
    )


def _resample(image: UInt8[np.ndarray, "m k 3"], count: int, shrinks: bool) -> UInt8[np.ndarray, "n k 3"]:
    """An image with ``count`` rows."""
    rows = image.shape[0]
    if rows == count:
        return image
    sums = csr_array(_weights(rows, count, shrinks)) @ image.reshape(rows, -1).astype(np.float32)
    return np.clip(np.floor(sums + 0.5), 0, 255).astype(np.uint8).reshape(count, *image.shape[1:])


def _weights(rows: int, count: int, sinc: bool) -> Float[np.ndarray, "{count} {rows}"]:
    """What each new row takes of each old one; the rows of the matrix sum to 1."""
    factor = rows / count
    centres = (np.arange(count) + 0.5) * factor
    distance = np.abs(np.arange(rows) + 0.5 - centres[:, None]) / max(factor, 1.0)
    weights = _lanczos(distance) if sinc else _cubic(distance)
    return weights / weights.sum(axis=1, keepdims=True)


def _lanczos(x: Float[np.ndarray, "n m"]) -> Float[np.ndarray, "n m"]:
    """Sinc windowed by its own main lobe, three zeros wide, at distances of at least 0."""
    return np.where(x < 3, np.sinc(x) * np.sinc(x / 3), 0)


def _cubic(x: Float[np.ndarray, "n m"]) -> Float[np.ndarray, "n m"]:
    """Cubic convolution with a = -1/2 (Keys 1981), at distances of at least 0."""
    near = (1.5 * x - 2.5) * x**2 + 1
    far = ((-0.5 * x + 2.5) * x - 4) * x + 2
    return np.where(x < 1, near, np.where(x < 2, far, 0))
