"""From a frame to a picture the network takes, and between the pixels of the two.

The network knows a few shapes only: the long side is brought to a fixed length, then the middle is cut out
so that both sides are multiples of 16. Resampling is that of Pillow, with which the published models were
trained: windowed sinc where a picture shrinks, cubic where it grows, both widened by the factor of shrinking.
OpenCV has neither of them in a form that averages over the pixels it leaves out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float, UInt8
from scipy.sparse import csr_array
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera

SQUARE_SIZE = 224
"""At this size the network takes squares; at all others the long side has the given length."""
_MULTIPLE = 16


@dataclass(frozen=True)
class Fitting:
    """How frames of one size are brought to the size of the network: resized, then the middle cut out.

    Pixel coordinates have the centre of the top-left pixel at (0.5, 0.5), in frames and pictures alike.

    Attributes:
        frame_size: Width and height of the frame in pixels.
        resized: Width and height after resizing.
        left: Columns cut off at the left.
        top: Rows cut off at the top.
        size: Width and height of the picture.
        shrinks: Whether resizing counts as shrinking, which takes the sinc instead of the cubic.
    """

    frame_size: tuple[int, int]
    resized: tuple[int, int]
    left: int
    top: int
    size: tuple[int, int]
    shrinks: bool

    def to_picture(self, pixels: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
        """Column and row (..., 2) in the picture of pixels of the frame."""
        return pixels * self._scale - self._corner

    def to_frame(self, pixels: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
        """Column and row (..., 2) in the frame of pixels of the picture."""
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


def fitting(width_px: int, height_px: int, size: int = 512, *, square_ok: bool = False) -> Fitting:
    """How frames of a size are brought to that of the network.

    Args:
        width_px: Width of the frame.
        height_px: Height of the frame.
        size: Length of the long side, or 224 for squares.
        square_ok: Whether square frames stay square; otherwise they are cut to 4:3, as in training.

    Raises:
        InputError: Nothing would be left of one side, or a side would be no multiple of 16.
    """
    shortest, longest = sorted((width_px, height_px))
    if shortest < 1 or size < _MULTIPLE:
        raise InputError(f"frames of {width_px}x{height_px} px cannot be brought to {size} px")
    long_side = round(SQUARE_SIZE * longest / shortest) if size == SQUARE_SIZE else size
    resized = (round(width_px * long_side / longest), round(height_px * long_side / longest))
    middle = (resized[0] // 2, resized[1] // 2)
    half = _half_square(middle) if size == SQUARE_SIZE else _half_sides(resized, square_ok)
    picture = (2 * half[0], 2 * half[1])
    if min(picture) < _MULTIPLE or picture[0] % _MULTIPLE or picture[1] % _MULTIPLE:
        raise InputError(
            f"frames of {width_px}x{height_px} px become {picture[0]}x{picture[1]} px at size {size}; "
            f"both sides have to be multiples of {_MULTIPLE}: choose another size (512, 224) or shape"
        )
    return Fitting(
        (width_px, height_px),
        resized,
        middle[0] - half[0],
        middle[1] - half[1],
        picture,
        shrinks=longest > long_side,
    )


def _half_square(middle: tuple[int, int]) -> tuple[int, int]:
    return min(middle), min(middle)


def _half_sides(resized: tuple[int, int], square_ok: bool) -> tuple[int, int]:
    half_width, half_height = (side // 2 * 2 // _MULTIPLE * (_MULTIPLE // 2) for side in resized)
    if resized[0] == resized[1] and not square_ok:
        half_height = 3 * half_width // 4
    return half_width, half_height


def prepare(frame: UInt8[np.ndarray, "h w 3"], how: Fitting) -> UInt8[np.ndarray, "u v 3"]:
    """The picture (U, V, 3) the network takes, RGB, of a frame (H, W, 3)."""
    if frame.shape[1::-1] != how.frame_size:
        raise ValueError(f"the frame has {frame.shape[1]}x{frame.shape[0]} px, not {how.frame_size}")
    # The order and the rounding between are Pillow's.
    wide = _resample(frame.swapaxes(0, 1), how.resized[0], how.shrinks).swapaxes(0, 1)
    whole = _resample(wide, how.resized[1], how.shrinks)
    width, height = how.size
    return np.ascontiguousarray(whole[how.top : how.top + height, how.left : how.left + width])


def as_input(pictures: Sequence[UInt8[np.ndarray, "h w 3"]]) -> Float[Tensor, "n 3 h w"]:
    """Pictures of one shape as the network reads them: (N, 3, H, W) in [-1, 1]."""
    return torch.from_numpy(np.stack(pictures)).permute(0, 3, 1, 2).float().div(127.5).sub(1)


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
