"""Marks on roads beside their lines: repairs, cracks, lids, oil, arrows, letters, tracks of wheels."""

import cv2
import numpy as np

from dreamdrive.scene.street.layout import Layout
from streetworld.edition2.roads.sheet import SHIFT, Sheet
from streetworld.engine.paint import Image


def repairs(rng: np.random.Generator, image: Image, texel_m: float) -> None:
    """Patches, sealed seams, lids and oil on a picture of asphalt, in place."""
    height, width = image.shape[:2]
    area_m2 = height * width * texel_m**2
    for _ in range(rng.poisson(area_m2 / 400 * rng.exponential(1.0))):
        _patch(rng, image, texel_m)
    for _ in range(rng.poisson(area_m2 / 120 * rng.exponential(1.0))):
        _seam(rng, image, texel_m)
    for _ in range(rng.poisson(area_m2 / 600)):
        centre = int(rng.integers(0, width)), int(rng.integers(0, height))
        radius = max(2, round(rng.uniform(0.25, 0.4) / texel_m))
        dark, rim = (np.array([1, 0.98, 0.96]) * s for s in (rng.uniform(40, 90), rng.uniform(60, 140)))
        cv2.circle(image, centre, radius, dark.tolist(), -1, cv2.LINE_AA)
        cv2.circle(image, centre, radius, rim.tolist(), 1, cv2.LINE_AA)
    for _ in range(rng.poisson(area_m2 / 200 * rng.exponential(1.0))):
        _stain(rng, image, texel_m)


def _patch(rng: np.random.Generator, image: Image, texel_m: float) -> None:
    """A repaired piece, darker or lighter."""
    height, width = image.shape[:2]
    size = rng.uniform(0.6, 4.0, 2) * ([4, 0.5] if rng.random() < 0.3 else [1, 1])
    centre = rng.uniform((0, 0), (width, height))
    box = cv2.boxPoints((tuple(centre), tuple(size / texel_m), float(rng.uniform(-10, 100)))).astype(np.int32)
    low = np.clip(box.min(0), 0, [width - 1, height - 1])
    high = np.clip(box.max(0) + 1, 1, [width, height])
    window = image[low[1] : high[1], low[0] : high[0]]
    mask = np.zeros(window.shape[:2], np.uint8)
    cv2.fillPoly(mask, [box - low], (1,))
    factor = rng.uniform(0.6, 1.25)
    changed = np.clip(window * factor, 0, 255).astype(np.uint8)
    cv2.copyTo(changed, mask, window)
    if rng.random() < 0.5:
        shade = float(rng.uniform(25, 60))
        cv2.polylines(image, [box], True, (shade, shade, shade), max(1, round(0.06 / texel_m)), cv2.LINE_AA)


def _seam(rng: np.random.Generator, image: Image, texel_m: float) -> None:
    """A crack, open or sealed with tar."""
    start = rng.uniform((0, 0), (image.shape[1], image.shape[0]))
    steps = int(rng.integers(8, 60))
    heading = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.normal(0, rng.uniform(0.05, 0.5), steps))
    way = np.stack([np.cos(heading), np.sin(heading)], -1) * rng.uniform(0.1, 0.3) / texel_m
    path = (start + np.cumsum(way, axis=0)).astype(np.int32)
    shade = float(rng.uniform(18, 70))
    thick = max(1, round(float(rng.choice([0.02, 0.05, 0.09])) / texel_m))
    cv2.polylines(image, [path], False, (shade, shade, shade), thick, cv2.LINE_AA)


def _stain(rng: np.random.Generator, image: Image, texel_m: float) -> None:
    """Oil or dirt, soft at its edge."""
    height, width = image.shape[:2]
    radius = int(rng.uniform(0.2, 1.5) / texel_m)
    x, y = int(rng.integers(0, width)), int(rng.integers(0, height))
    x0, x1, y0, y1 = max(0, x - radius), min(width, x + radius), max(0, y - radius), min(height, y + radius)
    if x1 <= x0 or y1 <= y0:
        return
    away = (
        (np.arange(x0, x1)[None] - x) ** 2 + rng.uniform(1, 4) * (np.arange(y0, y1)[:, None] - y) ** 2
    ) / radius**2
    factor = 1 - rng.uniform(0.1, 0.5) * np.clip(1 - away, 0, 1).astype(np.float32)
    window = image[y0:y1, x0:x1]
    window[:] = (window * factor[..., None]).astype(np.uint8)


def letters(
    rng: np.random.Generator, mask: np.ndarray, label: np.ndarray, sheet: Sheet, layout: Layout
) -> None:
    """Arrows, words and numbers on the road ahead, in place: long ones, as they are seen flat."""
    if rng.random() < 0.55:
        return
    points = np.array([[p.x_m, p.y_m] for p in layout.ego.track])
    heading = layout.ego.track[-1].yaw_rad
    ahead = np.array([np.cos(heading), np.sin(heading)])
    aside = np.array([-ahead[1], ahead[0]])
    for _ in range(int(rng.integers(1, 4))):
        at = points[-1] + ahead * rng.uniform(5, 50) + aside * float(rng.choice([0, 0, 3.4, -3.4, 6.8]))
        flip = 1 if rng.random() < 0.75 else -1
        for stroke in _strokes(rng):
            outline = at + flip * (stroke[:, :1] * ahead + stroke[:, 1:] * aside)
            cv2.fillPoly(mask, [sheet.pixels(outline)], (255,), cv2.LINE_AA, SHIFT)
    del label


def _strokes(rng: np.random.Generator) -> list[np.ndarray]:
    """Outlines (K, 2) of an arrow or of blocks that look like letters, along and to the left in metres."""
    kind = rng.integers(4)
    if kind == 0:  # ahead
        return [
            np.array([[0, -0.08], [3, -0.08], [3, 0.08], [0, 0.08]]),
            np.array([[3, -0.38], [4.6, 0], [3, 0.38]]),
        ]
    if kind == 1:  # a turn
        side = rng.choice([-1, 1])
        bent = np.array([[0, -0.08], [3, -0.08], [3.6, 0.5], [3.2, 0.65], [2.7, 0.08], [0, 0.08]])
        head = np.array([[2.6, 0.5], [3.6, 1.2], [4.2, 0.3]])
        return [bent * [1, side], head * [1, side]]
    if kind == 2:  # a lozenge or a triangle
        return [np.array([[0, 0], [1.2, -0.5], [2.4, 0], [1.2, 0.5]])]
    strokes: list[np.ndarray] = []
    count = int(rng.integers(2, 6))
    for k in range(count):
        y = (0.5 * count - k) * 0.62
        for bar in range(3):
            if rng.random() < 0.8:
                x = bar * 0.9
                strokes.append(np.array([[x, y], [x + 0.3, y], [x + 0.3, y - 0.45], [x, y - 0.45]]))
        for side in (0.0, 0.34):
            if rng.random() < 0.7:
                strokes.append(
                    np.array([[0, y - side], [2.1, y - side], [2.1, y - side - 0.12], [0, y - side - 0.12]])
                )
    return strokes


def tracks(sheet: Sheet, layout: Layout) -> np.ndarray:
    """Where wheels have cleared the snow (H, W): along the way of the recording car and of others."""
    mask = np.zeros(sheet.shape, np.uint8)
    tracks_ = [layout.ego.track, *(b.track for b in layout.boxes if len(b.track) > 1)]
    for track in tracks_:
        points = np.array([[p.x_m, p.y_m, p.yaw_rad] for p in track])
        heading = points[-1, 2]
        end = points[-1, :2] + 60 * np.array([np.cos(heading), np.sin(heading)])
        start = points[0, :2] - 30 * np.array([np.cos(points[0, 2]), np.sin(points[0, 2])])
        line = np.vstack([start, points[:, :2], end])
        yaw = np.concatenate([points[:1, 2], points[:, 2], points[-1:, 2]])
        for side in (-0.8, 0.8):
            shifted = line + side * np.stack([-np.sin(yaw), np.cos(yaw)], -1)
            wide = max(1, round(0.5 / sheet.texel_m))
            cv2.polylines(mask, [sheet.pixels(shifted)], False, (255,), wide, cv2.LINE_AA, SHIFT)
    return cv2.blur(mask, (9, 9)).astype(np.float32) / 255
