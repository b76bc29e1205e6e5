"""Logs, generated scenes and drawn streets in MCAP, which Foxglove shows."""

from collections import defaultdict
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float

from dreamdrive.data.pictures.images import read_image
from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.export.log import Retouch
from dreamdrive.export.log_parts import NS, path_of, picture_of, stamps
from dreamdrive.export.mcap.file import need_foxglove
from dreamdrive.export.mcap.words import RecordedBox
from dreamdrive.export.mcap.writer import DriveRecording, check_mcap
from dreamdrive.export.whole_log import log_of_scene, log_of_world
from dreamdrive.files.output import scratch_beside
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.log import LidarSweep, Log, LogCamera
from dreamdrive.scene.street.truth import DriveTruth, Mount

Points = Callable[[Path], Float[np.ndarray, "n 3"]]
_SHOWN = ("jpeg", "png", "webp")
"""Formats of pictures that viewers know."""


def write_mcap(log: Log, file: Path, *, points: Points = read_points, replace: bool = False) -> None:
    """Write a drive; the file appears whole or not at all.

    Pictures keep their bytes, unless they are BMP or TIFF, which become PNG. Each has the pose that the log
    gives it: a camera that is not fixed to the car is placed on it anew with each picture. Boxes are there at
    the times that are labelled. Maps are left out.

    Args:
        log: The drive.
        file: To write; its name ends in ``.mcap``.
        points: Reads the points of a sweep's file.
        replace: Take the place of an older file.

    Raises:
        InputError: The package is missing, the file is there already, or a picture is not of its pinhole's
            size.
    """
    with DriveRecording(file, start_us=log.start_us, replace=replace) as recording:
        recording.describe(name=log.name, about=log.about, location=log.location)
        for camera in log.cameras:
            recording.camera(camera.name, camera.pinhole, camera.ego_from_camera)
        times_ns, world_from_ego = path_of(log, NS)
        poses = dict(zip(times_ns.tolist(), world_from_ego, strict=True))
        pictures, boxes, sweeps = _pictures(log), _boxes(log), _sweeps(log)
        for time_ns in sorted({*poses, *boxes, *sweeps}):
            time_s = (time_ns - stamps(log, np.zeros(1), NS).item()) / NS
            if time_ns in poses:
                _write_views(recording, time_s, poses[time_ns], pictures.get(time_ns, []))
            if time_ns in boxes:
                recording.boxes(time_s, boxes[time_ns])
            for sweep in sweeps.get(time_ns, []):
                recording.points(time_s, points(sweep.file), sweep.world_from_points)


def scene_to_mcap(
    scene: Scene,
    file: Path,
    *,
    clip: Clip | None = None,
    blur: Retouch | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write the recorded views of a scene, with the scene's poses, actors and depth.

    Boxes are those of actors of which kind and size are known. Lidar points are those that the scene's depth
    shows.

    Args:
        scene: The scene.
        file: To write; its name ends in ``.mcap``.
        clip: What the scene was made of, whose frames are written; without it the scene is rendered.
        blur: Changes each picture before it is written.
        replace: Take the place of an older file.
        progress: Told of each picture.

    Raises:
        InputError: The package is missing, the file is there already, the scene does not know the height of
            its camera, or the clip is of another scene.
    """
    need_foxglove()
    check_mcap(file, replace)
    with scratch_beside(file) as scratch:
        log = log_of_scene(scene, file.stem, clip, scratch, progress, blur=blur)
        write_mcap(log, file, replace=replace)


def world_to_mcap(
    drives: Mapping[Mount, DriveTruth],
    file: Path,
    *,
    blur: Retouch | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write a drawn street: frames, poses and boxes are true, lidar points those that depth shows."""
    need_foxglove()
    check_mcap(file, replace)
    with scratch_beside(file) as scratch:
        log = log_of_world(drives, file.stem, scratch, progress, blur=blur)
        write_mcap(log, file, replace=replace)


def _write_views(
    recording: DriveRecording,
    time_s: float,
    world_from_ego: Float[np.ndarray, "4 4"],
    views: list[tuple[LogCamera, int]],
) -> None:
    """The pose of the car at a time, and the pictures of that time."""
    for camera, row in views:
        placed = np.linalg.inv(world_from_ego) @ camera.world_from_camera[row]
        recording.camera(camera.name, camera.pinhole, placed)
    recording.pose(time_s, world_from_ego)
    for camera, row in views:
        data, kind = picture_of(camera.files[row], camera.pinhole)
        if kind in _SHOWN:
            recording.encoded_picture(time_s, camera.name, data, kind)
        else:
            recording.picture(time_s, camera.name, read_image(camera.files[row]).rgb, lossless=True)


def _pictures(log: Log) -> Mapping[int, list[tuple[LogCamera, int]]]:
    """Cameras and numbers of their pictures by time."""
    found: defaultdict[int, list[tuple[LogCamera, int]]] = defaultdict(list)
    for camera in log.cameras:
        for row, time_ns in enumerate(stamps(log, camera.times_s, NS).tolist()):
            found[time_ns].append((camera, row))
    return found


def _boxes(log: Log) -> Mapping[int, list[RecordedBox]]:
    """Boxes by time; none at a labelled time at which nothing is there."""
    found: dict[int, list[RecordedBox]] = {each: [] for each in stamps(log, log.times_s, NS).tolist()}
    for track in log.boxes:
        times_ns = stamps(log, track.times_s, NS).tolist()
        for time_ns, pose, size_m in zip(times_ns, track.world_from_box, track.size_lwh_m, strict=True):
            found.setdefault(time_ns, []).append(RecordedBox(track.id, track.category, pose, size_m))
    return found


def _sweeps(log: Log) -> Mapping[int, list[LidarSweep]]:
    """Sweeps by time."""
    found: defaultdict[int, list[LidarSweep]] = defaultdict(list)
    for sweep in log.sweeps:
        found[stamps(log, np.array([sweep.time_s]), NS).item()].append(sweep)
    return found
