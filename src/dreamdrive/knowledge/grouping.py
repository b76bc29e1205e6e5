"""Road users from centres and offsets, as in Panoptic-DeepLab (Cheng et al. 2020)."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int, UInt16
from torch import Tensor
from torch.nn import functional

from dreamdrive.scene.look import RoadUser
from dreamdrive.scene.street_class import ROAD_USERS


@dataclass(frozen=True)
class GroupingOptions:
    """How pixels of road users become vehicles, two-wheelers and persons."""

    peak: float = 0.2
    """Least height of a centre's peak, in [0, 1]."""
    window: int = 3
    """Cells of the coarse map, along each side, of which a peak is the highest."""
    most: int = 100
    """Peaks of a class that are taken, the highest."""
    reach: float = 0.1
    """How far from a centre a pixel may point, as a share of the picture's width."""
    least: float = 2e-4
    """Smallest road user as a share of the picture: 26 pixels of 480x270."""


def group(
    classes: Int[Tensor, "h w"],
    confidence: Float[Tensor, "h w"],
    peaks: Float[Tensor, "3 h4 w4"],
    offset_px: Float[Tensor, "2 h w"],
    options: GroupingOptions = GroupingOptions(),
) -> tuple[UInt16[np.ndarray, "h w"], tuple[RoadUser, ...]]:
    """Number of each pixel's road user, 0 for none, and the road users by falling score.

    A pixel belongs to the centre of its class that is nearest to where it points. Peaks are in [0, 1], over
    the same picture, a channel for each of ``ROAD_USERS``; offsets are columns and rows, in its pixels.
    """
    height, width = classes.shape
    numbers = np.zeros((height, width), np.uint16)
    found: list[tuple[RoadUser, Int[np.ndarray, " n"]]] = []
    for heat, kind in zip(peaks, ROAD_USERS, strict=True):
        rows, columns = torch.nonzero(classes == kind, as_tuple=True)
        places, heights = _centres(heat, options)
        if not len(rows) or not len(places):
            continue
        places = places * torch.tensor([width / heat.shape[1], height / heat.shape[0]])
        aimed = torch.stack([columns, rows], dim=1) + 0.5 + offset_px[:, rows, columns].T
        distance, nearest = torch.cdist(aimed, places).min(dim=1)
        nearest[distance > options.reach * width] = -1
        for index, peak in enumerate(heights.tolist()):
            own = nearest == index
            if own.sum() < max(1, options.least * height * width):
                continue
            at, across = rows[own], columns[own]
            score = peak * float(confidence[at, across].mean())
            box = int(across.min()), int(at.min()), int(across.max()) + 1, int(at.max()) + 1
            found.append((RoadUser(kind, score, box, len(at)), (at * width + across).numpy()))
    found.sort(key=lambda each: -each[0].score)
    for number, (_, pixels) in enumerate(found, start=1):
        numbers.ravel()[pixels] = number
    return numbers, tuple(user for user, _ in found)


def _centres(
    heat: Float[Tensor, "h w"], options: GroupingOptions
) -> tuple[Float[Tensor, "n 2"], Float[Tensor, " n"]]:
    """Columns and rows of the peaks in cells, and their heights, the highest first."""
    highest = functional.max_pool2d(heat[None], options.window, stride=1, padding=options.window // 2)[0]
    rows, columns = torch.nonzero((heat == highest) & (heat >= options.peak), as_tuple=True)
    order = heat[rows, columns].argsort(descending=True)[: options.most]
    rows, columns = rows[order], columns[order]
    return torch.stack([columns, rows], dim=1) + 0.5, heat[rows, columns]
