"""Drawn streets and generated scenes as data sets in the format of nuScenes."""

from collections.abc import Mapping
from pathlib import Path

from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.export.labels import Labels
from dreamdrive.export.log import Retouch, Taken, take
from dreamdrive.export.nuscenes.writer import write_nuscenes
from dreamdrive.export.scene_log import taken_of_scene
from dreamdrive.export.world_log import taken_of_world
from dreamdrive.files.output import scratch_beside
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.truth import DriveTruth, Mount


def export_scene(
    scene: Scene,
    folder: Path,
    *,
    labels: Labels | None = None,
    blur: Retouch | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write a scene as its own cameras would have recorded it, as a data set of one drive.

    Every half second a time is labelled. Boxes are those of actors of which the scene knows kind and size, as
    it believes them to be: nobody has labelled them, and what never moved has none. There is no map. With
    ``labels``, of the drive that the scene was made of, other things have their boxes and attributes from
    there, the map is there, and places are those of the drive. Raises ``InputError`` where the scene does not
    know the height of its camera.
    """
    _write(taken_of_scene(scene, folder.stem, labels), folder, replace, progress, blur)


def export_world(
    drives: Mapping[Mount, DriveTruth],
    name: str,
    folder: Path,
    *,
    blur: Retouch | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write a drawn street as a data set of one drive.

    Every half second a time is labelled. Boxes, map and poses are true; lidar points are those that the
    cameras' depth shows along the beams of a lidar.
    """
    _write(taken_of_world(drives, name), folder, replace, progress, blur)


def world_to_nuscenes(
    drives: Mapping[Mount, DriveTruth],
    folder: Path,
    *,
    name: str,
    blur: Retouch | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """See ``export_world``."""
    export_world(drives, name, folder, blur=blur, replace=replace, progress=progress)


def _write(drive: Taken, folder: Path, replace: bool, progress: Progress, blur: Retouch | None) -> None:
    with scratch_beside(folder) as scratch:
        log = take(drive, scratch, progress, blur=blur)
        write_nuscenes([log], folder, read_points, replace=replace)
