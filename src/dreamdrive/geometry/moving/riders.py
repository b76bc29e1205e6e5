"""Riders and their two-wheelers, joined to one road user."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from jaxtyping import Bool, UInt16

from dreamdrive.scene.street.look import Look, RoadUser
from dreamdrive.scene.street.street_class import StreetClass

_BORDER_PX = 3  # least border that a rider shares with what is ridden
_ABOVE = 0.5  # of the narrower one's width lies over the other
_LOWEST = 0.3  # of the two-wheeler's height: the head of who rides it is higher


def with_riders(look: Look, frames: Sequence[int]) -> tuple[Look, Bool[np.ndarray, "f h w"]]:
    """The look with each rider as a part of what is ridden, and the pixels of both.

    A person rides the two-wheeler that it touches and sits above; of several that with the longest border.
    """
    instances = look.instances.copy()
    ridden = np.zeros(instances.shape, bool)
    for frame in frames:
        seen, road_users = look.instances[frame], look.road_users[frame]
        kinds = {number: user for number, user in enumerate(road_users, start=1)}
        wheels = {n: user for n, user in kinds.items() if user.kind == StreetClass.TWO_WHEELER}
        for number, user in kinds.items():
            if user.kind != StreetClass.PERSON:
                continue
            under = _under(seen, number, user, wheels)
            if under is not None:
                instances[frame][seen == number] = under
                ridden[frame] |= instances[frame] == under
    return replace(look, instances=instances), ridden


def _under(
    seen: UInt16[np.ndarray, "h w"], person: int, user: RoadUser, wheels: dict[int, RoadUser]
) -> int | None:
    """The number of the two-wheeler that a person rides."""
    around = cv2.dilate((seen == person).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    left, top, right, _ = user.box_px
    best, longest = None, _BORDER_PX - 1
    for number, wheel in wheels.items():
        first, highest, last, lowest = wheel.box_px
        shared_px = min(right, last) - max(left, first)
        above = top < highest + _LOWEST * (lowest - highest)
        border = int((around & (seen == number)).sum())
        if above and shared_px > _ABOVE * min(right - left, last - first) and border > longest:
            best, longest = number, border
    return best
