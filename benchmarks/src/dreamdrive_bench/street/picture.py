"""A grid of pictures: a row a world, the truth of a shifted view beside what each representation shows."""

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from dreamdrive.show import write_png
from dreamdrive_bench.street.case import SIZE
from dreamdrive_bench.street.views import true_frames

COLUMNS = ("hybrid", "vibration", "hexplane", "deformable", "static")
SHOWN = "true-corrupted-{}-equal_steps"
MARGIN, HEAD = 70, 22


def picture(path: Path, seeds: list[int], runs: Path) -> None:
    """The grid, with a head."""
    kept = {name: [runs / "shown" / f"{seed}-{SHOWN.format(name)}.png" for seed in seeds] for name in COLUMNS}
    names = [name for name, files in kept.items() if any(file.exists() for file in files)]
    rows = [_strip(["", "truth", *names])]
    for number, seed in enumerate(seeds):
        cells = [true_frames(seed, "shift_2", runs / "truth")[12][..., ::-1]]
        blank = np.zeros_like(cells[0])
        files = [kept[name][number] for name in names]
        cells += [cv2.imread(str(file)) if file.exists() else blank for file in files]
        rows.append(np.hstack([_label(f"world {seed}", (MARGIN, blank.shape[0])), *cells]))
    write_png(path, np.vstack(rows)[..., ::-1])


def _strip(names: list[str]) -> UInt8[np.ndarray, "h w 3"]:
    widths = [MARGIN] + [SIZE[0]] * (len(names) - 1)
    return np.hstack([_label(name, (width, HEAD)) for name, width in zip(names, widths, strict=True)])


def _label(text: str, size: tuple[int, int]) -> UInt8[np.ndarray, "h w 3"]:
    """Dark letters on white."""
    image = np.full((size[1], size[0], 3), 255, dtype=np.uint8)
    place = (6, size[1] // 2 + 5)
    return cv2.putText(image, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.45, (40, 40, 40), 1, cv2.LINE_AA)
