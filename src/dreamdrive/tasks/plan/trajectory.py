"""Planned trajectories, and the frame they are in.

Planning frame, as in the literature on nuScenes: seen from above, x right, y ahead, in metres, at the moment
of planning. Its origin is the lidar. Yaw counts from x counter-clockwise, so that ahead is pi / 2. The ego
frame is x ahead, y left, with its origin under the middle of the rear axle.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

STEP_S = 0.5
"""Time from one waypoint to the next in published plans."""
STEPS = 6
"""Waypoints of a published plan: three seconds."""
LIDAR_AHEAD_M = 0.94
"""How far the lidar of nuScenes' cars is ahead of the rear axle."""
AHEAD_RAD = np.pi / 2
"""Yaw of what points straight ahead in the planning frame."""
FARTHEST_M = 200.0
"""Farthest that a waypoint may be: 240 km/h for three seconds. Beyond it the unit is another one."""


@dataclass(frozen=True)
class Plan:
    """Where a car is to be at equal steps of time from now on.

    Attributes:
        waypoints_m: In the planning frame (T, 2). The first is one step after now; now is the origin.
        step_s: Time from one to the next.
    """

    waypoints_m: Float[np.ndarray, "t 2"]
    step_s: float = STEP_S

    def __post_init__(self) -> None:
        if not len(self.waypoints_m) or not np.isfinite(self.waypoints_m).all():
            raise ValueError("a plan needs at least one waypoint, and numbers that are finite")
        if not 0 < self.step_s < np.inf:
            raise ValueError(f"a plan with steps of {self.step_s} s; expected more than 0")

    def __len__(self) -> int:
        return len(self.waypoints_m)

    @property
    def times_s(self) -> Float[np.ndarray, " t"]:
        """Times of the waypoints (T,), counted from now."""
        return self.step_s * np.arange(1, len(self) + 1)


def ego_from_planning(
    points_m: Float[np.ndarray, "*b 2"], origin_ahead_m: float = LIDAR_AHEAD_M
) -> Float[np.ndarray, "*b 2"]:
    """Points of the planning frame in the ego frame.

    Args:
        points_m: (..., 2), x right and y ahead.
        origin_ahead_m: How far the origin of the planning frame is ahead of that of the ego frame.
    """
    return np.stack([points_m[..., 1] + origin_ahead_m, -points_m[..., 0]], axis=-1)


def planning_from_ego(
    points_m: Float[np.ndarray, "*b 2"], origin_ahead_m: float = LIDAR_AHEAD_M
) -> Float[np.ndarray, "*b 2"]:
    """Points of the ego frame (..., 2), x ahead and y left, in the planning frame."""
    return np.stack([-points_m[..., 1], points_m[..., 0] - origin_ahead_m], axis=-1)


def planning_poses(
    now: Float[np.ndarray, "4 4"],
    world_from_ego: Float[np.ndarray, "t 4 4"],
    origin_ahead_m: float = LIDAR_AHEAD_M,
) -> Float[np.ndarray, "t 3"]:
    """Where the origin of the planning frame was or will be, and how the car points: x, y, yaw (T, 3).

    Of poses to come this is the recorded drive that plans are compared with; of past ones what planners
    extrapolate.

    Args:
        now: World from ego at the moment of planning.
        world_from_ego: Poses at other times.
        origin_ahead_m: How far the origin of the planning frame is ahead of that of the ego frame.
    """
    poses = np.linalg.inv(now) @ world_from_ego
    origin = poses[:, :2, :2] @ np.array([origin_ahead_m, 0.0]) + poses[:, :2, 3]
    yaw = wrapped(np.arctan2(poses[:, 1, 0], poses[:, 0, 0]) + AHEAD_RAD)
    return np.column_stack([planning_from_ego(origin, origin_ahead_m), yaw])


def wrapped(angles_rad: Float[np.ndarray, "*b"]) -> Float[np.ndarray, "*b"]:
    """Angles in [-pi, pi)."""
    return (angles_rad + np.pi) % (2 * np.pi) - np.pi
