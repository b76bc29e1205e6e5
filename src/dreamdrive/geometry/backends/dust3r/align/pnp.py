"""Camera poses from points and the pixels where they are seen (OpenCV)."""

import cv2
import numpy as np
from jaxtyping import Bool, Float

_REPROJECTION_PX = 5.0
_FOCALS = 21


def pose_by_pnp(
    points: Float[np.ndarray, "h w 3"],
    usable: Bool[np.ndarray, "h w"],
    focal_px: float | None,
    iterations: int,
    principal_px: tuple[float, float],
    stretch: float,
) -> tuple[float, Float[np.ndarray, "4 4"]] | None:
    """Pose of the camera whose pixel grid sees the points: SQPNP in RANSAC, 5 px.

    Args:
        points: World point (H, W, 3) of each pixel.
        usable: Pixels to use (H, W).
        focal_px: None tries 21 focal lengths from S/2 to 3 S, S the longer side, and keeps that of most
            inliers.
        iterations: Of RANSAC.
        principal_px: Column and row.
        stretch: fx / fy.

    Returns:
        Focal length fx and world_from_camera, or None where fewer than four pixels are usable or nothing
        fits.
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
