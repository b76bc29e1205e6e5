"""Renders: colours, depth and opacity as splatting returns them."""

from dataclasses import dataclass

import torch
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
        median_depth_m: Depth of the Gaussian at which a pixel becomes at least half covered (H, W), 0 where
            that never happens; no gradient. Present if asked for.
        weight_sum_px: Sum of the compositing weights of each Gaussian over the image (N,): how many pixels
            it fills. Present if asked for.
        weight_most: Its largest compositing weight in any pixel (N,). Present if asked for.

    A batch of B views has one more dimension, first, everywhere.
    """

    colour: Float[Tensor, "*b h w 3"]
    alpha: Float[Tensor, "*b h w"]
    depth_m: Float[Tensor, "*b h w"]
    channels: Float[Tensor, "*b h w c"]
    visible: Bool[Tensor, "*b n"]
    median_depth_m: Float[Tensor, "*b h w"] | None = None
    weight_sum_px: Float[Tensor, "*b n"] | None = None
    weight_most: Float[Tensor, "*b n"] | None = None

    def expected_depth_m(self) -> Float[Tensor, "*b h w"]:
        """Mean depth of what covers a pixel, 0 where less than a thousandth of it is covered."""
        return torch.where(self.alpha > 1e-3, self.depth_m / self.alpha.clamp(min=1e-3), 0.0)
