"""A level frame: x ahead, y to the left, z up, the road at 0; poses in it, and that of a scene."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Scene

_LEAST_AHEAD = 1e-3
"""Sine of the angle to the vertical from which on a camera looks ahead."""


def level_from_world(scene: Scene) -> Float[np.ndarray, "4 4"]:
    """From the world of a scene to x ahead and y left of its first camera, z up, the road at 0 below it."""
    about = scene.provenance
    if about.up is None or about.camera_height_m is None:
        raise InputError(
            "the scene does not know its road, or was made before scenes kept the height of their camera; "
            "make it again with dreamdrive generate"
        )
    up, first = np.array(about.up), scene.trajectory.world_from_camera[0]
    ahead = first[:3, 2] - (first[:3, 2] @ up) * up
    if np.linalg.norm(ahead) < _LEAST_AHEAD:
        raise InputError("the first camera of the scene looks straight up or down, so that nothing is ahead")
    ahead = ahead / np.linalg.norm(ahead)
    level = np.eye(4)
    level[:3, :3] = np.stack([ahead, np.cross(up, ahead), up])
    level[:3, 3] = -level[:3, :3] @ first[:3, 3] + (0, 0, about.camera_height_m)
    return level


def upright(place: Sequence[float] | Float[np.ndarray, "3"]) -> Float[np.ndarray, "4 4"]:
    """Pose on the ground from x, y and yaw."""
    cos, sin = np.cos(place[2]), np.sin(place[2])
    pose = np.eye(4)
    pose[:2, :2] = [[cos, -sin], [sin, cos]]
    pose[:2, 3] = place[:2]
    return pose


def pitched(at_m: Sequence[float], angle_rad: float) -> Float[np.ndarray, "4 4"]:
    """Pose of something turned about its y axis: what is ahead goes down."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    pose = np.eye(4)
    pose[:3, :3] = [[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]
    pose[:3, 3] = at_m
    return pose
