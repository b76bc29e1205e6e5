"""Rectangles on the ground: x, y, length, width, yaw in metres and radians, yaw from x counter-clockwise."""

import numpy as np
from jaxtyping import Bool, Float


def corners(rectangles: Float[np.ndarray, "*b 5"]) -> Float[np.ndarray, "*b 4 2"]:
    """Corners of rectangles (..., 4, 2): ahead left, ahead right, behind right, behind left."""
    ahead, left = _sides(rectangles)
    middle = rectangles[..., :2]
    return np.stack(
        [middle + ahead + left, middle + ahead - left, middle - ahead - left, middle - ahead + left], -2
    )


def overlapping(a: Float[np.ndarray, "*#b 5"], b: Float[np.ndarray, "*#b 5"]) -> Bool[np.ndarray, "*b"]:
    """Which pairs of rectangles overlap or touch: none of their sides' directions tells them apart.

    Args:
        a: Rectangles (..., 5).
        b: Others, of the same shape or one that NumPy broadcasts to it.
    """
    a_sides, b_sides = _sides(a), _sides(b)
    between = b[..., :2] - a[..., :2]
    apart = np.zeros(between.shape[:-1], bool)
    for side in (*a_sides, *b_sides):
        reach = sum(np.abs((each * side).sum(-1)) for each in (*a_sides, *b_sides))
        apart |= np.abs((between * side).sum(-1)) > reach
    return ~apart


def inside(
    points_m: Float[np.ndarray, "*b 2"], rectangles: Float[np.ndarray, "*#b 5"]
) -> Bool[np.ndarray, "*b"]:
    """Which points lie in their rectangle, or on its border."""
    away = points_m - rectangles[..., :2]
    cos, sin = np.cos(rectangles[..., 4]), np.sin(rectangles[..., 4])
    along, across = cos * away[..., 0] + sin * away[..., 1], cos * away[..., 1] - sin * away[..., 0]
    return (2 * np.abs(along) <= rectangles[..., 2]) & (2 * np.abs(across) <= rectangles[..., 3])


def _sides(
    rectangles: Float[np.ndarray, "*b 5"],
) -> tuple[Float[np.ndarray, "*b 2"], Float[np.ndarray, "*b 2"]]:
    """Half of the length and half of the width as vectors."""
    direction = np.stack([np.cos(rectangles[..., 4]), np.sin(rectangles[..., 4])], axis=-1)
    aside = np.stack([-direction[..., 1], direction[..., 0]], axis=-1)
    return direction * rectangles[..., 2:3] / 2, aside * rectangles[..., 3:4] / 2
