"""Twelve frames of a drive towards a wall, for a wheel to make a scene of: python frames.py FOLDER."""

import sys
from pathlib import Path

import cv2
import numpy as np

WIDTH_PX, HEIGHT_PX, FRAMES = 96, 64, 12


def main() -> None:
    """Write them as PNG."""
    folder = Path(sys.argv[1])
    folder.mkdir()
    wall = np.random.default_rng(0).integers(0, 255, (HEIGHT_PX, WIDTH_PX, 3), np.uint8)
    wall = cv2.GaussianBlur(wall, (0, 0), 1.5)
    for frame in range(FRAMES):
        near = cv2.getRotationMatrix2D((WIDTH_PX / 2, HEIGHT_PX / 2), 0, 1 + 0.02 * frame)
        picture = cv2.warpAffine(wall, near, (WIDTH_PX, HEIGHT_PX), borderMode=cv2.BORDER_REFLECT)
        cv2.imwrite(str(folder / f"{frame:04}.png"), picture)


if __name__ == "__main__":
    main()
