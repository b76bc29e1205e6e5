"""Depth of each pixel along its ray, solved in closed form given everything else.

What a miss costs, of a pixel's point X against where an edge places it, Y, is told from its parts along the
pixel's ray and across it: the paper's distance, or less for what misses by far.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

_NEAREST = 1e-3  # of the median depth: the least that a depth may be
_TINY = 1e-30


def pixel_rays(pixels: Float[Tensor, "p 2"], focal_px: float) -> Float[Tensor, "p 3"]:
    """Directions in the camera's frame with z = 1 of pixels relative to the principal point."""
    return torch.cat([pixels / focal_px, torch.ones_like(pixels[:, :1])], dim=1)


@dataclass(frozen=True)
class Distance:
    """The paper's: w |X - Y|; below ``floor``, in the unit of the world, a miss weighs no more."""

    floor: float

    across = 1.0
    """Weight of the miss across the ray in units of that along it."""

    def __call__(
        self,
        along: Float[Tensor, "k p"],
        across2: Float[Tensor, "k p"],
        weight: Float[Tensor, "k p"],
        depth: Float[Tensor, " p"],
    ) -> tuple[Float[Tensor, "k p"], Float[Tensor, "k p"]]:
        """Cost, and weight of ``along`` squared in the quadratic that touches the cost from above.

        Of the miss across the ray the square is given; a relative cost measures by ``depth``.
        """
        distance = torch.sqrt(along * along + (across2 + self.floor**2))
        return weight * distance, weight / distance


@dataclass(frozen=True)
class Cauchy:
    """Relative misses under Cauchy's cost: w c^2/2 ln(1 + x^2/c^2), x^2 = (along^2 + a^2 across^2) / depth^2.

    Depth from a network is wrong in proportion to itself, and more so along the ray than across it: from c,
    the ``width``, on a miss matters less; a, how much ``sharper`` one across the ray counts.
    """

    width: float
    sharper: float

    @property
    def across(self) -> float:
        """As of :class:`Distance`."""
        return self.sharper**2

    def __call__(
        self,
        along: Float[Tensor, "k p"],
        across2: Float[Tensor, "k p"],
        weight: Float[Tensor, "k p"],
        depth: Float[Tensor, " p"],
    ) -> tuple[Float[Tensor, "k p"], Float[Tensor, "k p"]]:
        """As of :class:`Distance`."""
        unit = (self.width * depth) ** 2
        square = (along * along + self.across * across2) / unit
        cost = weight * (0.5 * self.width**2) * torch.log1p(square)
        return cost, weight / (depth.square() * (1 + square))


Penalty = Distance | Cauchy


@dataclass(frozen=True)
class RayMisses:
    """Where K edges place the points of P pixels, relative to the pixels' rays.

    The foot is the depth of the point of the ray that is nearest to the edge's point, at a distance whose
    square is ``across2``; ``weight`` is the log confidence over the divisor of the loss, ``length`` that of
    the ray at depth 1.
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
        """Cost and weight at a depth; ``reference`` is the depth by which a relative cost measures."""
        return penalty(self.length * (depth - self.foot), self.across2, self.weight, reference)

    def middle(self) -> Float[Tensor, " p"]:
        """Weighted median of the feet, positive; 1 where nothing weighs."""
        feet, order = self.foot.sort(dim=0)
        below = self.weight.gather(0, order).cumsum(dim=0)
        at = (below >= 0.5 * below[-1]).to(torch.uint8).argmax(dim=0)
        return _positive(torch.where(below[-1] > 0, feet.gather(0, at[None])[0], 1.0))

    def depth(
        self, depth: Float[Tensor, " p"], penalty: Penalty, reference: Float[Tensor, " p"], steps: int
    ) -> Float[Tensor, " p"]:
        """Depth after steps of reweighted least squares, d = sum w a / sum w, from a given one.

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
