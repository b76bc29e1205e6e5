"""Image regions that are fixed to the camera: bonnet, mirrors, overlays and black bars."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

BONNET, OVERLAY, BAR = "bonnet", "mirror or overlay", "bar"
MIN_FRAMES = 6
MIN_GRADIENT = 3.0
MAX_DEVIATION = 0.35
DRAWN_DEVIATION = 0.12
DRAWN_GRADIENT = 8.0
RADIAL_COSINE = 0.35
CENTRE = (0.5, 0.47)
FAR_RADIUS, FAR_BOTTOM = 0.28, 0.62
MIN_EDGE_PIXELS, MIN_BORDER_PIXELS = 8, 20
ACROSS_SHARE = 0.65
BAR_LEVEL = 16
BORDER = 0.03
ROAD_AHEAD = (0.2, 0.8, 0.4, 0.92)


@dataclass(frozen=True)
class Fixed:
    """What does not move with the street.

    Objects keep their place without being fixed to the camera: a car ahead at a constant distance, a faint
    reflection. They must not steer the poses, but they belong to the scene.
    """

    regions: Int[np.ndarray, "h w"]  # 0 for the street, else 1 + index into the names
    names: tuple[str, ...]
    objects: Bool[np.ndarray, "h w"]


@dataclass(frozen=True)
class _Edges:
    """Persistent gradients at the working size."""

    gradient: np.ndarray
    deviation: np.ndarray
    static: np.ndarray
    radial: np.ndarray


def find_fixed(
    grey: UInt8[np.ndarray, "f h w"],
    valid: Bool[np.ndarray, "h w"],
    moving: Bool[np.ndarray, " f"],
    size: tuple[int, int],
) -> Fixed:
    """Find the regions, in maps of ``size``, from edges that stay in place while the street moves.

    An edge stays when its temporal median gradient is strong and the frames, 320 px wide, deviate little from
    it. Lane lines and kerbs stay too under forward motion, so edges along lines through the centre of the
    image do not count, nor does the far field above the road. Wide edges at the bottom are the bonnet. Of the
    rest, what touches the border of the image, or is drawn over it away from the road ahead so sharply that
    only the codec disturbs it, is a mirror or an overlay. Anything else that stays is an object: a lead car
    at a constant distance stands on the road ahead, does not touch the border, and its edges shimmer. With
    fewer than six frames in which the camera moves only bars are looked for.
    """
    height, width = grey.shape[1:]
    regions = np.zeros((height, width), np.uint8)
    objects = np.zeros((height, width), bool)
    bars = _bars(grey)
    if moving.sum() >= MIN_FRAMES:
        edges = _persistent_edges(grey[moving], valid & ~bars)
        bonnet = _bonnet(edges)
        overlay, objects = _components(edges, bonnet)
        regions[overlay], regions[bonnet] = 2, 1
        if (regions > 0).mean() > 0.5:
            regions[:], objects[:] = 0, False
    regions[bars] = 3
    codes = np.unique(regions[regions > 0])
    names = tuple((BONNET, OVERLAY, BAR)[code - 1] for code in codes.tolist())
    renumbered = np.searchsorted(codes, regions, side="right").astype(np.uint8)
    maps = renumbered, objects.astype(np.uint8)
    resized, kept = (cv2.resize(each, size, interpolation=cv2.INTER_NEAREST) for each in maps)
    return Fixed(resized.astype(np.int32), names, kept > 0)


def with_own_car(fixed: Fixed, own_car: Bool[np.ndarray, "h w"]) -> Fixed:
    """What is fixed with the own car as another picture of it shows that, where nothing was found before."""
    added = own_car & (fixed.regions == 0)
    if not added.any():
        return fixed
    names = fixed.names if BONNET in fixed.names else (*fixed.names, BONNET)
    regions = np.where(added, 1 + names.index(BONNET), fixed.regions).astype(np.int32)
    return Fixed(regions, names, fixed.objects & ~added)


def _bars(grey: np.ndarray) -> np.ndarray:
    """Rows and columns at the border that are black in every frame."""
    dark = grey.max(axis=0) < BAR_LEVEL
    mask = np.zeros_like(dark)
    for axis in (0, 1):
        line = dark.mean(axis=1 - axis) > 0.98
        if line.all():
            continue
        lead, trail = int(np.argmin(line)), int(np.argmin(line[::-1]))
        view = mask if axis == 0 else mask.T
        view[:lead] = True
        view[len(line) - trail :] = True
    return mask


def _persistent_edges(grey: np.ndarray, usable: np.ndarray) -> _Edges:
    along_x = np.stack([cv2.Scharr(frame, cv2.CV_32F, 1, 0, scale=1 / 32) for frame in grey])
    along_y = np.stack([cv2.Scharr(frame, cv2.CV_32F, 0, 1, scale=1 / 32) for frame in grey])
    median_x, median_y = np.median(along_x, axis=0), np.median(along_y, axis=0)
    strength = np.hypot(median_x, median_y)
    spread = np.percentile(np.hypot(along_x - median_x, along_y - median_y), 75, axis=0)
    deviation = spread / np.maximum(strength, 1e-6)
    height, width = strength.shape
    rows, columns = np.mgrid[:height, :width]
    out_x, out_y = columns + 0.5 - CENTRE[0] * width, rows + 0.5 - CENTRE[1] * height
    distance = np.hypot(out_x, out_y)
    cosine = np.abs(median_x * out_x + median_y * out_y) / np.maximum(strength * distance, 1e-6)
    far = (distance < FAR_RADIUS * width) & (rows < FAR_BOTTOM * height)
    inside = cv2.erode(usable.astype(np.uint8), np.ones((5, 5), np.uint8), borderValue=1) > 0
    static = (strength > MIN_GRADIENT) & (deviation < MAX_DEVIATION) & ~far & inside
    return _Edges(strength, deviation, static, cosine < RADIAL_COSINE)


def _bonnet(edges: _Edges) -> np.ndarray:
    """Everything below the upper outline of wide persistent edges at the bottom."""
    height, width = edges.static.shape
    labels, boxes = _label(edges.static & ~edges.radial, reach=3)
    top = np.full(width, height)
    for label, (left, upper, span, tall, _) in enumerate(boxes):
        if label == 0 or upper < 0.55 * height or upper + tall < 0.85 * height or span < 0.25 * width:
            continue
        rows, columns = np.nonzero(labels[:, left : left + span] == label)
        np.minimum.at(top, columns + left, rows)
    known = np.flatnonzero(top < height)
    if len(known) < 0.25 * width:
        return np.zeros((height, width), bool)
    line = np.interp(np.arange(width), known, top[known])
    padded = np.pad(line, 10, mode="edge")
    smooth = np.array([np.percentile(padded[column : column + 21], 30) for column in range(width)])
    return np.arange(height)[:, None] >= smooth - 2


def _components(edges: _Edges, bonnet: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Overlays and objects among the persistent edges outside the bonnet."""
    height, width = edges.static.shape
    overlay, objects = np.zeros((2, height, width), bool)
    near_bonnet = cv2.dilate(bonnet.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
    edge_pixels = edges.static & ~near_bonnet
    labels, boxes = _label(edge_pixels & ~edges.radial, reach=9)
    for label, (left, upper, span, tall, _) in enumerate(boxes):
        pixels = edge_pixels & (labels == label)
        across_rays = int((pixels & ~edges.radial).sum())
        if label == 0 or across_rays < max(MIN_EDGE_PIXELS, ACROSS_SHARE * pixels.sum()):
            continue
        at_side = left <= BORDER * width or left + span >= (1 - BORDER) * width
        at_border = at_side or upper <= BORDER * height or upper + tall >= (1 - BORDER) * height
        across, down = (left + span / 2) / width, (upper + tall / 2) / height
        ahead = ROAD_AHEAD[0] < across < ROAD_AHEAD[1] and ROAD_AHEAD[2] < down < ROAD_AHEAD[3]
        drawn = not ahead and np.percentile(edges.deviation[pixels], 75) < DRAWN_DEVIATION
        strong = edges.gradient[pixels].mean() >= DRAWN_GRADIENT
        at_border = at_border and across_rays >= MIN_BORDER_PIXELS
        (overlay if strong and (at_border or drawn) else objects)[_fill(pixels)] = True
    return overlay & ~bonnet, objects & ~bonnet & ~overlay


def _label(edges: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray]:
    joined = cv2.dilate(edges.astype(np.uint8), np.ones((reach, reach), np.uint8))
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(joined, connectivity=8)
    return labels, boxes


def _fill(pixels: np.ndarray) -> np.ndarray:
    """The closed component, or its convex hull when that is not much larger."""
    closed = cv2.morphologyEx(pixels.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((9, 9), np.uint8))
    hull = np.zeros_like(closed)
    rows, columns = np.nonzero(pixels)
    points = np.stack([columns, rows], axis=1).astype(np.int32)
    cv2.fillConvexPoly(hull, cv2.convexHull(points), (1,))
    chosen = hull if hull.sum() < 4 * closed.sum() else closed
    return cv2.dilate(chosen, np.ones((3, 3), np.uint8)) > 0


def describe(fixed: Fixed) -> list[str]:
    """A sentence for each region found."""
    sentences: list[str] = []
    for index, name in enumerate(fixed.names, 1):
        share: Float[np.ndarray, ""] = (fixed.regions == index).mean()
        sentences.append(f"{name}: {100 * share:.1f} % of the image is fixed to the camera and left out")
    if fixed.objects.any():
        sentences.append(
            "something keeps its place in the image without being fixed to the camera, such as a car ahead "
            "at a constant distance or a faint reflection: kept out of the poses, kept in the scene"
        )
    return sentences
