"""Two labels for every pixel, as a minimum cut (Boykov and Jolly, 2001)."""

import numpy as np
from jaxtyping import Bool, Float
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

_UNIT = 100  # the flow is found in whole numbers


def minimum_cut(
    gain: Float[np.ndarray, "h w"],
    right: Float[np.ndarray, "h v"],
    below: Float[np.ndarray, "u w"],
) -> Bool[np.ndarray, "h w"]:
    """The labels with the largest sum of gains of the labelled pixels less the weights that are cut.

    A gain is what labelling a pixel is worth; negative where it costs. Non-negative weights are those of
    unlike labels of each pixel and its neighbour on the right or below. Gains and weights count in steps of
    1/100. Of equally good labellings it is that of the fewest pixels.
    """
    pixel = np.arange(gain.size).reshape(gain.shape)
    source, sink = gain.size, gain.size + 1
    worth, cost = _whole(np.maximum(gain, 0)).ravel(), _whole(np.maximum(-gain, 0)).ravel()
    edges = [
        (np.full(gain.size, source), pixel.ravel(), worth),
        (pixel.ravel(), np.full(gain.size, sink), cost),
    ]
    for start, end, weight in (
        (pixel[:, :-1], pixel[:, 1:], right),
        (pixel[:-1], pixel[1:], below),
    ):
        both = _whole(weight).ravel()
        edges += [(start.ravel(), end.ravel(), both), (end.ravel(), start.ravel(), both)]
    rows, columns, values = (np.concatenate(part) for part in zip(*edges, strict=True))
    network = csr_array((values, (rows, columns)), shape=(gain.size + 2, gain.size + 2))
    left = network - maximum_flow(network, source, sink).flow
    left.data[left.data < 0] = 0
    left.eliminate_zeros()
    labelled = np.zeros(gain.size + 2, bool)
    labelled[breadth_first_order(left, source, return_predecessors=False)] = True
    return labelled[: gain.size].reshape(gain.shape)


def _whole(values: np.ndarray) -> np.ndarray:
    return np.rint(values * _UNIT).astype(np.int32)
