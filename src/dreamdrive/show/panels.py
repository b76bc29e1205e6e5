"""Pictures beside pictures, with labels: what the videos and reports show."""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.vision.residual import BLOCK_PX

Image = UInt8[np.ndarray, "h w 3"]
_DOUBT = 214, 39, 40
"""The colour of what is not to be believed at all."""


def grid(images: dict[str, Image], columns: int = 2) -> UInt8[np.ndarray, "hg wg 3"]:
    """Labelled pictures of one size in rows; missing ones at the end are black."""
    if not images or len({image.shape for image in images.values()}) != 1:
        raise ValueError(f"panels: expected images of one size, got {[i.shape for i in images.values()]}")
    cells = [labelled(image, text) for text, image in images.items()]
    cells += [np.zeros_like(cells[0])] * (-len(cells) % columns)
    rows = [np.concatenate(cells[i : i + columns], axis=1) for i in range(0, len(cells), columns)]
    return np.concatenate(rows, axis=0)


def labelled(image: Image, text: str) -> Image:
    """A copy with a text in the top left corner, white on a darkened strip."""
    scale = max(0.35, image.shape[0] / 540)
    thickness = max(1, round(scale * 1.5))
    (width, height), descent = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, thickness)
    margin = max(2, round(8 * scale))
    marked = image.copy()
    strip = marked[: height + descent + 2 * margin, : width + 2 * margin]
    strip[:] = (strip * 0.35).astype(np.uint8)
    place = (margin, margin + height)
    cv2.putText(marked, text, place, cv2.FONT_HERSHEY_SIMPLEX, scale, (255, 255, 255), thickness, cv2.LINE_AA)
    return marked


def score_colours(score: Float[np.ndarray, "h w"]) -> Image:
    """A share in [0, 1] from black (static) through red and yellow to white (dynamic)."""
    scaled = np.rint(np.clip(score, 0, 1) * 255).astype(np.uint8)
    return cv2.cvtColor(cv2.applyColorMap(scaled, cv2.COLORMAP_HOT), cv2.COLOR_BGR2RGB)


def depth_colours(depth_m: Float[np.ndarray, "h w"], near_m: float = 2.0, far_m: float = 80.0) -> Image:
    """Depth from red (near) to blue (far), even in 1 / depth; black where there is none (0)."""
    span = 1 / near_m - 1 / far_m
    nearness = (1 / np.maximum(depth_m, near_m) - 1 / far_m) / span
    # The root spreads the far half of a street, which is even in 1 / depth only in theory.
    scaled = np.rint(np.clip(nearness, 0, 1) ** 0.5 * 255).astype(np.uint8)
    colours = cv2.cvtColor(cv2.applyColorMap(scaled, cv2.COLORMAP_TURBO), cv2.COLOR_BGR2RGB)
    colours[~(depth_m > 0)] = 0
    return colours


def trust_colours(image: Image, trust: Float[np.ndarray, "bh bw"]) -> Image:
    """A picture that fades to red where it is not to be believed.

    Args:
        image: The picture.
        trust: In [0, 1] of blocks of ``BLOCK_PX`` pixels; what they leave over at the right and below is as
            they are at their edge.
    """
    high, wide = image.shape[:2]
    covered = cv2.resize(trust.astype(np.float32), None, fx=BLOCK_PX, fy=BLOCK_PX)
    rest = (0, high - covered.shape[0]), (0, wide - covered.shape[1])
    share = np.pad(covered, rest, mode="edge")[..., None]
    grey = image.mean(axis=2, keepdims=True)
    doubted = 0.45 * grey + 0.55 * np.array(_DOUBT, np.float32)
    return np.rint(share * image + (1 - share) * doubted).astype(np.uint8)


def to_bytes(image: Float[np.ndarray, "h w 3"]) -> Image:
    """A picture in [0, 1] as bytes."""
    return np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8)
