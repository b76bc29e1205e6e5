"""The path of a scene's first camera as a list of poses, which evaluators of odometry read."""

from pathlib import Path

from dreamdrive.data import write_trajectory
from dreamdrive.files.output import check_new_file
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.scene import Scene


def scene_to_tum(scene: Scene, file: Path, *, replace: bool = False, progress: Progress = silent) -> None:
    """Write TUM: seconds, position and quaternion xyzw a line, in the scene's world, from camera to world.

    Raises:
        InputError: The file is there already, or cannot be written.
    """
    check_new_file(file, replace)
    write_trajectory(scene.trajectory, file)
    progress(1, 1)
