"""Generated scenes and drawn streets in NVIDIA NCore V4, which NuRec, 3dgrut and gsplat read."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from dreamdrive.export.log import Retouch
from dreamdrive.export.ncore.words import need_ncore
from dreamdrive.export.ncore.writer import NO_MASKS, Masks, write_ncore
from dreamdrive.export.whole_log import log_of_scene, log_of_world
from dreamdrive.files.output import scratch_beside
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.truth import DriveTruth, Mount


def scene_to_ncore(
    scene: Scene,
    folder: Path,
    *,
    clip: Clip | None = None,
    geometry: Geometry | None = None,
    blur: Retouch | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write the recorded views of a scene, with the scene's poses, actors and depth.

    The first picture of the first camera is the world of the scene. Boxes are those of actors of which kind
    and size are known. Lidar points are those that the scene's depth shows.

    Args:
        scene: The scene.
        folder: To write.
        clip: What the scene was made of, whose frames are written; without it the scene is rendered. What
            holds no picture is masked.
        geometry: Of the clip; what is fixed to its cameras, such as the bonnet, is masked.
        blur: Changes each picture before it is written.
        replace: Take the place of an older folder of this kind.
        progress: Told of each picture.

    Raises:
        InputError: The package is missing, the scene does not know the height of its camera, or the clip is
            of another scene.
    """
    need_ncore()
    with scratch_beside(folder) as scratch:
        log = log_of_scene(scene, folder.name, clip, scratch, progress, blur=blur)
        names = [camera.name for camera in log.cameras]
        hidden = NO_MASKS if clip is None else _hidden(clip, geometry, names)
        write_ncore(log, folder, origin="AUTOLABEL", hidden=hidden, replace=replace)


def world_to_ncore(
    drives: Mapping[Mount, DriveTruth],
    folder: Path,
    *,
    blur: Retouch | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write a drawn street: frames, poses and boxes are true, lidar points those that depth shows."""
    need_ncore()
    with scratch_beside(folder) as scratch:
        log = log_of_world(drives, folder.name, scratch, progress, blur=blur)
        write_ncore(log, folder, origin="GT_SYNTHETIC", replace=replace)


def _hidden(clip: Clip, geometry: Geometry | None, names: Sequence[str]) -> Masks:
    """What of each camera's frames shows no street: where no picture is, and what is fixed to the camera."""
    found: dict[str, np.ndarray] = {}
    for camera, name in zip(dict.fromkeys(clip.camera.tolist()), names, strict=True):
        hidden = np.asarray(~clip.valid[clip.of_camera(camera)].all(axis=0))
        if geometry is not None:
            hidden |= geometry.fixed_regions[camera] > 0
        if hidden.any():
            found[name] = hidden
    return found
