"""The road as a plane, found by warping the road between frames."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.geometry.classical.ground_points import Plane, up_direction
from dreamdrive.scene.camera import Camera

ROWS, COLUMNS = (0.62, 0.97), (0.25, 0.75)
HEIGHTS = 56
RANGE_STEPS = (0.08, 12.0)
REFERENCES, NEIGHBOURS = 7, 3
MIN_TEXTURE = 2.0
NOISE = 2.0
MIN_PEAK = 0.05


@dataclass(frozen=True)
class Pair:
    """The road of one frame and the frame it is warped from."""

    reference: int
    source: int


class Road:
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
        height, width = grey.shape[1:]
        self.top, self.bottom = round(ROWS[0] * height), round(ROWS[1] * height)
        self.left, self.right = round(COLUMNS[0] * width), round(COLUMNS[1] * width)
        rows, columns = np.mgrid[self.top : self.bottom, self.left : self.right]
        self.pixels = np.stack([columns + 0.5, rows + 0.5, np.ones(rows.shape)], axis=-1)
        road = (slice(None), slice(self.top, self.bottom), slice(self.left, self.right))
        patches = grey[road].astype(np.float32)
        self.mean = np.stack([_box(patch) for patch in patches])
        self.variance = np.stack([_box(patch**2) for patch in patches]) - self.mean**2
        self.patches = patches
        self.textured = (self.variance > MIN_TEXTURE**2) & usable[road]

    def agreement(self, pair: Pair, normal: np.ndarray, offset: float) -> float:
        """Mean clipped NCC (5x5) of the textured road pixels when warped by the plane; NaN without any."""
        first, second = self.poses[pair.reference], self.poses[pair.source]
        height = float(normal @ first[:3, 3] + offset)
        if height <= 0:
            return 0.0
        relative = second[:3, :3].T @ first[:3, :3]
        shift = second[:3, :3].T @ (first[:3, 3] - second[:3, 3])
        plane = relative - np.outer(shift, first[:3, :3].T @ normal) / height
        matrix = self.intrinsics @ plane @ np.linalg.inv(self.intrinsics)
        mapped = (self.pixels @ matrix.T).astype(np.float32)
        depth = np.maximum(mapped[..., 2], 1e-6)
        x, y = mapped[..., 0] / depth - 0.5, mapped[..., 1] / depth - 0.5
        warped = cv2.remap(self.grey[pair.source], x, y, cv2.INTER_LINEAR, borderValue=0).astype(np.float32)
        rows, columns = self.grey.shape[1:]
        good = self.textured[pair.reference] & (mapped[..., 2] > 0)
        good &= (x > 2) & (y > 2) & (x < columns - 3) & (y < rows - 3)
        if good.sum() < 50:
            return float("nan")
        here, mean = self.patches[pair.reference], self.mean[pair.reference]
        other = _box(warped)
        covariance = _box(here * warped) - mean * other
        variance = _box(warped**2) - other**2
        ncc = covariance / np.sqrt((self.variance[pair.reference] + NOISE) * (np.maximum(variance, 0) + NOISE))
        return float(np.clip(ncc[good], 0, 1).mean())


def sweep(road: Road, heights: tuple[float, float] | None = None) -> Plane | None:
    """Best plane over height, pitch and roll, or None when the profile has no clear peak.

    Args:
        road: Frames, poses and intrinsics.
        heights: Range of camera heights to try, in the units of the poses; None tries 0.08 to 12 steps. A peak at
            either end of the range is what a failure looks like and is refused.
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
    return Plane(normal, offset, height, prominence, 1.0, 0.03)


def _box(image: np.ndarray) -> np.ndarray:
    return cv2.boxFilter(image, cv2.CV_32F, (5, 5), borderType=cv2.BORDER_REPLICATE)


def _pairs(poses: np.ndarray, typical: float) -> list[Pair]:
    """About seven reference frames spread over the clip with three neighbours at growing baselines each."""
    centres = poses[:, :3, 3]
    count = len(centres)
    pairs: list[Pair] = []
    for reference in np.unique(np.linspace(0, count - 1, min(REFERENCES, count)).round().astype(int)):
        apart = np.linalg.norm(centres - centres[reference], axis=1)
        for wanted in (1.0, 2.0, 3.0)[:NEIGHBOURS]:
            source = int(np.argmin(np.abs(apart - wanted * typical)))
            if source != reference and apart[source] > 0.3 * typical:
                pairs.append(Pair(int(reference), source))
    return sorted(set(pairs), key=lambda pair: (pair.reference, pair.source))


def _tilted(poses: np.ndarray, pitch_deg: float, roll_deg: float) -> np.ndarray:
    """Up, tilted about the mean right axis (pitch) and the mean forward axis (roll)."""
    up = up_direction(poses)
    forward = poses[:, :3, 2].mean(axis=0)
    forward -= (forward @ up) * up
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, up)
    normal = up + np.tan(np.radians(pitch_deg)) * forward + np.tan(np.radians(roll_deg)) * right
    return normal / np.linalg.norm(normal)


def _scorer(road: Road, pairs: Sequence[Pair]) -> Callable[[float, float, float], float]:
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
    """Coordinate search around the coarse peak, then a parabola over the height."""
    pitch = roll = 0.0
    for width in (1.0, 0.4):
        for _ in range(2):
            pitch = _best(lambda value: score(height, value, roll), pitch + width * np.linspace(-1.5, 1.5, 5))
            roll = _best(lambda value: score(height, pitch, value), roll + width * np.linspace(-1.0, 1.0, 5))
            height = float(
                np.exp(_best(lambda value: score(float(np.exp(value)), pitch, roll),
                             np.log(height) + width * np.log(ratio) * np.linspace(-1, 1, 5)))
            )
    pitch, roll = float(np.clip(pitch, -3, 3)), float(np.clip(roll, -2, 2))
    return height, pitch, roll


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
