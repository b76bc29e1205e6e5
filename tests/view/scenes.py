"""Scenes for the page."""

from dataclasses import replace

import torch

from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from tests.cli.test_commands import driving
from tests.scene.scenes import make_scene


def drifting() -> Scene:
    """A scene whose street moves as its pictures do."""
    scene = driving(make_scene(full=False))
    count = len(scene.static)
    static = replace(
        scene.static, velocity=torch.zeros(count, 3), lifespan=torch.tensor([[0.4, 1.0]]).repeat(count, 1)
    )
    return replace(scene, static=static)


def wall(depth_m: float, opacity: float = 6.0) -> Gaussians:
    """Grey Gaussians in a plane across the view of the first camera, from side to side."""
    x, y = torch.meshgrid(torch.linspace(-4, 4, 41), torch.linspace(-4, 4, 41), indexing="ij")
    count = x.numel()
    return Gaussians(
        means=torch.stack([x, y, torch.full_like(x, depth_m)], dim=-1).reshape(-1, 3),
        quaternions=torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        log_scales=torch.tensor([[0.15, 0.15, 0.01]]).log().repeat(count, 1),
        logit_opacities=torch.full((count,), opacity),
        sh=torch.zeros(count, 1, 3),
        source_frame=torch.zeros(count, dtype=torch.int64),
    )
