"""What is known of some drives: path, lidar points, what moves."""

from typing import Any

import cv2
import numpy as np

from dreamdrive.metrics.paths import compare_paths
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive_bench.drives.drive import Drive
from dreamdrive_bench.recorded.kitti import camera_path as kitti_path
from dreamdrive_bench.recorded.lidar import point_shares
from dreamdrive_bench.recorded.pandaset import Movers, camera_path, moving_masks

CAMVID_MOVES, CAMVID_UNKNOWN = (8, 10), (9, 11)
"""Cars and cyclists, of which none stands there; people, and what has no label, count neither way."""


def path_figures(drive: Drive, clip: Clip, geometry: Geometry) -> dict[str, float]:
    """Position error after the best similarity, in per cent of the length; nothing where no path is known."""
    frames = clip.source_index.tolist()
    if drive.truth == "pandaset":
        true = camera_path(drive.folder, frames)
    elif drive.truth == "kitti":
        true = kitti_path(drive.folder, frames)
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
    """Depth against lidar, see ``recorded.lidar``; nothing where there is none."""
    if drive.lidar is None:
        return {}
    pattern = drive.lidar
    found = point_shares(geometry, clip, lambda k: drive.folder / pattern.format(k), drive.meta["width"])
    names = ("points", "off", "abs_rel", "vehicles_off")
    return {} if found is None else {f"lidar_{name}": found[name] for name in names}
