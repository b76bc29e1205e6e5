"""What a user asks a prior for."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Control:
    """The input of a prior and how to read it; ``None`` leaves a choice to the prior.

    Attributes:
        path: A video, a folder of images, a layout; ``None`` where the prior needs no input.
        frames: ``START:STOP:STEP`` over the indices of the source.
        fps: Rate of the input in frames a second, before the step of ``frames``.
        size: Width and height of the clip in pixels.
        intrinsics: Calibration file of the input.
        poses: Pose file of the input.
        hfov_deg: Horizontal field of view in degrees, where there is no calibration.
        hold_out: Withhold the selected frames i with i mod N = N // 2.
        seed: Seed of everything the prior draws.
    """

    path: Path | None = None
    frames: str | None = None
    fps: float | None = None
    size: tuple[int, int] | None = None
    intrinsics: Path | None = None
    poses: Path | None = None
    hfov_deg: float | None = None
    hold_out: int | None = None
    seed: int = 0
