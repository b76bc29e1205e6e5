"""Small sets of clips on disk."""

from pathlib import Path

import cv2
import numpy as np


def write_clip(
    folder: Path, seed: int, *, frames: int = 4, noise: float = 0, size: tuple[int, int] = (48, 40)
) -> None:
    """A smooth picture that moves sideways, as PNGs; noise has a seed of its own."""
    rng = np.random.default_rng(seed)
    picture = cv2.resize(
        rng.integers(0, 256, (5, 6, 3)).astype(np.uint8), size, interpolation=cv2.INTER_CUBIC
    )
    folder.mkdir(parents=True)
    for i in range(frames):
        frame = np.roll(picture, i, axis=1) + noise * rng.normal(size=picture.shape)
        cv2.imwrite(str(folder / f"{i}.png"), np.clip(frame, 0, 255).astype(np.uint8))


def write_set(folder: Path, *, clips: int = 3, frames: int = 4, noise: float = 0) -> Path:
    """Clips a, b, ...; equal but for the noise whenever they are written."""
    for seed in range(clips):
        write_clip(folder / "abcdefgh"[seed], seed, frames=frames, noise=noise)
    return folder
