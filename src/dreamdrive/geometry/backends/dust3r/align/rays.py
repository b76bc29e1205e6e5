"""Depth of each pixel, given everything else: one unknown along its ray, solved in closed form."""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.geometry.backends.dust3r.align.penalty import Penalty

_NEAREST = 1e-3  # of the median depth: the least that a depth may be
_TINY = 1e-30


def pixel_rays(pixels: Float[Tensor, "p 2"], focal_px: float) -> Float[Tensor, "p 3"]:
    """Directions (P, 3) in the camera's frame with z = 1 of pixels relative to the principal point."""
    return torch.cat([pixels / focal_px, torch.ones_like(pixels[:, :1])], dim=1)


@dataclass(frozen=True)
class RayMisses:
    """Where K edges place the points of P pixels, relative to the pixels' rays.

    Attributes:
        foot: Depth (K, P) of the point of the ray that is nearest to the edge's point.
        across2: Square of the distance (K, P) between the two.
        weight: Log confidence over the divisor of the loss (K, P).
        length: Length (P,) of the ray at depth 1.
    """

    foot: Float[Tensor, "k p"]
    across2: Float[Tensor, "k p"]
    weight: Float[Tensor, "k p"]
    length: Float[Tensor, " p"]

    @staticmethod
    def of(
        rays: Float[Tensor, "p 3"],
        points: Float[Tensor, "k p 3"],
        weight: Float[Tensor, "k p"],
    ) -> "RayMisses":
        """From rays and points, both in the frame of the camera."""
        square = rays.square().sum(dim=1)
        foot = (points * rays).sum(dim=-1) / square
        across = points - foot[..., None] * rays
        return RayMisses(foot, across.square().sum(dim=-1), weight, square.sqrt())

    def cost(
        self, depth: Float[Tensor, " p"], penalty: Penalty, reference: Float[Tensor, " p"]
    ) -> tuple[Float[Tensor, "k p"], Float[Tensor, "k p"]]:
        """Cost and weight (K, P) at a depth; ``reference`` is the depth by which a relative cost measures."""
        return penalty(self.length * (depth - self.foot), self.across2, self.weight, reference)

    def middle(self) -> Float[Tensor, " p"]:
        """Weighted median (P,) of the feet, positive; 1 where nothing weighs."""
        feet, order = self.foot.sort(dim=0)
        below = self.weight.gather(0, order).cumsum(dim=0)
        at = (below >= 0.5 * below[-1]).to(torch.uint8).argmax(dim=0)
        return _positive(torch.where(below[-1] > 0, feet.gather(0, at[None])[0], 1.0))

    def depth(
        self, depth: Float[Tensor, " p"], penalty: Penalty, reference: Float[Tensor, " p"], steps: int
    ) -> Float[Tensor, " p"]:
        """Depth (P,) after steps of reweighted least squares, d = sum w a / sum w, from a given one.

        Each step lowers the cost of each pixel, or leaves it. A pixel that no edge weighs keeps its depth.
        """
        for _ in range(steps):
            _, weight = self.cost(depth, penalty, reference)
            total = weight.sum(dim=0)
            mean = (weight * self.foot).sum(dim=0) / total.clamp_min(_TINY)
            depth = _positive(torch.where(total > 0, mean, depth))
        return depth


def _positive(depth: Float[Tensor, " p"]) -> Float[Tensor, " p"]:
    ahead = depth[depth > 0]
    least = _NEAREST * float(ahead.median()) if len(ahead) else 1.0
    return depth.clamp_min(least)
