"""How much of the way to what a view shows no recorded view has looked into: unseen things may be there."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene
from dreamdrive.trust.evidence import asked_views
from dreamdrive.vision.residual import BLOCK_PX

MOST_VIEWS = 48
_STEPS = 16
_NEAREST_M, _FARTHEST_M = 0.7, 60.0
"""Where ways begin, and where they end at the sky."""
_BEFORE, _BEHIND = 0.97, 1.03
"""Ways end before a surface, and views look as far behind theirs."""
_COARSE = 4
"""Pixels of a recorded view that stand for one; the farthest of them counts."""
_IN_VIEW_M = 0.2


@dataclass(frozen=True)
class FreeSpace:
    """How far recorded views look: depth (V, h, w) in metres of ``_COARSE`` pixels, sky far away."""

    cameras: tuple[Camera, ...]
    reach_m: tuple[Float[Tensor, "h w"], ...]

    @classmethod
    def of(cls, scene: Scene) -> "FreeSpace":
        """Of the views of a scene."""
        views = asked_views(scene, MOST_VIEWS)
        reach_m: list[Tensor] = []
        for view in views:
            shown = render_scene(scene, scene.cameras[view], float(scene.times_s[view]))
            deep = torch.where(shown.alpha > 0.5, shown.depth_m, torch.inf)
            reach_m.append(torch.nn.functional.max_pool2d(deep[None], _COARSE)[0])
        return cls(tuple(scene.cameras[view] for view in views), tuple(reach_m))

    def hidden(self, camera: Camera, depth_m: Float[Tensor, "h w"]) -> Float[Tensor, "bh bw"]:
        """Share, in logarithms of depth, of the way through each block that no view has looked into."""
        points = _points(camera, depth_m)
        flat = points.reshape(-1, 3)
        seen = torch.zeros(len(flat), dtype=torch.bool)
        for other, reach_m in zip(self.cameras, self.reach_m, strict=True):
            seen |= _looked_into(flat, other, reach_m)
        return (~seen).float().reshape(points.shape[:3]).mean(dim=2)


def _points(camera: Camera, depth_m: Float[Tensor, "h w"]) -> Float[Tensor, "bh bw k 3"]:
    """Points of the world on the way through the middle of each block."""
    high, wide = depth_m.shape[0] // BLOCK_PX, depth_m.shape[1] // BLOCK_PX
    end = torch.where(depth_m > 0, depth_m, _FARTHEST_M).clamp(max=_FARTHEST_M)
    end = torch.nn.functional.avg_pool2d(end[None], BLOCK_PX)[0].clamp(min=1.05 * _NEAREST_M)
    steps = (torch.arange(_STEPS) + 0.5) / _STEPS
    z_m = _BEFORE * torch.exp(np.log(_NEAREST_M) + steps * (end[..., None] / _NEAREST_M).log())
    middle = (torch.arange(max(high, wide)) + 0.5) * BLOCK_PX
    x = ((middle[:wide] - camera.cx_px) / camera.fx_px)[None, :, None] * z_m
    y = ((middle[:high] - camera.cy_px) / camera.fy_px)[:, None, None] * z_m
    world = torch.from_numpy(camera.world_from_camera).float()
    return torch.stack([x, y, z_m], dim=-1) @ world[:3, :3].T + world[:3, 3]


def _looked_into(points: Float[Tensor, "n 3"], camera: Camera, reach_m: Float[Tensor, "h w"]) -> torch.Tensor:
    """Which points lie in a view before what it shows (N,)."""
    view = torch.from_numpy(np.linalg.inv(camera.world_from_camera)).float()
    x, y, z = (points @ view[:3, :3].T + view[:3, 3]).unbind(1)
    near = z.clamp(min=_IN_VIEW_M)
    column = (x / near * camera.fx_px + camera.cx_px) / _COARSE
    row = (y / near * camera.fy_px + camera.cy_px) / _COARSE
    high, wide = reach_m.shape
    inside = (z > _IN_VIEW_M) & (column >= 0) & (column < wide) & (row >= 0) & (row < high)
    deep = reach_m[row.clamp(0, high - 1).long(), column.clamp(0, wide - 1).long()]
    return inside & (z < _BEHIND * deep)
