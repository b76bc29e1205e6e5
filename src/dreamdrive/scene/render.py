"""What splatting returns."""

from dataclasses import dataclass

from jaxtyping import Bool, Float
from torch import Tensor


@dataclass(frozen=True)
class Render:
    """One splatted view.

    Attributes:
        colour: RGB (H, W, 3), composited front to back without background; add ``(1 - alpha) * background``.
        alpha: Share of the pixel covered by Gaussians (H, W) in [0, 1].
        depth_m: Depth along z weighted by the compositing weights, not divided by alpha (H, W).
        channels: Further per-Gaussian values composited alike (H, W, C), C may be 0.
        visible: Which Gaussians reach at least one tile (N,).
    """

    colour: Float[Tensor, "h w 3"]
    alpha: Float[Tensor, "h w"]
    depth_m: Float[Tensor, "h w"]
    channels: Float[Tensor, "h w c"]
    visible: Bool[Tensor, " n"]
