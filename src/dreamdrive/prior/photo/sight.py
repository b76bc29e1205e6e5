"""Rendering of the layers of a photo."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.prior.photo.fill import inpainted
from dreamdrive.prior.photo.layers import Layers
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground
from dreamdrive.splat import render

_HALF, _SOLID = 0.5, 0.8
_EDGE, _JITTER = 0.1, 0.04


@dataclass(frozen=True)
class Sight:
    """A drawn view, before anything in it is mended.

    Attributes:
        rgb: Its colours, the sky behind them (H, W, 3).
        depth_m: Depth along z (H, W); 0 where nothing is, or where two surfaces mix.
        alpha: Share of each pixel that the layers cover (H, W).
        made_up: Share of that which the photo does not show (H, W).
        nearer: Logarithm of how much nearer it is than it was in the photo (H, W), and so how blurred.
        moving: Where it shows what moves (H, W).
        sky: Where there is none of the layers, above the horizon (H, W).
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float[np.ndarray, "h w"]
    alpha: Float[np.ndarray, "h w"]
    made_up: Float[np.ndarray, "h w"]
    nearer: Float[np.ndarray, "h w"]
    moving: Bool[np.ndarray, "h w"]
    sky: Bool[np.ndarray, "h w"]

    @property
    def holes(self) -> Bool[np.ndarray, "h w"]:
        """Where the road or what stands should be, and nothing is (H, W)."""
        return (self.alpha < _HALF) & ~self.sky

    @cached_property
    def filled(self) -> UInt8[np.ndarray, "h w 3"]:
        """The colours, its holes filled from around them (H, W, 3)."""
        return inpainted(self.rgb, self.holes)


def places_in(other: Camera, camera: Camera, depth_m: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w 3"]:
    """Column, row and depth in the picture of another camera of what a camera sees at a depth, float32."""
    points = _points(camera, depth_m)
    return other.project(points.reshape(-1, 3)).reshape(points.shape).astype(np.float32)


def _points(camera: Camera, depth_m: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w 3"]:
    rays = camera.rays() @ camera.world_from_camera[:3, :3].T
    return rays * depth_m[..., None] + camera.world_from_camera[:3, 3]


@one_torch_thread()
@torch.no_grad()
def sight_of(layers: Layers, camera: Camera, ground: Ground) -> Sight:
    """Draw the layers, whose photo was taken at the identity, from another place."""
    g, carried_m = layers.gaussians, layers.carried_m
    log_depth = (g.means - carried_m)[:, 2].clamp(min=0.1).log()
    marks = [g.source_frame.float(), log_depth, layers.behind.float(), layers.moving.float()]
    drawn = render(g, camera, channels=torch.cat([torch.stack(marks, dim=1), carried_m], dim=1))
    colour = (drawn.colour + (1 - drawn.alpha)[..., None] * layers.sky.colour(camera)).numpy()
    alpha, depth = drawn.alpha.numpy(), drawn.expected_depth_m().numpy()
    means = drawn.channels.numpy() / np.maximum(alpha, 1e-3)[..., None]
    made_up, log_before, behind, moving = (means[..., k] for k in range(4))
    near, far = cv2.erode(depth, np.ones((3, 3))), cv2.dilate(depth, np.ones((3, 3)))
    mixed = (depth > (1 + _EDGE) * near) & (depth < far / (1 + _EDGE))
    empty = alpha < _HALF
    # Discs that overlap jitter in depth.
    calm = cv2.blur(cv2.medianBlur(np.ascontiguousarray(depth, np.float32), 5), (3, 3))
    one = ~mixed & (alpha > _SOLID) & (behind < 1 - _SOLID) & (np.abs(calm - depth) < _JITTER * depth)
    points = _points(camera, calm) - means[..., 4:]
    return Sight(
        rgb=_sharp(np.rint(np.clip(colour, 0, 1) * 255).astype(np.uint8), layers, points, one),
        depth_m=np.where(empty | mixed, 0, depth).astype(np.float32),
        alpha=alpha,
        made_up=np.clip(made_up, 0, 1).astype(np.float32),
        nearer=np.where(empty, 0, log_before - np.log(np.maximum(depth, 0.1))).astype(np.float32),
        moving=~empty & (moving > _HALF),
        sky=empty & ~np.isfinite(ground.depth_m(camera)),
    )


def _sharp(
    rgb: UInt8[np.ndarray, "h w 3"],
    layers: Layers,
    points: Float[np.ndarray, "h w 3"],
    one: Bool[np.ndarray, "h w"],
) -> UInt8[np.ndarray, "h w 3"]:
    """Where one surface of the picture is seen its own pixels, which discs would blur; else as drawn."""
    at = layers.camera.project(points.reshape(-1, 3)).reshape(points.shape).astype(np.float32)
    found = cv2.remap(
        layers.rgb, at[..., 0] - 0.5, at[..., 1] - 0.5, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    share = np.clip(2 * cv2.blur(one.astype(np.float32), (3, 3)) - 1, 0, 1)[..., None]
    return np.rint(share * found + (1 - share) * rgb).astype(np.uint8)
