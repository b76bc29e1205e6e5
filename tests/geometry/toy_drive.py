"""A textured street seen along any path, turns included: small clips with exact poses for the pose half."""

from functools import lru_cache

import cv2
import numpy as np

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known

WIDTH, HEIGHT = 320, 180
FOCAL_PX = 272.0
HEIGHT_M = 1.5
HOOD_ROWS = 14


def texture(seed: int) -> np.ndarray:
    """Periodic noise of several scales (1024, 1024) in grey levels."""
    rng = np.random.default_rng(seed)
    total = np.zeros((1024, 1024), np.float32)
    for scale in (2.0, 4.0, 10.0):
        noise = rng.normal(size=(1024, 1024)).astype(np.float32)
        noise = cv2.GaussianBlur(np.tile(noise, (2, 2)), (0, 0), scale)[512:1536, 512:1536]
        total += noise / noise.std()
    return np.clip(120 + 28 * total, 0, 255)


TEXTURES = [texture(seed) for seed in range(4)]


PER_M = (24, 14, 14, 5)


def _paint(index: int, u_m: np.ndarray, v_m: np.ndarray) -> np.ndarray:
    """Texture at a metric place; far walls are painted coarsely, so that they do not alias."""
    u, v = (np.mod(place * PER_M[index], 1023).astype(np.float32) for place in (u_m, v_m))
    return cv2.remap(TEXTURES[index], u, v, cv2.INTER_LINEAR)


def render(camera: Camera) -> np.ndarray:
    """One RGB frame; road at y = 1.5 m, walls in four directions, grey sky."""
    origin = camera.world_from_camera[:3, 3]
    rays = camera.rays() @ camera.world_from_camera[:3, :3].T
    best = np.full(rays.shape[:2], np.inf)
    grey = np.full(rays.shape[:2], 200, np.float32)
    planes = [
        (1, HEIGHT_M, 0, 2, 0),
        (0, -9.0, 2, 1, 1),
        (0, 11.0, 2, 1, 2),
        (2, 45.0, 0, 1, 3),
        (0, 45.0, 2, 1, 3),
    ]
    for axis, place, first, second, index in planes:
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = (place - origin[axis]) / rays[..., axis]
            hit = origin + distance[..., None] * rays
        good = np.isfinite(distance) & (distance > 0.1) & (distance < best) & (hit[..., 1] > -7)
        if index == 2:
            good &= (hit[..., 2] < 14) | (hit[..., 2] > 30)
        hit = np.where(np.isfinite(hit), hit, 0)
        grey[good] = _paint(index, hit[..., first], hit[..., second])[good]
        best[good] = distance[good]
    return np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=-1)


@lru_cache(maxsize=64)
def _rendered(pose: bytes) -> np.ndarray:
    """The frame from a pose, given as its numbers: many tests drive the same way."""
    truth = Camera(FOCAL_PX, FOCAL_PX, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT)
    return render(truth.at(np.frombuffer(pose).reshape(4, 4)))


def turning(count: int, step_m: float = 0.5, yaw_deg: float = 5.0) -> np.ndarray:
    """A path of constant speed and yaw rate (to the right)."""
    poses = np.tile(np.eye(4), (count, 1, 1))
    position = np.zeros(3)
    for index in range(count):
        angle = np.radians(yaw_deg * index)
        rotation = np.array(
            [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
        )
        poses[index, :3, :3], poses[index, :3, 3] = rotation, position
        position = position + step_m * rotation[:, 2]
    return poses


def straight(steps_m: list[float]) -> np.ndarray:
    """A straight path with the given steps."""
    poses = np.tile(np.eye(4), (len(steps_m) + 1, 1, 1))
    poses[1:, 2, 3] = np.cumsum(steps_m)
    return poses


def make_clip(
    poses: np.ndarray, calibrated: bool = True, prior_px: float = FOCAL_PX, hood: bool = False
) -> Clip:
    """The toy street along a path; with ``hood``, a strip of bonnet at the bottom."""
    frames = np.stack([_rendered(pose.tobytes()) for pose in poses])
    if hood:
        frames[:, -HOOD_ROWS:] = (30, 40, 60)
        frames[:, -HOOD_ROWS : -HOOD_ROWS + 2] = 230
    count = len(poses)
    return Clip(
        frames=frames,
        times_s=0.1 * np.arange(count),
        camera=np.zeros(count, int),
        rig=(Camera(prior_px, prior_px, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT),),
        valid=np.ones((count, HEIGHT, WIDTH), bool),
        held_out=np.zeros(count, bool),
        source_index=np.arange(count),
        known=Known(intrinsics=calibrated),
    )


def path_error(found: np.ndarray, truth: np.ndarray) -> float:
    """RMSE of the positions after a similarity alignment (Umeyama 1991) over the length of the true path."""
    source, target = found[:, :3, 3], truth[:, :3, 3]
    a, b = source - source.mean(0), target - target.mean(0)
    left, values, right = np.linalg.svd(b.T @ a / len(a))
    sign = np.diag([1, 1, np.sign(np.linalg.det(left @ right))])
    scale = np.trace(np.diag(values) @ sign) / (a**2).sum(1).mean()
    error = np.linalg.norm(scale * a @ (left @ sign @ right).T - b, axis=1)
    return float(np.sqrt((error**2).mean()) / np.linalg.norm(np.diff(target, axis=0), axis=1).sum())
