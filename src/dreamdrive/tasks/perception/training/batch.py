"""Batches for a network: pictures of cameras and the cells around them."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from dreamdrive.tasks.perception.raster import BevLabels


@dataclass(frozen=True)
class BevTruth:
    """Labels of the cells of several samples.

    Attributes:
        vehicle: 1 where there is a vehicle, else 0.
        centre: How near its centre is, in [0, 1].
        visibility: Of the vehicle, 1 to 4; 255 without one.
        road: 1 where there is road, else 0.
    """

    vehicle: UInt8[Tensor, "b rows columns"]
    centre: Float[Tensor, "b rows columns"]
    visibility: UInt8[Tensor, "b rows columns"]
    road: UInt8[Tensor, "b rows columns"]

    def to(self, device: torch.device) -> "BevTruth":
        """The same on a device."""
        return BevTruth(*(getattr(self, each.name).to(device) for each in fields(self)))

    def part(self, first: int, end: int) -> "BevTruth":
        """Some of the samples."""
        return BevTruth(*(getattr(self, each.name)[first:end] for each in fields(self)))


@dataclass(frozen=True)
class BevBatch:
    """Samples as the network takes them.

    Attributes:
        pictures: RGB, as bytes or in [0, 1].
        pixel_from_camera: Intrinsics in pixels of these pictures.
        camera_from_ego: Extrinsics from the level ego frame.
        truth: Labels.
    """

    pictures: Float[Tensor, "b n 3 h w"] | UInt8[Tensor, "b n 3 h w"]
    pixel_from_camera: Float[Tensor, "b n 3 3"]
    camera_from_ego: Float[Tensor, "b n 4 4"]
    truth: BevTruth

    def __len__(self) -> int:
        return len(self.pictures)

    def to(self, device: torch.device) -> "BevBatch":
        """The same on a device."""
        return BevBatch(
            self.pictures.to(device),
            self.pixel_from_camera.to(device),
            self.camera_from_ego.to(device),
            self.truth.to(device),
        )

    def part(self, first: int, end: int) -> "BevBatch":
        """Some of the samples."""
        return BevBatch(
            self.pictures[first:end],
            self.pixel_from_camera[first:end],
            self.camera_from_ego[first:end],
            self.truth.part(first, end),
        )


def as_truth(labels: Sequence[BevLabels]) -> BevTruth:
    """Labels of several samples as tensors."""
    return BevTruth(
        vehicle=torch.stack([torch.from_numpy(each.vehicle()) for each in labels]),
        centre=torch.stack([torch.from_numpy(each.centre().copy()) for each in labels]),
        visibility=torch.stack([torch.from_numpy(each.visibility) for each in labels]),
        road=torch.stack([torch.from_numpy(each.road()) for each in labels]),
    )
