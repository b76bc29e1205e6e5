"""Registration of points: to pixels by a camera pose, to other points by a similarity."""

import cv2
import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.scene.similarity import Similarity

_REPROJECTION_PX = 5.0
_FOCALS = 21
_TINY = 1e-12


def pose_by_pnp(
    points: Float[np.ndarray, "h w 3"],
    usable: Bool[np.ndarray, "h w"],
    focal_px: float | None,
    iterations: int,
    principal_px: tuple[float, float],
    stretch: float,
) -> tuple[float, Float[np.ndarray, "4 4"]] | None:
    """Focal length fx and pose of the camera whose pixel grid sees the points: SQPNP in RANSAC, 5 px.

    Without a focal length 21 from S/2 to 3 S are tried, S the longer side, and that of most inliers is kept;
    ``stretch`` is fx / fy. None where fewer than four pixels are usable or nothing fits.
    """
    height, width = usable.shape
    if np.count_nonzero(usable) < 4:
        return None
    rows, columns = np.nonzero(usable)
    pixels = np.stack([columns, rows], axis=1).astype(np.float32)
    longer = max(height, width)
    cx, cy = principal_px
    focals = [focal_px] if focal_px is not None else np.geomspace(longer / 2, longer * 3, _FOCALS).tolist()
    best: tuple[int, float, np.ndarray] | None = None
    for focal in focals:
        matrix = np.array([[focal, 0, cx], [0, focal / stretch, cy], [0, 0, 1]], np.float32)
        success, turn, shift, inliers = cv2.solvePnPRansac(
            points[usable].astype(np.float32),
            pixels,
            matrix,
            None,
            iterationsCount=iterations,
            reprojectionError=_REPROJECTION_PX,
            flags=cv2.SOLVEPNP_SQPNP,
        )
        if success and (best is None or len(inliers) > best[0]):
            camera_from_world = np.eye(4)
            camera_from_world[:3, :3] = cv2.Rodrigues(turn)[0]
            camera_from_world[:3, 3] = shift[:, 0]
            best = len(inliers), float(focal), camera_from_world
    return None if best is None else (best[1], np.linalg.inv(best[2]))


def register(
    source: Float[np.ndarray, "*n 3"],
    target: Float[np.ndarray, "*n 3"],
    weights: Float[np.ndarray, "*n"],
    *,
    robust_steps: int = 0,
) -> Similarity:
    """Minimise sum w |s R x + t - y|^2 over points x and y (Umeyama 1991, weighted), in float64; w >= 0.

    In each robust step a point weighs w / |s R x + t - y|; their limit minimises sum w |s R x + t - y|.
    """
    counts = weights > 0
    if np.count_nonzero(counts) < 3:
        raise ValueError(
            f"registration: {np.count_nonzero(counts)} weighted points; a similarity takes three"
        )
    x, y = source[counts].astype(np.float64), target[counts].astype(np.float64)
    trust = weights[counts].astype(np.float64)
    found = _umeyama(x, y, trust)
    for _ in range(robust_steps):
        distance = np.linalg.norm(found(x) - y, axis=1)
        floor = max(1e-3 * float(np.median(distance)), _TINY)
        found = _umeyama(x, y, trust / np.maximum(distance, floor))
    return found


def _umeyama(
    x: Float[np.ndarray, "n 3"], y: Float[np.ndarray, "n 3"], weights: Float[np.ndarray, " n"]
) -> Similarity:
    share = (weights / weights.sum())[:, None]
    middle, target = (share * x).sum(axis=0), (share * y).sum(axis=0)
    x, y = x - middle, y - target
    left, singular, right = np.linalg.svd((share * y).T @ x)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation = (left * signs) @ right
    scale = float((singular * signs).sum() / max(float((share * x * x).sum()), _TINY))
    return Similarity(scale, rotation, target - scale * rotation @ middle)
