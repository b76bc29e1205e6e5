"""Motion of the road users of a photo: vehicles along their lane, people along the street."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.names import TrafficName
from dreamdrive.prior.photo.street import PhotoStreet
from dreamdrive.prior.photo.way import DRIVEN_M_S, level_axes
from dreamdrive.scene.street.street_class import FLAT, ROAD_USERS, StreetClass

TRAFFIC: TrafficName = "flow"
"""Unless told."""
SPEED_M_S = 8.0
"""Of vehicles, unless told."""
WALK_M_S = 1.3
"""Of people (Bohannon 1997, comfortable gait)."""
_FAST_M_S = 15.0
"""Where traffic is as fast, nobody parks."""
_LANE_M = 3.5
_FAR_M = 80.0
_LEAST_PX = 60
"""Of what is set in motion: smaller road users are a few specks."""
_FOOT = 0.1
"""Share of a road user's height that counts as its foot."""
_BESIDE_M, _KERB_M = 0.8, 2.5
"""How far beside a vehicle the road has to go on, and how far to the kerb: one that is parked is near it."""
_ON_ROAD = 0.7
_RED = 1.7
"""Red over the other colours, in the lamps at the back of a car; and the least and largest share of them."""
_LAMPS = (0.003, 0.15)


@dataclass(frozen=True)
class _Place:
    """Where a road user stands: metres to the right and ahead, its lowest row, whether it is cut off."""

    right_m: float
    ahead_m: float
    row: int
    cut_off: bool


def velocities_of(
    street: PhotoStreet, traffic: TrafficName, speed_m_s: float | None
) -> Float[np.ndarray, "u 3"]:
    """Velocities of the road users in the street's world, in m/s; row k is of user k + 1."""
    if traffic == "still":
        return np.zeros((int(street.road_users.max(initial=0)), 3))
    return flowing(street, SPEED_M_S if speed_m_s is None else speed_m_s)


def going_ahead(street: PhotoStreet, velocities: Float[np.ndarray, "u 3"]) -> list[int]:
    """Numbers, from 1, of the road users that drive ahead no slower than the own car does unless told."""
    return (1 + np.flatnonzero(velocities @ level_axes(street.ground)[:, 2] >= DRIVEN_M_S)).tolist()


def flowing(street: PhotoStreet, speed_m_s: float = SPEED_M_S) -> Float[np.ndarray, "u 3"]:
    """Velocities of the road users in the street's world, in m/s; row k is of user k + 1.

    What is in the own lane, or beside it on the own side with road all around, drives ahead; on the other
    side it comes towards the camera, unless its back is seen. Vehicles that stand at the edge of the road, or
    may do, are parked, and nearly all that the picture's border cuts off; on the own side none are where
    traffic is fast. Far users stand still.
    """
    count = int(street.road_users.max(initial=0))
    velocities, axes = np.zeros((count, 3)), level_axes(street.ground)
    points = street.camera.rays() * street.depth_m[..., None] @ axes
    side = _own_side(street, axes)
    stands = ~np.isin(street.classes, FLAT)  # shadows tell nothing of the place
    for user in range(1, count + 1):
        mask = (street.road_users == user) & stands
        place = _place_of(mask, street.depth_m, points)
        if place is None:
            continue
        kind = StreetClass(int(np.bincount(street.classes[mask]).argmax()))
        if kind == StreetClass.PERSON:
            way = 0.0 if place.cut_off else WALK_M_S * (1 if user % 2 else -1)
        else:
            way = speed_m_s * _direction(street, mask, place, side, parked=speed_m_s < _FAST_M_S)
            if kind == StreetClass.TWO_WHEELER and abs(place.right_m) > _LANE_M / 2:
                way = 0.0  # most that are not in the lane lean on something
        velocities[user - 1] = axes[:, 2] * way
    return velocities


def _own_side(street: PhotoStreet, axes: Float[np.ndarray, "3 3"]) -> int:
    """1 where traffic keeps to the right, -1 to the left: the road goes on to the other side."""
    plane = street.ground.depth_m(street.camera)
    near = (plane > 4.0) & (plane < 20.0)
    near &= np.isin(street.classes, (StreetClass.ROAD, StreetClass.MARKING, StreetClass.VEHICLE))
    if not near.any():
        return 1
    right_m = (street.camera.rays()[near] * plane[near, None] @ axes)[:, 0]
    return 1 if np.percentile(right_m, 5) + np.percentile(right_m, 95) < 0.5 else -1


def _place_of(
    mask: Bool[np.ndarray, "h w"], depth_m: Float[np.ndarray, "h w"], points: Float[np.ndarray, "h w 3"]
) -> _Place | None:
    """None where the road user is far or hardly seen."""
    if mask.sum() < _LEAST_PX:
        return None
    rows = np.flatnonzero(mask.any(1))
    foot = mask.copy()
    foot[: rows[-1] - max(1, int(_FOOT * len(rows)))] = False
    foot &= depth_m > 0
    if not foot.any() or np.median(depth_m[foot]) > _FAR_M:
        return None
    right_m = float(np.median(points[mask & (depth_m > 0)][:, 0]))
    cut_off = bool(mask[:, :2].any() or mask[:, -2:].any() or mask[-2:].any())
    return _Place(right_m, float(np.median(points[foot][:, 2])), int(rows[-1]), cut_off)


def _direction(
    street: PhotoStreet, mask: Bool[np.ndarray, "h w"], place: _Place, side: int, *, parked: bool
) -> int:
    """1 ahead, -1 towards the camera, 0 where it is parked; on the own side none may be."""
    if not parked and place.right_m * side > -_LANE_M / 2:
        return 1
    if abs(place.right_m) < _LANE_M / 2:
        return 0 if place.cut_off else 1
    strict, may_be = (_on_road(street, mask, place, hidden_is_road=each) for each in (False, True))
    if place.right_m * side > 0:
        return 1 if strict and not place.cut_off else 0
    if may_be and _back_is_seen(street, mask):
        return 1
    return -1 if strict and not place.cut_off else 0


def _on_road(
    street: PhotoStreet, mask: Bool[np.ndarray, "h w"], place: _Place, *, hidden_is_road: bool
) -> bool:
    """Whether the road goes on at both sides of the foot; what other road users hide is road or is not."""
    kerb = (_KERB_M, _BESIDE_M) if place.right_m < 0 else (_BESIDE_M, _KERB_M)
    left, right = (max(2, round(street.camera.fx_px * metres / place.ahead_m)) for metres in kerb)
    columns = np.flatnonzero(mask[max(place.row - 1, 0) : place.row + 1].any(0))
    kinds = (StreetClass.ROAD, StreetClass.MARKING, *(ROAD_USERS if hidden_is_road else ()))
    road, rows = np.isin(street.classes, kinds), slice(max(place.row - 1, 0), place.row + 3)
    beside = (
        road[rows, max(columns[0] - left, 0) : columns[0]],
        road[rows, columns[-1] + 1 : columns[-1] + 1 + right],
    )
    return all(each.size > 0 and float(each.mean()) > _ON_ROAD for each in beside)


def _back_is_seen(street: PhotoStreet, mask: Bool[np.ndarray, "h w"]) -> bool:
    """Whether red lamps are seen, and not a red car."""
    rgb = cv2.GaussianBlur(street.rgb, (3, 3), 0)[mask].astype(np.float64)
    red = (rgb[:, 0] > 70) & (rgb[:, 0] > _RED * rgb[:, 1:].max(1))
    return _LAMPS[0] < float(red.mean()) < _LAMPS[1]
