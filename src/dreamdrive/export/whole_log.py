"""Scenes and drawn streets as logs in which nothing is lost, for formats that hold all of it."""

from collections.abc import Mapping
from pathlib import Path

from dreamdrive.errors import InputError
from dreamdrive.export.log import Retouch
from dreamdrive.export.scene_log import level_frame, taken_of_scene
from dreamdrive.export.shots import log_of, shots_of_scene, shots_of_world
from dreamdrive.export.world_log import taken_of_world
from dreamdrive.progress import Progress
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.log import Log
from dreamdrive.scene.street.truth import DriveTruth, Mount


def log_of_scene(
    scene: Scene,
    name: str,
    clip: Clip | None,
    folder: Path,
    progress: Progress,
    *,
    blur: Retouch | None = None,
) -> Log:
    """The recorded views of a scene, with its poses, actors and depth.

    Args:
        scene: The scene.
        name: Of the log.
        clip: What the scene was made of, whose frames are written; without it the scene is rendered.
        folder: For pictures and lidar points.
        progress: Told of each picture.
        blur: Changes each picture before it is written.

    Raises:
        InputError: The scene does not know the height of its camera, or the clip is of another scene.
    """
    check_clip(scene, clip)
    world_from_scene, _ = level_frame(scene)
    shots = shots_of_scene(scene, world_from_scene, clip)
    return log_of(taken_of_scene(scene, name), shots, folder, progress, blur=blur)


def check_clip(scene: Scene, clip: Clip | None) -> None:
    """Raise ``InputError`` where a clip is of another scene."""
    if clip is not None and clip.times_s.tolist() != scene.times_s.tolist():
        raise InputError(f"the clip has {len(clip)} frames, which are not those of the scene; give its own")


def log_of_world(
    drives: Mapping[Mount, DriveTruth],
    name: str,
    folder: Path,
    progress: Progress,
    *,
    blur: Retouch | None = None,
) -> Log:
    """A drawn street: frames, poses and boxes are true, lidar points those that depth shows."""
    drive = taken_of_world(drives, name)
    return log_of(drive, shots_of_world(drive), folder, progress, blur=blur)
