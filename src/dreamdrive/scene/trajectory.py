"""Poses over time."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.camera import check_rigid


@dataclass(frozen=True)
class Trajectory:
    """A path of the camera in the world frame.

    Attributes:
        world_from_camera: Poses (T, 4, 4) in metres.
        times_s: Times (T,) in seconds, strictly increasing.
    """

    world_from_camera: Float[np.ndarray, "t 4 4"]
    times_s: Float[np.ndarray, " t"]

    def __post_init__(self) -> None:
        check_rigid(self.world_from_camera, "world_from_camera")
        if len(self.times_s) == 0:
            raise ValueError("a trajectory needs at least one pose")
        if not np.isfinite(self.times_s).all() or (np.diff(self.times_s) <= 0).any():
            raise ValueError("times_s must be finite and strictly increasing")

    def __len__(self) -> int:
        return len(self.times_s)

    @property
    def positions_m(self) -> Float[np.ndarray, "t 3"]:
        """Camera centres (T, 3)."""
        return self.world_from_camera[:, :3, 3]

    @property
    def length_m(self) -> float:
        """Length of the path."""
        return float(np.linalg.norm(np.diff(self.positions_m, axis=0), axis=1).sum())
