"""Plane sweep: how well each inverse depth of a reference frame is confirmed by its sources."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive import _native
from dreamdrive.scene.camera import Camera
from dreamdrive.vision.windows import window_px

LABELS = 64
MAX_INVERSE_DEPTH = 0.30  # 1/m; nearest plane 3.3 m
BASELINES_M = (0.8, 2.0)
UNSEEN_SCORE = 0.0
WINDOW_PX = 5
NOISE = 6.0**2  # grey levels squared, added to both variances: noise on bare asphalt must not correlate
CENTRE = 128.0
_OUTSIDE_PX = -10.0
_UNSEEN = np.float32(-2)
MIN_Z = 0.05  # of the reference's depth; nearer to the source's image plane a point is not projected


def choose_sources(
    positions_m: Float[np.ndarray, "f 3"], usable: Bool[np.ndarray, " f"], reference: int, reach: int
) -> tuple[int, ...]:
    """Usable frames nearest to each wanted baseline, behind and ahead, at most ``reach`` away; sorted."""
    chosen: set[int] = set()
    count = len(positions_m)
    sides = (
        [i for i in range(max(0, reference - reach), reference) if usable[i]],
        [i for i in range(reference + 1, min(count, reference + reach + 1)) if usable[i]],
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
        self.reference, self.source = reference, source
        self.rotation = relative[:3, :3]
        self.translation = relative[:3, 3]
        # Rays in the source's frame: what a pixel's column gives and what its row gives, added.
        right, down = reference.tangents()
        by_column = self.rotation[:, :1] * right + self.rotation[:, 2:]
        by_row = self.rotation[:, 1:2] * down
        self.rotated = np.empty((3, len(down), len(right)), np.float32)
        np.add(by_column[:, None], by_row[..., None], out=self.rotated, casting="same_kind")

    def homographies(self, inverse_depth: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 3 3"]:
        """Source from reference pixel indices for planes z = 1 / inverse_depth of the reference (1/m)."""
        shift = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
        planes = np.tile(self.rotation, (len(inverse_depth), 1, 1))
        planes[:, :, 2] += inverse_depth[:, None] * self.translation
        return (
            np.linalg.inv(shift) @ self.source.matrix @ planes @ np.linalg.inv(self.reference.matrix) @ shift
        )

    def __call__(
        self, inverse_depth: Float[np.ndarray, "h w"] | float
    ) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w"]]:
        """Source pixel indices (x, y) for ``cv2.remap``; far outside where the point is behind the source."""
        inverse, camera = np.asarray(inverse_depth, np.float32), self.source
        x, y, z = (self.rotated[k] + np.float32(self.translation[k]) * inverse for k in range(3))
        behind = None if z.min() > MIN_Z else ~(z > MIN_Z)
        if behind is not None:
            z[behind] = 1
        for at, focal, middle in ((x, camera.fx_px, camera.cx_px), (y, camera.fy_px, camera.cy_px)):
            at *= np.float32(focal)
            at /= z
            at += np.float32(middle - 0.5)
            if behind is not None:
                at[behind] = _OUTSIDE_PX
        return x, y


class Correlation:
    """Normalised cross-correlation of one reference picture with warped pictures, over a square window.

    Keeps working buffers, so one object serves one thread.
    """

    def __init__(self, grey: Float[np.ndarray, "h w"], window: int = WINDOW_PX) -> None:
        self.side = window_px(window, grey.shape[1])
        self._row = np.full(self.side, 1 / self.side, np.float32)
        # Centred values keep the differences of squares exact enough in float32.
        self.grey = np.ascontiguousarray(grey, np.float32) - np.float32(CENTRE)
        self._buffers = [np.empty_like(self.grey) for _ in range(4)]
        self.mean = self._box(self.grey, np.empty_like(self.grey))
        square = self._box(self.grey * self.grey, np.empty_like(self.grey))
        self.variance = np.maximum(square - self.mean * self.mean, 0)

    def _box(self, image: Float[np.ndarray, "h w"], out: np.ndarray) -> Float[np.ndarray, "h w"]:
        # Faster than boxFilter on one channel of float32.
        return np.asarray(cv2.sepFilter2D(image, cv2.CV_32F, self._row, self._row, out))

    def __call__(self, warped: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
        """Correlation in [-1, 1] with a picture (H, W) on the reference's grid, values in grey levels."""
        other, mean, product, square = self._buffers
        np.subtract(warped, np.float32(CENTRE), out=other)
        self._box(other, mean)
        self._box(np.multiply(other, other, out=product), square)
        np.subtract(square, np.multiply(mean, mean, out=product), out=square)
        np.maximum(square, 0, out=square)
        square += np.float32(NOISE)
        square *= self.variance + np.float32(NOISE)
        np.sqrt(square, out=square)
        covariance = self._box(np.multiply(self.grey, other, out=product), np.empty_like(other))
        covariance -= np.multiply(self.mean, mean, out=mean)
        covariance /= square
        return covariance


def sample(
    image: Float[np.ndarray, "h w"], x: Float[np.ndarray, "u v"], y: Float[np.ndarray, "u v"]
) -> Float[np.ndarray, "u v"]:
    """Bilinear samples at pixel indices (x, y); the edge is repeated outside."""
    return cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def inside(
    x: Float[np.ndarray, "u v"], y: Float[np.ndarray, "u v"], valid: Bool[np.ndarray, "h w"]
) -> Bool[np.ndarray, "u v"]:
    """Whether pixel indices (x, y) fall on valid pixels of the source."""
    height, width = valid.shape
    within = (x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1)
    if valid.all():
        return within
    return within & (cv2.remap(valid.astype(np.uint8), x, y, cv2.INTER_NEAREST) > 0)


class BestTwo:
    """Running mean of the best two correlations of each pixel."""

    def __init__(self, shape: tuple[int, int]) -> None:
        self.best = np.full(shape, _UNSEEN, np.float32)
        self.second = self.best.copy()

    def add(self, score: Float[np.ndarray, "h w"], seen: Bool[np.ndarray, "h w"]) -> None:
        """Take in the correlations with one source, where it sees the point; ``score`` is used up."""
        # Arithmetic instead of a masked copy, which is several times slower.
        score -= _UNSEEN
        score *= seen.view(np.uint8)
        score += _UNSEEN
        np.maximum(self.second, np.minimum(self.best, score), out=self.second)
        np.maximum(self.best, score, out=self.best)

    def mean(self) -> Float[np.ndarray, "h w"]:
        """Mean of the best two, the only one, or ``UNSEEN_SCORE`` where no source sees the point."""
        two = np.where(self.second > _UNSEEN, (self.best + self.second) * np.float32(0.5), self.best)
        return np.where(self.best > _UNSEEN, two, np.float32(UNSEEN_SCORE))


Source = tuple[Warp, np.ndarray, np.ndarray]
"""Warp into a source, its grey picture and its usable pixels."""


def similarity(
    correlation: Correlation, sources: Sequence[Source], inverse_depth: Float[np.ndarray, "h w"]
) -> Float[np.ndarray, "h w"]:
    """Mean of the best two correlations over the sources, at an inverse depth (H, W) in 1/m."""
    found = BestTwo(correlation.grey.shape)
    for warp, grey, usable in sources:
        x, y = warp(inverse_depth)
        found.add(correlation(sample(grey, x, y)), inside(x, y, usable))
    return found.mean()


def matching_cost(
    correlation: Correlation, sources: Sequence[Source], cost: Float[np.ndarray, "h labels w"]
) -> None:
    """One minus ``similarity`` for every plane, uniform in 1/m from 0, into ``cost`` (H, labels, W)."""
    laid = _laid_on_planes(sources, np.linspace(0.0, MAX_INVERSE_DEPTH, LABELS))
    reference = correlation.grey, correlation.mean, correlation.variance
    _native.sweep_cost(*reference, *laid, correlation.side, CENTRE, NOISE, MIN_Z, cost)


def misfits(
    grey: Float[np.ndarray, "h w"],
    sources: Sequence[Source],
    inverse_depth: Float[np.ndarray, " n"],
    most_levels: float,
) -> Float[np.ndarray, "n h w"]:
    """Mean absolute difference to the sources that see a point, if all were on planes z = 1 / inverse_depth.

    In grey levels, for each inverse depth in 1/m; no difference counts for more than ``most_levels``, which
    also stands where no source sees the point.
    """
    found = np.empty((len(inverse_depth), *grey.shape), np.float32)
    _native.sweep_misfit(grey, *_laid_on_planes(sources, inverse_depth), MIN_Z, most_levels, found)
    return found


def _laid_on_planes(
    sources: Sequence[Source], inverse_depth: Float[np.ndarray, " n"]
) -> tuple[list[np.ndarray], list[np.ndarray], Float[np.ndarray, "s n 3 3"]]:
    """Pictures and usable pixels of the sources, and where planes put the reference's pixels in them."""
    places = np.array([warp.homographies(inverse_depth) for warp, _, _ in sources]).reshape(
        -1, len(inverse_depth), 3, 3
    )
    return [grey for _, grey, _ in sources], [usable for _, _, usable in sources], places


def nearest_label(inverse_depth: Float[np.ndarray, "h w"]) -> Int[np.ndarray, "h w"]:
    """Index of the nearest swept plane (H, W), clipped to the range."""
    step = MAX_INVERSE_DEPTH / (LABELS - 1)
    return np.clip(np.rint(inverse_depth / step), 0, LABELS - 1).astype(np.intp)
