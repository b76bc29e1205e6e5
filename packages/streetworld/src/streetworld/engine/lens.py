"""The pinhole of a lens: its focal length, its tilt on the car, and its distortion."""

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.layout import Lens

AHEAD = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
"""Axes (x right, y down, z ahead) of a camera that looks ahead, in a mount (x ahead, y left, z up)."""
_STEPS = 12
_FOLD = 0.148
"""4/27: a barrel of k1 reaches out to r = 1 on the image plane if -k1 is below; beyond, the model folds."""


def pinhole(lens: Lens, size: tuple[int, int]) -> Camera:
    """The camera of a lens without its distortion, for pictures of a width and height in pixels."""
    focal_px = float(0.5 * size[0] / np.tan(0.5 * lens.hfov_rad))
    return Camera(focal_px, focal_px, size[0] / 2, size[1] / 2, *size)


def tilted(lens: Lens) -> Float[np.ndarray, "3 3"]:
    """How the axes of a camera (x right, y down, z ahead) are turned from the level of its mount."""
    down, roll = (float(a) for a in (lens.pitch_rad, lens.roll_rad))
    pitch = np.array([[1, 0, 0], [0, np.cos(down), np.sin(down)], [0, -np.sin(down), np.cos(down)]])
    turn = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]])
    return pitch @ turn


def level_from_camera(lens: Lens) -> Float[np.ndarray, "3 3"]:
    """The same in the frame of a mount: x ahead, y left, z up."""
    return AHEAD @ tilted(lens)


def bent(points: Float[np.ndarray, "n 2"], k1: float) -> Float[np.ndarray, "n 2"]:
    """Where a lens shows points (N, 2) of the image plane: x (1 + k1 r^2)."""
    return points * (1 + k1 * np.square(points).sum(-1, keepdims=True))


def unbent(points: Float[np.ndarray, "n 2"], k1: float) -> Float[np.ndarray, "n 2"]:
    """What ``bent`` makes points (N, 2) of; by Newton's method on the radius, inside of where it folds."""
    shown = np.linalg.norm(points, axis=-1)
    r = shown.copy()
    for _ in range(_STEPS):
        r -= (r * (1 + k1 * r**2) - shown) / (1 + 3 * k1 * r**2)
    return points * np.where(shown > 0, r / np.maximum(shown, 1e-12), 1.0)[:, None]


def most_barrel(camera: Camera) -> float:
    """The least k1 with which every pixel of a camera still sees something."""
    corner = np.hypot(camera.width_px, camera.height_px) / 2 / camera.fx_px
    return -_FOLD / corner**2
