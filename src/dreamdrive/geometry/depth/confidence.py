"""Confidence of depth maps by agreement with neighbouring frames."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.geometry.depth.one_frame import Swept
from dreamdrive.geometry.depth.sweep import Warp, inside
from dreamdrive.scene.camera import Camera
from dreamdrive.vision.windows import window_px

GROUND_PRIOR_CONFIDENCE = 0.3  # road that has its depth from the plane alone
_ABSOLUTE = 0.006  # 1/m
_RELATIVE = 0.06
_BASELINE_M = 0.3  # with less parallax than this between neighbours agreement proves little
_SUPPORTED = 0.4  # confidence from which an object's pixel speaks for the pixels below it
_ROAD_CORRELATION = 0.6  # from which the road is seen, not assumed
_MIN_PLANE_INVERSE = 0.004  # 1/m
_NEARER = 1.15  # an object's inverse depth over the plane's
_STILL_NEARER = 1.1
_LOW = 0.3  # share of the camera's height under which a pixel shows that its object stands on the road
_LOW_SHARE = 0.02
_LOW_PX = 4
_CLOSE_PX = 5


def temporal_neighbours(usable: Bool[np.ndarray, " f"], frame: int) -> tuple[int, ...]:
    """The two usable frames before and the two after ``frame``, fewer at the ends."""
    indices = np.flatnonzero(usable)
    before, after = indices[indices < frame], indices[indices > frame]
    return (*before[-2:].tolist(), *after[:2].tolist())


def agreement(
    frame: int,
    neighbours: Sequence[int],
    cameras: Sequence[Camera],
    inverse_depth: Float[np.ndarray, "f h w"],
    usable: Bool[np.ndarray, "f h w"],
) -> Float[np.ndarray, "h w"]:
    """Share of the neighbours that see a pixel's point at the depth they found themselves (H, W), in [0, 1].

    A neighbour that does not see the point counts as disagreeing, unless none sees it.
    """
    agreeing = np.zeros(inverse_depth.shape[1:], np.float32)
    baseline_m = 0.0
    for other in neighbours:
        warp = Warp(cameras[frame], cameras[other])
        x, y = warp(inverse_depth[frame])
        found = cv2.remap(
            inverse_depth[other].astype(np.float32), x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE
        )
        z_over_depth = warp.rotated[2] + np.float32(warp.translation[2]) * inverse_depth[frame]
        expected = inverse_depth[frame] / np.maximum(z_over_depth, 1e-3)
        close = np.abs(found - expected) < _ABSOLUTE + _RELATIVE * expected
        agreeing += close & inside(x, y, usable[other])
        baseline_m = max(baseline_m, float(np.linalg.norm(warp.translation)))
    return agreeing / max(len(neighbours), 1) * min(1.0, baseline_m / _BASELINE_M)


def combine(
    agreeing: Float[np.ndarray, "h w"],
    correlation: Float[np.ndarray, "h w"],
    from_plane: Bool[np.ndarray, "h w"],
) -> Float[np.ndarray, "h w"]:
    """Agreement times photometric support, at least the constant of the ground prior where the plane won."""
    confidence = agreeing * np.clip((correlation - 0.2) / 0.5, 0, 1)
    return np.where(from_plane, np.maximum(confidence, GROUND_PRIOR_CONFIDENCE), confidence)


def fill_flanks(
    swept: Swept,
    confidence: Float[np.ndarray, "h w"],
    plane_inverse: Float[np.ndarray, "h w"],
    street: Bool[np.ndarray, "h w"],
) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w"]]:
    """Inverse depth (1/m) and confidence with flanks of things filled downwards, upright, to the road.

    The sweep mistakes their smooth paint for the road behind. A confirmed point hides that: below it, down to
    where its depth meets the plane, its column shows the same thing or one nearer, unless the road itself is
    confirmed there. Only regions are filled of which some confirmed pixels are low above the road; what hangs
    (branches, signs) is left alone.
    """
    inverse = swept.inverse_depth
    below = (plane_inverse > _MIN_PLANE_INVERSE) & street
    solid = below & ~swept.on_plane & (confidence >= _SUPPORTED) & (inverse > _NEARER * plane_inverse)
    road = swept.on_plane & (swept.correlation > _ROAD_CORRELATION)
    above, above_road = _last_above(solid), _last_above(road)
    carried = np.take_along_axis(inverse, np.maximum(above, 0), axis=0)
    hidden = below & ~solid & (above > above_road) & (carried > _STILL_NEARER * plane_inverse)
    hidden &= confidence <= GROUND_PRIOR_CONFIDENCE
    fill = hidden & _stands(solid, hidden, 1 - plane_inverse / np.maximum(inverse, 1e-6))
    return (
        np.where(fill, carried, inverse).astype(np.float32),
        np.where(fill, GROUND_PRIOR_CONFIDENCE, confidence).astype(np.float32),
    )


def _last_above(mask: Bool[np.ndarray, "h w"]) -> np.ndarray:
    """Row of the nearest true pixel at or above each pixel (H, W), -1 where there is none."""
    rows = np.arange(len(mask))[:, None]
    return np.maximum.accumulate(np.where(mask, rows, -1), axis=0)


def _stands(
    solid: Bool[np.ndarray, "h w"], hidden: Bool[np.ndarray, "h w"], height: Float[np.ndarray, "h w"]
) -> Bool[np.ndarray, "h w"]:
    """Pixels of connected regions that reach down to the road; heights are in camera heights."""
    side = window_px(_CLOSE_PX, solid.shape[1])
    kernel = np.ones((side, side), np.uint8)
    closed = np.asarray(cv2.morphologyEx(solid.astype(np.uint8), cv2.MORPH_CLOSE, kernel)) > 0
    count, found = cv2.connectedComponents((closed | hidden).astype(np.uint8))
    labels = np.asarray(found, np.intp)
    low = np.bincount(labels[solid & (height < _LOW)], minlength=count)
    stands = low >= np.maximum(_LOW_PX, _LOW_SHARE * np.bincount(labels[solid], minlength=count))
    stands[0] = False
    return stands[labels]
