"""The observation of a policy, in numbers."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.tasks.environment.bicycle import EgoOptions, EgoState
from dreamdrive.tasks.environment.path import OnPath, RecordedPath
from dreamdrive.tasks.environment.road_users import RoadUserStates

ROUTE_M = (5.0, 10.0, 20.0, 40.0)
"""How far ahead points of the recorded path are told."""
ROAD_USERS = 8
"""How many road users are told, the nearest first."""
_FAR_M, _ALONG_M, _SPEED_M_S = 100.0, 10_000.0, 100.0
_OWN = {
    "speed_m_s": (0.0, _SPEED_M_S),
    "yaw_rate_rad_s": (-10.0, 10.0),
    "acceleration": (-1.0, 1.0),
    "steering": (-1.0, 1.0),
    "aside_m": (-_FAR_M, _FAR_M),
    "turned_rad": (-np.pi, np.pi),
    "along_m": (-_ALONG_M, _ALONG_M),
}
_ROAD_USER = {
    "there": (0.0, 1.0),
    "x_m": (-_FAR_M, _FAR_M),
    "y_m": (-_FAR_M, _FAR_M),
    "heading_rad": (-np.pi, np.pi),
    "length_m": (0.0, _FAR_M),
    "width_m": (0.0, _FAR_M),
    "speed_m_s": (0.0, _SPEED_M_S),
}
_RANGES = {
    **_OWN,
    **{f"route_{m:.0f}_{axis}_m": (-_FAR_M, _FAR_M) for m in ROUTE_M for axis in "xy"},
    **{f"user_{k}_{name}": ends for k in range(ROAD_USERS) for name, ends in _ROAD_USER.items()},
}
NAMES = tuple(_RANGES)
"""What each number of the vector is, in their order."""
LOW, HIGH = (np.array([ends[side] for ends in _RANGES.values()], dtype=np.float32) for side in (0, 1))
"""Ends of their ranges; what is beyond is told as the end."""


@dataclass(frozen=True)
class LastAction:
    """What was done last, both in [-1, 1]."""

    acceleration: float = 0.0
    steering: float = 0.0


def vector_of(
    state: EgoState,
    on_path: OnPath,
    action: LastAction,
    path: RecordedPath,
    road_users: RoadUserStates,
    options: EgoOptions,
) -> Float[np.ndarray, " k"]:
    """The numbers of ``NAMES``; frame of the car: x ahead, y left, from the middle of its rear axle."""
    own = (
        state.speed_m_s,
        state.yaw_rate_rad_s(options),
        action.acceleration,
        action.steering,
        on_path.aside_m,
        _wrapped(state.yaw_rad - on_path.yaw_rad),
        on_path.along_m,
    )
    route = path.at(on_path.along_m + np.array(ROUTE_M))[:, :2]
    parts = [np.array(own), _seen_from(state, route).reshape(-1), _nearest(state, road_users).reshape(-1)]
    return np.clip(np.concatenate(parts), LOW, HIGH).astype(np.float32)


def _nearest(state: EgoState, road_users: RoadUserStates) -> Float[np.ndarray, "u 7"]:
    """The boxes of the nearest road users; zeros where there are fewer."""
    told = np.zeros((ROAD_USERS, len(_ROAD_USER)))
    rows = np.flatnonzero(road_users.there)
    if not len(rows):
        return told
    boxes = road_users.boxes[rows]
    places = _seen_from(state, boxes[:, :2])
    order = np.argsort(np.hypot(*places.T), kind="stable")[:ROAD_USERS]
    heading = _wrapped(boxes[:, 4] - state.yaw_rad)
    columns = (np.ones(len(rows)), *places.T, heading, boxes[:, 2], boxes[:, 3], road_users.speeds_m_s[rows])
    told[: len(order)] = np.stack(columns, axis=1)[order]
    return told


def _seen_from(state: EgoState, places_m: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
    away = places_m - [state.x_m, state.y_m]
    cos, sin = np.cos(state.yaw_rad), np.sin(state.yaw_rad)
    return np.stack([away[:, 0] * cos + away[:, 1] * sin, away[:, 1] * cos - away[:, 0] * sin], axis=1)


def _wrapped(angle_rad: float | np.ndarray) -> float | np.ndarray:
    return (angle_rad + np.pi) % (2 * np.pi) - np.pi
