"""Logs in which nothing is lost: every picture that cameras took, and the boxes at every time.

``export.log`` labels twice a second, as nuScenes does, and its pictures are JPEG.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.export.lidar import EGO_FROM_LIDAR, turned
from dreamdrive.export.log import START_US, Moved, Retouch, Taken
from dreamdrive.export.nuscenes.writer import write_points
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.log import BoxTrack, LidarSweep, Log, LogCamera
from dreamdrive.splat import render_scene


@dataclass(frozen=True)
class Shot:
    """One picture of a drive, which is made when it is asked for.

    Attributes:
        camera: Index into the cameras of the drive.
        time_s: When it was taken.
        world_from_camera: From where, in the world of the drive.
        look: Gives RGB and depth along z in metres, 0 where there is none.
    """

    camera: int
    time_s: float
    world_from_camera: Float[np.ndarray, "4 4"]
    look: Callable[[], tuple[UInt8[np.ndarray, "h w 3"], Float[np.ndarray, "h w"]]]


def shots_of_world(drive: Taken) -> list[Shot]:
    """The frames of a drawn street, at each time those of all cameras."""

    def shot(camera: int, step: int) -> Shot:
        pose = drive.world_from_ego[step] @ drive.cameras[camera].ego_from_camera
        return Shot(camera, float(drive.times_s[step]), pose, lambda: drive.look(camera, step))

    return [shot(c, step) for step in range(len(drive.times_s)) for c in range(len(drive.cameras))]


def shots_of_scene(
    scene: Scene, world_from_scene: Float[np.ndarray, "4 4"], clip: Clip | None = None
) -> list[Shot]:
    """The recorded views of a scene, each from its own pose, in the order of time.

    Pictures are the frames of the clip that the scene was made of; without it they are rendered. Depth is
    that of the scene.
    """
    index = np.zeros(len(scene.cameras), int) if scene.camera is None else scene.camera
    names = list(dict.fromkeys(index.tolist()))

    def shot(view: int) -> Shot:
        time_s, of_rig = float(scene.times_s[view]), int(index[view])

        def look() -> tuple[np.ndarray, np.ndarray]:
            seen = render_scene(scene, scene.cameras[view], time_s, of_rig=of_rig)
            return seen.picture if clip is None else clip.frames[view], seen.seen_depth_m

        pose = world_from_scene @ scene.cameras[view].world_from_camera
        return Shot(names.index(of_rig), time_s, pose, look)

    return sorted(map(shot, range(len(scene.cameras))), key=lambda each: (each.time_s, each.camera))


def log_of(
    drive: Taken,
    shots: Sequence[Shot],
    folder: Path,
    progress: Progress = silent,
    *,
    blur: Retouch | None = None,
) -> Log:
    """Write the pictures of a drive as PNG and its lidar into a folder, and tell what they are of.

    The first camera that has a picture of a time tells where the car was. Each time is labelled, and has
    lidar points, which are those that the cameras' depth shows. Boxes are there whether seen or not.

    Args:
        drive: Names, mountings and boxes.
        shots: Its pictures, in the order of time and of the cameras.
        folder: To write.
        progress: Told of each picture.
        blur: Changes each picture before it is written.
    """
    files: list[Path] = []
    sweeps: list[LidarSweep] = []
    egos: list[np.ndarray] = []
    times_s: list[float] = []
    for time_s, together in groupby(shots, key=lambda each: each.time_s):
        views, rig = [], list(together)
        ego = rig[0].world_from_camera @ np.linalg.inv(drive.cameras[rig[0].camera].ego_from_camera)
        for shot in rig:
            picture, depth_m = shot.look()
            files.append(folder / f"{len(files):06d}.png")
            shown = picture if blur is None else blur(picture)
            write_picture(files[-1], shown[..., ::-1])
            views.append((drive.cameras[shot.camera].pinhole.at(shot.world_from_camera), depth_m))
            progress(len(files), len(shots))
        if drive.lidar:
            place, pose = folder / f"{len(times_s):06d}.pcd.bin", ego @ EGO_FROM_LIDAR
            write_points(place, turned(views, pose))
            sweeps.append(LidarSweep(place, time_s, pose))
        egos.append(ego)
        times_s.append(time_s)
    return Log(
        name=drive.name,
        about=drive.about,
        location=drive.location,
        root=folder,
        cameras=tuple(_camera(drive, k, shots, files) for k in range(len(drive.cameras))),
        times_s=np.array(times_s),
        start_us=START_US,
        world_from_ego=np.stack(egos),
        boxes=tuple(_track(drive, box) for box in drive.boxes if box.there.any()),
        sweeps=tuple(sweeps),
        map=drive.map,
    )


def _camera(drive: Taken, camera: int, shots: Sequence[Shot], files: Sequence[Path]) -> LogCamera:
    rig = drive.cameras[camera]
    own = [(shot, file) for shot, file in zip(shots, files, strict=True) if shot.camera == camera]
    return LogCamera(
        name=rig.name,
        files=tuple(file for _, file in own),
        times_s=np.array([shot.time_s for shot, _ in own]),
        world_from_camera=np.stack([shot.world_from_camera for shot, _ in own]),
        ego_from_camera=rig.ego_from_camera,
        pinhole=rig.pinhole.at(np.eye(4)),
        key=np.ones(len(own), bool),
    )


def _track(drive: Taken, box: Moved) -> BoxTrack:
    count, unknown = int(box.there.sum()), -1
    return BoxTrack(
        id=box.id,
        category=box.category,
        times_s=drive.times_s[box.there],
        world_from_box=box.world_from_box[box.there],
        size_lwh_m=np.repeat(box.size_lwh_m[None], count, axis=0),
        visibility=np.zeros(count, int),
        moves=np.full(count, unknown),
        lidar_points=np.full(count, unknown),
        attributes=((),) * count,
    )
