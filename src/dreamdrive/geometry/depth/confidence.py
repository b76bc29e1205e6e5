"""How far neighbouring frames confirm a depth map."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.geometry.depth.sweep import Warp, inside
from dreamdrive.scene.camera import Camera

GROUND_PRIOR_CONFIDENCE = 0.3  # road that has its depth from the plane alone
_ABSOLUTE = 0.006  # 1/m
_RELATIVE = 0.06
_BASELINE_M = 0.3  # with less parallax than this between neighbours agreement proves little


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
