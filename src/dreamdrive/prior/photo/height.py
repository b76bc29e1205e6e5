"""How high the camera is above the road, by the sizes of the road users that a photo shows whole."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.look import Look
from dreamdrive.scene.street_class import StreetClass

USUAL_M = 1.5
_USUAL_SPREAD = 0.25
"""Of the logarithm of the height of cameras in cars, vans and lorries."""
_SIZES: dict[StreetClass, tuple[tuple[float, float, float], ...]] = {
    StreetClass.VEHICLE: ((0.62, 1.48, 0.06), (0.2, 1.75, 0.07), (0.1, 2.2, 0.12), (0.08, 3.2, 0.15)),
    StreetClass.PERSON: ((0.9, 1.7, 0.06), (0.1, 1.3, 0.15)),
}
"""Shares, heights in metres and relative spreads: cars, tall cars, vans, lorries; grown-ups, children."""
_READING = 0.08
"""Relative spread of a height as it is read off the picture, besides two pixels."""
_READING_PX = 2.0
_WRONG = 0.15
"""Chance that what was read means nothing: hidden feet, two users taken for one."""
_LEAST_SCORE, _LEAST_PX, _MOST_M = 0.3, 12, 40.0
_GRID_M = np.exp(np.linspace(np.log(0.6), np.log(4.0), 400))


@dataclass(frozen=True)
class Height:
    """The camera's height above the road in metres, its relative spread, and how many users told it."""

    metres: float
    spread: float
    users: int


def height_of(look: Look, camera: Camera) -> Height:
    """The likeliest height, of what is usual for cameras and for the road users of the photo.

    A user's height over the camera's is read off its foot on the level road and its top; who is cut off by a
    border, or far, tells nothing.
    """
    ground = Ground(look.camera.up_in(camera), 1.0)
    plane, rays = ground.depth_m(camera), camera.rays()
    chance = np.exp(-0.5 * (np.log(_GRID_M / USUAL_M) / _USUAL_SPREAD) ** 2)
    told = 0
    for user in look.road_users[0]:
        left, top, right, below = user.box_px
        column = min((left + right) // 2, camera.width_px - 1)
        inside = left > 1 and top > 1 and right < camera.width_px - 1 and below < camera.height_px - 1
        if user.kind not in _SIZES or user.score < _LEAST_SCORE or not inside or below - top < _LEAST_PX:
            continue
        foot = float(plane[below - 1, column])
        if foot * USUAL_M > _MOST_M:
            continue
        over = float(ground.height_m(rays[top, column] * foot))
        if over <= 0:
            continue
        spread = np.hypot(_READING, _READING_PX / (below - top))
        chance = chance * _likely(over * _GRID_M, user.kind, spread)
        told += 1
    chance = chance / chance.sum()
    mean = float((chance * np.log(_GRID_M)).sum())
    deviation = float(np.sqrt((chance * (np.log(_GRID_M) - mean) ** 2).sum()))
    return Height(float(_GRID_M[chance.argmax()]), deviation, told)


def _likely(heights_m: Float[np.ndarray, " n"], kind: StreetClass, spread: float) -> Float[np.ndarray, " n"]:
    """How likely a user of that kind is to be so high, over what a wrong reading makes of it."""
    found = np.full(len(heights_m), _WRONG)
    for share, metres, own in _SIZES[kind]:
        off = np.log(heights_m / metres) / np.hypot(own, spread)
        found += (1 - _WRONG) * share * np.exp(-0.5 * off**2)
    return found
