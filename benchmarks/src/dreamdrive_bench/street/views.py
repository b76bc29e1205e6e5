"""From where the street benchmark looks at its worlds, and what is truly to be seen there."""

from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.files.digest import digest
from dreamdrive.files.output import new_file
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.truth import DriveTruth, WorldBox
from dreamdrive_bench.street.case import NOVEL, VIEWS, world_digest, world_of

NEAR_M = 0.5
"""Frames whose camera is nearer to a box, or inside it, do not count: 64 degrees show 0.6 m of what is half a
metre ahead, so that the paint of one door is the whole picture, and splats begin at 0.2 m."""


def true_cameras(seed: int, view: str) -> list[Camera]:
    """The cameras of a view in the true world, one a frame.

    Shifts go to the side on which fewer frames come too near to a box; of equal sides to that on which the
    boxes are further away.
    """
    made = world_of(seed)
    if view.startswith("shift"):
        metres = float(view.removeprefix("shift_"))
        right_m = metres * _free_side(made, metres)
        return [camera.moved(right_m) for camera in made.cameras]
    if view == "raise_1":
        return [camera.moved(down_m=-1.0) for camera in made.cameras]
    if view == "yaw_10":
        cos, sin = np.cos(np.deg2rad(10)), np.sin(np.deg2rad(10))
        turn = np.eye(4)
        turn[:3, :3] = [[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]
        return [camera.at(camera.world_from_camera @ turn) for camera in made.cameras]
    return list(made.cameras)


@cache
def counted(seed: int, view: str) -> Bool[np.ndarray, " f"]:
    """Which frames of a view count: those whose camera is ``NEAR_M`` or more away from every box."""
    return clearance_m(world_of(seed).boxes, true_cameras(seed, view)) >= NEAR_M


def clearance_m(boxes: tuple[WorldBox, ...], cameras: list[Camera]) -> Float[np.ndarray, " f"]:
    """Distance on the ground of each frame's camera (F,) from the nearest box; 0 inside one."""
    centres = [camera.world_from_camera[:3, 3] for camera in cameras]
    gaps = [[_gap_m(box, k, centre) for box in boxes] for k, centre in enumerate(centres)]
    return np.array([min(found, default=np.inf) for found in gaps])


@cache
def view_digest(seed: int, view: str) -> str:
    """Of everything that a view's true frames follow from."""
    poses = [camera.world_from_camera.tolist() for camera in true_cameras(seed, view)]
    return digest([world_digest(seed), view, poses, counted(seed, view).tolist()])


def views_digest(seed: int) -> str:
    """Of all views of a world."""
    return digest([view_digest(seed, view) for view in VIEWS])


def novel_digest(seed: int) -> str:
    """Of the novel views of a world."""
    return digest([view_digest(seed, view) for view in NOVEL])


def true_frames(seed: int, view: str, folder: Path) -> UInt8[np.ndarray, "f h w 3"]:
    """What those cameras see, kept in the folder; of the recorded path the frames themselves."""
    made = world_of(seed)
    if view == "held_out":
        return made.frames
    path, key = folder / f"truth-{seed}-{view}.npz", view_digest(seed, view)
    if path.exists():
        with np.load(path) as kept:
            if "key" in kept.files and str(kept["key"]) == key:
                return kept["frames"]
    seen = made.views(true_cameras(seed, view), made.times_s.tolist())
    frames = np.stack([v.frame for v in seen])
    with new_file(path) as partial:
        np.savez_compressed(partial, frames=frames, key=np.array(key))
    return frames


def _free_side(made: DriveTruth, metres: float) -> int:
    """1 for right, -1 for left."""

    def worth(side: int) -> tuple[int, float]:
        clear = clearance_m(made.boxes, [camera.moved(side * metres) for camera in made.cameras])
        return -int((clear < NEAR_M).sum()), float(clear.min())

    return 1 if worth(1) > worth(-1) else -1


def _gap_m(box: WorldBox, frame: int, point: Float[np.ndarray, "3"]) -> float:
    pose = box.world_from_box[frame]
    local = (pose[:3, :3].T @ (point - pose[:3, 3]))[:2]
    return float(np.hypot(*np.maximum(np.abs(local) - box.size_m[:2] / 2, 0)))
