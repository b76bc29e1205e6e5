"""The focal length that a pointmap in its own camera's frame speaks for.

It is the f of p = f q: pixels p relative to the principal point, slopes q = (x/z, y/z) of their points. Where
no principal point, a column and a row, is given it is the middle (W/2, H/2).
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.geometry.backends.dust3r.align.graph import Graph
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps
from dreamdrive.geometry.measured import weighted_median

_STEPS, _ROBUST_STEPS = 10, 6
_TINY_PX = 1e-8
_TUKEY = 4.685  # of the spread: 95 % as good as least squares where there are no outliers
_SPREAD_FLOOR_PX = 1e-3
_ENOUGH = 3_000  # pixels; more of them do not make the robust estimate better, only slower


@dataclass(frozen=True)
class FocalVotes:
    """Focal lengths of each edge's first image by its pointmap; the sums of its log confidences weigh."""

    image: Int[np.ndarray, " e"]
    focal_px: Float[np.ndarray, " e"]
    weight: Float[np.ndarray, " e"]

    @property
    def shared_px(self) -> float:
        """Weighted median over all edges: the focal length of one camera that took all images."""
        return weighted_median(self.focal_px, self.weight)

    @property
    def spread(self) -> float:
        """Robust standard deviation over edges (1.4826 times the median distance), relative to the median."""
        apart = np.abs(np.log(self.focal_px / self.shared_px))
        return 1.4826 * weighted_median(apart, self.weight)

    def all_at(self, focal_px: Float[np.ndarray, " n"]) -> "FocalVotes":
        """The votes of pointmaps that were given the focal lengths of their images."""
        return replace(self, focal_px=focal_px[self.image])

    def lateral(self, focal_px: Float[np.ndarray, " n"]) -> Float[np.ndarray, " e"]:
        """Factors on x and y that give pointmaps the focal lengths of their images, 1 where one has none."""
        return np.nan_to_num(self.focal_px / focal_px[self.image], nan=1.0)

    def per_image_px(self, count: int) -> Float[np.ndarray, " n"]:
        """Weighted median over the edges that start at an image; the shared one where none does."""
        focals = np.full(count, self.shared_px)
        for image in np.unique(self.image):
            mine = self.image == image
            focals[image] = weighted_median(self.focal_px[mine], self.weight[mine])
        return focals


def focal_votes(maps: PairMaps, graph: Graph) -> FocalVotes:
    """The focal length of every edge's first image by its own pointmap, by the robust rule."""
    focals: list[float] = []
    for image, points, confidence in zip(maps.edges[:, 0], maps.points, maps.confidence, strict=True):
        cx, cy = graph.principal_px[image].tolist()
        focals.append(robust_px(points[0], confidence[0], (cx, cy), float(graph.stretch[image])))
    weights = [float(np.log(confidence[0]).sum(dtype=np.float64)) for confidence in maps.confidence]
    return FocalVotes(maps.edges[:, 0], np.array(focals), np.array(weights))


def weiszfeld_px(
    points: Float[np.ndarray, "h w 3"], principal_px: tuple[float, float] | None = None
) -> float:
    """The paper's rule: minimise sum |p - f q| over all pixels alike (Wang et al. 2024, section 3.3)."""
    p, q = _pixels_and_slopes(points, principal_px, 1.0)
    pq, qq = (p * q).sum(axis=1), (q * q).sum(axis=1)
    focal = pq.mean() / qq.mean()
    for _ in range(_STEPS):
        weight = 1 / np.maximum(np.linalg.norm(p - focal * q, axis=1), _TINY_PX)
        focal = (weight * pq).mean() / (weight * qq).mean()
    return float(focal)


def robust_px(
    points: Float[np.ndarray, "h w 3"],
    confidence: Float[np.ndarray, "h w"] | None = None,
    principal_px: tuple[float, float] | None = None,
    stretch: float = 1.0,
) -> float:
    """The focal length, or NaN where no pixel speaks for a positive one.

    Log confidences weigh, masked pixels and points behind the camera do not count, outliers drop out.

    A sum of norms has no protection against points of great slope: a fifth of them six times too steep takes
    Weiszfeld's result from 36 px to 10. Here the weighted median of the radial votes p·q / q·q, each weighing
    as much as its distance from the principal point, starts steps with Tukey's weights, which end at zero.

    A confidence of 1 masks a pixel out; none weighs all alike. The stretch is fx / fy.
    """
    p, q = _pixels_and_slopes(points, principal_px, stretch)
    pq, qq = (p * q).sum(axis=1), (q * q).sum(axis=1)
    trust = np.ones(len(p)) if confidence is None else np.log(confidence.astype(np.float64)).ravel()
    counts = (trust > 0) & (points[..., 2].ravel() > 0) & (pq > 0)
    if not counts.any():
        return float("nan")
    some = np.flatnonzero(counts)
    some = some[:: max(1, len(some) // _ENOUGH)]
    p, q, pq, qq, trust = p[some], q[some], pq[some], qq[some], trust[some]
    focal = weighted_median(pq / qq, trust * np.linalg.norm(p, axis=1))
    for _ in range(_ROBUST_STEPS):
        error = np.linalg.norm(p - focal * q, axis=1)
        reach = _TUKEY * max(1.4826 * weighted_median(error, trust), _SPREAD_FLOOR_PX)
        weight = trust * np.square(np.maximum(1 - np.square(error / reach), 0))
        focal = (weight * pq).sum() / (weight * qq).sum()
    return float(focal)


def _pixels_and_slopes(
    points: Float[np.ndarray, "h w 3"], principal_px: tuple[float, float] | None, stretch: float
) -> tuple[Float[np.ndarray, "p 2"], Float[np.ndarray, "p 2"]]:
    flat = points.reshape(-1, 3).astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.nan_to_num(flat[:, :2] / flat[:, 2:], nan=0.0, posinf=0.0, neginf=0.0)
    height, width = points.shape[:2]
    cx, cy = (width / 2, height / 2) if principal_px is None else principal_px
    columns, rows = np.meshgrid(np.arange(width) - cx, stretch * (np.arange(height) - cy))
    return np.stack([columns.ravel(), rows.ravel()], axis=1), slopes
