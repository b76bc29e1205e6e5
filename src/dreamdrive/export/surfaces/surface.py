"""The surface that a camera sees of a scene, with hard edges, and where each of its points goes."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import Part, seen_by

_COVERED = 0.5
_ONE_SURFACE = 0.05
"""By so much, as a share, may the mean depth of a pixel differ from the median where there is one surface. On
the drawn street of seed 0 depth is then off by 2.7 % on average; the median alone by 2.8, the mean by 2.9."""


@dataclass(frozen=True)
class Surface:
    """What a camera sees at a time.

    Attributes:
        camera: From where.
        colour: RGB (H, W, 3) in [0, 1] of what covers the pixel, without sky and exposure.
        depth_m: Depth along z (H, W): the mean of what covers the pixel; at outlines, where that is far from
            the Gaussian at which the pixel becomes half covered, the depth of this one, so that it is of one
            side. 0 where less than half is covered.
        way_m: How far each point goes until another time, in the world (H, W, 3).
        beyond: Where the sky is seen: less than half is covered, above the horizon (H, W).
    """

    camera: Camera
    colour: Float[np.ndarray, "h w 3"]
    depth_m: Float[np.ndarray, "h w"]
    way_m: Float[np.ndarray, "h w 3"]
    beyond: Bool[np.ndarray, "h w"]


@torch.no_grad()
def surface_of(
    scene: Scene, camera: Camera, t_s: float, until_s: float | None = None, part: Part = "all"
) -> Surface:
    """The surface at ``t_s``, and the ways of its points until ``until_s``, which are 0 without it.

    What stands stays. Where what moves covers most of a pixel, the pixel's point goes as the Gaussians of
    what moves do there, in the mean.
    """
    gaussians, ways_m, dynamic = _moving(scene, t_s, t_s if until_s is None else until_s, part)
    drawn = seen_by(
        camera,
        gaussians.means,
        gaussians.quaternions,
        torch.exp(gaussians.log_scales),
        torch.sigmoid(gaussians.logit_opacities),
        gaussians.sh,
        channels=torch.cat([dynamic[:, None], ways_m], dim=1),
        inspect=True,
    )
    assert drawn.median_depth_m is not None
    median_m, mean_m = drawn.median_depth_m, drawn.expected_depth_m()
    one = (mean_m - median_m).abs() < _ONE_SURFACE * median_m
    alpha, share = drawn.alpha, drawn.channels[..., 0]
    moves = share > 0.5 * alpha
    weight = alpha if scene.moves_per_frame else torch.where(moves, share, torch.inf)
    covered = alpha > _COVERED
    up = torch.from_numpy(camera.rays() @ (scene.up @ camera.world_from_camera[:3, :3]))
    return Surface(
        camera=camera,
        colour=(drawn.colour / alpha.clamp(min=1e-3)[..., None]).clamp(0, 1).numpy(),
        depth_m=torch.where(covered, torch.where(one, mean_m, median_m), 0.0).numpy(),
        way_m=(drawn.channels[..., 1:] / weight.clamp(min=1e-3)[..., None]).numpy(),
        beyond=(~covered & (up > 0)).numpy() if scene.sky is not None else np.zeros(alpha.shape, bool),
    )


def _moving(
    scene: Scene, t_s: float, until_s: float, part: Part
) -> tuple[Gaussians, Float[Tensor, "n 3"], Float[Tensor, " n"]]:
    """Gaussians at a time, how far each goes until another, and 1 for each of what moves."""
    static = scene.static_at(t_s)
    ways_m = torch.zeros_like(static.means)
    if scene.moves_per_frame:
        ways_m = scene.static_at(until_s).means - static.means
    if part == "static" or not len(scene.dynamic):
        return static, ways_m, torch.zeros(len(static))
    living = scene.dynamic.without_features().select(scene.dynamic.alive_at(t_s))
    now, then = scene.moved_at(living, t_s), scene.moved_at(living, until_s)
    return (
        Gaussians.concatenate(static, now),
        torch.cat([ways_m, then.means - now.means]),
        torch.cat([torch.zeros(len(static)), torch.ones(len(now))]),
    )
