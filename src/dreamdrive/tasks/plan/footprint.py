"""The ground that a car covers on its way."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.drive import CAR_M
from dreamdrive.errors import InputError
from dreamdrive.tasks.plan.trajectory import AHEAD_RAD, wrapped

STILL_M = 0.2
"""Way over two steps below which a path tells no direction: 0.2 m/s, where noise of waypoints decides."""


@dataclass(frozen=True)
class Footprint:
    """The rectangle of a car around the point that its waypoints describe.

    Attributes:
        length_m: By default that of the cars of nuScenes, as in all published figures.
        width_m: Its width.
        ahead_m: How far its middle is ahead of the waypoint.
    """

    length_m: float = CAR_M[0]
    width_m: float = CAR_M[1]
    ahead_m: float = 0.5

    def __post_init__(self) -> None:
        if not 0 < self.width_m < np.inf or not 0 < self.length_m < np.inf or not np.isfinite(self.ahead_m):
            raise InputError(f"{self} is no car; expected a length and a width above 0 metres")

    def along(
        self, waypoints_m: Float[np.ndarray, "*b t 2"], margin_m: float = 0.0
    ) -> Float[np.ndarray, "*b t 5"]:
        """The rectangles at the waypoints (..., T, 5), turned as the path runs: see ``rectangles``.

        Args:
            waypoints_m: Paths (..., T, 2) that begin one step after the origin.
            margin_m: Added on every side.
        """
        yaw = headings(waypoints_m)
        middle = waypoints_m + self.ahead_m * np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)
        size = np.broadcast_to([self.length_m + 2 * margin_m, self.width_m + 2 * margin_m], middle.shape)
        return np.concatenate([middle, size, yaw[..., None]], axis=-1)


CAR = Footprint()
"""The car of all published figures on nuScenes."""


def headings(waypoints_m: Float[np.ndarray, "*b t 2"]) -> Float[np.ndarray, "*b t"]:
    """How a car points at each waypoint, in radians (..., T): from the waypoint before to the one after.

    The path begins at the origin, straight ahead. The last waypoint has none after it. Where the car hardly
    moves it points as before. It drives backwards where the path would turn it by more than a right angle in
    one step.

    Args:
        waypoints_m: Paths (..., T, 2) in the planning frame.
    """
    steps = waypoints_m.shape[-2]
    paths = np.pad(waypoints_m.reshape(-1, steps, 2).astype(np.float64), ((0, 0), (1, 0), (0, 0)))
    ways = np.concatenate([paths[:, 2:], paths[:, -1:]], axis=1) - paths[:, :-1]
    found = np.empty(ways.shape[:2])
    yaw = np.full(len(ways), AHEAD_RAD)
    for step in range(steps):
        x, y = ways[:, step].T
        turn = wrapped(np.arctan2(y, x) - yaw)
        turn = np.where(np.abs(turn) > np.pi / 2, wrapped(turn + np.pi), turn)
        yaw = np.where(np.hypot(x, y) < STILL_M, yaw, wrapped(yaw + turn))
        found[:, step] = yaw
    return found.reshape(waypoints_m.shape[:-1])
