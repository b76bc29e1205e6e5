"""A small drive that is drawn in no time, and how far a path is off."""

import cv2
import numpy as np

from dreamdrive_bench.geometry.simulated_pairs import Truth


def window(count: int, reach: int = 3) -> np.ndarray:
    """Edges (E, 2) of the symmetric sliding window that does not close."""
    pairs = [(i, j) for i in range(count) for j in range(i + 1, min(i + reach, count - 1) + 1)]
    return np.array(pairs + [(j, i) for i, j in pairs])


def street(
    frames: int,
    width: int,
    height: int,
    *,
    step: float = 0.8,
    turn: float = 0.03,
    seed: int = 0,
    principal_px: tuple[float, float] | None = None,
    focal: float = 0.9,
) -> Truth:
    """A drive between two walls over a level road under the sky, with bumps; ``focal`` is in widths."""
    cx, cy = principal_px or (width / 2, height / 2)
    random = np.random.default_rng(seed)
    focal_px = focal * width
    columns, rows = np.meshgrid((np.arange(width) - cx) / focal_px, (np.arange(height) - cy) / focal_px)
    rays = np.stack([columns, rows, np.ones_like(columns)], axis=-1)
    poses, yaw, place = [], 0.0, np.zeros(3)
    for frame in range(frames):
        pose = np.eye(4)
        pose[:3, :3] = cv2.Rodrigues(np.array([0.01 * np.sin(frame), yaw, 0.01 * np.cos(frame)]))[0]
        pose[:3, 3] = place
        poses.append(pose)
        yaw += turn * np.sin(frame / 4)
        place = place + step * np.array([np.sin(yaw), 0.02 * np.sin(frame), np.cos(yaw)])
    bumps = random.uniform(0, 2 * np.pi, 3)
    depths = [_ray_depth(rays, pose, bumps) for pose in poses]
    return Truth(np.stack(depths), np.stack(poses), focal_px, principal_px=principal_px)


def pinholes(truth: Truth) -> np.ndarray:
    """The true pinholes (N, 3, 3), pixels counted from 0."""
    (cx, cy), focal = truth.middle_px, truth.focal_px
    return np.tile(np.array([[focal, 0, cx], [0, focal, cy], [0, 0, 1]]), (len(truth.depth), 1, 1))


def _ray_depth(rays: np.ndarray, pose: np.ndarray, bumps: np.ndarray) -> np.ndarray:
    ways, at = rays @ pose[:3, :3].T, pose[:3, 3]
    depth = np.full(rays.shape[:2], np.inf)
    for axis, where in ((0, -5.0), (0, 6.0), (1, 1.5), (2, 70.0)):
        way = np.where(np.abs(ways[..., axis]) < 1e-6, 1e-6, ways[..., axis])
        reach = (where - at[axis]) / way
        for _ in range(3):  # the wall is where its bump puts it: found by fixed point
            along = (at + reach[..., None] * ways)[..., 2]
            reach = (where + (0.4 * np.sin(along / 2 + bumps[axis]) if axis == 0 else 0.0) - at[axis]) / way
        height = (at + reach[..., None] * ways)[..., 1]
        hit = (reach > 0.5) & ((height > -6) | (axis == 1))
        depth = np.where(hit & (reach < depth), reach, depth)
    return np.where(np.isfinite(depth), depth, 0)


def path_error(found: np.ndarray, true: np.ndarray) -> float:
    """RMSE of camera centres after the best similarity, over the length of the true path."""
    x, y = found[:, :3, 3], true[:, :3, 3]
    a, b = x - x.mean(axis=0), y - y.mean(axis=0)
    left, singular, right = np.linalg.svd(b.T @ a)
    signs = np.array([1, 1, np.sign(np.linalg.det(left @ right))])
    scale = (singular * signs).sum() / np.square(a).sum()
    missed = b - scale * a @ ((left * signs) @ right).T
    length = np.linalg.norm(np.diff(y, axis=0), axis=1).sum()
    return float(np.sqrt(np.square(missed).sum(axis=1).mean()) / length)
