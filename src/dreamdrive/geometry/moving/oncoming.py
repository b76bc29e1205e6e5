"""Detection of oncoming traffic, which pairs of frames take for standing and only the road contradicts.

What drives straight towards a camera that drives straight moves in the pictures like a standing thing at
another distance: with equal speeds at half of it. A standing thing meets the road at its own distance, an
oncoming one farther away. Single pixels of dark paint and glass do not tell at which distance they seem to
be. So whole stretches are swept: a column half a metre wide, above and below each row in which a thing might
meet the road.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.geometry.depth import PosedFrames, Warp, by_frame, inside, misfits, sample
from dreamdrive.geometry.moving.outline import TALLEST_M

_INVERSE = np.geomspace(1 / 27, 0.45, 31)  # 1/m; at which a thing may seem to be
_BACKGROUND = (0.0, 0.012, 0.024)  # 1/m; what is behind it, beside the road
_REACH = 2  # used frames, to both sides
_MOST_LEVELS = 25.0  # grey levels; a pixel that misses by more is hidden
_WIDTH_M = 0.5  # of a column
_ABOVE_M = 1.0  # of a thing that is compared
_GAIN_LEVELS = 1.0  # by which the thing fits better than the road above the contact
_ROAD_GAIN_LEVELS = 0.5  # by which the road does below it
_FIT_LEVELS = 14.0
_RATIO = (1.4, 2.75)  # seeming over true inverse depth: 1.0 to 1.2 of parked cars, whose lowest part is dark
_LEAST_CONTACT = 1 / 36  # 1/m
_GAP_PX = 3
_SAME_DEPTH = 0.12  # in its logarithm
_SAME_ROW_M = 0.2
_LEAST_WIDTH_M = 1.0
_VOTERS, _VOTES = 4, 2  # frames to both sides that are asked, and that have to agree
_NEAREST_M = 1.5
_BEHIND = 0.6  # of its seeming inverse depth
_BIAS_LEVELS = 0.5


@dataclass(frozen=True)
class _Thing:
    """What comes towards the camera in one frame: its pixels, and its seeming inverse depth in 1/m."""

    pixels: Bool[np.ndarray, "h w"]
    inverse: float


@dataclass(frozen=True)
class _Misfits:
    """Mean absolute difference in grey levels to the neighbours, if all pixels were at one place.

    Upright at each of the inverse depths in 1/m, those of the background first, or on the road.
    """

    inverse: Float[np.ndarray, " l"]
    upright: Float[np.ndarray, "l h w"]
    road: Float[np.ndarray, "h w"]


@dataclass(frozen=True)
class _Columns:
    """The best guess in each column: the number of the thing's seeming inverse depth, and its lowest row.

    The score is grey levels that thing and road gain together; 0 where there is none.
    """

    score: Float[np.ndarray, " w"]
    label: Int[np.ndarray, " w"]
    row: Int[np.ndarray, " w"]


def oncoming(view: PosedFrames) -> dict[int, Bool[np.ndarray, "h w"]]:
    """Pixels of each used frame that show what comes towards the camera; none without a road plane.

    These are things that seem to be nearer than where they meet the road, 1.4 to 2.75 times, in two frames or
    more: while its speed lasts such a thing seems to stand at one place, to which all frames agree.
    """
    found = by_frame(view, lambda frame: _things(view, frame))

    def agreed(frame: int) -> Bool[np.ndarray, "h w"]:
        at, votes = view.frames.index(frame), np.zeros(view.grey[0].shape, np.int64)
        for other in view.frames[max(0, at - _VOTERS) : at + _VOTERS + 1]:
            seen = np.zeros(votes.shape, bool)
            for thing in found[other]:
                seen |= thing.pixels if other == frame else _carried(view, thing, other, frame)
            votes += seen
        return (votes >= _VOTES) & view.usable[frame]

    return by_frame(view, agreed)


def _carried(view: PosedFrames, thing: _Thing, frame: int, to: int) -> Bool[np.ndarray, "h w"]:
    """Where a thing of one frame is in another, as if it stood where it seems to be."""
    ahead_m = float(
        (view.positions_m[to] - view.positions_m[frame]) @ view.cameras[frame].world_from_camera[:3, 2]
    )
    depth_m = 1 / thing.inverse - ahead_m
    if depth_m < _NEAREST_M:
        return np.zeros_like(thing.pixels)
    x, y = Warp(view.cameras[to], view.cameras[frame])(1 / depth_m)
    return sample(thing.pixels.astype(np.float32), x, y) > 0.5


def _things(view: PosedFrames, frame: int) -> list[_Thing]:
    plane = view.plane_inverse[frame]
    things: list[_Thing] = []
    if not plane.any():
        return things
    fy_px = view.cameras[frame].fy_px
    misfits, px_per_m = _misfits(view, frame), fy_px * plane
    found = _columns(misfits, plane, fy_px)
    for columns in _stretches(found, misfits.inverse, px_per_m):
        row, label = int(np.median(found.row[columns])), int(np.median(found.label[columns]))
        contact = plane[row, int(np.median(columns))]
        one_m = float(fy_px * contact)
        wide_m = (columns[-1] + 1 - columns[0]) / one_m
        comes = _RATIO[0] <= misfits.inverse[label] / contact <= _RATIO[1]
        if comes and contact >= _LEAST_CONTACT and wide_m >= _LEAST_WIDTH_M:
            across = slice(int(columns[0]), int(columns[-1]) + 1)
            pixels = _outline(misfits, label, row, across, one_m)
            things.append(_Thing(pixels, float(misfits.inverse[label])))
    return things


def _misfits(view: PosedFrames, frame: int) -> _Misfits:
    frames = view.frames
    at = frames.index(frame)
    near = [frames[k] for k in range(max(0, at - _REACH), min(len(frames), at + _REACH + 1)) if k != at]
    warps = [Warp(view.cameras[frame], view.cameras[other]) for other in near]
    sources = [(warp, view.grey[o], view.usable[o]) for warp, o in zip(warps, near, strict=True)]
    inverse = np.array([*_BACKGROUND, *_INVERSE])
    grey = view.grey[frame]
    upright = misfits(grey, sources, inverse, _MOST_LEVELS)
    places = [warp(view.plane_inverse[frame]) for warp in warps]
    road = [
        (sample(picture, *place), inside(*place, usable))
        for (_, picture, usable), place in zip(sources, places, strict=True)
    ]
    return _Misfits(inverse, upright, _misfit(grey, road))


def _misfit(
    grey: Float[np.ndarray, "h w"],
    seen_by: Sequence[tuple[Float[np.ndarray, "h w"], Bool[np.ndarray, "h w"]]],
) -> Float[np.ndarray, "h w"]:
    total, count = (np.zeros(grey.shape, np.float32) for _ in range(2))
    for picture, seen in seen_by:
        levels = np.minimum(np.abs(picture - grey), np.float32(_MOST_LEVELS))
        levels *= seen
        total += levels
        count += seen
    return np.where(count > 0, total / np.maximum(count, 1), np.float32(_MOST_LEVELS))


def _columns(misfits: _Misfits, plane: Float[np.ndarray, "h w"], fy_px: float) -> _Columns:
    """For each column the distance and the row with which thing above and road below gain most."""
    height, width = plane.shape
    rows = np.arange(height)[:, None]
    above_px = np.clip((_ABOVE_M * fy_px * plane).astype(int), 3, height)
    top = np.maximum(rows - above_px, 0)
    possible = (rows > above_px) & (plane > 0) & (rows < height - 3)
    nearest, farthest = plane.max(axis=1), plane.min(axis=1)
    best, label, row = np.zeros(width), np.zeros(width, np.intp), np.zeros(width, np.intp)
    for number in range(len(_BACKGROUND), len(misfits.inverse)):
        inverse, most = float(misfits.inverse[number]), _RATIO[1] * 1.1
        # A thing that seems to be at this distance meets the road in few of the rows.
        band = np.flatnonzero((inverse >= farthest) & (inverse <= most * nearest))
        if not len(band):
            continue
        at = slice(band[0], band[-1] + 1)
        # A standing thing would hide the road down to here.
        stands = (plane < inverse).sum(axis=0)
        bottom = np.minimum(np.maximum(rows[at] + 2, stands), height - 1)
        part = slice(int(top[at].min()), int(bottom.max()) + 1)
        window = (max(3, int(_WIDTH_M * fy_px * inverse / 2)) | 1, 1)
        thing, road = (cv2.blur(each[part], window) for each in (misfits.upright[number], misfits.road))
        gain = np.cumsum(np.where(plane[part] > 0, road - thing, 0), axis=0)
        cost = np.cumsum(thing, axis=0)
        here, from_top = np.s_[at.start - part.start : at.stop - part.start], top[at] - part.start
        above = (gain[here] - np.take_along_axis(gain, from_top, axis=0)) / above_px[at]
        below = gain[here] - np.take_along_axis(gain, bottom - part.start, axis=0)
        below /= np.maximum(bottom - rows[at], 1)
        fit = (cost[here] - np.take_along_axis(cost, from_top, axis=0)) / above_px[at]
        meets = (inverse >= plane[at]) & (inverse <= most * plane[at])
        good = (above > _GAIN_LEVELS) & (below > _ROAD_GAIN_LEVELS) & (fit < _FIT_LEVELS)
        score = np.where(possible[at] & meets & good, above + below - fit / 2, 0)
        found = score.argmax(axis=0)
        most_here = score.max(axis=0)
        better = most_here > best
        label, row = np.where(better, number, label), np.where(better, band[0] + found, row)
        best = np.maximum(best, most_here)
    return _Columns(best, label, row)


def _stretches(
    found: _Columns, inverse: Float[np.ndarray, " l"], px_per_m: Float[np.ndarray, "h w"]
) -> list[Int[np.ndarray, " n"]]:
    """Neighbouring columns that agree on distance and row."""
    stretches: list[list[int]] = []
    for column in np.flatnonzero(found.score > 0).tolist():
        last = stretches[-1][-1] if stretches else None
        if last is not None and _agree(found, inverse, px_per_m, last, column):
            stretches[-1].append(column)
        else:
            stretches.append([column])
    return [np.array(stretch) for stretch in stretches]


def _agree(
    found: _Columns, inverse: Float[np.ndarray, " l"], px_per_m: Float[np.ndarray, "h w"], a: int, b: int
) -> bool:
    depth = abs(np.log(inverse[found.label[a]] / inverse[found.label[b]]))
    rows = abs(int(found.row[a]) - int(found.row[b]))
    same_row = rows <= max(2, _SAME_ROW_M * px_per_m[found.row[b], b])
    return bool(b - a <= _GAP_PX and depth < _SAME_DEPTH and same_row)


def _outline(
    misfits: _Misfits, label: int, row: int, across: slice, px_per_m: float
) -> Bool[np.ndarray, "h w"]:
    """The part above the contact that the thing explains better than what is behind it."""
    first = max(0, row - int(TALLEST_M * px_per_m))
    part = np.s_[first : row + 1, across]
    same = np.abs(np.log(np.maximum(misfits.inverse, 1e-6) / misfits.inverse[label])) < _SAME_DEPTH
    behind = misfits.inverse < _BEHIND * misfits.inverse[label]
    thing = misfits.upright[same][:, *part].min(axis=0)
    other = np.minimum(misfits.road[part], misfits.upright[behind][:, *part].min(axis=0))
    gain = other - thing - _BIAS_LEVELS
    top = len(gain) - 1 - int(np.cumsum(gain.mean(axis=1)[::-1]).argmax())
    sides = np.cumsum(gain[top:].mean(axis=0))
    # The widest gain: from after the least sum before it to the greatest one.
    right = int(sides.argmax())
    left = int(np.append(0.0, sides[: right + 1]).argmin())
    pixels = np.zeros(misfits.road.shape, bool)
    pixels[first + top : row + 1, across.start + left : across.start + right + 1] = True
    return pixels
