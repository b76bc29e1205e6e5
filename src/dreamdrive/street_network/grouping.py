"""Road users from centres and offsets, as in Panoptic-DeepLab (Cheng et al. 2020)."""

from dataclasses import dataclass

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, Int, UInt16
from torch import Tensor
from torch.nn import functional

from dreamdrive.scene.street.look import RoadUser
from dreamdrive.scene.street.street_class import ROAD_USERS, StreetClass


@dataclass(frozen=True)
class GroupingOptions:
    """How pixels of road users become vehicles, two-wheelers and persons."""

    peak: float = 0.15
    """Least height of a centre's peak, in [0, 1]."""
    window: tuple[int, int] = (3, 3)
    """Rows and columns of the coarse map of whose cells a peak is the highest."""
    vehicle_window: tuple[int, int] = (19, 5)
    """The same of vehicles: none stands above another, but both halves of a lorry seem to have a centre."""
    most: int = 100
    """Peaks of a class that are taken, the highest."""
    reach: float = 0.2
    """How far from a centre a pixel may point, as a share of the picture's width."""
    closing: float = 0.2
    """Radius of closed notches in a vehicle's outline, over the root of its area; all holes are closed."""
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

    A pixel belongs to the centre of its class that is nearest to where it points. A vehicle has its panes and
    letters, too, which may be taken for something else. Peaks are in [0, 1], over the same picture, a channel
    for each of ``ROAD_USERS``; offsets are columns and rows, in its pixels.
    """
    height, width = classes.shape
    numbers = np.zeros((height, width), np.uint16)
    may_be = free(classes.numpy())
    found: list[tuple[RoadUser, Int[np.ndarray, " n"]]] = []
    for heat, kind in zip(peaks, ROAD_USERS, strict=True):
        window = options.vehicle_window if kind == StreetClass.VEHICLE else options.window
        rows, columns = torch.nonzero(classes == kind, as_tuple=True)
        places, heights = _centres(heat, window, options)
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
            mask = np.zeros((height, width), bool)
            mask[at.numpy(), across.numpy()] = True
            if kind == StreetClass.VEHICLE:
                mask |= outlined(mask, options.closing) & may_be
            found.append((measured(kind, score, mask), np.flatnonzero(mask)))
    found.sort(key=lambda each: -each[0].score)
    for number, (_, pixels) in enumerate(found, start=1):
        numbers.ravel()[pixels] = number
    return numbers, tuple(user for user, _ in found)


def measured(kind: StreetClass, score: float, mask: Bool[np.ndarray, "h w"]) -> RoadUser:
    """The road user that fills a mask."""
    rows, columns = np.nonzero(mask)
    box = int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1
    return RoadUser(kind, score, box, len(rows))


def free(classes: Int[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """Pixels that a vehicle's outline may take in: its panes and letters are taken for something else."""
    return ~np.isin(classes, (*ROAD_USERS, StreetClass.OWN_CAR))


def outlined(mask: Bool[np.ndarray, "h w"], closing: float) -> Bool[np.ndarray, "h w"]:
    """A thing without holes and narrow notches; what the picture's border cuts off goes on beyond it."""
    reach = max(1, round(closing * float(np.sqrt(mask.sum()))))
    beyond = reach + 1
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    box = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    thing = mask[box].astype(np.uint8)
    # Nothing that is closed or filled reaches out of the thing's box.
    wide = np.zeros((thing.shape[0] + 2 * beyond, thing.shape[1] + 2 * beyond), np.uint8)
    inner = slice(beyond, -beyond), slice(beyond, -beyond)
    height, width = mask.shape
    sides = (
        (box[1].start == 0, thing[:, 0], wide[inner[0], :beyond].T),
        (box[1].stop == width, thing[:, -1], wide[inner[0], -beyond:].T),
        (box[0].start == 0, thing[0], wide[:beyond, inner[1]]),
        (box[0].stop == height, thing[-1], wide[-beyond:, inner[1]]),
    )
    for cut, border, outside in sides:
        if cut:
            filled = np.flatnonzero(border)
            border[filled[0] : filled[-1] + 1] = 1
            outside[:] = border
    wide[inner] = thing
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    closed = cv2.morphologyEx(wide, cv2.MORPH_CLOSE, disc)
    outlines, _ = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(closed, outlines, -1, 1, cv2.FILLED)
    whole = np.zeros_like(mask)
    whole[box] = closed[inner] > 0
    return whole


def _centres(
    heat: Float[Tensor, "h w"], window: tuple[int, int], options: GroupingOptions
) -> tuple[Float[Tensor, "n 2"], Float[Tensor, " n"]]:
    """Columns and rows of the peaks in cells, and their heights, the highest first."""
    around = window[0] // 2, window[1] // 2
    highest = functional.max_pool2d(heat[None], window, stride=1, padding=around)[0]
    rows, columns = torch.nonzero((heat == highest) & (heat >= options.peak), as_tuple=True)
    order = heat[rows, columns].argsort(descending=True)[: options.most]
    rows, columns = rows[order], columns[order]
    return torch.stack([columns, rows], dim=1) + 0.5, heat[rows, columns]
