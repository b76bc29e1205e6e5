"""Blurred heads and plates: where the street network sees people and vehicles, a picture is made coarse."""

from collections.abc import Iterator

import cv2
import numpy as np
from jaxtyping import UInt8

from dreamdrive.scene.street.look import Look
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.street_network.look import Network, look

_PARTS = {
    StreetClass.PERSON: (-0.4, 0.35),
    StreetClass.TWO_WHEELER: (-0.4, 0.5),
    StreetClass.VEHICLE: (0.45, 1.0),
}
"""From where to where, as shares of its height from the top, a thing is blurred: the head of a person and
of a rider, who belongs to the two-wheeler, and the part of a vehicle where plates are. Often
the network sees no head on a body: what is above it is blurred, too."""
_AROUND = 0.1
"""Of the height of a thing: outlines that are seen are not exact."""
_CELL = {StreetClass.PERSON: 1 / 12, StreetClass.TWO_WHEELER: 1 / 12, StreetClass.VEHICLE: 1 / 10}
"""Side of a cell, which has one colour, as a share of the height: a head is two cells high, a plate one."""
_CUT_CELLS = 3
"""Of the shorter side of what the picture's border cuts off, of which the height tells nothing."""

Box = tuple[int, int, int, int]
"""First column and row, and last column and row + 1."""


def blur(frame: UInt8[np.ndarray, "h w 3"], network: Network) -> UInt8[np.ndarray, "h w 3"]:
    """The picture with heads and plates made coarse; all else is left as it is.

    It is as good as the network: who is not seen is not blurred, nor is a face behind a pane or on a poster,
    nor writing elsewhere. It makes people hard to know, and is no proof that nobody can be known.
    """
    made = frame.copy()
    for (left, top, right, low), cell_px in _boxes(look(frame[None], network)):
        part = made[top:low, left:right]
        height, width = part.shape[:2]
        cells = max(1, round(width / cell_px)), max(1, round(height / cell_px))
        coarse = cv2.resize(part, cells, interpolation=cv2.INTER_AREA)
        made[top:low, left:right] = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_LINEAR)
    return made


def _boxes(seen: Look) -> Iterator[tuple[Box, float]]:
    """What is to be blurred in the one frame that was looked at, and the side of its cells."""
    height, width = seen.classes.shape[1:]
    for kind, (first, last) in _PARTS.items():
        for left, top, right, low in _things(seen, kind):
            tall = low - top
            cell_px = _CELL[kind] * tall
            if left == 0 or top == 0 or right == width or low == height:
                cell_px = max(cell_px, min(tall, right - left) / _CUT_CELLS)
            around = _AROUND * tall
            begin, end = top + first * tall - around, top + last * tall + around
            corner = max(0, int(left - around)), max(0, int(begin))
            other = min(width, int(np.ceil(right + around))), min(height, int(np.ceil(end)))
            yield (*corner, *other), cell_px


def _things(seen: Look, kind: StreetClass) -> Iterator[Box]:
    """Boxes of the road users of a kind, and of what has their class and is of none of them."""
    yield from (user.box_px for user in seen.road_users[0] if user.kind == kind)
    rest = ((seen.classes[0] == kind) & (seen.instances[0] == 0)).astype(np.uint8)
    _, _, found, _ = cv2.connectedComponentsWithStats(rest)
    for left, top, width, height, _ in found[1:].tolist():
        yield left, top, left + width, top + height
