"""Conditions of MagicDrive from a scene of a data set: its cameras, boxes, map layers and words."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Float32, Int

from dreamdrive.errors import InputError
from dreamdrive.prior.magicdrive.cameras import FULL_SIZE, LIDAR_PLACE_M, NUSCENES, Ring
from dreamdrive.prior.magicdrive.condition import (
    CHANNELS,
    CLASSES,
    LINE_CELLS,
    LOCATION,
    RANGE_M,
    box_corners,
    prompt_of,
)
from dreamdrive.prior.street import StreetSource
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.level import upright
from dreamdrive.scene.street.log import BoxTrack, Log, LogCamera, OfLog, word_of
from dreamdrive.scene.trajectory import Trajectory

CATEGORIES = {
    "vehicle.car": "car",
    "vehicle.truck": "truck",
    "vehicle.construction": "construction_vehicle",
    "vehicle.bus": "bus",
    "vehicle.trailer": "trailer",
    "movable_object.barrier": "barrier",
    "vehicle.motorcycle": "motorcycle",
    "vehicle.bicycle": "bicycle",
    "human.pedestrian.adult": "pedestrian",
    "human.pedestrian.child": "pedestrian",
    "human.pedestrian.construction_worker": "pedestrian",
    "human.pedestrian.police_officer": "pedestrian",
    "movable_object.trafficcone": "traffic_cone",
}
"""Classes of the network by the beginning of a category's name, as nuScenes' detection task merges them; the
network was never told of others, such as ambulances, strollers and animals."""
LOCATIONS = (LOCATION, "singapore-onenorth", "singapore-hollandvillage", "singapore-queenstown")
"""Places of nuScenes, which are all that the network heard of."""
_NEAR_S = 0.06
"""How far a sweep may be from the labelled time that it belongs to: lidars turn 10 or 20 times a second."""
_LOOSE_M = 0.1
"""By how much the place of a lidar on its car may seem to change."""
_ON_CAR_M = (4.0, 0.5, 4.0)
"""A lidar is at most so far from the car's origin, and so high."""
_LIDAR_FROM_FRONT_M = np.array(LIDAR_PLACE_M) - np.array(NUSCENES[0].place_m)
"""Where the LiDAR is on cars of nuScenes, from the front camera: ahead, left, up."""
_BEYOND_S = 0.3
"""How far before or behind its pictures the path of the first camera may be needed: it goes on as there."""


@dataclass(frozen=True)
class OfScene:
    """A scene of a data set.

    Attributes:
        log: The scene.
        ring: Six of its cameras.
        notes: What was taken in place of something else, in sentences.
    """

    log: Log
    ring: Ring
    notes: tuple[str, ...] = ()

    def world_from_car(self, times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t 4 4"]:
        """Where the car was, by the pictures of the log's first camera, between them interpolated."""
        lead = self.log.cameras[0]
        early, late = lead.times_s[0] - _BEYOND_S, lead.times_s[-1] + _BEYOND_S
        if times_s.min() < early or times_s.max() > late:
            raise InputError(
                f"{self.log.name}: the path of {lead.name} is known from {lead.times_s[0]:.2f} to "
                f"{lead.times_s[-1]:.2f} s, and {times_s.min():.2f} to {times_s.max():.2f} s are asked for; "
                "choose other --frames"
            )
        poses = Trajectory(lead.world_from_camera, lead.times_s).at(times_s)
        poses[:, :3, 3] += _beyond(lead, times_s)
        return poses @ np.linalg.inv(lead.ego_from_camera)

    def place_in_log(self, time_s: float) -> OfLog:
        """Where a clip lies in the log, whose first frame is of a time and of the first camera.

        It is the pose that the frame was asked for, tilt and height included; the networks follow what they
        are asked for only roughly. Poses that are looked for in the frames may leave the log's path.
        """
        front = self.world_from_car(np.array([time_s]))[0] @ self.ring.car_from_camera[0]
        return OfLog.of(self.log, front, time_s)

    def boxes(
        self, lidar_from_world: Float[np.ndarray, "4 4"], time_s: float
    ) -> tuple[Float[np.ndarray, "b 8 3"], Int[np.ndarray, " b"]]:
        """True corners of what is labelled, upright in the LiDAR frame, and their classes."""
        poses, sizes, classes = list[np.ndarray](), list[np.ndarray](), list[int]()
        for track in self.log.boxes:
            kind = class_of(track.category)
            placed = None if kind is None else _placed(track, time_s)
            if kind is None or placed is None:
                continue
            centre, ahead, size = placed
            way = lidar_from_world[:3, :3] @ ahead
            x, y, z = lidar_from_world[:3, :3] @ centre + lidar_from_world[:3, 3]
            pose = upright(np.array([x, y, np.arctan2(way[1], way[0])]))
            pose[2, 3] = z - size[2] / 2
            poses.append(pose)
            sizes.append(size)
            classes.append(CLASSES.index(kind))
        corners = box_corners(np.array(poses).reshape(-1, 4, 4), np.array(sizes).reshape(-1, 3))
        return corners, np.array(classes, dtype=np.int64)

    def raster(self, lidar_from_world: Float[np.ndarray, "4 4"], cells: int) -> Float32[np.ndarray, "8 x y"]:
        """Each layer of the map in the channel of its name, seen straight from above."""
        world_from_lidar = np.linalg.inv(lidar_from_world)
        right = world_from_lidar[:2, 0] / np.linalg.norm(world_from_lidar[:2, 0])
        axes = np.stack([right, [-right[1], right[0]]])

        def placed(points: Float[np.ndarray, "n 2"]) -> np.ndarray:
            across = (points - world_from_lidar[:2, 3]) @ axes.T
            return np.round((across / RANGE_M + 0.5) * cells).astype(np.int32)[:, ::-1]

        layers = np.zeros((len(CHANNELS), cells, cells), dtype=np.uint8)
        for layer, name in zip(layers, CHANNELS, strict=True):
            for area in self.log.map.areas.get(name, ()):
                cv2.fillPoly(layer, [placed(ring) for ring in (area.outline, *area.holes)], 1)
            for line in self.log.map.lines.get(name, ()):
                cv2.polylines(layer, [placed(line)], False, 1, LINE_CELLS)
        return layers.astype(np.float32)

    def prompt(self, description: str | None) -> str:
        """The sentence that the networks were taught with, of the scene's place and words."""
        words = description if description is not None else self.log.about.strip() or None
        return prompt_of(words, self.log.location if self.log.location in LOCATIONS else LOCATION)


def of_street(street: StreetSource) -> OfScene:
    """A scene with the six cameras that are asked for, in their ring.

    Raises:
        InputError: They are not six, or the scene has no map of roads.
    """
    log = street.log
    assert log is not None
    if len(street.cameras) != len(NUSCENES):
        names = ", ".join(camera.name for camera in street.cameras)
        raise InputError(
            f"MagicDrive's networks see a ring of {len(NUSCENES)} cameras, and {street.name} gives "
            f"{len(street.cameras)}: {names}; choose {len(NUSCENES)} with --cameras, or take --prior "
            "street-world"
        )
    if not log.map.areas.get("drivable_area"):
        raise InputError(
            f"{street.name} has no map with a drivable_area, which MagicDrive's map needs; add the map "
            "expansion of the data set, or its pictures of the drivable area"
        )
    cameras, lidar = clockwise(street.cameras), mounted_lidar(log)
    ring = ring_of(cameras, typical_lidar(cameras[0]) if lidar is None else lidar)
    return OfScene(log, ring, (*_notes(log, cameras), *([] if lidar is not None else [_no_lidar(log)])))


def ring_of(cameras: Sequence[LogCamera], car_from_lidar: Float[np.ndarray, "4 4"]) -> Ring:
    """Cameras as calibrated, their pictures scaled to the width of the full picture."""
    full = tuple(map(_full, cameras))
    told = np.stack([camera.index_matrix for camera in full])
    mounted = np.stack([camera.ego_from_camera for camera in cameras])
    return Ring(tuple(camera.name for camera in cameras), told, full, mounted, car_from_lidar)


def clockwise(cameras: Sequence[LogCamera]) -> tuple[LogCamera, ...]:
    """Cameras in the order of a ring, seen from above: from the first one to the right and around."""
    yaws = np.array([np.arctan2(*camera.ego_from_camera[[1, 0], 2]) for camera in cameras])
    turns = (yaws[0] - yaws) % (2 * np.pi)
    return tuple(cameras[k] for k in np.argsort(turns, kind="stable"))


def class_of(category: str) -> str | None:
    """The network's class of a category of nuScenes; None for what it was never told of."""
    return word_of(category, CATEGORIES)


def typical_lidar(front: LogCamera) -> Float[np.ndarray, "4 4"]:
    """A LiDAR where cars of nuScenes have it, from the front camera; its axes are x right, y ahead, z up."""
    pose = upright(np.array([0.0, 0.0, -np.pi / 2]))
    pose[:3, 3] = front.ego_from_camera[:3, 3] + _LIDAR_FROM_FRONT_M
    return pose


def mounted_lidar(log: Log) -> Float[np.ndarray, "4 4"] | None:
    """Pose of the lidar on its car, its axes turned by quarters until y is ahead.

    None where there are no sweeps, or where their points are not told from a place on the car.
    """
    if not log.sweeps:
        return None
    times_s = np.array([sweep.time_s for sweep in log.sweeps])
    found = list[np.ndarray]()
    for time_s, world_from_ego in zip(log.times_s, log.world_from_ego, strict=True):
        nearest = int(np.abs(times_s - time_s).argmin())
        if abs(times_s[nearest] - time_s) <= _NEAR_S:
            found.append(np.linalg.inv(world_from_ego) @ log.sweeps[nearest].world_from_points)
    if not found:
        return None
    places = np.stack(found)[:, :3, 3]
    reach, low, high = _ON_CAR_M
    on_car = np.hypot(*places[0, :2]) < reach and low < places[0, 2] < high
    if not on_car or np.ptp(places, axis=0).max() > _LOOSE_M:
        return None
    ahead = np.arctan2(*found[0][[1, 0], 1])
    quarters = round(float(ahead) / (np.pi / 2))
    return found[0] @ upright(np.array([0.0, 0.0, -quarters * np.pi / 2]))


def _full(camera: LogCamera) -> Camera:
    """The pinhole of pictures of the full size; of others the bottom is kept, as ``crop`` does."""
    pinhole = camera.pinhole
    scale = FULL_SIZE[0] / pinhole.width_px
    down = FULL_SIZE[1] - pinhole.height_px * scale
    return Camera(
        pinhole.fx_px * scale,
        pinhole.fy_px * scale,
        pinhole.cx_px * scale,
        pinhole.cy_px * scale + down,
        *FULL_SIZE,
    )


def _no_lidar(log: Log) -> str:
    ahead, _, up = _LIDAR_FROM_FRONT_M
    return (
        f"{log.name} tells no place of a lidar on the car: boxes, cameras and map are told from where it is "
        f"on cars of nuScenes, {-ahead:.2f} m behind the front camera and {up:.2f} m above it."
    )


def _notes(log: Log, cameras: Sequence[LogCamera]) -> list[str]:
    """What is the scene's own, and what is not."""
    notes = [
        f"Cameras, path, boxes and map are those of {log.name}; the networks learned from no cars but those "
        "of nuScenes. All six pictures of a time count as taken at once.",
        *log.notes,
    ]
    drawn = {name for name in CHANNELS if log.map.areas.get(name) or log.map.lines.get(name)}
    if missing := [name for name in CHANNELS if name not in drawn]:
        notes.append(f"The map of {log.name} has no {', '.join(missing)}: those channels are empty.")
    if not log.boxes:
        notes.append(f"{log.name} has no boxes: the networks are told of no road users.")
    if left_out := sorted({each.category for each in log.boxes if class_of(each.category) is None}):
        notes.append(f"The networks know no {', '.join(left_out)}: such boxes are left out.")
    sizes = [(camera.pinhole.width_px, camera.pinhole.height_px) for camera in cameras]
    if resized := [each.name for each, size in zip(cameras, sizes, strict=True) if size != FULL_SIZE]:
        notes.append(
            f"Intrinsics of {', '.join(resized)} are told as of pictures {FULL_SIZE[0]} px wide, as those of "
            f"nuScenes are, and {FULL_SIZE[1]} px high from the bottom up."
        )
    if log.location not in LOCATIONS:
        where = log.location or "no other place"
        notes.append(f"The networks are told that it is {LOCATION}: they never heard of {where}.")
    return notes


def _beyond(lead: LogCamera, times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t 3"]:
    """By how much the path is longer than from the first to the last picture."""
    if len(lead) == 1:
        return np.zeros((len(times_s), 3))
    places, taken_s = lead.world_from_camera[:, :3, 3], lead.times_s
    before = (
        np.minimum(times_s - taken_s[0], 0)[:, None] * (places[1] - places[0]) / (taken_s[1] - taken_s[0])
    )
    after = np.maximum(times_s - taken_s[-1], 0)[:, None] * (places[-1] - places[-2])
    return before + after / (taken_s[-1] - taken_s[-2])


def _placed(
    track: BoxTrack, time_s: float
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"], Float[np.ndarray, "3"]] | None:
    """Centre, direction and size of a box, between two labels interpolated.

    None before its first label and behind its last one, and where the lidar hit nothing of it, which nuScenes
    does not list.
    """
    pose, row = track.pose_at(time_s), track.row_at(time_s)
    if pose is None or track.lidar_points[row] == 0:
        return None
    return pose[:3, 3], pose[:3, 0], track.size_lwh_m[row]
