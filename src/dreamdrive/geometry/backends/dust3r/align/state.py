"""What the solver moves: cameras, and the similarity of each pair."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.scene.similarity import Similarity

PER_IMAGE = 7
"""Steps of an image: turn about its centre (3), shift (3), log focal length; all in the world's frame."""
PER_EDGE = 7
"""Steps of an edge: turn about its first camera's centre (3), shift (3), log scale."""


@dataclass(frozen=True)
class State:
    """Cameras and pairs in one world.

    Attributes:
        rotation: Of world_from_camera (N, 3, 3).
        centre: Of the cameras (N, 3).
        focal_px: (N,).
        edge_scale: Scale s (E,) of X = s R P + T, which takes a pair's points P to the world.
        edge_rotation: R (E, 3, 3).
        edge_centre: T (E, 3).
    """

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
        """Poses (N, 4, 4)."""
        poses = np.tile(np.eye(4), (len(self.centre), 1, 1))
        poses[:, :3, :3], poses[:, :3, 3] = self.rotation, self.centre
        return poses
