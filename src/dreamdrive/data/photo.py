"""One picture for a video model to start from."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from dreamdrive.data.images import SUFFIXES, read_image
from dreamdrive.data.intrinsics import guess_camera, read_intrinsics
from dreamdrive.data.lens import Lens, Undistorter
from dreamdrive.data.size import cover
from dreamdrive.data.source import open_source
from dreamdrive.scene.camera import Camera

_WORTH_A_NOTE = 0.02


@dataclass(frozen=True)
class Photo:
    """A picture of a street as a pinhole sees it.

    Attributes:
        rgb: The picture (H, W, 3).
        camera: Its pinhole, at the identity.
        calibrated: Whether the pinhole comes from a calibration rather than a guess.
        notes: What the report should say, a sentence each.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    camera: Camera
    calibrated: bool
    notes: tuple[str, ...]


def read_photo(
    path: Path, size: tuple[int, int], intrinsics: Path | None = None, hfov_deg: float | None = None
) -> Photo:
    """Read a photo, or the first frame of a recording, at the size that a model wants.

    It is scaled to cover the size and cut around its centre; a known distortion is taken out of it.

    Args:
        path: An image, a video or a folder of images.
        size: Width and height in pixels.
        intrinsics: Calibration file (see ``intrinsics.read_intrinsics``).
        hfov_deg: Horizontal field of view of the picture, where there is no calibration.

    Raises:
        InputError: The picture or the calibration cannot be used.
    """
    if path.is_file() and path.suffix.lower() in SUFFIXES:
        raw, notes = read_image(path), []
    else:
        raw = next(iter(open_source(path).read(range(1))))
        notes = [f"The video goes on from the first frame of {path.name}."]
    known = guess_camera(raw.size, hfov_deg) if intrinsics is None else read_intrinsics(intrinsics, raw.size)
    sizing = cover(raw.size, size)
    camera = sizing.camera(known.camera)
    if known.distortion is None:
        rgb = sizing.apply(raw.rgb)
    else:
        rgb = Undistorter.create(Lens(known.distortion, camera), known.camera, sizing).apply(raw.rgb)
    cut = 1 - min(sizing.target[axis] / sizing.scaled[axis] for axis in (0, 1))
    if cut > _WORTH_A_NOTE:
        notes.append(f"{100 * cut:.0f} % of the photo was cut away to fit the model's {size[0]}x{size[1]}.")
    if sizing.shrink < 1:
        notes.append(f"The photo was enlarged {1 / sizing.shrink:.2f} times; it holds no more detail.")
    return Photo(rgb, camera, known.known, (*raw.notes, *known.notes, *notes))
