"""What the network says of pairs of frames."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int


@dataclass(frozen=True)
class PairMaps:
    """Points and confidences of both images of each pair, whose indices i and j are its edge.

    Points of image i and of image j are both in the frame of camera i (x right, y down, z forward), up to a
    scale of each pair's own. Confidences are at least 1 in the published models. Images may differ in shape.
    """

    edges: Int[np.ndarray, "e 2"]
    points: tuple[tuple[Float[np.ndarray, "_ _ 3"], Float[np.ndarray, "_ _ 3"]], ...]
    confidence: tuple[tuple[Float[np.ndarray, "_ _"], Float[np.ndarray, "_ _"]], ...]

    def __post_init__(self) -> None:
        if not len(self.edges) == len(self.points) == len(self.confidence):
            raise ValueError(
                f"{len(self.edges)} pairs, but points of {len(self.points)} "
                f"and confidences of {len(self.confidence)}"
            )
        for edge, points, confidence in zip(self.edges, self.points, self.confidence, strict=True):
            if any(p.shape[:2] != c.shape for p, c in zip(points, confidence, strict=True)):
                raise ValueError(f"pair {tuple(edge.tolist())}: points and confidence differ in shape")

    def __len__(self) -> int:
        return len(self.edges)

    def masked(self, usable: Sequence[Bool[np.ndarray, "_ _"]]) -> "PairMaps":
        """With a confidence of 1, which weighs nothing, where an image (H, W) is not usable."""

        def kept(image: int, trust: Float[np.ndarray, "_ _"]) -> Float[np.ndarray, "_ _"]:
            return np.where(usable[image], trust, trust.dtype.type(1))

        confidence = tuple(
            (kept(i, first), kept(j, second))
            for (i, j), (first, second) in zip(self.edges.tolist(), self.confidence, strict=True)
        )
        return replace(self, confidence=confidence)
