"""Photos as the network wants them: cut to its shape, scaled by Lanczos, their intrinsics with them."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from dreamdrive.data.cameras.intrinsics import Calibration, calibration
from dreamdrive.data.cameras.lens import SourceLens, Undistorter
from dreamdrive.data.frames.size import Sizing
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera

NATIVE = (1024, 576)
"""Width and height that both models were trained for."""
SIDE = 64
"""Sides must be a multiple of it: the autoencoder shrinks by 8, the UNet by 8 again."""
MAX_ENLARGED = 2.0


@dataclass(frozen=True)
class Framing:
    """Which part of a photo becomes the first frame: its top left pixel and size, and that of the frame."""

    corner: tuple[int, int]
    part: tuple[int, int]
    target: tuple[int, int]

    def camera(self, source: Camera) -> Camera:
        """The camera of the frame, from that of the photo."""
        part = replace(
            source,
            cx_px=source.cx_px - self.corner[0],
            cy_px=source.cy_px - self.corner[1],
            width_px=self.part[0],
            height_px=self.part[1],
        )
        return part.resized(*self.target)

    def apply(self, photo: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h2 w2 3"]:
        """The frame."""
        from PIL import Image  # diffusers brings it along; its Lanczos is the one of Vista's sampling script

        left, top = self.corner
        part = Image.fromarray(photo[top : top + self.part[1], left : left + self.part[0]])
        return np.array(part.resize(self.target, Image.Resampling.LANCZOS), dtype=np.uint8)


@dataclass(frozen=True)
class Leading:
    """The known frames, a frame of the model apart in time, with their camera's calibration at their size.

    ``notes`` are for the report, a sentence each.
    """

    frames: UInt8[np.ndarray, "n h w 3"]
    calibration: Calibration
    framing: Framing
    notes: tuple[str, ...]


def nearest_side(length_px: float) -> int:
    """The side that the network can make and that is nearest to a length."""
    return max(SIDE, SIDE * round(length_px / SIDE))


def check_size(size: tuple[int, int]) -> None:
    """Whether the network can make frames of this width and height."""
    if min(size) < SIDE or size[0] % SIDE or size[1] % SIDE:
        near = [nearest_side(side) for side in size]
        raise InputError(
            f"--size {size[0]}x{size[1]}: the network makes frames whose sides are multiples of {SIDE}; give "
            f"{near[0]}x{near[1]}, or leave it out for {NATIVE[0]}x{NATIVE[1]}"
        )


def frame(source: tuple[int, int], target: tuple[int, int], name: str) -> Framing:
    """The largest part of a photo, in its middle, that has the target's shape; both by width and height."""
    (width, height), wanted = source, target[0] / target[1]
    part = (int(wanted * height), height) if width / height > wanted else (width, int(width / wanted))
    larger = max(target[0] / max(part[0], 1), target[1] / max(part[1], 1))
    if larger > MAX_ENLARGED:
        fits = [SIDE * int(side / larger * MAX_ENLARGED / SIDE) for side in target]
        advice = f", or --size {fits[0]}x{fits[1]}" if min(fits) >= SIDE else ""
        raise InputError(
            f"{name} is {width}x{height} pixels: too small for {target[0]}x{target[1]}, for which it would "
            f"be enlarged {larger:.1f} times (at most {MAX_ENLARGED:g}); give a larger photo{advice}"
        )
    return Framing(((width - part[0]) // 2, (height - part[1]) // 2), part, target)


def read_leading(
    path: Path,
    count: int,
    rate_hz: float,
    size: tuple[int, int],
    intrinsics: Path | None = None,
    hfov_deg: float | None = None,
) -> Leading:
    """Read a photo, or the first frames of a video, or of a folder of images at the model's rate.

    Of a video, the frames nearest to the times of the model's rate are taken, ``count`` at most; ``size`` is
    width and height of the result. A lens in the calibration file is taken out of the frames.
    """
    from dreamdrive.data.photo import leading_frames  # here: it brings the decoder of videos along

    check_size(size)
    raw, said = leading_frames(path, count, rate_hz)
    source = raw[0].size
    if any(each.size != source for each in raw):
        raise InputError(f"{path}: its frames differ in size; expected one size")
    framing = frame(source, size, path.name)
    lens = calibration(source, intrinsics, hfov_deg)
    notes = [*said, *dict.fromkeys(note for each in raw for note in each.notes), *lens.notes]
    photos = [each.rgb for each in raw]
    if lens.distortion is not None:
        straight = Undistorter.create(
            SourceLens(lens.distortion, lens.camera), lens.camera, Sizing(source, source, (0, 0), source)
        )
        photos = [straight.apply(photo) for photo in photos]
        notes.append("The lens was taken out of the photo; where it then shows nothing, it is black.")
    if framing.part != source:
        notes.append(
            f"Of the {source[0]}x{source[1]} pixels of the input, the middle {framing.part[0]}x"
            f"{framing.part[1]} are used: the shape of the frames."
        )
    if framing.part[0] < size[0]:
        notes.append(f"The input is enlarged {size[0] / framing.part[0]:.2f} times.")
    frames = np.stack([framing.apply(photo) for photo in photos])
    return Leading(frames, replace(lens, camera=framing.camera(lens.camera)), framing, tuple(notes))


def to_images(frames: UInt8[np.ndarray, "n h w 3"]) -> Float[Tensor, "n 3 h w"]:
    """8-bit frames in [-1, 1], channels first."""
    return torch.from_numpy(frames.astype(np.float32)).permute(0, 3, 1, 2).div(127.5).sub(1)


def to_frames(images: Float[Tensor, "n 3 h w"]) -> UInt8[np.ndarray, "n h w 3"]:
    """Frames in 8 bits of images in [-1, 1]; what lies outside is cut off."""
    # One after the other: what lies between is as large as the images.
    bytes_ = [image.float().add(1).mul(127.5).clamp(0, 255).round().to(torch.uint8) for image in images]
    return torch.stack(bytes_).permute(0, 2, 3, 1).contiguous().numpy()
