"""A wall of many colours that a camera drives up to."""

import numpy as np
import torch

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.vision.residual import BLOCK_PX

WIDE, HIGH = 96, 64
CAMERA = Camera(80.0, 80.0, WIDE / 2, HIGH / 2, WIDE, HIGH)


def board(
    z_m: float, x_m: tuple[float, float], y_m: tuple[float, float], step_m: float, seed: int = 0
) -> Gaussians:
    """A board of many colours that faces the camera."""
    x, y = (np.arange(low, high + 1e-6, step_m) for low, high in (x_m, y_m))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    count = len(places)
    colours = torch.rand(count, 3, generator=torch.Generator().manual_seed(seed))
    return Gaussians(
        means=torch.from_numpy(np.column_stack([places, np.full(count, z_m)])).float(),
        quaternions=torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        log_scales=torch.full((count, 3), float(np.log(0.6 * step_m))),
        logit_opacities=torch.full((count,), 5.0),
        sh=((colours - 0.5) / SH_C0)[:, None],
        source_frame=torch.zeros(count, dtype=torch.int64),
    )


def street(residual: float = 0.02, held_out: tuple[int, ...] = ()) -> Scene:
    """A wall, driven up to: eight views half a metre apart."""
    wall = board(14.0, (-14, 14), (-8, 8), 0.4)
    cameras = tuple(CAMERA.at(pose_at(0.5 * k)) for k in range(8))
    shape = (8, HIGH // BLOCK_PX, WIDE // BLOCK_PX)
    return Scene(
        static=wall,
        dynamic=wall.select(torch.zeros(0, dtype=torch.int64)),
        deformation=None,
        actors=(),
        sky=None,
        exposure=None,
        cameras=cameras,
        times_s=np.arange(8) / 10,
        held_out=np.isin(np.arange(8), held_out),
        residual=np.full(shape, residual, dtype=np.float16),
    )


def pose_at(z_m: float) -> np.ndarray:
    pose = np.eye(4)
    pose[2, 3] = z_m
    return pose
