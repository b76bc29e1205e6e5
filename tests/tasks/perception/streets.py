"""Small networks and streets for the tests."""

from dataclasses import replace

import numpy as np
import torch
from torch import Tensor, nn

from dreamdrive.tasks.perception import (
    BevBatch,
    BevGrid,
    BevTruth,
    CrossViewTransformer,
    CvtOptions,
    ImageSize,
)

TINY = CvtOptions(
    image=ImageSize(32, 64, 4),
    grid=BevGrid(16, 16, 40.0, 40.0),
    classes=("vehicle", "road"),
    dim=16,
    heads=2,
    head_dim=8,
    bottlenecks=(1, 1),
    decoder=(16, 8),
    head=8,
)

ON_STREET_TRUNK = CvtOptions(
    ImageSize(32, 64, 4), BevGrid(16, 16), ("vehicle", "road"), "street", dim=16, heads=2, head_dim=8,
    bottlenecks=(1, 1), decoder=(16, 16, 8), head=8,
)  # fmt: skip


class Stub(nn.Module):
    """Two convolutions in place of a trunk, as in the golden numbers."""

    def __init__(self, channels: tuple[int, int] = (6, 10)) -> None:
        super().__init__()
        self.channels = channels
        self.a = nn.Conv2d(3, channels[0], 4, 4)
        self.b = nn.Conv2d(channels[0], channels[1], 4, 4)

    def forward(self, pictures: Tensor) -> list[Tensor]:
        fine = self.a(pictures).relu()
        return [fine, self.b(fine).relu()]


def tiny_network(seed: int = 0, **changed: object) -> CrossViewTransformer:
    torch.manual_seed(seed)
    return CrossViewTransformer(replace(TINY, **changed), Stub())


def cameras(batch: int, count: int) -> tuple[Tensor, Tensor]:
    """Intrinsics and extrinsics of cameras 1.5 m above the ground that look around."""
    intrinsics = torch.tensor([[40.0, 0, 32], [0, 40, 12], [0, 0, 1]]).repeat(batch, count, 1, 1)
    poses = np.tile(np.eye(4, dtype=np.float32), (batch, count, 1, 1))
    for index in range(count):
        yaw = 2 * np.pi * index / count
        ahead = np.array([np.cos(yaw), np.sin(yaw), 0])
        right, down = np.array([np.sin(yaw), -np.cos(yaw), 0]), np.array([0.0, 0.0, -1.0])
        turn = np.stack([right, down, ahead])
        poses[:, index, :3, :3] = turn
        poses[:, index, :3, 3] = -turn @ np.array([0.5, 0.2, 1.5])
    return intrinsics, torch.from_numpy(poses)


def street(seed: int, batch: int = 2, count: int = 3) -> BevBatch:
    """A vehicle ahead on the left or on the right, which is bright in the first camera."""
    rng = np.random.default_rng(seed)
    left = rng.integers(0, 2, batch).astype(bool)
    pictures = rng.integers(0, 60, (batch, count, 3, 32, 64), dtype=np.uint8)
    pictures[left, 0, :, 8:24, 4:28] += 150
    pictures[~left, 0, :, 8:24, 36:60] += 150
    vehicle = np.zeros((batch, 16, 16), np.uint8)
    vehicle[left, 2:6, 2:5] = 1
    vehicle[~left, 2:6, 11:14] = 1
    road = np.zeros((batch, 16, 16), np.uint8)
    road[:, :, 4:12] = 1
    truth = BevTruth(
        vehicle=torch.from_numpy(vehicle),
        centre=torch.from_numpy(vehicle.astype(np.float32) * 0.5),
        visibility=torch.from_numpy(np.where(vehicle == 1, 4, 255).astype(np.uint8)),
        road=torch.from_numpy(road),
    )
    return BevBatch(torch.from_numpy(pictures), *cameras(batch, count), truth)
