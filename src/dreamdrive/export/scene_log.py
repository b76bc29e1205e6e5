"""A generated scene as a drive with labels, as cameras of a car see it."""

import numpy as np
from jaxtyping import Float

from dreamdrive.export.labels import Labels
from dreamdrive.export.log import AXLE_M, Moved, RigCamera, Taken
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.level import level_from_world
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.log import LogMap
from dreamdrive.splat import render_scene

CATEGORIES = {
    "vehicle": "vehicle.car",
    "two-wheeler": "vehicle.bicycle",
    "person": "human.pedestrian.adult",
}
_TRUCK_M = 6.0
"""Vehicles that are longer are no cars."""
_NAMES = {
    0: "CAM_FRONT",
    55: "CAM_FRONT_LEFT",
    -55: "CAM_FRONT_RIGHT",
    110: "CAM_BACK_LEFT",
    -110: "CAM_BACK_RIGHT",
    180: "CAM_BACK",
}
"""Names of cameras by where they look, in degrees to the left."""


def taken_of_scene(scene: Scene, name: str, labels: Labels | None = None) -> Taken:
    """A scene along its recorded path by its own cameras; its ground is level and lies at a height of 0.

    With labels it lies in the world of the drive that it was made of, with the map and the things of that.
    """
    world_from_scene, ego_from_front = level_frame(scene)
    if labels is not None:
        world_from_scene = np.array(labels.link.log_from_world)
    path = scene.trajectory
    front = world_from_scene @ path.world_from_camera
    rig = rig_of(scene, ego_from_front)
    world_from_ego = front @ np.linalg.inv(ego_from_front)
    scene_from_world = np.linalg.inv(world_from_scene)

    def look(camera: int, step: int) -> tuple[np.ndarray, np.ndarray]:
        pose = scene_from_world @ world_from_ego[step] @ rig[camera].ego_from_camera
        view = render_scene(scene, rig[camera].pinhole.at(pose), float(path.times_s[step]), of_rig=camera)
        return view.picture, view.seen_depth_m

    boxes = [_moved(actor, scene, path.times_s, world_from_scene) for actor in scene.actors]
    return Taken(
        name=name,
        about=f"Scene made of {scene.provenance.input or 'an unknown input'}",
        location=f"scene-{name}" if labels is None else labels.location,
        times_s=path.times_s,
        world_from_ego=world_from_ego,
        cameras=rig,
        look=look,
        boxes=(
            *(box for box in boxes if box is not None),
            *([] if labels is None else labels.at(path.times_s)),
        ),
        map=LogMap() if labels is None else labels.map,
    )


def level_frame(scene: Scene) -> tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, "4 4"]]:
    """From the scene's world to one with z up and the road at 0, and the mounting of its first camera."""
    world_from_scene, front = level_from_world(scene), scene.trajectory.world_from_camera[0]
    map_from_ego = np.eye(4)
    map_from_ego[:3, 3] = (world_from_scene @ front)[:3, 3] - (AXLE_M, 0, scene.provenance.camera_height_m)
    return world_from_scene, np.linalg.inv(map_from_ego) @ world_from_scene @ front


def rig_of(scene: Scene, ego_from_front: Float[np.ndarray, "4 4"]) -> tuple[RigCamera, ...]:
    """The cameras of a scene with names like those of nuScenes, by where they look."""
    index = np.zeros(len(scene.cameras), int) if scene.camera is None else scene.camera
    found: list[RigCamera] = []
    for camera in dict.fromkeys(index.tolist()):
        view = int(np.flatnonzero(index == camera)[0])
        front = scene.trajectory.at(scene.times_s[view : view + 1])[0]
        mounted = ego_from_front @ np.linalg.inv(front) @ scene.cameras[view].world_from_camera
        left = float(np.rad2deg(np.arctan2(mounted[1, 2], mounted[0, 2])))
        nearest = min(_NAMES, key=lambda each: abs((left - each + 180) % 360 - 180))
        name = _NAMES[nearest]
        taken = [each.name for each in found]
        found.append(
            RigCamera(name if name not in taken else f"{name}_{camera}", scene.cameras[view], mounted)
        )
    return tuple(found)


def _moved(
    actor: Actor, scene: Scene, times_s: Float[np.ndarray, " t"], world_from_scene: Float[np.ndarray, "4 4"]
) -> Moved | None:
    """The box of an actor at all times; None where its kind or size is not known."""
    category = CATEGORIES.get(actor.kind)
    if category is None or actor.box is None:
        return None
    length, _, height = actor.box.size_m
    if actor.kind == "vehicle" and length > _TRUCK_M:
        category = "vehicle.truck"
    up, track = np.array(scene.provenance.up), actor.track.at(times_s)
    poses = np.tile(np.eye(4), (len(times_s), 1, 1))
    for pose, place, yaw in zip(poses, track.positions_m, track.yaw_rad, strict=True):
        ahead = actor.box.pointing(float(yaw), up)
        ahead = ahead - (ahead @ up) * up
        ahead = ahead / np.linalg.norm(ahead)
        pose[:3, :3] = np.stack([ahead, np.cross(up, ahead), up], axis=1)
        pose[:3, 3] = place + up * height / 2
    there = (times_s >= actor.track.first_s - 1e-6) & (times_s <= actor.track.last_s + 1e-6)
    return Moved(actor.name, category, actor.box.size_m, world_from_scene @ poses, there)
