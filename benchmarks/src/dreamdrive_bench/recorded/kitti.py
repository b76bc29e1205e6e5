"""Truth of the clips of KITTI's odometry."""

from pathlib import Path

import numpy as np
from jaxtyping import Float


def camera_path(clip_dir: Path, frames: list[int]) -> Float[np.ndarray, "f 4 4"]:
    """world_from_camera of some frames of the recording."""
    rows = np.loadtxt(clip_dir / "poses.txt").reshape(-1, 3, 4)[frames]
    return np.concatenate([rows, np.broadcast_to([0.0, 0, 0, 1], (len(rows), 1, 4))], axis=1)
