"""What a camera sees of the layers of a photo."""

from dataclasses import dataclass

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8

from dreamdrive.prior.photo.layers import Layers
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground
from dreamdrive.splat import one_torch_thread, render

_HALF = 0.5
_EDGE = 0.1


@dataclass(frozen=True)
class Sight:
    """A drawn view, before anything in it is mended.

    Attributes:
        rgb: Its colours, the sky behind them (H, W, 3).
        depth_m: Depth along z (H, W); 0 where nothing is, or where two surfaces mix.
        alpha: Share of each pixel that the layers cover (H, W).
        made_up: Share of that which the photo does not show (H, W).
        nearer: Logarithm of how much nearer it is than it was in the photo (H, W), and so how blurred.
        sky: Where there is none of the layers, above the horizon (H, W).
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float[np.ndarray, "h w"]
    alpha: Float[np.ndarray, "h w"]
    made_up: Float[np.ndarray, "h w"]
    nearer: Float[np.ndarray, "h w"]
    sky: Bool[np.ndarray, "h w"]

    @property
    def holes(self) -> Bool[np.ndarray, "h w"]:
        """Where the road or what stands should be, and nothing is (H, W)."""
        return (self.alpha < _HALF) & ~self.sky


def places_in(other: Camera, camera: Camera, depth_m: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w 3"]:
    """Column, row and depth in the picture of another camera of what a camera sees at a depth, float32."""
    points = camera.rays() * depth_m[..., None] @ camera.world_from_camera[:3, :3].T
    points += camera.world_from_camera[:3, 3]
    return other.project(points.reshape(-1, 3)).reshape(points.shape).astype(np.float32)


@one_torch_thread()
@torch.no_grad()
def sight_of(layers: Layers, camera: Camera, ground: Ground) -> Sight:
    """Draw the layers, whose photo was taken at the identity, from another place."""
    g = layers.gaussians
    marks = torch.stack([g.source_frame.float(), g.means[:, 2].clamp(min=0.1).log()], dim=1)
    drawn = render(g, camera, channels=marks)
    colour = drawn.colour + (1 - drawn.alpha)[..., None] * layers.sky.colour(camera)
    alpha, depth = drawn.alpha.numpy(), drawn.expected_depth_m().numpy()
    covered = np.maximum(alpha, 1e-3)
    made_up, log_before = (drawn.channels[..., k].numpy() / covered for k in (0, 1))
    nearer = np.where(alpha > _HALF, log_before - np.log(np.maximum(depth, 0.1)), 0)
    near, far = cv2.erode(depth, np.ones((3, 3))), cv2.dilate(depth, np.ones((3, 3)))
    mixed = (depth > (1 + _EDGE) * near) & (depth < far / (1 + _EDGE))
    empty = alpha < _HALF
    return Sight(
        rgb=np.rint(np.clip(colour.numpy(), 0, 1) * 255).astype(np.uint8),
        depth_m=np.where(empty | mixed, 0, depth).astype(np.float32),
        alpha=alpha,
        made_up=np.clip(made_up, 0, 1).astype(np.float32),
        nearer=nearer.astype(np.float32),
        sky=empty & ~np.isfinite(ground.depth_m(camera)),
    )
