"""Gaussians as a mirror shows them, which of them no camera shows, and whose they are."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry

_NEAREST_M = 0.3


def plain(gaussians: Gaussians) -> Gaussians:
    """The same with what a copy has no use for left out: one colour from all sides, without features."""
    left_out = ("features", "actor", "lifespan", "filled")
    kept = {name: value for name, value in gaussians.tensors().items() if name not in left_out}
    return Gaussians(**{**kept, "sh": gaussians.sh[:, :1].contiguous()})


def road_user_of(gaussians: Gaussians, geometry: Geometry) -> Int[np.ndarray, " n"]:
    """The road user that each was seeded from, as ``Geometry.road_users`` numbers them; 0 for none."""
    users = np.zeros(len(gaussians), np.int64)
    if geometry.road_users is None:
        return users
    means, frames = gaussians.means.double().numpy(), gaussians.source_frame.numpy()
    for frame in np.unique(frames).tolist():
        rows = np.flatnonzero(frames == frame)
        camera = geometry.cameras[frame]
        columns, lines = camera.project(means[rows])[:, :2].astype(int).T
        inside = lines.clip(0, camera.height_px - 1), columns.clip(0, camera.width_px - 1)
        users[rows] = geometry.road_users[frame][inside]
    return users


def turned(
    quaternions: Float[np.ndarray, "n 4"], normal: Float[np.ndarray, "3"]
) -> Float[torch.Tensor, "n 4"]:
    """Rotations of what is seen in a mirror; a Gaussian is its own image along its axes."""
    if not len(quaternions):
        return torch.zeros(0, 4)
    axes = Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]).as_matrix()
    axes = (np.eye(3) - 2 * np.outer(normal, normal)) @ axes
    axes[:, :, 2] *= -1
    return torch.from_numpy(Rotation.from_matrix(axes).as_quat()[:, [3, 0, 1, 2]]).float()


def unseen(added: Gaussians, cameras: Sequence[Camera]) -> Bool[np.ndarray, " n"]:
    """Which ones no camera shows, nor half of what they spread to."""
    places, size_m = added.means.double().numpy(), added.log_scales.amax(dim=1).exp().double().numpy()
    hidden = np.ones(len(places), bool)
    for camera in cameras:
        left = np.flatnonzero(hidden)
        at = camera.project(places[left])
        reach_px = size_m[left] * camera.fx_px / np.maximum(at[:, 2], _NEAREST_M)
        sides = ((at[:, 0], camera.width_px), (at[:, 1], camera.height_px))
        inside = [(value > -reach_px) & (value < size + reach_px) for value, size in sides]
        hidden[left] = ~((at[:, 2] > 0) & inside[0] & inside[1])
    return hidden
