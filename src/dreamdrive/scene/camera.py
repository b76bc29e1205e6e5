"""A pinhole camera with its pose."""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float

NEAR_M = 0.2
"""Depth along z from which on a camera shows things: the near plane of 3DGS, also in the compiled core."""
FARTHEST_M = 1e7
"""Largest coordinate of a place: northings of UTM reach it."""
MAX_SIDE_PX = 65_535
"""Longest side of a picture, as long as JPEG has them."""
MIN_FOCAL_PX, MAX_FOCAL_PX = 0.01, 1e7
"""Focal lengths, and distances of the principal point, that a lens may have."""


def check_rigid(matrix: np.ndarray, name: str, tolerance: float = 1e-4) -> None:
    """Raise ``ValueError`` unless ``matrix`` (..., 4, 4) is a finite rigid transform."""
    if matrix.shape[-2:] != (4, 4):
        raise ValueError(f"{name}: expected 4x4 matrices, got shape {matrix.shape}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name}: holds NaN or infinite numbers")
    if np.abs(matrix).max(initial=0.0) > FARTHEST_M:
        raise ValueError(f"{name}: holds {np.abs(matrix).max():.4g}; expected places within {FARTHEST_M:g} m")
    rotation = matrix[..., :3, :3]
    error = np.abs(rotation @ np.swapaxes(rotation, -1, -2) - np.eye(3)).max(initial=0.0)
    if error > tolerance or (np.linalg.det(rotation) < 0).any():
        raise ValueError(
            f"{name}: the 3x3 part is not a rotation (R R^T differs from the identity by {error:.2g}; "
            "expected right-handed rotations without scale)"
        )
    if np.abs(matrix[..., 3, :] - np.array([0, 0, 0, 1])).max(initial=0.0) > tolerance:
        raise ValueError(f"{name}: the last row must be 0 0 0 1")


@dataclass(frozen=True)
class Camera:
    """A pinhole: axes x right, y down, z forward; the centre of the top-left pixel is at (0.5, 0.5).

    Attributes:
        fx_px: Focal length along x in pixels.
        fy_px: Focal length along y in pixels.
        cx_px: Principal point in pixels, counted from the left edge of the image.
        cy_px: Principal point in pixels, counted from the top edge of the image.
        width_px: Image width.
        height_px: Image height.
        world_from_camera: Rigid pose (4, 4) in metres.
    """

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    width_px: int
    height_px: int
    world_from_camera: Float[np.ndarray, "4 4"] = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        if not all(MIN_FOCAL_PX <= each <= MAX_FOCAL_PX for each in (self.fx_px, self.fy_px)):
            raise ValueError(
                f"focal lengths must be positive, {MIN_FOCAL_PX} to {MAX_FOCAL_PX:g} px, "
                f"got fx {self.fx_px:g}, fy {self.fy_px:g}"
            )
        if not all(abs(each) <= MAX_FOCAL_PX for each in (self.cx_px, self.cy_px)):
            raise ValueError(
                f"the principal point must lie within {MAX_FOCAL_PX:g} px, got {self.cx_px:g}, {self.cy_px:g}"
            )
        if not all(1 <= each <= MAX_SIDE_PX for each in (self.width_px, self.height_px)):
            raise ValueError(
                f"image size must be positive, {MAX_SIDE_PX} px a side at most, "
                f"got {self.width_px}x{self.height_px}"
            )
        check_rigid(self.world_from_camera, "world_from_camera")

    @property
    def matrix(self) -> Float[np.ndarray, "3 3"]:
        """Intrinsic matrix (3, 3) for pixel coordinates with centres at +0.5."""
        return np.array(
            [[self.fx_px, 0, self.cx_px], [0, self.fy_px, self.cy_px], [0, 0, 1]], dtype=np.float64
        )

    @property
    def index_matrix(self) -> Float[np.ndarray, "3 3"]:
        """Intrinsic matrix (3, 3) where the centre of the top-left pixel is at 0, as OpenCV counts."""
        return self.matrix - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]

    @property
    def camera_from_world(self) -> Float[np.ndarray, "4 4"]:
        """Inverse of the pose (4, 4)."""
        rotation = self.world_from_camera[:3, :3]
        inverse = np.eye(4)
        inverse[:3, :3] = rotation.T
        inverse[:3, 3] = -rotation.T @ self.world_from_camera[:3, 3]
        return inverse

    def at(self, world_from_camera: Float[np.ndarray, "4 4"]) -> "Camera":
        """The same pinhole at another pose."""
        return replace(self, world_from_camera=np.asarray(world_from_camera, dtype=np.float64))

    def moved(self, right_m: float = 0.0, down_m: float = 0.0, ahead_m: float = 0.0) -> "Camera":
        """The same view from so far along its own axes."""
        pose = self.world_from_camera.copy()
        pose[:3, 3] += pose[:3, :3] @ [right_m, down_m, ahead_m]
        return self.at(pose)

    def resized(self, width_px: int, height_px: int) -> "Camera":
        """The same view sampled on another pixel grid."""
        sx, sy = width_px / self.width_px, height_px / self.height_px
        return replace(
            self,
            fx_px=self.fx_px * sx,
            fy_px=self.fy_px * sy,
            cx_px=self.cx_px * sx,
            cy_px=self.cy_px * sy,
            width_px=width_px,
            height_px=height_px,
        )

    def cropped(self, rows: slice, columns: slice) -> "Camera":
        """The part of the same picture that shows these rows and columns."""
        top, bottom, _ = rows.indices(self.height_px)
        left, right, _ = columns.indices(self.width_px)
        middle = {"cx_px": self.cx_px - left, "cy_px": self.cy_px - top}
        return replace(self, width_px=right - left, height_px=bottom - top, **middle)

    def project(self, points_world: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Column and row in pixels and depth along z in metres (N, 3) of points in the world.

        Columns and rows mean something only where the depth is positive.
        """
        local = points_world @ self.camera_from_world[:3, :3].T + self.camera_from_world[:3, 3]
        z = np.maximum(local[:, 2], 1e-6)
        column = local[:, 0] / z * self.fx_px + self.cx_px
        row = local[:, 1] / z * self.fy_px + self.cy_px
        return np.column_stack([column, row, local[:, 2]])

    def lift(self, pixels: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Points in the world (N, 3) of what ``project`` gives: columns, rows and depths along z."""
        x = (pixels[:, 0] - self.cx_px) / self.fx_px
        y = (pixels[:, 1] - self.cy_px) / self.fy_px
        local = np.column_stack([x, y, np.ones_like(x)]) * pixels[:, 2:]
        return local @ self.world_from_camera[:3, :3].T + self.world_from_camera[:3, 3]

    def shows(self, projected: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        """Which of the points that ``project`` gives lie in the picture and not before the near plane."""
        column, row, z = projected.T
        inside = (column >= 0) & (column < self.width_px) & (row >= 0) & (row < self.height_px)
        return inside & (z > NEAR_M)

    def tangents(self) -> tuple[Float[np.ndarray, " w"], Float[np.ndarray, " h"]]:
        """Where the rays of all columns and of all rows meet z = 1: x and y in the camera frame."""
        x = (np.arange(self.width_px) + 0.5 - self.cx_px) / self.fx_px
        y = (np.arange(self.height_px) + 0.5 - self.cy_px) / self.fy_px
        return x, y

    def rays(self) -> Float[np.ndarray, "h w 3"]:
        """Directions (H, W, 3) of the pixel centres in the camera frame, scaled to z = 1."""
        grid_x, grid_y = np.meshgrid(*self.tangents())
        return np.stack([grid_x, grid_y, np.ones_like(grid_x)], axis=-1)
