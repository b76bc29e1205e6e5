"""Lens distortion of points: OpenCV's polynomial models and its fisheye model."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.errors import InputError

_NEWTON_STEPS = 20
_STEP = 1e-6
_TOLERANCE = 1e-7
"""Largest error of an inverted point, in units of the focal length: under a thousandth of a pixel."""


MOST_BEND = 1e4
"""Largest coefficient: calibrations of narrow lenses have hundreds."""


def check_bend(coefficients: Sequence[float], where: str) -> None:
    """Refuse coefficients that are those of no lens."""
    for each in coefficients:
        if abs(each) > MOST_BEND:
            raise InputError(
                f"{where}: the distortion coefficient {each:g} is that of no lens; expected numbers of "
                f"OpenCV's models, at most {MOST_BEND:g}"
            )


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
        return _polynomial(points, coefficients)

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
        if self.model == "fisheye":
            radius = _fisheye_radius(angle, k)
        else:
            radius = np.tan(angle) * _radial(np.tan(angle) ** 2, _padded(k))
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


def _radial(square: Float[np.ndarray, " n"], c: Float[np.ndarray, "14"]) -> Float[np.ndarray, " n"]:
    """The rational radial factor of OpenCV's model at squared radii."""
    above = 1 + square * (c[0] + square * (c[1] + square * c[4]))
    return above / (1 + square * (c[5] + square * (c[6] + square * c[7])))


def _polynomial(points: Float[np.ndarray, "n 2"], given: Float[np.ndarray, " k"]) -> Float[np.ndarray, "n 2"]:
    """OpenCV's model: rational radial, tangential, thin prism, and tilt of the sensor."""
    c = _padded(given)
    x, y = points[:, 0], points[:, 1]
    square, cross = x * x + y * y, 2 * x * y
    radial = _radial(square, c)
    u = x * radial + c[2] * cross + c[3] * (square + 2 * x * x) + square * (c[8] + square * c[9])
    v = y * radial + c[2] * (square + 2 * y * y) + c[3] * cross + square * (c[10] + square * c[11])
    if not c[12:].any():
        return np.stack([u, v], axis=1)
    tilted = np.stack([u, v, np.ones_like(u)], axis=1) @ _tilt(*c[12:]).T
    return tilted[:, :2] / tilted[:, 2:]


def _tilt(x_rad: float, y_rad: float) -> Float[np.ndarray, "3 3"]:
    """Projection onto a sensor turned about its x and then its y axis."""
    cx, sx, cy, sy = np.cos(x_rad), np.sin(x_rad), np.cos(y_rad), np.sin(y_rad)
    turn = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]]) @ np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
    back = np.array([[turn[2, 2], 0, -turn[0, 2]], [0, turn[2, 2], -turn[1, 2]], [0, 0, 1]])
    return back @ turn


def _padded(given: Float[np.ndarray, " k"]) -> Float[np.ndarray, "14"]:
    return np.concatenate([given, np.zeros(14 - len(given))])


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
