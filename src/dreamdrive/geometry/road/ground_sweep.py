"""The road as a plane, found by warping the road between frames."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.optimize import minimize

from dreamdrive.geometry.road.ground_points import Plane, up_direction
from dreamdrive.scene.camera import Camera
from dreamdrive.vision.windows import window_px

ROWS, COLUMNS = (0.62, 0.97), (0.25, 0.75)
HEIGHTS = 56
RANGE_STEPS = (0.08, 12.0)
REFERENCES = 7
MIN_TEXTURE = 2.0
NOISE = 2.0
MIN_PEAK = 0.05
MIN_RADIAL = 0.1
STILL_NCC = 0.5
MIN_PIXELS = 50
EVALUATIONS = 80
SPREAD = 0.04


@dataclass(frozen=True, order=True)
class Pair:
    """The road of one frame and the frame it is warped from."""

    reference: int
    source: int


class RoadSweep:
    """The road trapezoid of a clip at 320 px and how well a plane explains it."""

    def __init__(
        self,
        grey: UInt8[np.ndarray, "f h w"],
        usable: Bool[np.ndarray, "f h w"],
        camera: Camera,
        world_from_camera: Float[np.ndarray, "f 4 4"],
    ) -> None:
        self.grey, self.poses = grey, world_from_camera
        self.intrinsics = camera.matrix
        self.inverse = np.linalg.inv(self.intrinsics)
        height, width = grey.shape[1:]
        rows, columns = np.mgrid[
            round(ROWS[0] * height) : round(ROWS[1] * height),
            round(COLUMNS[0] * width) : round(COLUMNS[1] * width),
        ]
        self.pixels = np.stack([columns + 0.5, rows + 0.5, np.ones(rows.shape)], axis=-1)
        road = (slice(None), slice(rows[0, 0], rows[-1, 0] + 1), slice(columns[0, 0], columns[0, -1] + 1))
        self.patches = grey[road].astype(np.float32)
        self.mean = np.stack([_box(patch) for patch in self.patches])
        self.variance = np.stack([_box(patch**2) for patch in self.patches]) - self.mean**2
        self.textured = (self.variance > MIN_TEXTURE**2) & usable[road]
        self._telling: dict[Pair, np.ndarray] = {}

    def agreement(self, pair: Pair, normal: np.ndarray, offset: float) -> float:
        """Mean clipped NCC (5x5) of the telling road pixels when warped by the plane; NaN with too few."""
        height = float(normal @ self.poses[pair.reference, :3, 3] + offset)
        if height <= 0:
            return 0.0
        ncc, inside = self._warp(pair, normal, 1 / height)
        good = inside & self.telling(pair)
        return float(np.clip(ncc[good], 0, 1).mean()) if good.sum() >= MIN_PIXELS else float("nan")

    def telling(self, pair: Pair) -> np.ndarray:
        """Pixels that can tell one plane from another.

        Texture must vary along the lines through the point the camera heads for: a lane line along them looks
        the same at any height. And what does not move at all once rotation is undone is no road: a car ahead
        that keeps its distance, or a reflection.
        """
        if pair not in self._telling:
            still, _ = self._warp(pair, np.array([0.0, -1.0, 0.0]), 0.0)
            self._telling[pair] = self.textured[pair.reference] & self._radial(pair) & (still < STILL_NCC)
        return self._telling[pair]

    def _radial(self, pair: Pair) -> np.ndarray:
        first, second = self.poses[pair.reference], self.poses[pair.source]
        towards = self.intrinsics @ (first[:3, :3].T @ (second[:3, 3] - first[:3, 3]))
        if abs(towards[2]) < 1e-9:
            return np.ones(self.pixels.shape[:2], bool)
        ray = self.pixels[..., :2] - towards[:2] / towards[2]
        ray = (ray / np.maximum(np.linalg.norm(ray, axis=-1, keepdims=True), 1e-9)).astype(np.float32)
        patch = self.patches[pair.reference]
        along_x = cv2.Scharr(patch, cv2.CV_32F, 1, 0, scale=1 / 32)
        along_y = cv2.Scharr(patch, cv2.CV_32F, 0, 1, scale=1 / 32)
        along = _box((along_x * ray[..., 0] + along_y * ray[..., 1]) ** 2)
        across = _box((along_x * ray[..., 1] - along_y * ray[..., 0]) ** 2)
        return (along > 1.0) & (along > MIN_RADIAL * across)

    def _warp(self, pair: Pair, normal: np.ndarray, inverse_height: float) -> tuple[np.ndarray, np.ndarray]:
        """NCC of the reference's road with the source warped by a plane, and where the warp falls inside."""
        first, second = self.poses[pair.reference], self.poses[pair.source]
        relative = second[:3, :3].T @ first[:3, :3]
        shift = second[:3, :3].T @ (first[:3, 3] - second[:3, 3])
        plane = relative - np.outer(shift, first[:3, :3].T @ normal) * inverse_height
        mapping = self.intrinsics @ plane @ self.inverse
        by_column = mapping[:, :1] * self.pixels[0, :, 0] + mapping[:, 2:]
        by_row = mapping[:, 1:2] * self.pixels[:, 0, 1]
        mapped = np.empty((3, *self.pixels.shape[:2]), np.float32)
        np.add(by_column[:, None], by_row[..., None], out=mapped, casting="same_kind")
        x, y = mapped[:2] / np.maximum(mapped[2], 1e-6) - 0.5
        warped = cv2.remap(self.grey[pair.source], x, y, cv2.INTER_LINEAR, borderValue=0).astype(np.float32)
        rows, columns = self.grey.shape[1:]
        inside = (mapped[2] > 0) & (x > 2) & (y > 2) & (x < columns - 3) & (y < rows - 3)
        mean = _box(warped)
        covariance = _box(self.patches[pair.reference] * warped) - self.mean[pair.reference] * mean
        variance = np.maximum(_box(warped**2) - mean**2, 0) + NOISE
        return covariance / np.sqrt((self.variance[pair.reference] + NOISE) * variance), inside


def sweep(road: RoadSweep, heights: tuple[float, float] | None = None) -> Plane | None:
    """Best plane over height, pitch and roll, or None when the profile has no clear peak.

    Without a range of camera heights, in the units of the poses, 0.08 to 12 steps are tried. A peak at either
    end of the range is what a failure looks like and is refused.
    """
    poses = road.poses
    step = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    if len(step) == 0 or step.max() <= 0:
        return None
    typical = float(np.median(step[step > 0.1 * step.max()]))
    pairs = _pairs(poses, typical)
    if not pairs:
        return None
    low, high = heights or (RANGE_STEPS[0] * typical, RANGE_STEPS[1] * typical)
    ladder = np.geomspace(low, high, HEIGHTS)
    coarse, score = _scorer(road, pairs[::2]), _scorer(road, pairs)
    profile = np.array([max(coarse(h, pitch, 0.0) for pitch in (-1.0, 0.0, 1.0)) for h in ladder])
    peak = int(profile.argmax())
    prominence = float(profile[peak] - np.median(profile))
    if not np.isfinite(prominence) or prominence < MIN_PEAK or peak in (0, 1, HEIGHTS - 2, HEIGHTS - 1):
        return None
    height, pitch, roll = _refine(score, float(ladder[peak]), float(ladder[1] / ladder[0]))
    normal = _tilted(poses, pitch, roll)
    offset = height - float(normal @ poses[:, :3, 3].mean(axis=0))
    return Plane(normal, offset, height, prominence, 1.0, SPREAD)


def _box(image: np.ndarray) -> np.ndarray:
    side = window_px(5, image.shape[1])
    return cv2.boxFilter(image, cv2.CV_32F, (side, side), borderType=cv2.BORDER_REPLICATE)


def _pairs(poses: np.ndarray, typical: float) -> list[Pair]:
    """About seven reference frames spread over the clip with three neighbours at growing baselines each."""
    centres = poses[:, :3, 3]
    count = len(centres)
    pairs: list[Pair] = []
    for reference in np.unique(np.linspace(0, count - 1, min(REFERENCES, count)).round().astype(int)):
        apart = np.linalg.norm(centres - centres[reference], axis=1)
        for wanted in (1.0, 2.0, 3.0):
            source = int(np.argmin(np.abs(apart - wanted * typical)))
            if source != reference and apart[source] > 0.3 * typical:
                pairs.append(Pair(int(reference), source))
    return sorted(set(pairs))


def _tilted(poses: np.ndarray, pitch_deg: float, roll_deg: float) -> np.ndarray:
    """Up, tilted about the mean right axis (pitch) and the mean forward axis (roll)."""
    up = up_direction(poses)
    forward = poses[:, :3, 2].mean(axis=0)
    forward -= (forward @ up) * up
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, up)
    normal = up + np.tan(np.radians(pitch_deg)) * forward + np.tan(np.radians(roll_deg)) * right
    return normal / np.linalg.norm(normal)


def _scorer(road: RoadSweep, pairs: Sequence[Pair]) -> Callable[[float, float, float], float]:
    centre = road.poses[:, :3, 3].mean(axis=0)

    def score(height: float, pitch_deg: float, roll_deg: float) -> float:
        normal = _tilted(road.poses, pitch_deg, roll_deg)
        offset = height - float(normal @ centre)
        values = np.array([road.agreement(pair, normal, offset) for pair in pairs])
        return float(values[np.isfinite(values)].mean()) if np.isfinite(values).any() else 0.0

    return score


def _refine(
    score: Callable[[float, float, float], float], height: float, ratio: float
) -> tuple[float, float, float]:
    """One search along each coordinate around the coarse peak, then the simplex of Nelder and Mead (1965).

    Height and pitch trade against each other along a ridge on which a search by coordinates alone stops 1.5 %
    beside the true height.
    """
    log = np.log(height)
    pitch = _best(lambda value: score(height, value, 0.0), np.linspace(-1.5, 1.5, 5))
    roll = _best(lambda value: score(height, pitch, value), np.linspace(-1.0, 1.0, 5))
    log = _best(
        lambda value: score(float(np.exp(value)), pitch, roll), log + np.log(ratio) * np.linspace(-1, 1, 5)
    )
    start = np.array([log, pitch, roll])
    corners = start + np.array([[0, 0, 0], [0.05, 0, 0], [0, 0.5, 0], [0, 0, 0.5]])

    def loss(at: np.ndarray) -> float:
        return -score(float(np.exp(at[0])), float(at[1]), float(at[2]))

    found = minimize(
        loss,
        start,
        method="Nelder-Mead",
        options={"initial_simplex": corners, "maxfev": EVALUATIONS, "xatol": 0.005, "fatol": 1e-4},
    )
    log, pitch, roll = found.x
    return float(np.exp(log)), float(np.clip(pitch, -3, 3)), float(np.clip(roll, -2, 2))


def _best(score: Callable[[float], float], values: np.ndarray) -> float:
    """Maximum over evenly spaced values, to the vertex of the parabola through it and its neighbours."""
    scores = np.array([score(float(value)) for value in values])
    top = int(scores.argmax())
    if 0 < top < len(values) - 1:
        before, here, after = scores[top - 1 : top + 2]
        bend = before - 2 * here + after
        if bend < 0:
            return float(values[top] + 0.5 * (before - after) / bend * (values[1] - values[0]))
    return float(values[top])
