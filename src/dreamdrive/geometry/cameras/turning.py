"""How a camera turns that stays where it is: its car settles on its springs, or wind shakes its pole."""

import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.spatial.transform import Rotation

from dreamdrive.geometry.evidence import track
from dreamdrive.scene.camera import Camera

FEWEST = 12
TRUSTED_PX = 0.3
ROUNDS = 10


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
