"""What is known of some drives: path, lidar points, what moves."""

from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, Integer

from common.pandaset_truth import Movers, camera_path, moving_masks
from dreamdrive.evaluate.paths import compare_paths
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from drives.drive import Drive
from knowledge.shots import VEHICLES, labels

NEAR_M, FAR_M, OFF = 2.0, 80.0, 0.1
CAMVID_MOVES, CAMVID_UNKNOWN = (8, 10), (9, 11)
"""Cars and cyclists, of which none stands there; people, and what has no label, count neither way."""


def path_figures(drive: Drive, clip: Clip, geometry: Geometry) -> dict[str, float]:
    """Position error after the best similarity, in per cent of the length; nothing where no path is known."""
    frames = clip.source_index.tolist()
    if drive.truth == "pandaset":
        true = camera_path(drive.folder, frames)
    elif drive.truth == "kitti":
        rows = np.loadtxt(drive.folder / "poses.txt").reshape(-1, 3, 4)[frames]
        true = np.concatenate([rows, np.broadcast_to([0.0, 0, 0, 1], (len(rows), 1, 4))], axis=1)
    else:
        return {}
    error = compare_paths(np.stack([camera.world_from_camera for camera in geometry.cameras]), true)
    if error is None:
        return {}
    return {"path_percent": error.ate_percent, "path_scale": error.scale}


def movers_of(drive: Drive, clip: Clip) -> Movers | None:
    """What moves in each frame, where boxes or label maps tell."""
    frames = clip.source_index.tolist()
    if drive.truth == "pandaset":
        return moving_masks(drive.folder, frames, clip.size)
    if drive.truth != "camvid":
        return None
    maps = [cv2.imread(str(drive.folder / "labels" / f"{i:06d}.png"), cv2.IMREAD_UNCHANGED) for i in frames]
    sized = np.stack([cv2.resize(each, clip.size, interpolation=cv2.INTER_NEAREST) for each in maps])
    return Movers(np.isin(sized, CAMVID_MOVES), np.isin(sized, CAMVID_UNKNOWN))


def lidar_figures(drive: Drive, clip: Clip, geometry: Geometry) -> dict[str, Any]:
    """Depth against lidar points from 2 to 80 m, after one scale for the clip; frames that were seen only."""
    if drive.lidar is None:
        return {}
    each = [_points(drive, clip, geometry, frame) for frame in np.flatnonzero(~clip.held_out).tolist()]
    found = [points for points in each if points is not None]
    if not found:
        return {}
    true, depth, kind = (np.concatenate(column) for column in zip(*found, strict=True))
    known = depth > 0
    ratio = np.median(true[known] / depth[known])
    off = np.where(known, np.abs(depth * ratio - true) / true, np.inf)
    vehicle = np.isin(kind, list(labels(VEHICLES)))
    return {
        "lidar_points": len(true),
        "lidar_off": float((off > OFF).mean()),
        "lidar_abs_rel": float(off[known].mean()),
        "lidar_vehicles_off": float((off[vehicle] > OFF).mean()) if vehicle.any() else None,
    }


def _points(
    drive: Drive, clip: Clip, geometry: Geometry, frame: int
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], Integer[np.ndarray, " n"]] | None:
    """True depth, depth and class of a frame's points; None without lidar."""
    assert drive.lidar is not None
    path = drive.folder / drive.lidar.format(int(clip.source_index[frame]))
    if not path.exists():
        return None
    with np.load(path) as stored:
        true, kind = stored["depth"], stored["sem"] if "sem" in stored.files else None
        place = np.stack([stored["u"], stored["v"]]) + 0.5
    near = (true >= NEAR_M) & (true <= FAR_M)
    column, row = (place[:, near] * clip.size[0] / drive.meta["width"]).astype(int)
    at = row.clip(0, clip.size[1] - 1), column.clip(0, clip.size[0] - 1)
    kinds = np.full(near.sum(), -1) if kind is None else kind[near].astype(int)
    return true[near], geometry.depth_m[frame][at], kinds
