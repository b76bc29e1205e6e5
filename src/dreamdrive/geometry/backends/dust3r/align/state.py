"""The solver's unknowns: cameras and the similarity of each pair."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.sparse import coo_array, csr_array
from scipy.spatial.transform import Rotation

from dreamdrive.scene.similarity import Similarity

PER_IMAGE = 7
"""Steps of an image: turn about its centre (3), shift (3), log focal length; all in the world's frame."""
PER_EDGE = 7
"""Steps of an edge: turn about its first camera's centre (3), shift (3), log scale."""
FocalFreedom = Literal["shared", "each"]
_FOCAL = 6


@dataclass(frozen=True)
class State:
    """Cameras in one world; scale s, rotation R and centre T of each pair, X = s R P + T for its points P."""

    rotation: Float[np.ndarray, "n 3 3"]
    centre: Float[np.ndarray, "n 3"]
    focal_px: Float[np.ndarray, " n"]
    edge_scale: Float[np.ndarray, " e"]
    edge_rotation: Float[np.ndarray, "e 3 3"]
    edge_centre: Float[np.ndarray, "e 3"]

    @staticmethod
    def of(
        world_from_camera: Float[np.ndarray, "n 4 4"],
        focal_px: Float[np.ndarray, " n"],
        pairs: Sequence[Similarity],
    ) -> "State":
        """The state of these poses, focal lengths and pairs."""
        return State(
            world_from_camera[:, :3, :3],
            world_from_camera[:, :3, 3],
            focal_px,
            np.array([pair.scale for pair in pairs]),
            np.stack([pair.rotation for pair in pairs]),
            np.stack([pair.translation for pair in pairs]),
        )

    def moved(self, step: Float[np.ndarray, " p"]) -> "State":
        """After a step (7 N + 7 E,): that of each image, then that of each edge."""
        images = step[: PER_IMAGE * len(self.centre)].reshape(-1, PER_IMAGE)
        edges = step[PER_IMAGE * len(self.centre) :].reshape(-1, PER_EDGE)
        return State(
            Rotation.from_rotvec(images[:, :3]).as_matrix() @ self.rotation,
            self.centre + images[:, 3:6],
            self.focal_px * np.exp(images[:, 6]),
            self.edge_scale * np.exp(edges[:, 6]),
            Rotation.from_rotvec(edges[:, :3]).as_matrix() @ self.edge_rotation,
            self.edge_centre + edges[:, 3:6],
        )

    def camera_from_edge(self, image: int, edge: int) -> tuple[np.ndarray, np.ndarray]:
        """Matrix (3, 3), with the scale, and shift (3,) from a pair's points to the frame of a camera."""
        back = self.rotation[image].T
        matrix = self.edge_scale[edge] * back @ self.edge_rotation[edge]
        return matrix, back @ (self.edge_centre[edge] - self.centre[image])

    @property
    def world_from_camera(self) -> Float[np.ndarray, "n 4 4"]:
        """Poses of all images."""
        poses = np.tile(np.eye(4), (len(self.centre), 1, 1))
        poses[:, :3, :3], poses[:, :3, 3] = self.rotation, self.centre
        return poses


@dataclass(frozen=True)
class Freedom:
    """What is unknown: one focal length for all images, or one for each; None keeps those there are.

    Without ``poses`` the shape of the path is kept, and its scale solved.
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
