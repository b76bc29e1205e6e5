"""Lens distortion of points: OpenCV's polynomial models and its fisheye model."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Bool, Float

_NEWTON_STEPS = 20
_BLOCK = 1 << 15
"""Points given to OpenCV at once; its scratch memory is 500 bytes a point."""
_STEP = 1e-6
_TOLERANCE = 1e-7
"""Largest error of an inverted point, in units of the focal length: under a thousandth of a pixel."""


@dataclass(frozen=True)
class Distortion:
    """Where a lens moves the points of an ideal pinhole image.

    Attributes:
        model: ``"opencv"`` (k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tx ty]]]]) or ``"fisheye"``
            (equidistant, k1 k2 k3 k4), as in OpenCV's camera calibration.
        coefficients: 4, 5, 8, 12 or 14 numbers; 4 for the fisheye.
    """

    model: Literal["opencv", "fisheye"]
    coefficients: tuple[float, ...]

    def __post_init__(self) -> None:
        allowed = (4,) if self.model == "fisheye" else (4, 5, 8, 12, 14)
        if len(self.coefficients) not in allowed:
            raise ValueError(f"{self.model}: expected {allowed} coefficients, got {len(self.coefficients)}")

    def distort(self, points: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Distorted points of ideal ones, both as x/z and y/z (focal length 1, centre 0)."""
        if not len(points):
            return points
        coefficients = np.array(self.coefficients)
        if self.model == "fisheye":
            radius = np.linalg.norm(points, axis=1)
            angle = np.arctan(radius)
            bent = _fisheye_radius(angle, coefficients)
            return points * (bent / np.maximum(radius, 1e-12))[:, None]
        rays = np.concatenate([points, np.ones((len(points), 1))], axis=1)[:, None]
        blocks = (rays[start : start + _BLOCK] for start in range(0, len(rays), _BLOCK))
        found = [cv2.projectPoints(b, np.zeros(3), np.zeros(3), np.eye(3), coefficients)[0] for b in blocks]
        return np.concatenate(found).astype(np.float64).reshape(-1, 2)

    def undistort(self, points: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """The inverse of ``distort``; NaN where no ideal point in front of the camera leads there.

        Newton's method with a numeric Jacobian, started at the distorted point itself; a fisheye's angle is
        found by bisection, since it is monotone up to the angle where the lens folds.
        """
        if self.model == "fisheye":
            return _undistort_fisheye(points, np.array(self.coefficients), self.fold_rad)
        ideal = np.array(points, dtype=np.float64)
        left = np.arange(len(points))
        with np.errstate(all="ignore"):  # points that diverge are thrown out below
            for _ in range(_NEWTON_STEPS):
                error = self.distort(ideal[left]) - points[left]
                far = np.abs(error).max(axis=1, initial=0.0) > 1e-12
                left, error = left[far], error[far]
                ideal[left] -= _solve(self._jacobian(ideal[left]), error)
                left = left[np.isfinite(ideal[left]).all(axis=1)]
            good = np.abs(self.distort(ideal) - points).max(axis=1, initial=0.0) < _TOLERANCE
        good &= self.unfolded(ideal)
        return np.where(good[:, None], ideal, np.nan)

    def unfolded(self, points: Float[np.ndarray, "n 2"]) -> Bool[np.ndarray, " n"]:
        """Whether the radial part still grows outwards all the way to each ideal point (N,).

        Beyond the angle where it turns back it would show a mirrored copy of the inner image.
        """
        return np.asarray(np.arctan(np.hypot(points[:, 0], points[:, 1])) < self.fold_rad)

    @cached_property
    def fold_rad(self) -> float:
        """Smallest angle to the axis, at most 90 degrees, at which the radial part stops growing."""
        angle = np.linspace(0, np.pi / 2, 4097)[:-1]
        k = np.array(self.coefficients)
        radius = _fisheye_radius(angle, k) if self.model == "fisheye" else _radial(np.tan(angle), k)
        shrinking = np.flatnonzero(np.diff(radius) <= 0)
        return float(angle[shrinking[0]] if len(shrinking) else np.pi / 2)

    def _jacobian(self, points: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2 2"]:
        columns = [
            (self.distort(points + step) - self.distort(points - step)) / (2 * _STEP)
            for step in (np.array([_STEP, 0.0]), np.array([0.0, _STEP]))
        ]
        return np.stack(columns, axis=2)


def _solve(matrix: Float[np.ndarray, "n 2 2"], right: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
    a, b, c, d = matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 0], matrix[:, 1, 1]
    x, y = right[:, 0], right[:, 1]
    return np.stack([d * x - b * y, a * y - c * x], axis=1) / (a * d - b * c)[:, None]


def _fisheye_radius(angle: Float[np.ndarray, " n"], k: Float[np.ndarray, "4"]) -> Float[np.ndarray, " n"]:
    square = angle * angle
    return angle * (1 + square * (k[0] + square * (k[1] + square * (k[2] + square * k[3]))))


def _radial(radius: Float[np.ndarray, " n"], k: Float[np.ndarray, " k"]) -> Float[np.ndarray, " n"]:
    """The rational radial part of OpenCV's model, without its tangential terms."""
    k1, k2, k3, k4, k5, k6 = [*k[:2], *k[4:8], *np.zeros(4)][:6]
    s = radius * radius
    return radius * (1 + s * (k1 + s * (k2 + s * k3))) / (1 + s * (k4 + s * (k5 + s * k6)))


def _undistort_fisheye(
    points: Float[np.ndarray, "n 2"], k: Float[np.ndarray, "4"], fold: float
) -> Float[np.ndarray, "n 2"]:
    radius = np.linalg.norm(points, axis=1)
    low, high = np.zeros(len(points)), np.full(len(points), fold)
    for _ in range(52):
        middle = (low + high) / 2
        below = _fisheye_radius(middle, k) < radius
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    inside = radius < _fisheye_radius(np.array([fold]), k)[0] - _TOLERANCE
    scale = np.where(inside, np.tan(np.where(inside, low, 0.0)) / np.maximum(radius, 1e-12), np.nan)
    scale[radius < 1e-12] = 1.0
    return points * scale[:, None]
