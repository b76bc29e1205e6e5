"""The recorded path of the car, which drives in a scene are measured by."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory

_LONGEST_M = 20_000.0
_SPACING_M = 0.5
"""Between the points of a path."""
_CHORD_M = 1.5
"""A path points from so far behind to so far ahead: over that, centimetres of noise are half a degree."""
_NEAR_M = 25.0
"""How far from where it last was a car is looked for: a path may cross itself."""
_FAR_M = 1000.0
"""How far a path goes straight on at both ends."""
_SPEED_S = 0.25
"""The recorded speed is that from so much before to so much after."""


@dataclass(frozen=True)
class OnPath:
    """A place by a path.

    Attributes:
        along_m: From where the recording begins; below 0 before it.
        aside_m: To the left of the path.
        yaw_rad: Where the path points there.
    """

    along_m: float
    aside_m: float
    yaw_rad: float


@dataclass(frozen=True)
class RecordedPath:
    """The way of the rear axle in the level frame of a scene, straight on beyond both ends.

    Attributes:
        along_m: Of its points (K,), increasing; the first is far before the recording, the last far behind.
        places_m: (K, 2).
        yaw_rad: Where it points there (K,), unwrapped.
        times_s: Of the recording (T,).
        reached_m: How far along the car was at these (T,), never less than before.
    """

    along_m: Float[np.ndarray, " k"]
    places_m: Float[np.ndarray, "k 2"]
    yaw_rad: Float[np.ndarray, " k"]
    times_s: Float[np.ndarray, " t"]
    reached_m: Float[np.ndarray, " t"]

    @property
    def length_m(self) -> float:
        """Of what was recorded."""
        return float(self.reached_m[-1])

    @cached_property
    def _ahead(self) -> Float[np.ndarray, "s 2"]:
        """Directions of the pieces between its points."""
        way = np.diff(self.places_m, axis=0)
        return way / np.linalg.norm(way, axis=1, keepdims=True)

    def at(self, along_m: Float[np.ndarray, "*b"]) -> Float[np.ndarray, "*b 3"]:
        """x, y and yaw at places along the path (..., 3)."""
        columns = (*self.places_m.T, self.yaw_rad)
        return np.stack([np.interp(along_m, self.along_m, each) for each in columns], axis=-1)

    def along_at(self, time_s: float) -> float:
        """How far along the recorded car was at a time."""
        return float(np.interp(time_s, self.times_s, self.reached_m))

    def speed_at(self, time_s: float) -> float:
        """The recorded speed at a time of the recording."""
        first_s, last_s = float(self.times_s[0]), float(self.times_s[-1])
        since_s, until_s = max(time_s - _SPEED_S, first_s), min(time_s + _SPEED_S, last_s)
        if until_s <= since_s:
            return 0.0
        return (self.along_at(until_s) - self.along_at(since_s)) / (until_s - since_s)

    def time_at(self, along_m: float) -> float:
        """When the recorded car was there; the first or the last time beyond its ends."""
        reached_m, rows = np.unique(self.reached_m, return_index=True)
        return float(np.interp(along_m, reached_m, self.times_s[rows]))

    def beside(self, x_m: float, y_m: float, near_m: float) -> OnPath:
        """Where a place lies by the path, not far from where it was along it before."""
        first, last = np.searchsorted(self.along_m, [near_m - _NEAR_M, near_m + _NEAR_M])
        rows = slice(max(int(first) - 1, 0), int(last))
        away = np.array([x_m, y_m]) - self.places_m[rows]
        ahead, length = self._ahead[rows], np.diff(self.along_m[rows.start : rows.stop + 1])
        away = away[: len(ahead)]
        share = np.clip((away * ahead).sum(1), 0.0, length)
        row = int(np.square(away - share[:, None] * ahead).sum(1).argmin())
        along = float(self.along_m[rows.start + row] + share[row])
        aside = float(ahead[row, 0] * away[row, 1] - ahead[row, 1] * away[row, 0])
        return OnPath(along, aside, float(np.interp(along, self.along_m, self.yaw_rad)))


def recorded_path(
    scene: Scene, level_from_world: Float[np.ndarray, "4 4"], camera_ahead_m: float
) -> RecordedPath:
    """The path of the rear axle, which is ``camera_ahead_m`` behind the camera that recorded.

    The camera is taken to look ahead for that; where the path points is told by the path alone, unless the
    car stood.
    """
    front = level_from_world @ scene.trajectory.world_from_camera
    yaw = np.unwrap(np.arctan2(front[:, 1, 2], front[:, 0, 2]))
    axle_m = front[:, :2, 3] - camera_ahead_m * _directions(yaw)
    way_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(_thinned(axle_m), axis=0), axis=1))])
    if way_m[-1] > _LONGEST_M:
        raise InputError(
            f"the recorded path is {way_m[-1] / 1000:.0f} km long; expected a drive of up to "
            f"{_LONGEST_M / 1000:.0f} km"
        )
    places_m, along_m = _thinned(axle_m), way_m
    if way_m[-1] > _SPACING_M:
        along_m = np.linspace(0.0, way_m[-1], round(way_m[-1] / _SPACING_M) + 1)
        places_m = np.stack([np.interp(along_m, way_m, column) for column in places_m.T], axis=1)
    ahead_rad = _pointing(along_m, places_m) if way_m[-1] > _SPACING_M else np.full(len(along_m), yaw.mean())
    ends = _FAR_M * _directions(ahead_rad[[0, -1]])
    path = RecordedPath(
        np.concatenate([[-_FAR_M], along_m, [along_m[-1] + _FAR_M]]),
        np.concatenate([places_m[:1] - ends[0], places_m, places_m[-1:] + ends[1]]),
        np.concatenate([ahead_rad[:1], ahead_rad, ahead_rad[-1:]]),
        scene.trajectory.times_s,
        np.zeros(len(axle_m)),
    )
    return _timed(path, axle_m)


def moved_pose(
    recorded: Trajectory,
    level_from_world: Float[np.ndarray, "4 4"],
    path: RecordedPath,
    place: Float[np.ndarray, "3"],
    along_m: float,
) -> Float[np.ndarray, "4 4"]:
    """Where the camera that recorded would be, in the world, on a car at another place.

    As high and as tilted as it was where the recorded car was as far along; moved and turned as the car is
    against that. On the recorded path it is the recorded pose itself.

    Args:
        recorded: The recorded drive.
        level_from_world: Of the scene.
        path: The recorded path.
        place: x, y and yaw of the car.
        along_m: How far along the path it is.
    """
    along_m = min(max(along_m, 0.0), path.length_m)
    x, y, yaw = path.at(np.array(along_m))
    turn = place[2] - yaw
    moved = np.eye(4)
    moved[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    moved[:2, 3] = place[:2] - moved[:2, :2] @ [x, y]
    then = recorded.at(np.array([path.time_at(along_m)]))[0]
    return np.linalg.inv(level_from_world) @ moved @ level_from_world @ then


def _timed(path: RecordedPath, axle_m: Float[np.ndarray, "t 2"]) -> RecordedPath:
    """The path that knows when it was driven."""
    reached: list[float] = []
    for x_m, y_m in axle_m.tolist():
        reached.append(max(path.beside(x_m, y_m, reached[-1] if reached else 0.0).along_m, 0.0))
    return RecordedPath(
        path.along_m, path.places_m, path.yaw_rad, path.times_s, np.maximum.accumulate(np.array(reached))
    )


def _thinned(places_m: Float[np.ndarray, "t 2"]) -> Float[np.ndarray, "k 2"]:
    """Places without those that are too near to the one before: a car that waits stands nowhere exactly."""
    kept = [places_m[0]]
    for place in places_m[1:]:
        if np.linalg.norm(place - kept[-1]) >= _SPACING_M:
            kept.append(place)
    return np.stack(kept)


def _pointing(
    along_m: Float[np.ndarray, " k"], places_m: Float[np.ndarray, "k 2"]
) -> Float[np.ndarray, " k"]:
    """Where a path points at its points: along chords, which are shorter near its ends."""
    behind, ahead = (
        np.stack([np.interp(along_m + side * _CHORD_M, along_m, column) for column in places_m.T], axis=1)
        for side in (-1, 1)
    )
    way = ahead - behind
    return np.unwrap(np.arctan2(way[:, 1], way[:, 0]))


def _directions(yaw_rad: Float[np.ndarray, " k"]) -> Float[np.ndarray, "k 2"]:
    return np.stack([np.cos(yaw_rad), np.sin(yaw_rad)], axis=-1)
