"""A scene on its road: the frame in which up is z and the road is at 0."""

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Scene


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
    ahead = ahead / np.linalg.norm(ahead)
    level = np.eye(4)
    level[:3, :3] = np.stack([ahead, np.cross(up, ahead), up])
    level[:3, 3] = -level[:3, :3] @ first[:3, 3] + (0, 0, about.camera_height_m)
    return level
