"""One pinhole for a clip: from those that a network gives each frame, or a known one in their place."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.feedforward.network import Seen
from dreamdrive.geometry.fitting import Fitting
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.similarity import nearest_rotation


def share(intrinsics: Float[np.ndarray, "n 3 3"], how: Fitting) -> tuple[Camera, float]:
    """The pinhole of the frames that took all pictures, with square pixels, and how far they disagree.

    It is the median of all pinholes (N, 3, 3), and of both axes for the focal length; the disagreement is the
    robust standard deviation (1.4826 times the median distance) of the logarithm of the focal lengths.

    Raises:
        InputError: A focal length is not positive.
    """
    focals_px = intrinsics[:, [0, 1], [0, 1]] * np.divide(how.frame_size, how.size)
    if not (focals_px > 0).all() or not np.isfinite(intrinsics).all():
        raise InputError("the network gives focal lengths that are not positive: are these its weights?")
    focal_px = float(np.median(focals_px))
    spread = 1.4826 * float(np.median(np.abs(np.log(focals_px / focal_px))))
    cx_px, cy_px = how.to_frame(np.median(intrinsics[:, :2, 2], axis=0))
    return Camera(focal_px, focal_px, float(cx_px), float(cy_px), *how.frame_size), spread


def seen_through(seen: Seen, camera: Camera) -> Seen:
    """What a network saw through pinholes of its own, as it is through the known one of the pictures.

    Networks that cannot be told have the principal point in the middle. What they see is right for a camera
    that looks along the middle of the picture: it is turned to look along the true axis, by the rotation that
    brings the rays of all pixels nearest together. What a rotation does not mend, a focal length of their
    own, stays.
    """
    poses, depth = seen.world_from_camera.copy(), np.empty_like(seen.depth)
    rays = camera.rays()
    towards = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    for frame, matrix in enumerate(seen.intrinsics):
        size = camera.width_px, camera.height_px
        own = Camera(matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *size).rays()
        own_towards = own / np.linalg.norm(own, axis=-1, keepdims=True)
        turn = nearest_rotation(np.einsum("hwi,hwj->ij", own_towards, towards))
        poses[frame, :3, :3] = poses[frame, :3, :3] @ turn
        depth[frame] = seen.depth[frame] * (own @ turn[:, 2])
    return replace(seen, world_from_camera=poses, depth=depth)
