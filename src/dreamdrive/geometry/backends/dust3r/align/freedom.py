"""What may move: from the unknowns of a problem to the steps of all images and edges."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.sparse import coo_array, csr_array

from dreamdrive.geometry.backends.dust3r.align.state import PER_EDGE, PER_IMAGE, State

FocalFreedom = Literal["shared", "each"]
_FOCAL = 6


@dataclass(frozen=True)
class Freedom:
    """What is unknown.

    Attributes:
        focal: One focal length for all images, or one for each; None keeps those there are.
        poses: False keeps the shape of the path and solves its scale.
    """

    focal: FocalFreedom | None = "shared"
    poses: bool = True

    def basis(self, state: State) -> csr_array:
        """Matrix (7 N + 7 E, unknowns): step = basis @ unknowns.

        Image 0 stays where it is. The scales of the pairs keep their geometric mean, or the loss would be
        least where everything shrinks to a point.
        """
        images, edges = len(state.centre), len(state.edge_scale)
        first, last = PER_IMAGE * images, PER_IMAGE * images + PER_EDGE * edges - 1
        if self.poses:
            unknowns = [[(row, 1.0)] for row in range(PER_IMAGE, first) if row % PER_IMAGE != _FOCAL]
        else:
            shifts = [[PER_IMAGE * image + 3 + axis for axis in range(3)] for image in range(images)]
            unknowns = [list(zip(np.ravel(shifts).tolist(), state.centre.ravel().tolist(), strict=True))]
        focals = [(PER_IMAGE * image + _FOCAL, 1.0) for image in range(images)]
        if self.focal is not None:
            unknowns += [focals] if self.focal == "shared" else [[focal] for focal in focals]
        starts = range(first, last, PER_EDGE)
        unknowns += [[(start + part, 1.0)] for start in starts for part in range(PER_EDGE - 1)]
        unknowns += [[(start + PER_EDGE - 1, 1.0), (last, -1.0)] for start in starts[:-1]]
        rows, values = zip(*(each for moved in unknowns for each in moved), strict=True)
        columns = np.repeat(np.arange(len(unknowns)), [len(moved) for moved in unknowns])
        return coo_array((values, (rows, columns)), shape=(last + 1, len(unknowns))).tocsr()
