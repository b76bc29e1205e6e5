"""Samples of recorded drives: pictures as they are, labels from boxes and map."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from dreamdrive.data.pictures.images import read_image
from dreamdrive.errors import InputError
from dreamdrive.scene.street.log import BoxTrack, Log, LogCamera, LogMap
from dreamdrive.tasks.perception.bev_set import SampleNote, cameras_of, note_of
from dreamdrive.tasks.perception.grid import BevGrid
from dreamdrive.tasks.perception.network.inputs import BevSample, camera_from_level_ego, prepare_picture
from dreamdrive.tasks.perception.options import ImageSize
from dreamdrive.tasks.perception.raster import Annotation, bev_labels

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


def boxes_at(log: Log, time_s: float) -> list[tuple[BoxTrack, Float[np.ndarray, "4 4"]]]:
    """What is labelled around a time and where it is then, between its labels where the time lies there."""
    placed = [(track, track.pose_at(time_s)) for track in log.boxes]
    return [(track, pose) for track, pose in placed if pose is not None]


def annotation_of(
    track: BoxTrack, pose: Float[np.ndarray, "4 4"], time_s: float, level: int | None = None
) -> Annotation:
    """A box as labels take it; without ``level`` it is as visible as it was labelled."""
    row = track.row_at(time_s)
    visibility = (int(track.visibility[row]) or _UNKNOWN) if level is None else level
    return Annotation(track.category, pose, track.size_lwh_m[row], visibility)


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
    boxes = [annotation_of(track, pose, time_s) for track, pose in boxes_at(log, time_s)]
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
