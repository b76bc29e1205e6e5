"""A scene as a camera sees it at a time: Gaussians, sky behind them, the recording's exposure on top."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8
from torch import Tensor

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.splat.view import render

Part = Literal["all", "static", "dynamic"]
Moment = tuple[Gaussians, Tensor]
"""Gaussians at a time, and which of them are dynamic."""


@dataclass(frozen=True)
class SceneView:
    """One finished view, on the CPU wherever the scene is.

    Attributes:
        colour: RGB (H, W, 3) in [0, 1], with sky and exposure.
        alpha: Share of the pixel covered by Gaussians (H, W).
        depth_m: Expected depth along z of what covers the pixel (H, W); 0 where nothing does.
        dynamic_share: Share of the pixel covered by dynamic Gaussians (H, W), at most ``alpha``.
        channels: The further channels asked for (H, W, C), composited without background; C may be 0.
    """

    colour: Float[Tensor, "h w 3"]
    alpha: Float[Tensor, "h w"]
    depth_m: Float[Tensor, "h w"]
    dynamic_share: Float[Tensor, "h w"]
    channels: Float[Tensor, "h w c"]

    @property
    def dynamic(self) -> Bool[Tensor, "h w"]:
        """Pixels of moving things: dynamic Gaussians carry at least half of the alpha, and alpha one half."""
        return (self.dynamic_share >= 0.5 * self.alpha) & (self.alpha >= 0.5)

    @property
    def picture(self) -> UInt8[np.ndarray, "h w 3"]:
        """The colours as bytes."""
        return self.colour.mul(255).round().to(torch.uint8).numpy()

    @property
    def seen_depth_m(self) -> Float[np.ndarray, "h w"]:
        """Depth where Gaussians cover more than half of the pixel, else 0."""
        return torch.where(self.alpha > 0.5, self.depth_m, 0.0).numpy()


@one_torch_thread()
@torch.no_grad()
def render_scene(
    scene: Scene,
    camera: Camera,
    t_s: float,
    *,
    exposure: bool = True,
    channels: Float[Tensor, "n c"] | None = None,
    part: Part = "all",
    of_rig: int = 0,
    moment: Moment | None = None,
) -> SceneView:
    """Render a scene at ``t_s`` from any camera; no gradients.

    Args:
        scene: What to render; on the device of its tensors, with one copy to the CPU.
        camera: Pinhole with its pose in the scene's world.
        t_s: Time in seconds.
        exposure: Whether to apply the recording's exposure at this time.
        channels: Further values of each Gaussian of the part, in the order of ``Scene.at``.
        part: All Gaussians, or the static or the dynamic ones alone; the dynamic ones stand before black.
        of_rig: Whose exposure it is, of several cameras.
        moment: What ``moment_of`` says of this time and part, for whoever renders several cameras at once.
    """
    gaussians, is_dynamic = moment_of(scene, t_s, part) if moment is None else moment
    marked = is_dynamic[:, None]
    if channels is not None:
        marked = torch.cat([marked, channels.to(marked.device)], dim=-1)
    drawn = render(gaussians, camera, channels=marked)
    colour = drawn.colour
    if scene.sky is not None and part != "dynamic":
        colour = colour + (1 - drawn.alpha)[..., None] * scene.sky.colour(camera)
    if exposure and scene.exposure is not None:
        colour = scene.exposure.apply(colour, t_s, of_rig)
        if part == "dynamic":
            # Black stays black: the exposure's offset counts for what is in front of it.
            colour = colour - (1 - drawn.alpha)[..., None] * scene.exposure.at(t_s, of_rig)[:, 3]
    return _view(colour.clamp(0, 1), drawn.alpha, drawn.expected_depth_m(), drawn.channels)


def _view(
    colour: Float[Tensor, "h w 3"],
    alpha: Float[Tensor, "h w"],
    depth_m: Float[Tensor, "h w"],
    channels: Float[Tensor, "h w c"],
) -> SceneView:
    """All of it on the CPU: each copy from another device waits for it, so that it is one."""
    if not colour.is_cpu:
        whole = torch.cat([colour, alpha[..., None], depth_m[..., None], channels], dim=-1).cpu()
        colour, alpha, depth_m, channels = whole[..., :3], whole[..., 3], whole[..., 4], whole[..., 5:]
    return SceneView(colour, alpha, depth_m, channels[..., 0], channels[..., 1:])


@torch.no_grad()
def moment_of(scene: Scene, t_s: float, part: Part = "all") -> Moment:
    """The Gaussians of a part at a time, and 1 for each dynamic one, 0 for each static one."""
    if part == "dynamic":
        gaussians, static = scene.dynamic_at(t_s), 0
    else:
        gaussians = scene.static_at(t_s) if part == "static" else scene.at(t_s)
        static = len(scene.static)
    mark = gaussians.means.new_ones(len(gaussians))
    mark[:static] = 0
    return gaussians, mark
