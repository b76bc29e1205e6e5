"""Plane sweep: how well each inverse depth of a reference frame is confirmed by its sources."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.scene.camera import Camera

LABELS = 64
MAX_INVERSE_DEPTH = 0.30  # 1/m; nearest plane 3.3 m
BASELINES_M = (0.8, 2.0)
REACH_FRAMES = 5
_WINDOW_PX = 5
_NOISE = 6.0**2  # grey levels squared, added to both variances: noise on bare asphalt must not correlate
_OUTSIDE_PX = -10.0


def inverse_depths() -> Float[np.ndarray, " labels"]:
    """The swept inverse depths in 1/m, uniform from 0."""
    return np.linspace(0.0, MAX_INVERSE_DEPTH, LABELS)


def choose_sources(
    positions_m: Float[np.ndarray, "f 3"], usable: Bool[np.ndarray, " f"], reference: int
) -> tuple[int, ...]:
    """Usable frames nearest to each wanted baseline, behind and ahead, within the reach; sorted."""
    chosen: set[int] = set()
    count = len(positions_m)
    sides = (
        [i for i in range(max(0, reference - REACH_FRAMES), reference) if usable[i]],
        [i for i in range(reference + 1, min(count, reference + REACH_FRAMES + 1)) if usable[i]],
    )
    for side in sides:
        baseline = {i: float(np.linalg.norm(positions_m[i] - positions_m[reference])) for i in side}
        for wanted in BASELINES_M:
            if side:
                chosen.add(min(side, key=lambda i: (abs(baseline[i] - wanted), abs(i - reference))))
    return tuple(sorted(chosen))


class Warp:
    """Where the pixels of a reference land in a source, as a function of inverse depth.

    With r the ray of a pixel scaled to z = 1 and (R, t) source-from-reference, a point at inverse depth w
    projects to K (R r + w t): a straight line in w.
    """

    def __init__(self, reference: Camera, source: Camera) -> None:
        relative = source.camera_from_world @ reference.world_from_camera
        rotated = reference.rays() @ relative[:3, :3].T
        self.source = source
        self.translation = relative[:3, 3]
        self.rotated = np.ascontiguousarray(np.moveaxis(rotated, -1, 0)).astype(np.float32)

    def __call__(
        self, inverse_depth: Float[np.ndarray, "h w"] | float
    ) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w"]]:
        """Source pixel indices (x, y) for ``cv2.remap``; far outside where the point is behind the source."""
        x, y, z = (
            self.rotated[k] + np.float32(self.translation[k]) * np.asarray(inverse_depth, np.float32)
            for k in range(3)
        )
        front = z > 0.05
        z = np.where(front, z, 1).astype(np.float32)
        camera = self.source
        u = np.float32(camera.fx_px) * x / z + np.float32(camera.cx_px - 0.5)
        v = np.float32(camera.fy_px) * y / z + np.float32(camera.cy_px - 0.5)
        outside = np.float32(_OUTSIDE_PX)
        return np.where(front, u, outside), np.where(front, v, outside)


class Correlation:
    """Normalised cross-correlation of one reference picture with warped pictures, over a square window."""

    def __init__(self, grey: Float[np.ndarray, "h w"], window_px: int = _WINDOW_PX) -> None:
        self.window = (window_px, window_px)
        # Centred values keep the differences of squares exact enough in float32.
        self.grey = np.ascontiguousarray(grey, np.float32) - np.float32(128)
        self.mean = self._box(self.grey)
        self.variance = np.maximum(self._box(self.grey * self.grey) - self.mean * self.mean, 0)

    def _box(self, image: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
        return cv2.boxFilter(image, cv2.CV_32F, self.window, borderType=cv2.BORDER_REFLECT)

    def __call__(self, warped: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
        """Correlation in [-1, 1] with a picture (H, W) on the reference's grid, values in grey levels."""
        other = warped - np.float32(128)
        mean = self._box(other)
        variance = np.maximum(self._box(other * other) - mean * mean, 0)
        covariance = self._box(self.grey * other) - self.mean * mean
        return covariance / np.sqrt((self.variance + _NOISE) * (variance + _NOISE))


def sample(
    image: Float[np.ndarray, "h w"], x: Float[np.ndarray, "h w"], y: Float[np.ndarray, "h w"]
) -> Float[np.ndarray, "h w"]:
    """Bilinear samples at pixel indices (x, y); the edge is repeated outside."""
    return cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def inside(
    x: Float[np.ndarray, "h w"], y: Float[np.ndarray, "h w"], valid: Bool[np.ndarray, "h w"]
) -> Bool[np.ndarray, "h w"]:
    """Whether pixel indices (x, y) fall on valid pixels of the source."""
    height, width = valid.shape
    within = (x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1)
    if valid.all():
        return within
    return within & (cv2.remap(valid.astype(np.uint8), x, y, cv2.INTER_NEAREST) > 0)


def similarity(
    correlation: Correlation,
    sources: Sequence[tuple[Warp, Float[np.ndarray, "h w"], Bool[np.ndarray, "h w"]]],
    inverse_depth: Float[np.ndarray, "h w"] | float,
) -> Float[np.ndarray, "h w"]:
    """Mean of the best two correlations over the sources; 0 where no source sees the point.

    Args:
        correlation: The reference picture.
        sources: Warp, grey picture and usable pixels of each source.
        inverse_depth: One plane or a value a pixel, in 1/m.
    """
    best = second = np.full(correlation.grey.shape, -2, np.float32)
    for warp, grey, valid in sources:
        x, y = warp(inverse_depth)
        seen = inside(x, y, valid)
        score = np.where(seen, correlation(sample(grey, x, y)), np.float32(-2))
        best, second = np.maximum(best, score), np.maximum(second, np.minimum(best, score))
    two = np.where(second > -2, (best + second) / 2, best)
    return np.where(best > -2, two, np.float32(0))


def matching_volume(
    correlation: Correlation,
    sources: Sequence[tuple[Warp, Float[np.ndarray, "h w"], Bool[np.ndarray, "h w"]]],
) -> Float[np.ndarray, "h labels w"]:
    """``similarity`` for every plane of ``inverse_depths()`` (H, labels, W), float32."""
    height, width = correlation.grey.shape
    volume = np.empty((height, LABELS, width), np.float32)
    for label, inverse in enumerate(inverse_depths()):
        volume[:, label] = similarity(correlation, sources, float(inverse))
    return volume


def nearest_label(inverse_depth: Float[np.ndarray, "h w"]) -> Int[np.ndarray, "h w"]:
    """Index of the nearest swept plane (H, W), clipped to the range."""
    step = MAX_INVERSE_DEPTH / (LABELS - 1)
    return np.clip(np.rint(inverse_depth / step), 0, LABELS - 1).astype(np.intp)
