"""Oncoming traffic, which stereo is sure of and the road contradicts.

What drives straight towards a camera that drives straight looks in every pair of frames like a standing thing
at another distance: with equal speeds at half of it. Nothing in the pictures tells them apart but the road: a
standing thing meets it at the thing's own depth, an oncoming one much farther away, as if it floated.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.geometry.depth import View, Warp
from dreamdrive.geometry.moving.flow import PairFlow
from dreamdrive.geometry.moving.misfit import misfit
from dreamdrive.scene.linked_pixels import linked_pixels

_SURE = 0.4  # confidence from which stereo is believed
_NEARER = 1.12  # times the road's inverse depth
_ON_ROAD = 0.1  # of it
_FARTHEST_INVERSE = 1 / 60  # 1/m
_MIN_PLANE_INVERSE = 0.004  # 1/m
_REACH = 2  # offsets whose flows say where the road is not
_NO_ROAD_LEVELS = 3.0  # by which the flow fits better than the road
_ROAD_AGAIN_PX = 4  # rows of sure road above which another thing may stand
_NEIGHBOUR_SHARE = 4 / 320  # of the image width
_NEIGHBOUR_DEPTH = 0.06  # in its logarithm
_MIN_AREA = 0.0005  # of the image, in sure pixels
_SURE_AREA = 0.0024
_MIN_BELOW_HORIZON = 0.3  # of a thing's pixels
_RATIO = 1.4
_MAX_HEIGHT_M = 4.0
_MAX_GAP_M = 0.6  # from a thing's lowest sure pixel to where it meets the road
_ROAD_BELOW_M = 0.4
_ROAD_BELOW_SHARE = 0.4  # of the pixels there that are surely road
_ROOM = 0.2  # of the image height below the contact
_CLOSE_SHARE = 9 / 320


@dataclass(frozen=True)
class Floating:
    """What floats in one frame.

    Attributes:
        likely: Its pixels (H, W).
        sure: Those of large things (H, W).
    """

    likely: Bool[np.ndarray, "h w"]
    sure: Bool[np.ndarray, "h w"]


@dataclass(frozen=True)
class _Road:
    """A frame against the road plane.

    Attributes:
        plane: Its inverse depth (H, W) in 1/m.
        contact: The plane's inverse depth where what stands in the column meets it (H, W).
        on: Where stereo is sure to see it (H, W).
        fy_px: Focal length.
    """

    plane: Float[np.ndarray, "h w"]
    contact: Float[np.ndarray, "h w"]
    on: Bool[np.ndarray, "h w"]
    fy_px: float


def floating(
    view: View,
    frame: int,
    flows: Sequence[PairFlow],
    inverse_depth: Float[np.ndarray, "h w"],
    confidence: Float[np.ndarray, "h w"],
    sky: Bool[np.ndarray, "h w"],
) -> Floating:
    """Things whose static depth is nearer than ``1 / 1.4`` of the road's where they stand on it.

    A parked car has 1.0 to 1.2 times it, for its lowest part is dark; one that comes at the camera's speed 2.

    Args:
        view: The posed frames.
        frame: Index of the frame.
        flows: Its flows.
        inverse_depth: Static depth of the frame in 1/m.
        confidence: Trust in it.
        sky: Sky mask.
    """
    road = _road(view, frame, flows, inverse_depth, confidence)
    near = inverse_depth > np.maximum(_NEARER * road.plane, _FARTHEST_INVERSE)
    standing = (confidence > _SURE) & near & ~sky & view.usable[frame]
    likely, sure = np.zeros_like(standing), np.zeros_like(standing)
    for rows, columns in _things(standing, inverse_depth):
        if not _floats(road, inverse_depth, rows, columns):
            continue
        thing = _closed(rows, columns, standing.shape)
        likely |= thing
        if len(rows) >= _SURE_AREA * standing.size:
            sure |= thing
    return Floating(likely, sure)


def _road(
    view: View,
    frame: int,
    flows: Sequence[PairFlow],
    inverse_depth: Float[np.ndarray, "h w"],
    confidence: Float[np.ndarray, "h w"],
) -> _Road:
    plane = view.plane_inverse[frame]
    below = (plane > _MIN_PLANE_INVERSE) & (confidence > _SURE)
    standing = below & (inverse_depth > _NEARER * plane)
    elsewhere = _plane_loss(view, frame, flows) > _NO_ROAD_LEVELS
    other = standing | ((plane > _MIN_PLANE_INVERSE) & elsewhere)
    other = cv2.morphologyEx(other.astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2), np.uint8)) > 0
    on = below & (np.abs(inverse_depth - plane) < _ON_ROAD * plane)
    return _Road(plane, _contact(plane, other, on & ~other), on, view.cameras[frame].fy_px)


def _plane_loss(view: View, frame: int, flows: Sequence[PairFlow]) -> Float[np.ndarray, "h w"]:
    """By how many grey levels the flow fits better than the road, in the mean of the near frames."""
    total, count = np.zeros(view.grey[frame].shape, np.float32), 1e-6
    for flow in flows:
        if abs(flow.offset) > _REACH:
            continue
        on_plane = Warp(view.cameras[frame], view.cameras[flow.source])(view.plane_inverse[frame])
        loss = misfit(view, frame, flow.source, *on_plane) - misfit(view, frame, flow.source, flow.x, flow.y)
        known = np.isfinite(loss)
        total, count = total + np.where(known, loss, 0), count + known
    return (total / count).astype(np.float32)


def _contact(
    plane: Float[np.ndarray, "h w"], other: Bool[np.ndarray, "h w"], on: Bool[np.ndarray, "h w"]
) -> Float[np.ndarray, "h w"]:
    """Inverse depth of the road below each pixel: from what is not road upwards that of its lowest row."""
    contact = np.zeros_like(plane)
    current = plane[-1]
    held = np.zeros(plane.shape[1], bool)
    road_rows = np.zeros(plane.shape[1], np.int32)
    for row in range(len(plane) - 1, -1, -1):
        road_rows = np.where(on[row], road_rows + 1, 0)
        held = (held | other[row]) & (road_rows < _ROAD_AGAIN_PX)
        current = np.where(held, current, plane[row])
        contact[row] = current
    return contact


def _things(
    standing: Bool[np.ndarray, "h w"], inverse_depth: Float[np.ndarray, "h w"]
) -> Iterator[tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"]]]:
    """Rows and columns of pixels that hang together in the image and in depth."""
    rows, columns = np.nonzero(standing)
    if not len(rows):
        return
    pixels = np.column_stack([columns, rows, 1 / inverse_depth[rows, columns]])
    labels = linked_pixels(pixels, _NEIGHBOUR_SHARE * standing.shape[1], _NEIGHBOUR_DEPTH)
    for label in np.flatnonzero(np.bincount(labels) >= _MIN_AREA * standing.size):
        yield rows[labels == label], columns[labels == label]


def _floats(
    road: _Road,
    inverse_depth: Float[np.ndarray, "h w"],
    rows: Int[np.ndarray, " n"],
    columns: Int[np.ndarray, " n"],
) -> bool:
    """Whether a thing of a vehicle's height floats above a piece of road that is surely seen below it."""
    inverse, contact = inverse_depth[rows, columns], road.contact[rows, columns]
    below = road.plane[rows, columns] > _MIN_PLANE_INVERSE
    if below.mean() < _MIN_BELOW_HORIZON or np.ptp(rows) > _MAX_HEIGHT_M * np.median(inverse) * road.fy_px:
        return False
    stands_at = float(np.median(contact[below]))
    with np.errstate(divide="ignore"):  # nothing touches the road there: infinitely nearer than it
        nearer = inverse[below] / contact[below]
    if stands_at <= 0 or np.median(nearer) < _RATIO:
        return False
    height, px_per_m = len(road.plane), stands_at * road.fy_px
    at = int(np.searchsorted(road.plane[:, int(np.median(columns))], stands_at))
    if at - rows.max() > _MAX_GAP_M * px_per_m or height - at < _ROOM * height:
        return False
    end = at + 2 + max(3, int(_ROAD_BELOW_M * px_per_m))
    return bool(road.on[at + 2 : end, columns.min() : columns.max() + 1].mean() >= _ROAD_BELOW_SHARE)


def _closed(
    rows: Int[np.ndarray, " n"], columns: Int[np.ndarray, " n"], shape: tuple[int, ...]
) -> Bool[np.ndarray, "h w"]:
    """The area that the pixels of a thing mark out."""
    mask = np.zeros(shape, np.uint8)
    mask[rows, columns] = 1
    size_px = 2 * round((_CLOSE_SHARE * shape[1] - 1) / 2) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size_px, size_px))
    return cv2.morphologyEx(mask, cv2.MORPH_CLOSE, kernel) > 0
