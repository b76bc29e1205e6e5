"""What may move: from the unknowns of a problem to the steps of all images and edges."""

from dataclasses import dataclass
from typing import Literal

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
        rows: list[int] = []
        columns: list[int] = []
        values: list[float] = []
        count = 0

        def add(row: int, column: int, value: float = 1.0) -> None:
            rows.append(row)
            columns.append(column)
            values.append(value)

        images, edges = len(state.centre), len(state.edge_scale)
        if self.poses:
            for row in range(PER_IMAGE, PER_IMAGE * images):
                if row % PER_IMAGE != _FOCAL:
                    add(row, count)
                    count += 1
        else:
            for image in range(images):
                for axis in range(3):
                    add(PER_IMAGE * image + 3 + axis, count, float(state.centre[image, axis]))
            count += 1
        if self.focal is not None:
            for image in range(images):
                add(PER_IMAGE * image + _FOCAL, count + (image if self.focal == "each" else 0))
            count += images if self.focal == "each" else 1
        first = PER_IMAGE * images
        for edge in range(edges):
            for part in range(PER_EDGE - 1):
                add(first + PER_EDGE * edge + part, count)
                count += 1
        for edge in range(edges - 1):
            add(first + PER_EDGE * edge + PER_EDGE - 1, count)
            add(first + PER_EDGE * edges - 1, count, -1.0)
            count += 1
        return coo_array((values, (rows, columns)), shape=(first + PER_EDGE * edges, count)).tocsr()
