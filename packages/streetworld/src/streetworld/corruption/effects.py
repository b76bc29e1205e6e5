"""Corruptions of the frames of a clip: pixels that move, colours that change, and all of them together."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.errors import InputError
from streetworld.corruption.settings import Corruption

# Amplitudes are RMS lengths over the width of the picture at strength 1.
_WOBBLE, _WOBBLE_CELLS, _WOBBLE_HOLD = 0.006, 6, 8
_JUMP, _JUMP_CELLS = 0.0015, 10
_SLIDE, _SLIDE_HOLD = 0.012, 12
_BEND, _BEND_CELLS, _BEND_HOLD = 0.006, 5, 8
_HALF_WAY_M = 25.0
_SEAM = 0.01
"""Blur, over the width, of where the sliding distance begins: what is drawn is stretched there, not torn."""
_FINE = 1 / 160
"""Standard deviation, over the width, of the blur that fine detail is left over from."""
_SWIM, _SWIM_CELLS, _SWIM_HOLD = 0.004, 40, 3
_GRAIN_CELLS, _GRAIN_HOLD = 128, 2  # a cell is what one latent pixel of the usual autoencoder decodes to
_LOST, _GRAIN = 0.4, 0.45
_GAIN, _GAMMA, _PATCH, _PATCH_CELLS = 0.02, 0.04, 0.025, 3
_TINT, _CONTRAST, _SATURATION, _DRIFT_HOLD = 0.05, 0.08, 0.2, 12
_LUMA = np.array([0.299, 0.587, 0.114], np.float32)
_WEIGHT_RMS = np.float32(np.sqrt(151 / 315))
"""Root of the summed squares of a cubic B-spline's four weights, averaged over where one looks."""


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
        displacement += np.float32(corruption.warp) * wobble(seed, index, *frame.shape[:2])
    if corruption.far > 0:
        assert depth_m is not None
        displacement += np.float32(corruption.far) * slide(seed, index, depth_m)
    if displacement.any():
        picture = moved(picture, displacement)
    if corruption.shimmer > 0:
        picture = shimmer(picture, corruption.shimmer, seed, index)
    if corruption.flicker > 0:
        picture = flicker(picture, corruption.flicker, seed, index)
    if corruption.drift > 0:
        picture = drift(picture, corruption.drift, seed, index)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def wobble(seed: int, frame: int, height: int, width: int) -> Float[np.ndarray, "2 h w"]:
    """Displacement of ``warp`` at strength 1: right and down in pixels (2, H, W)."""
    slow = Noise(seed, 0, 2, _WOBBLE_CELLS, _WOBBLE_HOLD).field(frame, height, width)
    fast = Noise(seed, 1, 2, _JUMP_CELLS).field(frame, height, width)
    return (_WOBBLE * slow + _JUMP * fast) * np.float32(width / np.sqrt(2))


def slide(seed: int, frame: int, depth_m: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "2 h w"]:
    """Displacement of ``far`` at strength 1: right and down in pixels, from depth along z, 0 in the sky."""
    height, width = depth_m.shape
    square = np.square(depth_m, dtype=np.float32)
    share = np.where(depth_m > 0, square / (square + np.float32(_HALF_WAY_M**2)), np.float32(1))
    share = cv2.GaussianBlur(share.astype(np.float32), (0, 0), _SEAM * width)
    whole = Noise(seed, 2, 2, hold=_SLIDE_HOLD).values(frame)[:, None, None]
    local = Noise(seed, 3, 2, _BEND_CELLS, _BEND_HOLD).field(frame, height, width)
    return share * (_SLIDE * whole + _BEND * local) * np.float32(width / np.sqrt(2))


def moved(
    picture: Float[np.ndarray, "h w 3"], displacement_px: Float[np.ndarray, "2 h w"]
) -> Float[np.ndarray, "h w 3"]:
    """Each pixel shows what lies one displacement away; the border is mirrored."""
    height, width = picture.shape[:2]
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    x, y = x + displacement_px[0], y + displacement_px[1]
    return cv2.remap(picture, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101)


def shimmer(
    picture: Float[np.ndarray, "h w 3"], strength: float, seed: int, frame: int
) -> Float[np.ndarray, "h w 3"]:
    """Fine detail displaced, partly lost, and replaced by grain as strong as the texture around it."""
    height, width = picture.shape[:2]
    coarse = cv2.GaussianBlur(picture, (0, 0), _FINE * width)
    detail = picture - coarse
    swim = Noise(seed, 4, 2, _SWIM_CELLS, _SWIM_HOLD).field(frame, height, width)
    kept = moved(detail, np.float32(strength * _SWIM * width / np.sqrt(2)) * swim)
    contrast = np.sqrt(cv2.GaussianBlur(np.square(detail @ _LUMA), (0, 0), _FINE * width))
    grain = Noise(seed, 5, 1, _GRAIN_CELLS, _GRAIN_HOLD).field(frame, height, width)[0]
    lost, added = min(1.0, strength * _LOST), strength * _GRAIN
    return coarse + np.float32(1 - lost) * kept + np.float32(added) * (contrast * grain)[..., None]


def flicker(
    picture: Float[np.ndarray, "h w 3"], strength: float, seed: int, frame: int
) -> Float[np.ndarray, "h w 3"]:
    """Exposure and gamma of one frame, and exposure that is uneven over the picture."""
    height, width = picture.shape[:2]
    whole = Noise(seed, 6, 2).values(frame)
    patch = Noise(seed, 7, 1, _PATCH_CELLS).field(frame, height, width)[0]
    gain = np.exp(np.float32(strength) * (_GAIN * whole[0] + _PATCH * patch))
    curved = cv2.pow(np.clip(picture, 0, 255) / np.float32(255), float(np.exp(strength * _GAMMA * whole[1])))
    return 255 * curved * gain[..., None]


def drift(
    picture: Float[np.ndarray, "h w 3"], strength: float, seed: int, frame: int
) -> Float[np.ndarray, "h w 3"]:
    """White balance, contrast and saturation as far as they have wandered since frame 0."""
    wander = Noise(seed, 8, 5, hold=_DRIFT_HOLD)
    way = np.float32(strength) * (wander.values(frame) - wander.values(0))
    tint = np.exp(_TINT * way[:3])
    contrast, saturation = np.exp(_CONTRAST * way[3]), np.exp(_SATURATION * way[4])
    grey = (picture @ _LUMA)[..., None]
    mixed = grey + saturation * (picture - grey)
    return (128 + contrast * (mixed - 128)) * tint


@dataclass(frozen=True)
class Noise:
    """Cubic B-splines over a lattice of random numbers: zero mean, RMS 1 over all seeds.

    ``stream`` tells apart the independent fields of one seed. ``cells`` of the lattice lie across the width
    of the picture; from one lattice to the next there are ``hold`` frames, over which the field changes
    smoothly, and none for a new field in each frame.
    """

    seed: int
    stream: int
    channels: int
    cells: int = 1
    hold: int = 0

    def field(self, frame: int, height: int, width: int) -> Float[np.ndarray, "c h w"]:
        """The field in frame ``frame``, counted from 0."""
        rows = max(1, round(self.cells * height / width))
        lattice = self._lattice(frame, (self.channels, rows + 3, self.cells + 3))
        down, across = _spline(height, rows), _spline(width, self.cells)
        tall = np.add.reduce([w[:, None] * lattice[:, first] for first, w in zip(*down, strict=True)])
        wide = np.add.reduce([w * tall[:, :, first] for first, w in zip(*across, strict=True)])
        return wide / _WEIGHT_RMS**2

    def values(self, frame: int) -> Float[np.ndarray, " c"]:
        """One number a channel in frame ``frame``, for what changes the whole picture alike."""
        return self._lattice(frame, (self.channels,))

    def _lattice(self, frame: int, shape: tuple[int, ...]) -> np.ndarray:
        if self.hold == 0:
            return _random(self.seed, self.stream, frame, shape)
        knot, share = divmod(frame, self.hold)
        weights = _weights(np.array([share / self.hold]))[:, 0]
        knots = [_random(self.seed, self.stream, knot + i, shape) for i in range(4)]
        return np.add.reduce([w * values for w, values in zip(weights, knots, strict=True)]) / _WEIGHT_RMS


@lru_cache(maxsize=256)
def _random(seed: int, stream: int, index: int, shape: tuple[int, ...]) -> np.ndarray:
    numbers = np.random.default_rng([seed, stream, index]).standard_normal(shape, np.float32)
    numbers.setflags(write=False)
    return numbers


@lru_cache(maxsize=64)
def _spline(samples: int, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """For each of ``samples`` pixels the four knots around it and their weights, both (4, samples)."""
    position = (np.arange(samples) + 0.5) * cells / samples
    first = position.astype(int)
    return first + np.arange(4)[:, None], _weights(position - first)


def _weights(share: np.ndarray) -> np.ndarray:
    """Weights (4, n) of the uniform cubic B-spline at shares (n,) of a cell."""
    t = share
    four = [(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]
    return (np.stack(four) / 6).astype(np.float32)
