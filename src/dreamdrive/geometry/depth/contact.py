"""The depth of what stands on the road, from where it touches it."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Integer

from dreamdrive.geometry.options import FusionOptions
from dreamdrive.vision.windows import grown

_LEAST_PX = 8  # of a thing that is given a depth
_BELOW_PX = 2  # rows under a thing's lowest pixel in which the ground is looked for
_SEEN_SHARE = 0.1  # of a thing's columns whose contact has to be seen
_SEEN_COLUMNS = 3
_LEAST_BORDER_PX = 3  # with what carries it
_LEAST_INVERSE = 1 / 250  # 1/m; a contact farther away is the horizon
_ENDS = 0.2  # of a thing's columns on each side
_MOST_END_PX = 15  # of pictures that are 480 wide
_TURNED = 1.0  # metres by which a side recedes a metre, at most
_ROW_PX = 0.7  # by which a contact is off


@dataclass(frozen=True)
class Contact:
    """What contact with the road says of one picture: inverse depth in 1/m, 0 where it says nothing.

    ``spread`` is the relative standard deviation of the depth.
    """

    inverse: Float[np.ndarray, "h w"]
    spread: Float[np.ndarray, "h w"]


def on_the_road(
    instances: Integer[np.ndarray, "h w"],
    ground: Bool[np.ndarray, "h w"],
    plane_inverse: Float[np.ndarray, "h w"],
    camera_height_m: float,
    is_vehicle: Bool[np.ndarray, " n"],
    options: FusionOptions,
) -> Contact:
    """Every column of a road user gets the depth at which it meets the road.

    Wheels touch the road, the floor between them does not: the line of contact is the lower convex hull of
    the outline, taken of those columns in which the ground is seen right below. Columns between these are on
    the hull, too. A thing whose foot is hidden, by the border or by another one, gets nothing; but who sits
    on a two-wheeler, or the upper part of a person that was taken for two, is where that below it is.

    ``plane_inverse`` is inverse depth of the road in 1/m, ``camera_height_m`` above which the camera is;
    ``is_vehicle`` has a flag for each label, 0 included. The surface of a vehicle is nearer than its contact.
    """
    height, width = instances.shape
    inverse, spread = np.zeros((2, height, width), np.float32)
    below = max(1, round(grown(_BELOW_PX, width)))
    for label in range(1, int(instances.max(initial=0)) + 1):
        mask = instances == label
        columns = np.flatnonzero(mask.any(axis=0))
        if mask.sum() < _LEAST_PX:
            continue
        lowest = height - 1 - mask[::-1, columns].argmax(axis=0)
        seen = (lowest + below < height) & ground[np.minimum(lowest + below, height - 1), columns]
        if seen.sum() < max(_SEEN_COLUMNS, _SEEN_SHARE * len(columns)):
            continue
        foot = _hull(columns[seen], lowest[seen] + 1, columns)
        contact = _at_rows(plane_inverse, foot, columns)
        # A row is that share of the camera's height at the distance of the foot.
        a_row = (contact - _at_rows(plane_inverse, foot - 1, columns)) / np.maximum(contact, 1e-6)
        row_m = camera_height_m * a_row
        right_px = columns + 0.5 - width / 2
        if columns[0] > 0 and columns[-1] < width - 1:
            contact = _without_leaps(contact, right_px, row_m, round(grown(_MOST_END_PX, width)))
        near = contact > _LEAST_INVERSE
        if not near.any():
            continue
        if is_vehicle[label]:
            tall_m = float(((foot - mask[:, columns].argmax(axis=0)) * row_m)[near].max())
            contact = _overhanging(contact, right_px * row_m, tall_m, options)
        place = np.zeros((2, width), np.float32)
        place[0, columns[near]] = contact[near]
        place[1, columns[near]] = np.hypot(_ROW_PX * a_row[near], options.contact_spread)
        inverse[mask] = np.broadcast_to(place[0], mask.shape)[mask]
        spread[mask] = np.broadcast_to(place[1], mask.shape)[mask]
    _carry(instances, is_vehicle, inverse, spread)
    return Contact(inverse, spread)


def _carry(
    instances: Integer[np.ndarray, "h w"],
    is_vehicle: Bool[np.ndarray, " n"],
    inverse: Float[np.ndarray, "h w"],
    spread: Float[np.ndarray, "h w"],
) -> None:
    """People and two-wheelers without a contact get that of what carries them: no vehicle, right below."""
    placed = np.bincount(instances.ravel(), inverse.ravel(), minlength=len(is_vehicle)) > 0
    above, under = instances[:-1], instances[1:]
    for label in (1 + np.flatnonzero(~placed[1:] & ~is_vehicle[1:])).tolist():
        border = np.bincount(under[above == label], minlength=len(is_vehicle))
        carrier = int(np.where(placed & ~is_vehicle, border, 0).argmax())
        if not carrier or border[carrier] < _LEAST_BORDER_PX:
            continue
        inside = (instances == carrier) & (inverse > 0)
        inverse[instances == label] = np.median(inverse[inside])
        spread[instances == label] = np.median(spread[inside])


def _at_rows(
    image: Float[np.ndarray, "h w"], edge_px: Float[np.ndarray, " n"], columns: Integer[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Values between rows, at heights counted from the picture's upper edge."""
    at = np.clip(edge_px - 0.5, 0, len(image) - 1)
    above = np.minimum(np.floor(at).astype(np.intp), len(image) - 2)
    share = at - above
    return (1 - share) * image[above, columns] + share * image[above + 1, columns]


def _without_leaps(
    contact: Float[np.ndarray, " n"],
    right_px: Float[np.ndarray, " n"],
    column_m: Float[np.ndarray, " n"],
    most_px: int,
) -> Float[np.ndarray, " n"]:
    """A line of contact (inverse depth) whose ends recede no faster than sides do.

    Beside the wheels a thing ends above the road, and what is seen below its corners is road far behind it.
    Sides that are seen run along the road, towards the middle of the picture; or else a thing has turned,
    and they recede by no more than ``_TURNED`` metres a metre. ``column_m`` is what a column spans there;
    an end has at most ``most_px`` columns.
    """
    depth_m = 1 / np.maximum(contact, 1e-6)
    ends = min(round(_ENDS * len(depth_m)), most_px)
    for way, first in ((1, len(depth_m) - ends), (-1, ends - 1)):
        for at in range(max(first, 1), len(depth_m)) if way > 0 else range(first, -1, -1):
            before = at - way
            step_px = abs(right_px[at] - right_px[before])
            along = abs(right_px[before]) / max(abs(right_px[at]), 0.5)
            turned = 1 + _TURNED * step_px * column_m[before] / depth_m[before]
            depth_m[at] = min(depth_m[at], depth_m[before] * max(along, turned))
    return 1 / depth_m


def _overhanging(
    contact: Float[np.ndarray, " n"], right_m: Float[np.ndarray, " n"], tall_m: float, options: FusionOptions
) -> Float[np.ndarray, " n"]:
    """Inverse depth of a vehicle above a line of contact: bumpers reach out beyond the wheels, sides little.

    The line is at inverse depths ``contact`` in 1/m, and ``right_m`` right of the camera.
    """
    if len(contact) < 2:
        return contact
    along, across = np.gradient(1 / np.maximum(contact, 1e-6)), np.gradient(right_m)
    facing = across**2 / np.maximum(across**2 + along**2, 1e-12)
    by_m = tall_m * (options.end_overhang * facing + options.side_overhang * (1 - facing))
    return contact / np.maximum(1 - by_m * contact, 0.5)


def _hull(
    columns: Integer[np.ndarray, " s"], rows: Integer[np.ndarray, " s"], wanted: Integer[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Rows at which wanted columns meet the lower convex hull of some points; level beyond its ends."""
    points = np.stack([columns, rows], axis=1).astype(np.float32)
    hull = cv2.convexHull(points)[:, 0]
    first, last = hull[:, 0].min(), hull[:, 0].max()
    if last - first < 1:
        return np.full(len(wanted), float(rows.max()))
    grid = np.arange(first, last + 1)
    # The hull goes round: each of its edges covers some columns, and the lower of two edges is the contact.
    line = np.full(len(grid), -np.inf)
    for (x0, y0), (x1, y1) in zip(hull, np.roll(hull, -1, axis=0), strict=True):
        low, high = sorted((x0, x1))
        inside = (grid >= low) & (grid <= high)
        share = (grid[inside] - x0) / (x1 - x0) if x1 != x0 else np.zeros(inside.sum())
        line[inside] = np.maximum(line[inside], y0 + share * (y1 - y0))
    return np.interp(wanted, grid, line)
