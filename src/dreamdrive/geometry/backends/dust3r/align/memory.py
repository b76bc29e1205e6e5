"""How much memory an alignment takes, known before it starts."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Int

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.align.state import PER_EDGE, PER_IMAGE

_SAMPLE_BYTES = 32  # a point and a weight in float64
_WORK_BYTES = 1000  # of the normal equations, for each edge at each sample of one image
_MATRICES = 6  # of the size of the Hessian
_PIXEL_BYTES = 48  # of start and result: a placed point and what became of it
_FIXED_BYTES = 100_000_000


def predicted_bytes(
    sizes: Sequence[tuple[int, int]],
    edges: Int[np.ndarray, "e 2"],
    samples_per_image: int,
    storage_bytes: int = 4,
) -> int:
    """Bytes that pointmaps, confidences and their alignment take at most at once.

    Args:
        sizes: Height and width of each image.
        edges: First and second image (E, 2) of each pair.
        samples_per_image: Pixels that the solver looks at.
        storage_bytes: Of a number of the pointmaps: 4 for float32, 2 for float16.
    """
    areas = np.array([height * width for height, width in sizes])
    degrees = np.bincount(edges.ravel(), minlength=len(areas))
    sampled = np.minimum(areas, samples_per_image)
    return int(
        4 * storage_bytes * areas[edges].sum()
        + _SAMPLE_BYTES * (degrees * sampled).sum()
        + _WORK_BYTES * (degrees * sampled).max()
        + _MATRICES * 8 * (PER_IMAGE * len(areas) + PER_EDGE * len(edges)) ** 2
        + _PIXEL_BYTES * areas.sum()
        + _FIXED_BYTES
    )


def check_budget(predicted: int, budget: int, images: int, edges: int) -> None:
    """Refuse what would not fit.

    Raises:
        InputError: The prediction is above the budget.
    """
    if predicted > budget:
        raise InputError(
            f"Aligning {images} images in {edges} pairs takes about {predicted / 1e9:.1f} GB, and "
            f"{budget / 1e9:.1f} GB are allowed: take fewer frames (--frames)."
        )
