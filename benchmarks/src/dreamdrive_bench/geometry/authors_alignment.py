"""Global alignment as its authors' program does it: raw parameters, all edges stacked, Adam.

The measure of what is done here; no clip goes through it. With the points X of image i in the world, the
points P of an edge, its similarity T and w = ln confidence (Wang et al. 2024, eq. 5):
    L = sum over edges and both images, sum over pixels, w |X - T P| / A
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from torch import Tensor

from dreamdrive.geometry.backends.dust3r import PairMaps
from dreamdrive.geometry.backends.dust3r.align import BASE_SCALE, AlignmentStart, Graph
from dreamdrive.scene.similarity import Similarity

_FOCAL_BREAK = 20.0
Normalisation = Literal["pooled", "modular"]
Schedule = Literal["cosine", "linear"]
BETAS = (0.9, 0.9)


@dataclass(frozen=True)
class Raw:
    """Parameters as the authors' program has them; quaternions are xyzw and of any length."""

    pw_poses: Float[Tensor, "e 8"]  # of edges: quaternion, signed log1p of translation / scale, log scale
    im_poses: Float[Tensor, "n 7"]  # quaternion, signed log1p of translation of world_from_camera
    im_focals: Float[Tensor, "n 1"]  # 20 times the log focal length
    im_depthmaps: Float[Tensor, "n a"]  # log depth, row by row, padded at the end

    @property
    def tensors(self) -> list[Tensor]:
        """All of them."""
        return [self.pw_poses, self.im_poses, self.im_focals, self.im_depthmaps]


def raw_parameters(start: AlignmentStart) -> Raw:
    """The parameters of a start, float32, ready for gradients."""
    most = max(depth.size for depth in start.depth)
    depth = [np.pad(np.log(depth).ravel(), (0, most - depth.size)) for depth in start.depth]
    pairs = [
        [*_quaternion(p.rotation), *_signed_log1p(p.translation / p.scale), np.log(p.scale)]
        for p in start.pairs
    ]
    poses = [[*_quaternion(pose[:3, :3]), *_signed_log1p(pose[:3, 3])] for pose in start.world_from_camera]
    arrays = (pairs, poses, _FOCAL_BREAK * np.log(start.focals_px)[:, None], np.stack(depth))
    return Raw(*(torch.tensor(np.asarray(a), dtype=torch.float32, requires_grad=True) for a in arrays))


def half_areas(maps: PairMaps, normalisation: Normalisation) -> Float[np.ndarray, "e 2"]:
    """The divisor A of each edge's first and second image.

    ``pooled`` is the number of pixels of all first images, or of all second images; ``modular`` the mean over
    edges of the means over pixels. They are the same where all images are of one size.
    """
    areas = np.array([[side.size for side in pair] for pair in maps.confidence], dtype=np.float64)
    if normalisation == "modular":
        return len(areas) * areas
    return np.broadcast_to(areas.sum(axis=0), areas.shape).copy()


class Objective:
    """The loss of raw parameters, differentiable."""

    def __init__(self, maps: PairMaps, graph: Graph, normalisation: Normalisation = "pooled") -> None:
        self.sizes = graph.sizes
        most = max(height * width for height, width in graph.sizes)
        areas = half_areas(maps, normalisation)
        self.images = [torch.from_numpy(maps.edges[:, side].astype(np.int64)) for side in (0, 1)]
        self.points, self.weights = [], []
        for side in (0, 1):
            xyz = torch.zeros(len(maps.edges), most, 3)
            weight = torch.zeros(len(maps.edges), most)
            for edge in range(len(maps.edges)):
                trust = torch.from_numpy(np.log(maps.confidence[edge][side], dtype=np.float32).ravel())
                flat = torch.from_numpy(maps.points[edge][side].astype(np.float32).reshape(-1, 3))
                weight[edge, : len(trust)] = trust / areas[edge, side]
                xyz[edge, : len(trust)] = torch.where(trust[:, None] > 0, flat, 0.0)
            self.points.append(xyz)
            self.weights.append(weight)
        self.grid = torch.zeros(len(graph), most, 2)
        for image, (height, width) in enumerate(graph.sizes):
            columns, rows = np.meshgrid(np.arange(width) - width / 2, np.arange(height) - height / 2)
            pixels = np.stack([columns.ravel(), rows.ravel()], axis=1).astype(np.float32)
            self.grid[image, : height * width] = torch.from_numpy(pixels)

    def __call__(self, raw: Raw) -> Tensor:
        """The loss, a scalar."""
        world = self.world_points(raw)
        scales, rotations, translations = pair_transforms(raw)
        turns, shifts = scales[:, None, None] * rotations, scales[:, None] * translations
        loss = world.new_zeros(())
        for image, points, weight in zip(self.images, self.points, self.weights, strict=True):
            placed = points @ turns.mT + shifts[:, None]
            loss = loss + (weight * torch.linalg.vector_norm(world[image] - placed, dim=-1)).sum()
        return loss

    def world_points(self, raw: Raw) -> Float[Tensor, "n a 3"]:
        """X = R [(u - cx) d / f, (v - cy) d / f, d] + t of all pixels, padded at the end."""
        depth = raw.im_depthmaps.exp()[..., None]
        focals = (raw.im_focals / _FOCAL_BREAK).exp()[:, None]
        local = torch.cat([depth * self.grid / focals, depth], dim=-1)
        return local @ _rotations(raw.im_poses[:, :4]).mT + _signed_expm1(raw.im_poses[:, 4:7])[:, None]

    def start_of(self, raw: Raw) -> AlignmentStart:
        """The parameters as poses, focal lengths and depths."""
        with torch.no_grad():
            poses = np.tile(np.eye(4), (len(raw.im_poses), 1, 1))
            poses[:, :3, :3] = _rotations(raw.im_poses[:, :4].double()).numpy()
            poses[:, :3, 3] = _signed_expm1(raw.im_poses[:, 4:7].double()).numpy()
            focals = (raw.im_focals[:, 0].double() / _FOCAL_BREAK).exp().numpy()
            scales, rotations, translations = (part.double().numpy() for part in pair_transforms(raw))
            depth = raw.im_depthmaps.exp().numpy()
        pairs = [
            Similarity(float(s), r, s * t) for s, r, t in zip(scales, rotations, translations, strict=True)
        ]
        maps = [d[: h * w].reshape(h, w) for d, (h, w) in zip(depth, self.sizes, strict=True)]
        return AlignmentStart(poses, focals, tuple(maps), tuple(pairs))


def descend(
    objective: Objective,
    raw: Raw,
    steps: int = 300,
    *,
    schedule: Schedule = "cosine",
    of: int | None = None,
    rate: float = 0.01,
    last_rate: float = 1e-6,
) -> Float[np.ndarray, " _"]:
    """Adam with a falling rate moves the parameters in place; the loss before each step comes back.

    A step moves a parameter by about the rate at most, and the rates of 300 steps sum to 1.5: the log of a
    focal length, being a 20th of its parameter, never moves by more than 0.075.
    The rate falls over a whole schedule ``of`` so many steps, of which the first ``steps`` are made.
    """
    optimiser = torch.optim.Adam(raw.tensors, lr=rate, betas=BETAS, eps=1e-8)
    losses: list[float] = []
    for step in range(steps):
        t = step / (of or steps)
        share = (1 + np.cos(np.pi * t)) / 2 if schedule == "cosine" else 1 - t
        optimiser.param_groups[0]["lr"] = float(last_rate + (rate - last_rate) * share)
        optimiser.zero_grad()
        loss = objective(raw)
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
    return np.array(losses)


def pair_transforms(raw: Raw) -> tuple[Float[Tensor, " e"], Float[Tensor, "e 3 3"], Float[Tensor, "e 3"]]:
    """Scale s, rotation R and translation t of X = s (R P + t); the scales have a geometric mean of 0.5."""
    logs = raw.pw_poses[:, 7]
    scales = (logs - logs.mean() + float(np.log(BASE_SCALE))).exp()
    return scales, _rotations(raw.pw_poses[:, :4]), _signed_expm1(raw.pw_poses[:, 4:7])


def _rotations(quaternions: Float[Tensor, "n 4"]) -> Float[Tensor, "n 3 3"]:
    x, y, z, w = torch.nn.functional.normalize(quaternions, dim=-1).unbind(-1)
    rows = [
        torch.stack([x * x - y * y - z * z + w * w, 2 * (x * y - z * w), 2 * (x * z + y * w)], dim=-1),
        torch.stack([2 * (x * y + z * w), -x * x + y * y - z * z + w * w, 2 * (y * z - x * w)], dim=-1),
        torch.stack([2 * (x * z - y * w), 2 * (y * z + x * w), -x * x - y * y + z * z + w * w], dim=-1),
    ]
    return torch.stack(rows, dim=-2)


def _quaternion(rotation: Float[np.ndarray, "3 3"]) -> list[float]:
    return Rotation.from_matrix(rotation).as_quat().tolist()


def _signed_log1p(values: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    return np.sign(values) * np.log1p(np.abs(values))


def _signed_expm1(values: Float[Tensor, "n 3"]) -> Float[Tensor, "n 3"]:
    return values.sign() * values.abs().expm1()
