"""Pairwise pointmaps as a network might give them, made from true depth, poses and focal length."""

from dataclasses import dataclass

import cv2
import numpy as np

from dreamdrive.geometry.dust3r.pairmaps import PairMaps


@dataclass(frozen=True)
class Noise:
    """What is wrong with each pair, all of it drawn anew for each.

    Attributes:
        depth: Standard deviation of the log depth, smooth over ``smooth`` of the width.
        smooth: Correlation length of it, in widths.
        scale: Standard deviation of the pair's log scale.
        focal: Standard deviation of the log focal length that the pair believes in. Its pointmaps are the
            true points in the frame of its first camera, x and y stretched by true focal / believed focal.
        outliers: Share of pixels whose depth is off by a factor of 0.3 to 3; a third of them with high
            confidence.
    """

    depth: float = 0.05
    smooth: float = 1 / 8
    scale: float = 0.10
    focal: float = 0.05
    outliers: float = 0.10


@dataclass(frozen=True)
class Truth:
    """A drive.

    Attributes:
        depth: (N, H, W); 0 where there is none (sky).
        world_from_camera: Poses (N, 4, 4).
        focal_px: Of all frames.
        offset_px: Where in a pixel its depth is true: 0 where pixels are counted as the network does, 0.5 at
            centres of pixels whose corner is at 0.
        instance: Labels (N, H, W) of the moving things, from 1; 0 elsewhere.
        centres: Their places (B, N, 3) in the world at each frame, in the order of the labels.
    """

    depth: np.ndarray
    world_from_camera: np.ndarray
    focal_px: float
    offset_px: float = 0.0
    instance: np.ndarray | None = None
    centres: np.ndarray | None = None

    def mistaken(self, i: int, j: int, image: int) -> np.ndarray:
        """Factor (H, W) on the depth of what moves, for who takes it to stand still between frames i and j.

        Seen from a camera that goes b, a thing that goes s along with it is as far away as it would have to
        be for its motion in the image to come from b alone: b / (b - s), up to 5 times. Oncoming things come
        closer.
        """
        factor = np.ones(self.depth.shape[1:])
        if self.instance is None or self.centres is None:
            return factor
        way = self.world_from_camera[j, :3, 3] - self.world_from_camera[i, :3, 3]
        for label, centres in enumerate(self.centres, start=1):
            left = way @ way - way @ (centres[j] - centres[i])
            ratio = 5.0 if left <= way @ way / 5 else max(way @ way / left, 0.3)
            factor[self.instance[image] == label] = ratio
        return factor


def window(count: int, reach: int = 3) -> np.ndarray:
    """Edges (E, 2) of the symmetric sliding window that does not close."""
    pairs = [(i, j) for i in range(count) for j in range(i + 1, min(i + reach, count - 1) + 1)]
    return np.array(pairs + [(j, i) for i, j in pairs])


def street(
    frames: int, width: int, height: int, *, step: float = 0.8, turn: float = 0.03, seed: int = 0
) -> Truth:
    """A drive between two walls over a level road under the sky, with bumps on all of it."""
    random = np.random.default_rng(seed)
    focal = 0.9 * width
    columns, rows = np.meshgrid(
        (np.arange(width) - width / 2) / focal, (np.arange(height) - height / 2) / focal
    )
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
    return Truth(np.stack(depths), np.stack(poses), focal)


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


def pair_maps(
    truth: Truth, edges: np.ndarray, noise: Noise, seed: int = 0, dtype: type = np.float32
) -> PairMaps:
    """Pointmaps and confidences of all edges."""
    points, confidence = [], []
    for edge, (i, j) in enumerate(edges):
        random = np.random.default_rng([seed, edge])
        scale = np.exp(noise.scale * random.standard_normal())
        believed = np.exp(noise.focal * random.standard_normal())
        maps, trusts = [], []
        for image in (int(i), int(j)):
            depth, trust = _disturbed(truth, image, noise, random)
            xyz = _lifted(depth * truth.mistaken(int(i), int(j), image), truth)
            seen = np.linalg.inv(truth.world_from_camera[i]) @ truth.world_from_camera[image]
            xyz = xyz @ seen[:3, :3].T + seen[:3, 3]
            xyz *= scale * np.array([1 / believed, 1 / believed, 1])
            maps.append(xyz.astype(dtype))
            trusts.append(trust.astype(dtype))
        points.append(tuple(maps))
        confidence.append(tuple(trusts))
    return PairMaps(edges, tuple(points), tuple(confidence))


def _disturbed(
    truth: Truth, image: int, noise: Noise, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    depth = truth.depth[image].copy()
    height, width = depth.shape
    sky = depth == 0
    depth *= np.exp(noise.depth * smooth_noise(height, width, noise.smooth * width, random))
    trust = np.exp(random.normal(1.5, 0.4, depth.shape)) + 1
    wrong = random.random(depth.shape) < noise.outliers
    depth = np.where(wrong, depth * np.exp(random.uniform(np.log(0.3), np.log(3), depth.shape)), depth)
    doubted = wrong & (random.random(depth.shape) < 2 / 3)
    trust = np.where(doubted, 1 + 0.3 * random.random(depth.shape), trust)
    depth = np.where(sky, random.uniform(50, 500), depth)
    return depth, np.where(sky, 1.0, trust)


def smooth_noise(height: int, width: int, length: float, random: np.random.Generator) -> np.ndarray:
    """Gaussian noise (H, W) of mean 0 and standard deviation about 1, correlated over ``length`` px."""
    margin = int(3 * length)
    white = random.standard_normal((height + 2 * margin, width + 2 * margin))
    blurred = cv2.GaussianBlur(white, (0, 0), length / np.sqrt(2))[
        margin : margin + height, margin : margin + width
    ]
    return blurred * np.sqrt(4 * np.pi) * length / np.sqrt(2)


def _lifted(depth: np.ndarray, truth: Truth) -> np.ndarray:
    height, width = depth.shape
    columns = (np.arange(width) + truth.offset_px - width / 2) / truth.focal_px
    rows = (np.arange(height) + truth.offset_px - height / 2) / truth.focal_px
    return np.stack([columns * depth, rows[:, None] * depth, depth], axis=-1)


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
