"""Parts of a moving cluster that lie on the road: shadows, and road around the wheels."""

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int


def on_road(
    pixels: Float[np.ndarray, "m 2"],
    frames: Int[np.ndarray, " m"],
    labels: Int[np.ndarray, " m"],
    low: Bool[np.ndarray, " m"],
) -> Bool[np.ndarray, " m"]:
    """Which points are road, though they are in a cluster with things that move.

    A shadow moves with its car, but what carries it is the road. A low point, in the plane of the road, is
    road unless it lies within the outline, the convex hull in the image, of the high points of its cluster
    and frame: there it is a pane or a door whose depth was taken for that of the road seen through or before
    it. Pixels are column and row in the frame a point was seen in.
    """
    road = low.copy()
    order = np.lexsort((frames, labels))
    breaks = np.flatnonzero(np.diff(labels[order]) | np.diff(frames[order])) + 1
    for rows in np.split(order, breaks):
        down, up = rows[low[rows]], rows[~low[rows]]
        road[down] = ~_inside(pixels[down], pixels[up])
    return road


def _inside(points: Float[np.ndarray, "m 2"], outline_of: Float[np.ndarray, "k 2"]) -> Bool[np.ndarray, " m"]:
    """Whether points lie in the convex hull of others; fewer than three have none."""
    if len(outline_of) < 3 or not len(points):
        return np.zeros(len(points), dtype=bool)
    corners = cv2.convexHull(outline_of.astype(np.float32))[:, 0].astype(np.float64)
    edges = np.roll(corners, -1, axis=0) - corners
    away = points[:, None] - corners
    side = edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0]
    return np.all(side >= 0, axis=1) | np.all(side <= 0, axis=1)
