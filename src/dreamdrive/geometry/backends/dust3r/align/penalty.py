"""What a point that misses costs: the paper's distance, or less for what misses by far.

The miss of a pixel's point X against where an edge places it is split along the pixel's ray and across it.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor


@dataclass(frozen=True)
class Distance:
    """The paper's: w |X - Y|.

    Attributes:
        floor: Distance below which a miss weighs no more; in the unit of the world.
    """

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
        """Cost, and weight of ``along`` squared (K, P) in the quadratic that touches the cost from above.

        Args:
            along: Miss along the ray (K, P) of each of K edges at each of P pixels.
            across2: Square of the miss across the ray.
            weight: Log confidence over the divisor of the loss.
            depth: Depth (P,) by which a relative cost measures; without meaning here.
        """
        distance = torch.sqrt(along * along + (across2 + self.floor**2))
        return weight * distance, weight / distance


@dataclass(frozen=True)
class Cauchy:
    """Relative misses under Cauchy's cost: w c^2/2 ln(1 + x^2/c^2), x^2 = (along^2 + a^2 across^2) / depth^2.

    Depth from a network is wrong in proportion to itself, and more so along the ray than across it.

    Attributes:
        width: c, the relative miss from which on more matters less.
        sharper: a, by how much a miss across the ray counts more than one along it.
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
        """Cost and weight as of :class:`Distance`, with ``depth`` (P,) the measure of a miss."""
        unit = (self.width * depth) ** 2
        square = (along * along + self.across * across2) / unit
        cost = weight * (0.5 * self.width**2) * torch.log1p(square)
        return cost, weight / (depth.square() * (1 + square))


Penalty = Distance | Cauchy
