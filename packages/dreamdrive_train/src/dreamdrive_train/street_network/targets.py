"""Targets of the network as the losses take them: batches of tensors."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import log

import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8
from torch import Tensor

from dreamdrive.scene.street.street_class import ROAD_USERS
from dreamdrive_train.street_network.data.picture import Picture
from dreamdrive_train.street_network.data.records import DEPTH_STEPS, FAR, LABEL_SETS, UNKNOWN

_WIDTH = 0.09
"""Standard deviation of a centre's peak in square roots of its road user's area, at least one place."""
_MAY_BE_USER = np.array(
    [label not in LABEL_SETS or bool(LABEL_SETS[label] & set(ROAD_USERS)) for label in range(256)]
)


@dataclass(frozen=True)
class Batch:
    """N pictures with their targets, at half (h, w) and a quarter (h4, w4) of their size.

    Attributes:
        pictures: RGB.
        labels: See ``LABEL_SETS``.
        depth_m: 0 unknown, infinite as far as can be told or farther.
        centre: Peaks of 1 at the centres of road users, a channel for each of ``ROAD_USERS``.
        centre_known: Where there would be a peak if there were a centre.
        offset: To the centre of each place's road user, columns and rows in pixels of the picture.
        on_road_user: Where the offset is known.
        camera: log(focal length / width), horizon / width, roll; not a number where unknown.
        camera_height_m: Not a number where unknown.
        distorted: 1 or 0, not a number where unknown.
        taught: Pictures of which labels or depth are missing, so that the teacher's answers stand in.
        clean: These pictures (M) as they are without changed colours.
    """

    pictures: UInt8[Tensor, "n 3 _ _"]
    labels: UInt8[Tensor, "n h w"]
    depth_m: Float[Tensor, "n h w"]
    centre: Float[Tensor, "n 3 h4 w4"]
    centre_known: Bool[Tensor, "n h4 w4"]
    offset: Float[Tensor, "n 2 h4 w4"]
    on_road_user: Bool[Tensor, "n h4 w4"]
    camera: Float[Tensor, "n 3"]
    camera_height_m: Float[Tensor, " n"]
    distorted: Float[Tensor, " n"]
    taught: Bool[Tensor, " n"]
    clean: UInt8[Tensor, "m 3 _ _"]

    def to(self, device: torch.device) -> "Batch":
        """On a device."""
        return Batch(**{each.name: getattr(self, each.name).to(device) for each in fields(self)})


def batch_of(
    pictures: Sequence[Picture], taught: Sequence[bool], clean: Sequence[UInt8[np.ndarray, "h w 3"]]
) -> Batch:
    """Targets of cut pictures; ``clean`` are those that are taught, before their colours were changed."""
    road_users = [_road_users(each) for each in pictures]

    def stacked(arrays: Sequence[np.ndarray]) -> Tensor:
        return torch.from_numpy(np.stack(arrays))

    cameras = [[log(each.focal), each.horizon, each.roll_rad] for each in pictures]
    rgb = stacked([each.rgb for each in pictures]).permute(0, 3, 1, 2)
    return Batch(
        pictures=rgb,
        labels=stacked([each.labels for each in pictures]),
        depth_m=stacked([_depth_m(each) for each in pictures]),
        centre=stacked([each[0] for each in road_users]),
        centre_known=stacked([each[1] for each in road_users]),
        offset=stacked([each[2] for each in road_users]),
        on_road_user=stacked([each[3] for each in road_users]),
        camera=torch.tensor(cameras, dtype=torch.float32),
        camera_height_m=torch.tensor([each.camera_height_m for each in pictures], dtype=torch.float32),
        distorted=torch.tensor([each.distorted for each in pictures], dtype=torch.float32),
        taught=torch.tensor(list(taught)),
        clean=stacked(clean).permute(0, 3, 1, 2) if clean else rgb[:0],
    )


def _depth_m(picture: Picture) -> Float[np.ndarray, "h w"]:
    depth = picture.depth.astype(np.float32) / np.float32(DEPTH_STEPS)
    depth[picture.depth == FAR] = np.inf
    return depth


def _road_users(
    picture: Picture,
) -> tuple[
    Float[np.ndarray, "3 h4 w4"],
    Bool[np.ndarray, "h4 w4"],
    Float[np.ndarray, "2 h4 w4"],
    Bool[np.ndarray, "h4 w4"],
]:
    """Peaks, where they are known, offsets, and where these are known, at stride 4."""
    instances, labels = picture.instances, picture.labels
    small, near = instances[::2, ::2], labels[::2, ::2]
    height, width = small.shape
    peaks = np.zeros((3, height, width), np.float32)
    offset = np.zeros((2, height, width), np.float32)
    known = ~((small == UNKNOWN) & _MAY_BE_USER[near])
    on_road_user = (small > 0) & (small < UNKNOWN)
    rows, columns = np.mgrid[:height, :width].astype(np.float32)
    for number in np.unique(instances[(instances > 0) & (instances < UNKNOWN)]):
        down, across = np.nonzero(instances == number)
        y, x = (down.mean() + 0.5) / 2, (across.mean() + 0.5) / 2  # in places of stride 4
        own = small == number
        offset[:, own] = 4 * np.stack([x - columns[own] - 0.5, y - rows[own] - 0.5])
        kinds = [int((labels[down, across] == kind).sum()) for kind in ROAD_USERS]
        if not max(kinds):  # some road user, no telling which
            known &= ~own
            continue
        sigma = max(1.0, _WIDTH * float(np.sqrt(len(down) / 4)))
        row, column = min(int(y), height - 1), min(int(x), width - 1)
        distance = (rows - row) ** 2 + (columns - column) ** 2
        channel = peaks[int(np.argmax(kinds))]
        np.maximum(channel, np.exp(-distance / (2 * sigma**2)), out=channel)
    return peaks, known, offset, on_road_user
