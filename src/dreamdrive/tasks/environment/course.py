"""A scene made ready for driving: the recorded path, what can be hit, where the road ends."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from dreamdrive.drive import obstacles_of
from dreamdrive.errors import InputError
from dreamdrive.scene.level import level_from_world
from dreamdrive.scene.scene import Scene
from dreamdrive.tasks.environment.bicycle import EgoOptions, EgoState
from dreamdrive.tasks.environment.path import RecordedPath, moved_pose, recorded_path
from dreamdrive.tasks.environment.road import DrivableArea
from dreamdrive.tasks.environment.road_users import RoadUsers, RoadUserStates, road_users_of
from dreamdrive.tasks.plan import inside, overlapping

STANDING = "standing"
"""What was hit where it is no actor."""


@dataclass(frozen=True)
class Course:
    """One scene to drive in.

    Attributes:
        name: For people.
        scene: What is seen.
        level_from_world: To x ahead and y left of the first camera, z up.
        path: The recorded one.
        road_users: Actors.
        standing_m: Middles of cells in which something stands (N, 2).
        road: Where a car may drive; None where no map tells.
        ego_from_front: Mounting of the camera that recorded.
    """

    name: str
    scene: Scene
    level_from_world: Float[np.ndarray, "4 4"]
    path: RecordedPath
    road_users: RoadUsers
    standing_m: Float[np.ndarray, "n 2"]
    road: DrivableArea | None
    ego_from_front: Float[np.ndarray, "4 4"]

    @cached_property
    def _cells(self) -> KDTree | None:
        return KDTree(self.standing_m) if len(self.standing_m) else None

    def recorded(self, time_s: float) -> EgoState:
        """The recorded car at a time."""
        x, y, yaw = self.path.at(np.array(self.path.along_at(time_s))).tolist()
        return EgoState(x, y, yaw, self.path.speed_at(time_s))

    def world_from_ego(self, state: EgoState, along_m: float) -> Float[np.ndarray, "4 4"]:
        """The pose of a car on the path or beside it, as high and tilted as the recorded one was there."""
        place = np.array([state.x_m, state.y_m, state.yaw_rad])
        front = moved_pose(self.scene.trajectory, self.level_from_world, self.path, place, along_m)
        return front @ np.linalg.inv(self.ego_from_front)

    def hit(self, rectangle: Float[np.ndarray, "5"], road_users: RoadUserStates) -> str:
        """What a rectangle lies on: ``"standing"``, the name of an actor, or ``""``.

        A cell is hit where its middle is in the rectangle, as in the planning metrics.
        """
        if self._cells is not None:
            reach_m = 0.5 * float(np.hypot(rectangle[2], rectangle[3]))
            near = self._cells.query_ball_point(rectangle[:2], reach_m)
            if near and inside(self.standing_m[near], rectangle).any():
                return STANDING
        can_be_hit = road_users.there & self.road_users.solid
        rows = np.flatnonzero(can_be_hit & overlapping(rectangle[None], road_users.boxes))
        return self.scene.actor(self.road_users.ids[rows[0]]).name if len(rows) else ""


def course_of(scene: Scene, name: str, road: DrivableArea | None, ego: EgoOptions, margin_m: float) -> Course:
    """Make a scene ready for driving.

    Args:
        scene: Made by ``generate``.
        name: For people.
        road: Where a car may drive, in the level frame of the scene.
        ego: The car.
        margin_m: How far a corner of it may be outside of the road.

    Raises:
        InputError: The scene does not know its road, or its street is one of single frames; or the road is
            not that of the scene: the recorded car leaves it.
    """
    level = level_from_world(scene)
    path = recorded_path(scene, level, ego.camera_ahead_m)
    places = path.at(path.reached_m)
    rectangles = np.stack([EgoState(x, y, yaw, 0.0).rectangle(ego) for x, y, yaw in places.tolist()])
    x, y, yaw = places[0].tolist()
    level_from_axle = np.eye(4)
    level_from_axle[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    level_from_axle[:2, 3] = x, y
    if road is not None:
        outside_m = max(road.sticks_out_m(rectangle) for rectangle in rectangles)
        if outside_m > margin_m:
            raise InputError(
                f"{name}: the recorded car is {outside_m:.2g} m outside of the road, and road_margin_m is "
                f"{margin_m:g}; raise it, or leave the road out if it does not fit the scene"
            )
    return Course(
        name=name,
        scene=scene,
        level_from_world=level,
        path=path,
        road_users=road_users_of(scene, level, rectangles),
        standing_m=obstacles_of(scene, []).standing_m,
        road=road,
        ego_from_front=np.linalg.inv(level_from_axle) @ level @ scene.trajectory.world_from_camera[0],
    )
