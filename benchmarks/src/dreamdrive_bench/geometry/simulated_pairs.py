"""Pairwise pointmaps as a network might give them, made from a drive of which all is known.

What the alignment is tested and measured with where no weights are at hand.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.geometry.backends.dust3r import PairMaps
from dreamdrive.scene.street.truth import DriveTruth

_FINEST_PX = 16.0  # noise is drawn on a grid on which its correlation length is at least so many pixels
_FARTHEST, _NEAREST = 5.0, 0.3  # of the true distance: where a mover is mistaken to be


@dataclass(frozen=True)
class Noise:
    """What is wrong with each pair, drawn anew for each but for ``common_focal``.

    Attributes:
        depth: Standard deviation of the log depth, smooth over ``smooth`` of the width.
        smooth: Correlation length of it, in widths.
        scale: Standard deviation of the pair's log scale.
        focal: Standard deviation of the log focal length that the pair believes in. Its pointmaps are the
            true points in the frame of its first camera, x and y stretched by true focal / believed focal.
        outliers: Share of pixels whose depth is off by a factor of 0.3 to 3; a third of them with high
            confidence.
        unseen: How much greater the error of depth is where the first camera does not look.
        mistaken: Whether a mover is put where it would have to stand for its motion in the image to come
            from the camera alone; else each image has it where it is at that frame.
        common_focal: How much longer than the true one the focal length is that all pairs believe in, as a
            fraction, on top of ``focal``: it does not average away.
        place: Standard deviation of a smooth error of each point along each axis, relative to its depth in
            its own image; that of ``depth`` and ``outliers`` leaves points on their pixels' rays.
    """

    depth: float = 0.05
    smooth: float = 1 / 8
    scale: float = 0.10
    focal: float = 0.05
    outliers: float = 0.10
    unseen: float = 1.0
    mistaken: bool = True
    common_focal: float = 0.0
    place: float = 0.0


@dataclass(frozen=True)
class Truth:
    """A drive.

    Attributes:
        depth: Along z (N, H, W); 0 where there is none (sky).
        world_from_camera: Poses (N, 4, 4).
        focal_px: Of all frames.
        offset_px: Where in a pixel its depth is true: 0 where pixels are counted as the network does, 0.5 at
            centres of pixels whose corner is at 0.
        principal_px: Column and row of the principal point, pixels counted from 0; None is the middle,
            (W/2, H/2).
        instance: Labels (N, H, W) of the moving things, from 1; 0 elsewhere.
        centres: Their places (B, N, 3) in the world at each frame, in the order of the labels.
    """

    depth: Float[np.ndarray, "n h w"]
    world_from_camera: Float[np.ndarray, "n 4 4"]
    focal_px: float
    offset_px: float = 0.0
    principal_px: tuple[float, float] | None = None
    instance: Int[np.ndarray, "n h w"] | None = None
    centres: Float[np.ndarray, "b n 3"] | None = None

    @property
    def middle_px(self) -> tuple[float, float]:
        """Column and row of the principal point."""
        height, width = self.depth.shape[1:]
        return (width / 2, height / 2) if self.principal_px is None else self.principal_px

    def mistaken(self, i: int, j: int, image: int) -> Float[np.ndarray, "h w"]:
        """Factor on the depth of what moves, for who takes it to stand still between frames i and j.

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
            ratio = _FARTHEST if left <= way @ way / _FARTHEST else max(way @ way / left, _NEAREST)
            factor[self.instance[image] == label] = ratio
        return factor


def truth_of(drive: DriveTruth) -> Truth:
    """What pairs of a drawn street are made from."""
    movers = [box for box in drive.boxes if box.moving]
    instance = np.zeros(drive.depth_m.shape, int)
    for label, box in enumerate(movers, start=1):
        instance[drive.instance == box.instance] = label
    return Truth(
        depth=drive.depth_m.astype(np.float64),
        world_from_camera=np.stack([camera.world_from_camera for camera in drive.cameras]),
        focal_px=float(drive.cameras[0].fx_px),
        offset_px=0.5,
        instance=instance,
        centres=np.array([box.world_from_box[:, :3, 3] for box in movers]).reshape(-1, len(instance), 3),
    )


def pair_maps(
    truth: Truth,
    edges: Int[np.ndarray, "e 2"],
    noise: Noise,
    seed: int = 0,
    dtype: type[np.floating] = np.float32,
) -> PairMaps:
    """Pointmaps and confidences of all edges; those of the sky are 1.

    Args:
        truth: The drive.
        edges: First and second image of each pair.
        noise: What is wrong with them.
        seed: Of the noise; that of an edge depends on its number alone.
        dtype: Of what is stored.
    """
    points: list[tuple[np.ndarray, np.ndarray]] = []
    confidence: list[tuple[np.ndarray, np.ndarray]] = []
    for edge, (i, j) in enumerate(edges.tolist()):
        random = np.random.default_rng([seed, edge])
        scale = np.exp(noise.scale * random.standard_normal())
        believed = np.exp(noise.focal * random.standard_normal()) * (1 + noise.common_focal)
        stretch = scale * np.array([1 / believed, 1 / believed, 1])
        sides = [_side(truth, (i, j), image, noise, random) for image in (i, j)]
        (first, trust), (second, other_trust) = sides
        points.append(((first * stretch).astype(dtype), (second * stretch).astype(dtype)))
        confidence.append((trust.astype(dtype), other_trust.astype(dtype)))
    return PairMaps(edges, tuple(points), tuple(confidence))


def _side(
    truth: Truth, pair: tuple[int, int], image: int, noise: Noise, random: np.random.Generator
) -> tuple[Float[np.ndarray, "h w 3"], Float[np.ndarray, "h w"]]:
    """Points of one image in the frame of the pair's first camera, and their confidence."""
    first_from_image = np.linalg.inv(truth.world_from_camera[pair[0]]) @ truth.world_from_camera[image]
    worse = np.ones(truth.depth.shape[1:])
    if noise.unseen != 1:
        inside = _looked_at(_moved(_lifted(truth.depth[image], truth), first_from_image), truth)
        worse = np.where(inside, 1.0, noise.unseen)
    depth, trust = _disturbed(truth, image, noise, worse, random)
    if noise.mistaken:
        depth = depth * truth.mistaken(*pair, image)
    points = _moved(_lifted(depth, truth), first_from_image)
    if noise.place:
        height, width = depth.shape
        axes = [smooth_noise(height, width, noise.smooth * width, random) for _ in range(3)]
        points = points + noise.place * depth[..., None] * np.stack(axes, axis=-1)
    return points, trust


def _disturbed(
    truth: Truth, image: int, noise: Noise, worse: Float[np.ndarray, "h w"], random: np.random.Generator
) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w"]]:
    depth = truth.depth[image].copy()
    height, width = depth.shape
    sky = depth == 0
    depth *= np.exp(noise.depth * worse * smooth_noise(height, width, noise.smooth * width, random))
    trust = np.exp(random.normal(1.5, 0.4, depth.shape)) + 1
    wrong = random.random(depth.shape) < noise.outliers
    depth = np.where(wrong, depth * np.exp(random.uniform(np.log(0.3), np.log(3), depth.shape)), depth)
    doubted = wrong & (random.random(depth.shape) < 2 / 3)
    trust = np.where(doubted, 1 + 0.3 * random.random(depth.shape), trust)
    depth = np.where(sky, random.uniform(50, 500), depth)
    return depth, np.where(sky, 1.0, trust)


def smooth_noise(
    height: int, width: int, length: float, random: np.random.Generator
) -> Float[np.ndarray, "h w"]:
    """Gaussian noise of mean 0 and standard deviation about 1, correlated over ``length`` px."""
    coarser = max(1, int(length / _FINEST_PX))
    if coarser > 1:
        small = smooth_noise(-(-height // coarser), -(-width // coarser), length / coarser, random)
        return cv2.resize(small, None, fx=coarser, fy=coarser, interpolation=cv2.INTER_CUBIC)[:height, :width]
    margin = int(3 * length)
    white = random.standard_normal((height + 2 * margin, width + 2 * margin))
    blurred = cv2.GaussianBlur(white, (0, 0), length / np.sqrt(2))[
        margin : margin + height, margin : margin + width
    ]
    return blurred * np.sqrt(4 * np.pi) * length / np.sqrt(2)


def _lifted(depth: Float[np.ndarray, "h w"], truth: Truth) -> Float[np.ndarray, "h w 3"]:
    height, width = depth.shape
    cx, cy = truth.middle_px
    columns = (np.arange(width) + truth.offset_px - cx) / truth.focal_px
    rows = (np.arange(height) + truth.offset_px - cy) / truth.focal_px
    return np.stack([columns * depth, rows[:, None] * depth, depth], axis=-1)


def _moved(points: Float[np.ndarray, "h w 3"], pose: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "h w 3"]:
    return points @ pose[:3, :3].T + pose[:3, 3]


def _looked_at(points: Float[np.ndarray, "h w 3"], truth: Truth) -> Bool[np.ndarray, "h w"]:
    """Which points (H, W) a camera at the origin has in its picture, behind other things or not."""
    height, width = points.shape[:2]
    x, y, z = np.moveaxis(points, -1, 0)
    pixel = np.maximum(z, 1e-9) / truth.focal_px
    cx, cy = truth.middle_px
    # A pixel more on all sides: at the very edge rounding would decide.
    inside = (x >= -pixel * (cx + 1)) & (x <= pixel * (width - cx + 1))
    return (z > 0) & inside & (y >= -pixel * (cy + 1)) & (y <= pixel * (height - cy + 1))
