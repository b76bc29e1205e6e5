"""Random fields, smooth in space and time, the same for every length of clip and size of picture."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float

_WEIGHT_RMS = np.float32(np.sqrt(151 / 315))
"""Root of the summed squares of a cubic B-spline's four weights, averaged over where one looks."""


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
