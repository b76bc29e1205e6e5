"""Which pixels of a view the training frames have seen, and what they look like there: the ceiling."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive_bench.street.case import world_of
from dreamdrive_bench.street.views import counted, true_cameras
from streetworld import WorldView

_LIKE = 0.02  # of the depth, within which two frames see one surface
_SLACK_M = 0.02


@dataclass(frozen=True)
class Seen:
    """A view of all its frames.

    Attributes:
        frames: What is truly to be seen.
        groups: Pixels by what they are: ``standing``, ``moving``, both seen by a training frame, ``unseen``;
            and ``all`` of them.
        ceiling: Each seen pixel as the training frame shows it that saw it from the most similar distance.
        counts: Which frames count.
    """

    frames: UInt8[np.ndarray, "f h w 3"]
    groups: dict[str, Bool[np.ndarray, "f h w"]]
    ceiling: UInt8[np.ndarray, "f h w 3"]
    counts: Bool[np.ndarray, " f"]


def seen(seed: int, view: str, clip: Clip) -> Seen:
    """The view of a drawn street; ``clip`` tells which frames are held out."""
    made, cameras = world_of(seed), true_cameras(seed, view)
    shown = made.views(cameras, made.times_s.tolist())
    reads = [_read(made, camera, k, shown[k], clip) for k, camera in enumerate(cameras)]
    known = np.stack([known for known, _ in reads])
    moving = np.stack([each.moving for each in shown])
    groups = {
        "all": np.ones_like(known),
        "standing": known & ~moving,
        "moving": known & moving,
        "unseen": ~known,
    }
    counts = clip.held_out if view == "held_out" else counted(seed, view)
    return Seen(np.stack([each.frame for each in shown]), groups, np.stack([p for _, p in reads]), counts)


def _read(
    made: DriveTruth, camera: Camera, moment: int, shown: WorldView, clip: Clip
) -> tuple[Bool[np.ndarray, "h w"], UInt8[np.ndarray, "h w 3"]]:
    """Which pixels some training frame saw, and how; the sky is seen where a frame looks there."""
    height, width = shown.depth_m.shape
    depth = np.where(shown.depth_m > 0, shown.depth_m, 1e4).astype(np.float64)
    rows, columns = np.indices((height, width))
    pixels = np.stack([columns + 0.5, rows + 0.5, depth], axis=-1).reshape(-1, 3)
    points, instance = camera.lift(pixels), np.where(shown.moving, shown.instance, 0).ravel()
    away = np.linalg.norm(points - camera.world_from_camera[:3, 3], axis=1)
    best = np.full(len(points), np.inf)
    picture = np.zeros((len(points), 3), np.uint8)
    for frame in np.flatnonzero(~clip.held_out).tolist():
        there = _carried(points, instance, made, moment, frame)
        source = made.cameras[frame]
        found = source.project(there)
        visible = source.shows(found) & _agrees(made, frame, found, instance)
        ratio = np.abs(np.log(away / np.linalg.norm(there - source.world_from_camera[:3, 3], axis=1)))
        better = visible & (ratio < best)
        best[better] = ratio[better]
        picture[better] = _sampled(made.frames[frame], found[better, :2])
    return np.isfinite(best).reshape(height, width), picture.reshape(height, width, 3)


def _carried(
    points: Float[np.ndarray, "n 3"],
    instance: Int[np.ndarray, " n"],
    made: DriveTruth,
    moment: int,
    frame: int,
) -> Float[np.ndarray, "n 3"]:
    """Where the points are at another frame."""
    there = points.copy()
    for box in made.boxes:
        rows = instance == box.instance
        if rows.any():
            moved = box.world_from_box[frame] @ np.linalg.inv(box.world_from_box[moment])
            there[rows] = points[rows] @ moved[:3, :3].T + moved[:3, 3]
    return there


def _agrees(
    made: DriveTruth, frame: int, found: Float[np.ndarray, "n 3"], instance: Int[np.ndarray, " n"]
) -> Bool[np.ndarray, " n"]:
    """Whether the frame shows these very points at their pixels, by depth and instance."""
    height, width = made.depth_m.shape[1:]
    column, row = found[:, :2].clip(0, [width - 1, height - 1]).astype(int).T
    depth = np.where(made.depth_m[frame] > 0, made.depth_m[frame], 1e4)[row, column]
    near = np.abs(depth - found[:, 2]) < _LIKE * depth + _SLACK_M
    near |= (depth >= 1e4) & (found[:, 2] > 5e3)  # the sky lies in one direction, not in one place
    same = np.where(made.moving[frame], made.instance[frame], 0)[row, column] == instance
    return near & same


def _sampled(frame: UInt8[np.ndarray, "h w 3"], at: Float[np.ndarray, "n 2"]) -> UInt8[np.ndarray, "n 3"]:
    if not len(at):
        return np.zeros((0, 3), np.uint8)
    # OpenCV's pictures have at most 32,767 rows.
    x, y = (np.ascontiguousarray(at[None, :, k] - 0.5, np.float32) for k in (0, 1))
    parts = range(0, x.shape[1], 30_000)
    read = [
        cv2.remap(
            frame,
            x[:, k : k + 30_000],
            y[:, k : k + 30_000],
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        for k in parts
    ]
    return np.concatenate(read, axis=1)[0]
