"""What frames and drives can be asked for; known without loading what makes them."""

import math

from dreamdrive.compute.machine import free_bytes
from dreamdrive.errors import InputError

MIN_SIDE_PX = 16
MAX_SIDE_PX = 8192
MAX_PIXELS = 4096 * 2176
"""Largest frames: a video with four of them, as ``panels.mp4`` is, is the largest that H.264 knows."""
_BYTES_PER_PX = 200
"""Memory that rendering and encoding take a pixel: 190 for a video of 3840x2160, less for the others."""
RATES_HZ = (0.1, 240.0)
"""Rates that ``--fps`` takes: from a picture every ten seconds to the fastest that players show."""


def check_largest(size: tuple[int, int], text: str) -> None:
    """Refuse frames, called ``text``, of a width and height that no video could show."""
    if is_too_large(size):
        raise InputError(
            f"{text}: too large for H.264 video; expected {MAX_SIDE_PX} pixels a side and "
            f"{MAX_PIXELS / 1e6:.1f} million in all at most, such as 3840x2160"
        )


def is_too_large(size: tuple[int, int]) -> bool:
    """Whether no video could show frames of a width and height."""
    return max(size) > MAX_SIDE_PX or size[0] * size[1] > MAX_PIXELS


def check_video_size(size: tuple[int, int]) -> None:
    """Refuse a width and height of ``--size`` that no frame of a clip can have."""
    text = f"--size {size[0]}x{size[1]}"
    check_largest(size, text)
    if min(size) < MIN_SIDE_PX:
        raise InputError(
            f"{text}: expected WIDTHxHEIGHT of at least {MIN_SIDE_PX} pixels each, such as 480x270"
        )
    if size[0] % 2 or size[1] % 2:
        even = (size[0] + size[0] % 2, size[1] + size[1] % 2)
        raise InputError(f"{text}: H.264 video needs an even width and height; give {even[0]}x{even[1]}")


def check_render_size(size: tuple[int, int], *, video: bool) -> None:
    """Refuse a width and height of ``--size`` that cannot be rendered, or kept as a video."""
    width, height = size
    check_largest(size, f"--size {width}x{height}")
    if min(size) < MIN_SIDE_PX:
        raise InputError(f"--size {width}x{height}: expected sides of at least {MIN_SIDE_PX} pixels")
    if video and (width % 2 or height % 2):
        raise InputError(
            f"--size {width}x{height}: a video has even sides; choose "
            f"{width - width % 2}x{height - height % 2}, or --format png"
        )
    needed, free = width * height * _BYTES_PER_PX, free_bytes()
    if free is not None and needed > free:
        raise InputError(
            f"--size {width}x{height} takes about {needed / 1e9:.1f} GB, and {free / 1e9:.1f} GB of memory "
            "are free; choose a smaller size"
        )


def check_numbers(shift_m: float, fps: float | None) -> None:
    """Refuse what no drive can be made with."""
    if not math.isfinite(shift_m):
        raise InputError(f"--shift-m {shift_m:g}: expected metres to the right, such as 2 or -2")
    if fps is not None and not RATES_HZ[0] <= fps <= RATES_HZ[1]:
        raise InputError(f"--fps {fps:g}: expected {RATES_HZ[0]:g} to {RATES_HZ[1]:g} frames a second")
