"""The size of a clip, from that of its source."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Shaped, UInt8

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.control import MIN_SIDE_PX, check_largest, check_video_size, is_too_large

DEFAULT_WIDTH_PX = 480
_LEAST_LEFT = 0.1
MAX_CROP = 0.02
"""Largest share of the width or height that is cut away to reach an asked size."""


@dataclass(frozen=True)
class Sizing:
    """Scale to cover the target, then cut the centre; every pair is width, height in pixels.

    ``offset`` are the columns and rows cut away at the left and the top.
    """

    source: tuple[int, int]
    scaled: tuple[int, int]
    offset: tuple[int, int]
    target: tuple[int, int]

    @property
    def shrink(self) -> float:
        """Source pixels per scaled pixel along the axis that shrinks most; below 1 when enlarging."""
        return max(self.source[0] / self.scaled[0], self.source[1] / self.scaled[1])

    def camera(self, source: Camera) -> Camera:
        """The camera of the clip's frames, from that of the source's."""
        scaled = source.resized(*self.scaled)
        return replace(
            scaled,
            cx_px=scaled.cx_px - self.offset[0],
            cy_px=scaled.cy_px - self.offset[1],
            width_px=self.target[0],
            height_px=self.target[1],
        )

    def crop(self, image: Shaped[np.ndarray, "h w *c"]) -> Shaped[np.ndarray, "h2 w2 *c"]:
        """The target's part of an image of the scaled size."""
        (left, top), (width, height) = self.offset, self.target
        return image[top : top + height, left : left + width]

    def apply(self, image: UInt8[np.ndarray, "h w *c"]) -> UInt8[np.ndarray, "h2 w2 *c"]:
        """A source image at the clip's size: area averaging when shrinking, bicubic when enlarging."""
        if self.scaled != self.source:
            rule = cv2.INTER_AREA if self.shrink > 1 else cv2.INTER_CUBIC
            image = np.asarray(cv2.resize(image, self.scaled, interpolation=rule), dtype=np.uint8)
        return np.ascontiguousarray(self.crop(image))


def choose_size(source: tuple[int, int], wanted: tuple[int, int] | None) -> Sizing:
    """How frames of ``source`` become frames of ``wanted``, of which at most 2 % is cut away.

    Without ``wanted`` the width is 480, or the source's if that is smaller, and the height the nearest even
    number that keeps the aspect.
    """
    if wanted is None:
        return cover(source, _default(source))
    check_video_size(wanted)
    cut = cut_share(source, wanted)
    if cut > MAX_CROP:
        by_width = (wanted[0], _even(wanted[0] * source[1] / source[0]))
        by_height = (_even(wanted[1] * source[0] / source[1]), wanted[1])
        nearest = [f"{w}x{h}" for w, h in (by_width, by_height) if not is_too_large((w, h))]
        raise InputError(
            f"--size {wanted[0]}x{wanted[1]} would cut away {100 * cut:.0f} % of the {source[0]}x{source[1]} "
            f"frames (at most {100 * MAX_CROP:.0f} % is cropped); the nearest sizes are "
            f"{' and '.join(nearest)}"
        )
    return cover(source, wanted)


def _even(number: float) -> int:
    return max(2, 2 * round(number / 2))


def _default(source: tuple[int, int]) -> tuple[int, int]:
    if min(source) < MIN_SIDE_PX:
        raise InputError(
            f"the frames are {source[0]}x{source[1]} pixels; expected at least {MIN_SIDE_PX} each way"
        )
    width = min(DEFAULT_WIDTH_PX, source[0] - source[0] % 2)
    height = _even(width * source[1] / source[0])
    if height < MIN_SIDE_PX:
        raise InputError(
            f"the frames are {source[0]}x{source[1]} pixels, too flat for a width of {width}: give --size"
        )
    check_largest((width, height), f"the frames are {source[0]}x{source[1]} pixels")
    return width, height


def cut_share(source: tuple[int, int], target: tuple[int, int]) -> float:
    """Share of the width or height of ``source`` that is cut away where it covers ``target``."""
    scale = max(target[0] / source[0], target[1] / source[1])
    return max(1 - target[0] / (source[0] * scale), 1 - target[1] / (source[1] * scale))


def cover(source: tuple[int, int], target: tuple[int, int]) -> Sizing:
    """How frames of ``source`` cover ``target``, whatever has to be cut away for that, within reason.

    Raises:
        InputError: Next to nothing of a frame would be left: it is a strip, which would fill memory first.
    """
    scale = max(target[0] / source[0], target[1] / source[1])
    left = 1 - cut_share(source, target)
    if left < _LEAST_LEFT:
        raise InputError(
            f"of a picture of {source[0]}x{source[1]} pixels {100 * left:.1g} % would be left at "
            f"{target[0]}x{target[1]}; expected a picture of a street, not a strip"
        )
    scaled = (max(target[0], round(source[0] * scale)), max(target[1], round(source[1] * scale)))
    offset = ((scaled[0] - target[0]) // 2, (scaled[1] - target[1]) // 2)
    return Sizing(source, scaled, offset, target)
