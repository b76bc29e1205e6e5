"""Repeating pictures of ground: asphalt, concrete, slabs, stones, grass, earth, sand."""

from collections.abc import Callable, Sequence
from functools import lru_cache

import cv2
import numpy as np

from streetworld.engine.paint import Image, finished, noise

TILE_PX = 512
VARIANTS = 12
"""Painted tiles of each kind; a process paints each once."""


def between(rng: np.random.Generator, low: Sequence[float], high: Sequence[float]) -> np.ndarray:
    """A colour (3,) between two, all channels by about the same share."""
    share = rng.uniform(0, 1) + rng.normal(0, 0.06, 3)
    return np.asarray(low) + share * (np.asarray(high) - np.asarray(low))


def _seamless(rng: np.random.Generator, octaves: dict[float, float]) -> np.ndarray:
    """Smooth noise that repeats: octaves from cell size in texels to standard deviation."""
    total = np.zeros((TILE_PX, TILE_PX), np.float32)
    for cell, amplitude in octaves.items():
        count = max(2, round(TILE_PX / cell))
        values = np.pad(rng.standard_normal((count, count), dtype=np.float32), 2, mode="wrap")
        size = round(TILE_PX * (count + 4) / count)
        large = cv2.resize(values, (size, size), interpolation=cv2.INTER_CUBIC)
        start = (size - TILE_PX) // 2
        total += amplitude * large[start : start + TILE_PX, start : start + TILE_PX]
    return total


def _asphalt(rng: np.random.Generator) -> np.ndarray:
    grey = float(
        rng.choice([rng.uniform(48, 75), rng.uniform(75, 120), rng.uniform(120, 165)], p=[0.25, 0.5, 0.25])
    )
    field = _seamless(
        rng, {1: rng.uniform(3, 9), 3: rng.uniform(2, 6), 20: rng.uniform(1, 6), 120: rng.uniform(1, 8)}
    )
    image = grey + field[..., None] + np.zeros(3, np.float32)
    image = image * (1 + rng.normal(0, 0.02, 3) + np.array([0.0, 0.0, 0.012])).astype(np.float32)
    for _ in range(int(rng.integers(0, 9))):
        path = _walk(rng, int(rng.integers(20, 120)), 5.0)
        shade = grey * rng.uniform(0.45, 0.8)
        cv2.polylines(image, [path], False, (shade, shade, shade), int(rng.integers(1, 3)), cv2.LINE_AA)
    return image


def _walk(rng: np.random.Generator, steps: int, step: float) -> np.ndarray:
    heading = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.normal(0, 0.35, steps))
    ways = np.cumsum(np.stack([np.cos(heading), np.sin(heading)], -1) * step, axis=0)
    return (rng.uniform(0, TILE_PX, 2) + ways).astype(np.int32)


def _concrete(rng: np.random.Generator) -> np.ndarray:
    grey = rng.uniform(120, 190)
    image = grey + _seamless(rng, {1: 4, 6: 4, 50: 7, 170: 7})[..., None] + rng.normal(0, 3, 3)
    side = TILE_PX // int(rng.choice([4, 5, 6, 8]))
    _joints(rng, image, side, side, grey * rng.uniform(0.45, 0.85), 0)
    return image


def _slabs(rng: np.random.Generator) -> np.ndarray:
    """Paving of uneven slabs."""
    tint = np.array([[150, 146, 138], [176, 170, 160], [128, 126, 124], [160, 120, 104], [182, 158, 128]])
    colour = tint[int(rng.integers(len(tint)))] + rng.normal(0, 8, 3)
    image = _seamless(rng, {1: 4, 5: 5, 40: 6})[..., None] + colour
    high, wide = TILE_PX // int(rng.choice([16, 24, 32])), TILE_PX // int(rng.choice([8, 12, 16, 24]))
    _joints(
        rng,
        image,
        high,
        wide,
        float(colour.mean()) * rng.uniform(0.5, 0.85),
        wide // 2 * int(rng.random() < 0.5),
    )
    return image


def _stones(rng: np.random.Generator) -> np.ndarray:
    """Cobbles in rows."""
    colour = between(rng, (70, 68, 66), (150, 142, 136))
    image = _seamless(rng, {1: 6, 4: 8, 60: 6})[..., None] + colour
    side = TILE_PX // int(rng.choice([32, 42, 51]))
    _joints(rng, image, side, int(side * rng.choice([1, 1.6])), float(colour.mean()) * 0.5, side // 2)
    return image


def _joints(
    rng: np.random.Generator, image: np.ndarray, high: int, wide: int, dark: float, shift: int
) -> None:
    """Lines between slabs, each of its own brightness, in place; every second row is shifted."""
    tones = rng.normal(0, 0.05 * image.mean(), (TILE_PX // high + 1, TILE_PX // wide + 2))
    for row, top in enumerate(range(0, TILE_PX, high)):
        offset = shift if row % 2 else 0
        tone = np.roll(np.repeat(tones[row], wide), offset)[:TILE_PX]
        image[top : top + high] += tone[None, :, None]
        image[top : top + high, offset::wide] = dark
        image[top] = dark


def _grass(rng: np.random.Generator) -> np.ndarray:
    """Green to dry, with earth between."""
    green = between(rng, (44, 66, 22), (132, 142, 78))
    dry = between(rng, (120, 108, 66), (182, 164, 116))
    earth = between(rng, (86, 70, 50), (150, 126, 98))
    share = np.clip(0.5 + rng.normal(0, 0.5) + _seamless(rng, {6: 0.15, 24: 0.25, 90: 0.4}), 0, 1)[..., None]
    bare = np.clip(4 * (_seamless(rng, {8: 0.2, 40: 0.3, 150: 0.4}) - rng.uniform(0.1, 1.4)), 0, 1)[..., None]
    image = green * share + dry * (1 - share)
    image = image * (1 + _seamless(rng, {1: 0.14, 2: 0.12, 5: 0.08})[..., None])
    return image * (1 - bare) + earth * (1 + _seamless(rng, {1: 0.08, 4: 0.06})[..., None]) * bare


def _earth(rng: np.random.Generator) -> np.ndarray:
    """Sand, gravel or earth."""
    colour = between(rng, (92, 70, 46), (206, 188, 156))
    field = _seamless(rng, {1: rng.uniform(0.04, 0.16), 3: 0.08, 20: 0.06, 90: 0.08, 200: 0.06})
    return colour * (1 + field[..., None])


_PAINT: dict[str, Callable[[np.random.Generator], np.ndarray]] = {
    "asphalt": _asphalt,
    "concrete": _concrete,
    "slabs": _slabs,
    "stones": _stones,
    "grass": _grass,
    "earth": _earth,
}


@lru_cache(maxsize=96)
def tile(kind: str, variant: int) -> Image:
    """A painted tile (512, 512, 3) of a kind, one of ``VARIANTS``."""
    rng = np.random.default_rng([list(_PAINT).index(kind), variant, 61])
    return finished(_PAINT[kind](rng))


@lru_cache(maxsize=8)
def grain(variant: int) -> Image:
    """Fine grain about a grey of 128, which near ground is multiplied by."""
    rng = np.random.default_rng([variant, 62])
    field = _seamless(rng, {1: rng.uniform(0.04, 0.12), 3: rng.uniform(0.03, 0.1), 9: 0.03, 40: 0.03})
    return finished(np.repeat(128 * (1 + field[..., None]), 3, axis=-1))


def low_noise(rng: np.random.Generator, shape: tuple[int, int], octaves: dict[float, float]) -> np.ndarray:
    """Smooth noise (H, W) made at an eighth of the size."""
    small = noise(rng, (shape[0] // 8 + 2, shape[1] // 8 + 2), octaves)
    return cv2.resize(small, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR)
