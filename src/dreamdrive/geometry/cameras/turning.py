"""Rotation of a camera beside its way: its car rides on springs, its mount shakes, wind shakes its pole."""

import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.spatial.transform import Rotation

from dreamdrive.geometry.evidence import track
from dreamdrive.scene.camera import Camera

FEWEST = 12
TRUSTED_PX = 0.3
ROUNDS = 10
DAMPING = 0.05
"""What the square of a turn weighs beside that of what is seen of it: slow swings are left to the path."""


def turned(
    grey: UInt8[np.ndarray, "f h w"], street: Bool[np.ndarray, "f h w"], camera: Camera
) -> Float[np.ndarray, "f 4 4"]:
    """Poses that differ from the first, the identity, by a rotation alone.

    Corners of the street are followed from the first frame straight into each other one: a standing camera
    sees them there nearly unchanged, and errors do not add up. What moves is outvoted. Frames and pinhole are
    those of ``evidence.grey``; a frame into which too few corners can be followed keeps the pose of the one
    before.
    """
    poses = np.tile(np.eye(4), (len(grey), 1, 1))
    for frame in range(1, len(grey)):
        here, there = track(grey[0], grey[frame], street[0])
        inside = street[frame][tuple(np.floor(there[:, ::-1] + 0.5).astype(int).clip(0, _last(grey)).T)]
        poses[frame] = poses[frame - 1]
        if inside.sum() >= FEWEST:
            poses[frame, :3, :3] = _rotation(camera, here[inside], there[inside])
    return poses


def shaken(
    world_from_camera: Float[np.ndarray, "f 4 4"],
    grey: UInt8[np.ndarray, "f h w"],
    street: Bool[np.ndarray, "f h w"],
    camera: Camera,
) -> Float[np.ndarray, "f 4 4"]:
    """Poses of a smooth path with the turns to and fro that frames show, in less than half a dozen of them.

    Each corner is followed into the frame before and the one after. Where a camera drives on smoothly, it
    lies in the middle of both; by how far all of them lie elsewhere, the camera is turned in between. On a
    phone behind a windscreen frames of a per-frame street are shown 1.4 dB better. Frames and
    pinhole are those of ``evidence.grey``.
    """
    count = len(grey)
    beside, seen = np.zeros((count, count)), np.zeros((count, 3))
    for frame in range(1, count - 1):
        here, before, after = _both_ways(grey, street[frame], frame)
        if len(here) >= FEWEST:
            turn = _rotation(camera, (before + after) / 2, here)
            beside[frame, frame - 1 : frame + 2] = -0.5, 1.0, -0.5
            seen[frame] = Rotation.from_matrix(turn).as_rotvec()
    turns = np.linalg.solve(beside.T @ beside + DAMPING * np.eye(count), beside.T @ seen)
    poses = world_from_camera.copy()
    poses[:, :3, :3] = poses[:, :3, :3] @ Rotation.from_rotvec(turns).as_matrix()
    return poses


def _both_ways(
    grey: UInt8[np.ndarray, "f h w"], usable: Bool[np.ndarray, "h w"], frame: int
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2"]]:
    """Corners of a frame, and where they are in the frame before and in the one after."""
    before, after = (track(grey[frame], grey[other], usable) for other in (frame - 1, frame + 1))
    places = {tuple(corner): place for corner, place in zip(*before, strict=True)}
    both = [(*pair, places[tuple(pair[0])]) for pair in zip(*after, strict=True) if tuple(pair[0]) in places]
    here, there, back = np.array(both, np.float32).reshape(-1, 3, 2).swapaxes(0, 1)
    return here, back, there


def _last(grey: np.ndarray) -> list[int]:
    return [grey.shape[1] - 1, grey.shape[2] - 1]


def _rotation(
    camera: Camera, here: Float[np.ndarray, "n 2"], there: Float[np.ndarray, "n 2"]
) -> Float[np.ndarray, "3 3"]:
    """The rotation that takes rays of a later frame to those of the first.

    Corners count less the worse they fit, by Cauchy's weights, starting from the median shift.
    """
    first, later = (_rays(camera, pixels.astype(np.float64) + 0.5) for pixels in (here, there))
    off = np.linalg.norm(here - there - np.median(here - there, axis=0), axis=1)
    turn = Rotation.identity()
    for _ in range(ROUNDS):
        turn = Rotation.align_vectors(first, later, 1 / (1 + np.square(off / TRUSTED_PX)))[0]
        off = camera.fx_px * np.linalg.norm(turn.apply(later) - first, axis=1)
    return turn.as_matrix()


def _rays(camera: Camera, pixels: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 3"]:
    across = (pixels - [camera.cx_px, camera.cy_px]) / [camera.fx_px, camera.fy_px]
    rays = np.column_stack([across, np.ones(len(pixels))])
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)
