"""All corruptions, one after the other, on the frames of a clip."""

import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.errors import InputError
from dreamdrive.world.corruption import colours, shapes
from dreamdrive.world.corruption.settings import Corruption


def corrupt(
    frames: UInt8[np.ndarray, "f h w 3"],
    corruption: Corruption,
    depth_m: Float[np.ndarray, "f h w"] | None = None,
) -> UInt8[np.ndarray, "f h w 3"]:
    """Draw the frames of a clip as a video model might have drawn them.

    Frame k depends on the seed, on k and on the picture alone: a longer clip begins with the same frames.
    What is off leaves no trace; with all off the frames come back bit for bit. Only ``far`` looks at the
    depth along z, 0 in the sky.
    """
    if corruption.far > 0 and depth_m is None:
        raise InputError(
            f"corruption far={corruption.far:g} slides what is far against what is near and needs the depth "
            "of every frame, which this clip does not have; add far=0"
        )
    if corruption.off:
        return frames.copy()
    result = np.empty_like(frames)
    for index, frame in enumerate(frames):
        result[index] = _one(frame, corruption, index, None if depth_m is None else depth_m[index])
    return result


def _one(
    frame: np.ndarray, corruption: Corruption, index: int, depth_m: np.ndarray | None
) -> UInt8[np.ndarray, "h w 3"]:
    """Shapes first, then what is drawn on them, then its light: as a decoder paints over a bent layout."""
    seed, picture = corruption.seed, frame.astype(np.float32)
    displacement = np.zeros((2, *frame.shape[:2]), np.float32)
    if corruption.warp > 0:
        displacement += np.float32(corruption.warp) * shapes.wobble(seed, index, *frame.shape[:2])
    if corruption.far > 0:
        assert depth_m is not None
        displacement += np.float32(corruption.far) * shapes.slide(seed, index, depth_m)
    if displacement.any():
        picture = shapes.moved(picture, displacement)
    if corruption.shimmer > 0:
        picture = colours.shimmer(picture, corruption.shimmer, seed, index)
    if corruption.flicker > 0:
        picture = colours.flicker(picture, corruption.flicker, seed, index)
    if corruption.drift > 0:
        picture = colours.drift(picture, corruption.drift, seed, index)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)
