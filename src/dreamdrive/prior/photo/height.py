"""The camera's height above the road, by the sizes of road users and the widths of lanes in a photo."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.prior.photo.lanes import lane_widths
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.look import Look, RoadUser
from dreamdrive.scene.street.street_class import StreetClass

USUAL_M = 1.5
_USUAL_SPREAD = 0.25
"""Of the logarithm of the height of cameras in cars, vans and lorries."""
_SIZES: dict[StreetClass, tuple[tuple[float, float, float], ...]] = {
    StreetClass.VEHICLE: (
        (0.5, 1.47, 0.05),
        (0.32, 1.67, 0.05),
        (0.05, 1.93, 0.05),
        (0.07, 2.3, 0.12),
        (0.06, 3.3, 0.13),
    ),
    StreetClass.PERSON: ((0.9, 1.7, 0.06), (0.1, 1.3, 0.15)),
}
"""Shares, heights in metres, relative spreads: low, high cars, pick-ups, vans, lorries; adults, children."""
_READING, _TOP_PX, _FOOT_PX = 0.06, 2.0, 1.5
"""Relative spread of a size as it is read off the picture, beside that of its top and of its foot."""
_TOO_TALL = 0.05
"""By how much vehicles are read too tall: what the network takes for them reaches out of them."""
_WRONG = 0.15
"""Chance that what was read means nothing: hidden feet, two road users taken for one."""
_LANE_M, _LANE_SPREAD, _NO_LANE = 3.35, 0.1, 0.2
"""Widths of lanes, and the chance that what lies between two lines is none."""
_LEAST_SCORE, _LEAST_PX, _LEAST_DROP_PX, _MOST_M = 0.3, 12, 3.0, 30.0
_GRID_M = np.exp(np.linspace(np.log(0.6), np.log(4.0), 400))
_HORIZONS = np.linspace(-2.5, 2.5, 21)
"""Rows tried for the horizon, in standard deviations from where it is seen."""


@dataclass(frozen=True)
class Height:
    """The camera's height above the road in metres, its relative spread, and what told it.

    Attributes:
        metres: The height.
        spread: Standard deviation of its logarithm.
        road_users: How many road users told it.
        lanes: And how many lanes.
    """

    metres: float
    spread: float
    road_users: int
    lanes: int = 0


def height_of(look: Look, camera: Camera) -> Height:
    """The median height, of what is usual for cameras and for the road users and lanes of the photo.

    Over the camera's height a user's is its rows from foot to top over those from foot to horizon, wherever
    on a level road it is (Hoiem et al. 2008). As the horizon is not exact, it is sought together with the
    height. Who is cut off by a border, or far, tells nothing.
    """
    horizons_px = _HORIZONS * look.camera.horizon_spread_px
    chance = -0.5 * (_HORIZONS[:, None] ** 2 + (np.log(_GRID_M / USUAL_M) / _USUAL_SPREAD) ** 2)
    told = 0
    for number, user in enumerate(look.road_users[0], 1):
        if not _whole(user, camera):
            continue
        left, _, right, below = user.box_px
        horizon = float(look.camera.horizon_rows(np.array([(left + right) / 2]))[0])
        if look.camera.focal_px * USUAL_M > _MOST_M * (below - horizon):
            continue
        drop = below - horizon - horizons_px
        tall = below - _top(user, look.instances[0] == number)
        chance = chance + np.log(_likely(tall, np.maximum(drop, _LEAST_DROP_PX), user.kind))
        told += 1
    lanes = lane_widths(look, camera)
    for width in lanes:
        off = np.log(_GRID_M * width / _LANE_M) / _LANE_SPREAD
        chance = chance + np.log(_NO_LANE + (1 - _NO_LANE) * np.exp(-0.5 * off**2))
    share = np.exp(chance - chance.max()).sum(0)
    share = share / share.sum()
    mean = float((share * np.log(_GRID_M)).sum())
    deviation = float(np.sqrt((share * (np.log(_GRID_M) - mean) ** 2).sum()))
    return Height(float(np.interp(0.5, share.cumsum(), _GRID_M)), deviation, told, len(lanes))


def _whole(user: RoadUser, camera: Camera) -> bool:
    left, top, right, below = user.box_px
    inside = left > 1 and top > 1 and right < camera.width_px - 1 and below < camera.height_px - 1
    return user.kind in _SIZES and user.score >= _LEAST_SCORE and inside and below - top >= _LEAST_PX


def _top(user: RoadUser, mask: Bool[np.ndarray, "h w"]) -> int:
    """Row of the top: of a vehicle where it is half as wide as anywhere, as single pixels stick out."""
    wide = mask.sum(1)
    if user.kind != StreetClass.VEHICLE or not wide.any():
        return user.box_px[1]
    return int(np.flatnonzero(wide >= 0.5 * wide.max())[0])


def _likely(tall_px: float, drop_px: Float[np.ndarray, " o"], kind: StreetClass) -> Float[np.ndarray, "o n"]:
    """How likely a road user of a kind is seen so tall, by rows of the horizon and heights of the camera."""
    spread = np.sqrt(_READING**2 + (_TOP_PX / tall_px) ** 2 + (_FOOT_PX / drop_px) ** 2)
    read = np.log(_GRID_M[None] * (tall_px / drop_px)[:, None])
    read -= _TOO_TALL if kind == StreetClass.VEHICLE else 0.0
    found = np.full(read.shape, _WRONG)
    for share, metres, own in _SIZES[kind]:
        off = (read - np.log(metres)) / np.hypot(own, spread)[:, None]
        found += (1 - _WRONG) * share * np.exp(-0.5 * off**2)
    return found
