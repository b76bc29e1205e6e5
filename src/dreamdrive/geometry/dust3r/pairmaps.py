"""What the network says of pairs of frames."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True)
class PairMaps:
    """Points and confidences of both images of each pair.

    Images may differ in shape, also within a pair.

    Attributes:
        edges: For each pair (E, 2) the indices i and j of its images.
        points: For each pair the points of image i and of image j, (H, W, 3) and (U, V, 3), both in the frame
            of camera i (x right, y down, z forward), up to a scale of each pair's own.
        confidence: Their confidences (H, W) and (U, V), at least 1 in the published models.
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
