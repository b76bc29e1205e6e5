"""Scale and road plane from known depth."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip

MIN_RATIOS = 50
MAX_DEPTH_M = 40.0
POINTS_A_FRAME = 400


def depth_points(clip: Clip) -> Float[np.ndarray, "p 3"]:
    """Known depth as points (P, 3) in the frame of the known poses, or of the one pose of a standing clip.

    Of up to eight frames, each n-th pixel that is known and nearer than 40 m; empty without known depth.
    """
    if clip.known.depth_m is None:
        return np.zeros((0, 3))
    clouds: list[np.ndarray] = []
    for frame in np.unique(np.linspace(0, len(clip) - 1, min(8, len(clip))).round().astype(int)):
        camera = clip.rig[0]
        pose = np.eye(4) if clip.known.world_from_camera is None else clip.known.world_from_camera[frame]
        depth = clip.known.depth_m[frame]
        there = np.argwhere((depth > 0) & (depth < MAX_DEPTH_M))
        rows, columns = there[:: max(1, len(there) // POINTS_A_FRAME)].T
        local = camera.rays()[rows, columns] * depth[rows, columns, None]
        clouds.append(local @ pose[:3, :3].T + pose[:3, 3])
    return np.concatenate(clouds).astype(np.float64)


def depth_ratios(
    clip: Clip,
    camera: Camera,
    world_from_camera: Float[np.ndarray, "f 4 4"],
    points: Float[np.ndarray, "p 3"],
    seen: Bool[np.ndarray, "f p"],
) -> Float[np.ndarray, " n"]:
    """Known depth over the depth of each sparse point in each frame that sees it; empty below 50."""
    if clip.known.depth_m is None:
        return np.zeros(0)
    ratios: list[np.ndarray] = []
    for frame, pose in enumerate(world_from_camera):
        local = (points[seen[frame]] - pose[:3, 3]) @ pose[:3, :3]
        local = local[local[:, 2] > 1e-6]
        columns = np.floor(local[:, 0] / local[:, 2] * camera.fx_px + camera.cx_px).astype(int)
        rows = np.floor(local[:, 1] / local[:, 2] * camera.fy_px + camera.cy_px).astype(int)
        inside = (columns >= 0) & (columns < camera.width_px) & (rows >= 0) & (rows < camera.height_px)
        known = clip.known.depth_m[frame, rows[inside], columns[inside]]
        ratios.append((known / local[inside, 2])[known > 0])
    joined = np.concatenate(ratios)
    return joined if len(joined) >= MIN_RATIOS else np.zeros(0)


def factor_of(ratios: Float[np.ndarray, " n"]) -> tuple[float, float]:
    """The factor that ratios (N,) agree on, and their spread around it as a fraction."""
    factor = float(np.median(ratios))
    return factor, float(np.median(np.abs(ratios / factor - 1)) * 1.4826)


def in_metres(clip: Clip, metres_per_unit: float | None) -> Clip:
    """The clip with its known depth in metres; without depth where nothing makes metres of its unit."""
    if metres_per_unit == 1 or clip.known.depth_m is None:
        return clip
    depth = None if metres_per_unit is None else clip.known.depth_m * np.float32(metres_per_unit)
    return replace(clip, known=replace(clip.known, depth_m=depth))
