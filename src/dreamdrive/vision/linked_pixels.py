"""Pixels of one frame that hang together, in the image and in depth."""

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree


def linked_pixels(
    pixels: Float[np.ndarray, "m 3"], reach_px: float, reach_depth: float
) -> Int[np.ndarray, " m"]:
    """Label of the connected component of each pixel, from 0, by its column, row and positive depth.

    Neighbours are at most ``reach_px`` apart along columns and along rows, and differ by at most
    ``reach_depth`` in the logarithm of depth.
    """
    depth = np.log(pixels[:, 2]) * (reach_px / reach_depth)
    tree = KDTree(np.column_stack([pixels[:, :2], depth]))
    pairs = tree.query_pairs(reach_px, p=np.inf, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(pixels), len(pixels)))
    return connected_components(links, directed=False)[1]
