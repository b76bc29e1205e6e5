"""Pictures of a source made frames of a clip: pinholes of one size."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, UInt8

from dreamdrive.compute.machine import free_bytes
from dreamdrive.data.cameras.intrinsics import Calibration
from dreamdrive.data.cameras.lens import SourceLens, Undistorter
from dreamdrive.data.frames.select import MAX_FRAMES
from dreamdrive.data.frames.size import Sizing, choose_size
from dreamdrive.data.pictures.images import RawFrame
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera

BLACK, BLACK_SPREAD = 16.0, 4.0
"""Grey levels: mean and standard deviation below which frames show nothing."""


@dataclass(frozen=True)
class Sampler:
    """How a picture of a source becomes a frame of a clip, in one resampling."""

    calibration: Calibration
    sizing: Sizing
    camera: Camera
    lens: SourceLens | None
    undistorter: Undistorter | None

    @staticmethod
    def create(source: tuple[int, int], size: tuple[int, int] | None, known: Calibration) -> "Sampler":
        """For pictures of the size ``source``; ``size`` is the wanted one, see ``choose_size``."""
        return Sampler.of(choose_size(source, size), known)

    @staticmethod
    def of(sizing: Sizing, known: Calibration) -> "Sampler":
        """For pictures that are scaled and cut in a chosen way."""
        camera = sizing.camera(known.camera)
        if known.distortion is None:
            return Sampler(known, sizing, camera, None, None)
        lens = SourceLens(known.distortion, camera)
        return Sampler(known, sizing, camera, lens, Undistorter.create(lens, known.camera, sizing))

    @property
    def notes(self) -> list[str]:
        """What to say of the calibration and the size."""
        larger = f"The frames are enlarged {1 / self.sizing.shrink:.2f} times; they hold no more detail."
        return [*self.calibration.notes, *([larger] if self.sizing.shrink < 1 else [])]

    def __call__(self, raw: RawFrame) -> RawFrame:
        """The frame; ``opaque`` tells where it holds a picture."""
        apply = self.sizing.apply if self.undistorter is None else self.undistorter.apply
        width, height = self.sizing.target
        valid = np.ones((height, width), bool) if self.undistorter is None else self.undistorter.valid.copy()
        if raw.opaque is not None:  # a clip pixel is valid when all of its footprint is
            valid &= apply(raw.opaque.astype(np.uint8) * 255) == 255
        frame = apply(raw.rgb)
        frame[~valid] = 0
        return replace(raw, rgb=frame, opaque=valid)


def most_frames(size: tuple[int, int]) -> int:
    """Frames that free memory holds: four bytes a pixel with its validity, twice while they are stacked."""
    free = free_bytes()
    return MAX_FRAMES if free is None else min(MAX_FRAMES, max(1, free // (8 * size[0] * size[1])))


def too_many(most: int, size: tuple[int, int], where: Path) -> InputError:
    """The error for more frames than ``most_frames``."""
    smaller = ", or give a smaller --size" if most < MAX_FRAMES else ""
    return InputError(
        f"{where}: more than {most} frames of {size[0]}x{size[1]} are selected, too many to hold in memory; "
        f"choose some with --frames START:STOP:STEP{smaller}"
    )


def check_pictures(
    frames: UInt8[np.ndarray, "f h w 3"], valid: Bool[np.ndarray, "f h w"], path: Path
) -> None:
    """Refuse a recording of nothing: a lens cap, a camera that failed."""
    shown = (frame[where] for frame, where in zip(frames, valid, strict=True) if where.any())
    if all(pixels.mean() < BLACK and pixels.std() < BLACK_SPREAD for pixels in shown):
        raise InputError(
            f"{path}: every selected frame is black; expected pictures of a street, choose others with "
            "--frames"
        )
