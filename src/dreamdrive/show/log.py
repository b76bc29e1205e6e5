"""A picture of a log: what its cameras saw, the boxes in it, and the map from above."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.data.pictures.images import read_image
from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.scene.camera import NEAR_M, Camera
from dreamdrive.scene.street.log import BoxTrack, Log, LogCamera
from dreamdrive.show.panels import Image, depth_colours, grid

_WIDTH_PX = 640
_COLOURS = {
    "vehicle.car": (70, 150, 255),
    "vehicle": (255, 160, 40),
    "human": (255, 70, 90),
    "": (180, 180, 180),
}
"""Of boxes, by the beginning of their category."""
_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
_SIDE_RAD = 1.4
"""Cameras that look farther aside than this are in the lower row."""
_FRONT = ((0, 5), (1, 4))
"""The cross on the face that looks ahead."""


def draw_log(log: Log, step: int, seen: Image | None = None) -> UInt8[np.ndarray, "h2 w2 3"]:
    """All cameras at a labelled time with boxes and lidar points, and beside them another picture.

    Args:
        log: The drive.
        step: Which of its labelled times.
        seen: A picture of the map from above, which is put to the right.
    """
    time_s = log.times_s[step]
    ordered = sorted(log.cameras, key=_from_left)
    pictures = {camera.name: _shown(log, camera, time_s) for camera in ordered}
    height = min(each.shape[0] for each in pictures.values())
    cameras = grid({name: each[:height] for name, each in pictures.items()}, columns=min(3, len(pictures)))
    if seen is None:
        return cameras
    return np.concatenate([cameras, _fitted(seen, cameras.shape[0])], axis=1)


def _from_left(camera: LogCamera) -> tuple[bool, float]:
    """Cameras that look ahead first, then those that look back, each from the left to the right."""
    x, y = camera.ego_from_camera[:2, 2]
    left = float(np.arctan2(y, x))
    behind = abs(left) > _SIDE_RAD
    return behind, left % (2 * np.pi) if behind else -left


def _shown(log: Log, camera: LogCamera, time_s: float) -> Image:
    row = int(np.abs(camera.times_s - time_s).argmin())
    picture = read_image(Path(camera.files[row])).rgb
    height = round(picture.shape[0] * _WIDTH_PX / picture.shape[1])
    image = np.asarray(cv2.resize(picture, (_WIDTH_PX, height), interpolation=cv2.INTER_AREA), np.uint8)
    view = camera.pinhole.at(camera.world_from_camera[row]).resized(_WIDTH_PX, height)
    near = [sweep for sweep in log.sweeps if abs(sweep.time_s - time_s) < 0.06]
    for sweep in near[:1]:
        points = read_points(sweep.file)
        pose = sweep.world_from_points
        _draw_points(image, view, points @ pose[:3, :3].T + pose[:3, 3])
    for track in log.boxes:
        for k in np.flatnonzero(np.abs(track.times_s - time_s) < 1e-3)[:1]:
            _draw_box(image, view, track.corners(int(k)), track)
    return image


def _draw_points(image: Image, view: Camera, points: Float[np.ndarray, "n 3"]) -> None:
    local = (points - view.world_from_camera[:3, 3]) @ view.world_from_camera[:3, :3]
    local = local[local[:, 2] > 1.0]
    u = np.floor(view.fx_px * local[:, 0] / local[:, 2] + view.cx_px).astype(int)
    v = np.floor(view.fy_px * local[:, 1] / local[:, 2] + view.cy_px).astype(int)
    inside = (u >= 0) & (u < view.width_px) & (v >= 0) & (v < view.height_px)
    if inside.any():
        image[v[inside], u[inside]] = depth_colours(local[inside, 2].astype(np.float32)[None])[0]


def _draw_box(image: Image, view: Camera, corners: Float[np.ndarray, "8 3"], track: BoxTrack) -> None:
    """Edges of a box, cut off at the near plane."""
    local = (corners - view.world_from_camera[:3, 3]) @ view.world_from_camera[:3, :3]
    colour = next(c for name, c in _COLOURS.items() if track.category.startswith(name))
    for a, b in (*_EDGES, *_FRONT):
        ends = _before(local[a], local[b])
        if ends is not None:
            _line(image, view, ends, colour)


def _before(
    one: Float[np.ndarray, " 3"], other: Float[np.ndarray, " 3"]
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]] | None:
    """The part of an edge that lies before the near plane."""
    if max(one[2], other[2]) <= NEAR_M:
        return None
    if one[2] > other[2]:
        one, other = other, one
    if one[2] < NEAR_M:
        one = one + (NEAR_M - one[2]) / (other[2] - one[2]) * (other - one)
    return one, other


def _line(
    image: Image, view: Camera, ends: Sequence[Float[np.ndarray, " 3"]], colour: tuple[int, int, int]
) -> None:
    at = np.array(
        [(view.fx_px * x / z + view.cx_px - 0.5, view.fy_px * y / z + view.cy_px - 0.5) for x, y, z in ends]
    )
    inside = _clipped(at, image.shape[1], image.shape[0])
    if inside is not None:
        (x0, y0), (x1, y1) = np.rint(16 * inside).astype(int).tolist()
        cv2.line(image, (x0, y0), (x1, y1), colour, 1, cv2.LINE_AA, 4)


def _clipped(ends: Float[np.ndarray, "2 2"], width: int, height: int) -> Float[np.ndarray, "2 2"] | None:
    """The part of a line inside a picture (Liang and Barsky 1984): OpenCV fails at ends far outside of it."""
    first, last = 0.0, 1.0
    way = ends[1] - ends[0]
    for axis, bound in ((0, width - 1), (1, height - 1)):
        for step, room in ((-way[axis], ends[0, axis]), (way[axis], bound - ends[0, axis])):
            if step == 0 and room < 0:
                return None
            if step < 0:
                first = max(first, room / step)
            elif step > 0:
                last = min(last, room / step)
    return ends[0] + np.outer([first, last], way) if first < last else None


def _fitted(image: Image, height: int) -> UInt8[np.ndarray, "h2 w2 3"]:
    """An image at a height."""
    width = round(image.shape[1] * height / image.shape[0])
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
