"""Poses over time."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation, Slerp

from dreamdrive.registry import shown
from dreamdrive.scene.camera import check_rigid

LATEST_S = 1e12
"""Largest time: clocks that count from 1970 are at 1.8e9 seconds."""


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
        if not (np.abs(self.times_s) <= LATEST_S).all() or (np.diff(self.times_s) <= 0).any():
            raise ValueError(f"times_s must be finite, at most {LATEST_S:g}, and strictly increasing")

    def __len__(self) -> int:
        return len(self.times_s)

    def _repr_html_(self) -> str:
        return shown(self)

    @property
    def positions_m(self) -> Float[np.ndarray, "t 3"]:
        """Camera centres (T, 3)."""
        return self.world_from_camera[:, :3, 3]

    @property
    def length_m(self) -> float:
        """Length of the path."""
        return float(np.linalg.norm(np.diff(self.positions_m, axis=0), axis=1).sum())

    def at(self, times_s: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 4 4"]:
        """Poses (N, 4, 4) at any times; positions linear and rotations slerped, the ends held."""
        if len(self) == 1:
            return np.repeat(self.world_from_camera, len(times_s), axis=0)
        times = np.clip(times_s, self.times_s[0], self.times_s[-1])
        poses = np.tile(np.eye(4), (len(times), 1, 1))
        turns = Slerp(self.times_s, Rotation.from_matrix(self.world_from_camera[:, :3, :3]))
        poses[:, :3, :3] = turns(times).as_matrix()
        for axis in range(3):
            poses[:, axis, 3] = np.interp(times, self.times_s, self.positions_m[:, axis])
        return poses
