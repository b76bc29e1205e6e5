"""Photos for tests."""

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image


def picture(width: int, height: int) -> Image.Image:
    """Red grows to the right, green downwards; smooth, so that JPEG keeps it."""
    column, row = np.meshgrid(np.linspace(0, 255, width), np.linspace(0, 255, height))
    return Image.fromarray(np.stack([column, row, 128 + 0 * row], axis=-1).astype(np.uint8))


def save_photo(path: Path, width: int = 160, height: int = 90, mode: str = "RGB", **how: Any) -> Path:
    picture(width, height).convert(mode).save(path, **how)
    return path
