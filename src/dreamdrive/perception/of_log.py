"""Samples of recorded drives: pictures as they are, labels from boxes and map."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from dreamdrive.data.images import read_image
from dreamdrive.errors import InputError
from dreamdrive.perception.bev_set import SampleNote, cameras_of, note_of
from dreamdrive.perception.grid import BevGrid
from dreamdrive.perception.inputs import BevSample, camera_from_level_ego, prepare_picture
from dreamdrive.perception.options import ImageSize
from dreamdrive.perception.raster import Annotation, bev_labels
from dreamdrive.scene.log import Log, LogCamera, LogMap

ORDER = ("CAM_FRONT_LEFT", "CAM_FRONT", "CAM_FRONT_RIGHT", "CAM_BACK_LEFT", "CAM_BACK", "CAM_BACK_RIGHT")
"""Of the cameras of nuScenes, as published networks take them."""
_NEAR_S = 0.3
"""A picture belongs to a labelled time that is at most so far from it."""


_UNKNOWN = 4
"""Level of boxes of which nobody told how visible they are: losses would leave them out otherwise."""


def in_order(log: Log) -> list[LogCamera]:
    """Cameras as published networks take them; others follow in the order of the log."""
    known = {camera.name: camera for camera in log.cameras}
    first = [known[name] for name in ORDER if name in known]
    return first + [camera for camera in log.cameras if camera.name not in ORDER]


def annotations_at(log: Log, time_s: float, seen: Mapping[str, int] | None = None) -> list[Annotation]:
    """Boxes at a time, between their labels where it lies there.

    ``seen`` tells how visible they are by their ids, in place of the labels; what it lacks is left out.
    """
    found: list[Annotation] = []
    for track in log.boxes:
        pose = track.pose_at(time_s)
        if pose is None or (seen is not None and track.id not in seen):
            continue
        row = track.row_at(time_s)
        level = (int(track.visibility[row]) or _UNKNOWN) if seen is None else seen[track.id]
        found.append(Annotation(track.category, pose, track.size_lwh_m[row], level))
    return found


def road_map(log: Log) -> LogMap:
    """The map whose layers labels are drawn of; a map without roads and lanes has the drivable area for them.

    Raises:
        InputError: The drive has no map.
    """
    areas = log.map.areas
    if not log.map:
        raise InputError(f"{log.name} has no map, and labels of the road are drawn from it")
    if areas.get("road_segment") or areas.get("lane"):
        return log.map
    return replace(log.map, areas={**areas, "road_segment": areas.get("drivable_area", ())})


def samples_of_log(
    log: Log, image: ImageSize, grid: BevGrid, most: int | None = None
) -> Iterator[tuple[SampleNote, BevSample]]:
    """A sample of each labelled time, or of ``most`` of them that are spread evenly.

    Raises:
        InputError: The drive has no map, or a camera has no picture at such a time.
    """
    map = road_map(log)
    steps = np.arange(len(log.times_s))
    if most is not None and most < len(steps):
        steps = np.unique(np.linspace(0, len(steps) - 1, most).round().astype(int))
    for step in steps.tolist():
        yield _sample(log, map, step, image, grid)


def _sample(
    log: Log, map: LogMap, step: int, image: ImageSize, grid: BevGrid
) -> tuple[SampleNote, BevSample]:
    time_s, ego = float(log.times_s[step]), log.world_from_ego[step]
    cameras = in_order(log)
    pictures, intrinsics, extrinsics = [], [], []
    for camera in cameras:
        row = int(np.abs(camera.times_s - time_s).argmin())
        if abs(camera.times_s[row] - time_s) > _NEAR_S:
            raise InputError(f"{log.name}: {camera.name} has no picture at {time_s:g} s")
        k = camera.pinhole.index_matrix
        picture, k = prepare_picture(read_image(camera.files[row]).rgb, k, image)
        pictures.append(picture)
        intrinsics.append(k)
        extrinsics.append(camera_from_level_ego(camera.world_from_camera[row], ego))
    boxes = annotations_at(log, time_s)
    sample = BevSample(
        np.stack(pictures), np.stack(intrinsics), np.stack(extrinsics), bev_labels(grid, ego, boxes, map)
    )
    names = [camera.name for camera in cameras]
    note = note_of(
        f"{log.name}-{step:04d}",
        log.name,
        time_s,
        ego,
        kind="recorded",
        aside_m=0.0,
        turned_rad=0.0,
        covered=1.0,
        boxes=len(boxes),
        cameras=cameras_of(names, sample.pixel_from_camera, sample.camera_from_ego),
    )
    return note, sample
