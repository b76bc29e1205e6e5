"""The side of a drive that has room, as far as its scene shows."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from dreamdrive.drive.occupancy import obstacles_of
from dreamdrive.scene.level import level_from_world
from dreamdrive.scene.scene import Scene

Side = Literal["left", "right"]

_BOTH: tuple[Side, Side] = ("right", "left")
_PLACES = 12
"""Places of the drive at which both sides are looked at."""
CAR_M = (4.084, 1.85)
"""Length and width of the own car: those of the cars of nuScenes, as in all published figures of planning."""
_OWN_M = CAR_M[1] / 2 + 0.3
"""What is nearer to the path is the own car, or in its way already."""
_DRIVES = "vehicle", "two-wheeler"
_LEAST_WAY_M = 2.0
_ONCOMING = -0.5
"""What goes that way, as a cosine to the drive, comes towards it."""


@dataclass(frozen=True)
class Room:
    """How much of a drive, as a share, has something in its way on either side, and where traffic comes."""

    taken: dict[Side, float]
    oncoming: frozenset[Side] = frozenset()

    @property
    def side(self) -> Side:
        """The freer side, the right one of two that are alike."""
        return min(_BOTH, key=self._worse)

    @property
    def free(self) -> bool:
        """Whether nothing is in the way on that side."""
        return not self._worse(self.side)

    @property
    def why(self) -> str:
        """What is in the way on that side and on the other, in words."""
        here, there = self._words(self.side), self._words("left" if self.side == "right" else "right")
        if here:
            return f"{here} there, and {there} on the other side"
        return f"{there} on the other side" if there else "nothing is in the way on either side"

    def _worse(self, side: Side) -> float:
        return self.taken[side] + (side in self.oncoming)

    def _words(self, side: Side) -> str:
        if side in self.oncoming:
            return "traffic comes"
        return f"{self.taken[side]:.0%} of the way is taken" if self.taken[side] else ""


def room_of(scene: Scene, shift_m: float) -> Room | None:
    """What is in the way of a car that drives so far beside the recorded drive, to either side.

    Parked cars, walls and what moves are cells that are taken, see ``plan.obstacles_of``; a lane is known by
    who comes along it. None where the scene knows no road, or moves per frame.
    """
    about = scene.provenance
    if scene.moves_per_frame or about.up is None or about.camera_height_m is None:
        return None
    level, path = level_from_world(scene), scene.trajectory
    times_s = np.linspace(path.times_s[0], path.times_s[-1], _PLACES)
    places = level @ path.at(times_s)
    obstacles = obstacles_of(scene, times_s.tolist())
    reach_m = shift_m + CAR_M[1] / 2
    taken: dict[Side, int] = {"left": 0, "right": 0}
    for step, place in enumerate(places):
        ahead_m, left_m = _seen_from(place, obstacles.at(step))
        beside = np.abs(ahead_m) <= CAR_M[0] / 2
        taken["left"] += bool((beside & (left_m > _OWN_M) & (left_m <= reach_m)).any())
        taken["right"] += bool((beside & (left_m < -_OWN_M) & (left_m >= -reach_m)).any())
    coming = frozenset[Side](_oncoming(scene, level, places, reach_m + CAR_M[1] / 2))
    return Room({side: count / len(places) for side, count in taken.items()}, coming)


def _seen_from(
    level_from_camera: Float[np.ndarray, "4 4"], points_m: Float[np.ndarray, "n 2"]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """How far points are ahead of a camera, and to its left."""
    ahead = level_from_camera[:2, 2] / np.linalg.norm(level_from_camera[:2, 2])
    away = points_m - level_from_camera[:2, 3]
    return away @ ahead, away @ np.array([-ahead[1], ahead[0]])


def _oncoming(
    scene: Scene, level: Float[np.ndarray, "4 4"], places: Float[np.ndarray, "k 4 4"], reach_m: float
) -> set[Side]:
    """The sides on which something comes towards the drive, within reach of it."""
    found: set[Side] = set()
    for actor in scene.actors:
        if actor.kind not in _DRIVES:
            continue
        track = (actor.track.positions_m @ level[:3, :3].T + level[:3, 3])[:, :2]
        way = track[-1] - track[0]
        near = places[np.linalg.norm(places[:, None, :2, 3] - track, axis=2).min(axis=1).argmin()]
        heading = near[:2, 2] / np.linalg.norm(near[:2, 2])
        if np.linalg.norm(way) < _LEAST_WAY_M or way @ heading > _ONCOMING * np.linalg.norm(way):
            continue
        left_m = float(np.median(_seen_from(near, track)[1]))
        if _OWN_M < abs(left_m) <= reach_m:
            found.add("left" if left_m > 0 else "right")
    return found
