"""The street of a photo, as depth in metres over a level road."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8, UInt16

from dreamdrive.prior.photo.upright import poles_stand, upright
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.street.look import Look
from dreamdrive.scene.street.street_class import FLAT, StreetClass

FAR_M = 250.0
_LEVEL_M, _HILLY_M = 40.0, 120.0
"""Up to the first distance the ground is the level road; from the second on it is as deep as it looks."""
_FOOT = 0.12
"""Share of a road user's height that counts as its foot."""
_LIKE = 2.0
"""A depth that has to be changed by more than this factor is no foot on the road."""
_NEARER = 0.93
"""What faces the camera is nearer than where the lowest pixels of a road user meet the road: 8 % on lidar."""
_EDGE = 0.1
_SHADOW, _DARK = 0.2, 0.75
"""How far a shadow reaches over the size of its road user, and how light it is over the ground below."""


@dataclass(frozen=True)
class PhotoStreet:
    """A picture with depth: the world is its camera, in metres.

    Attributes:
        rgb: The picture (H, W, 3).
        camera: Its pinhole, at the identity.
        depth_m: Depth along z (H, W); 0 in the sky and on the own car.
        classes: ``StreetClass`` of each pixel (H, W).
        road_users: 1 + the index of a road user (H, W); 0 where there is none.
        ground: The level road.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    camera: Camera
    depth_m: Float[np.ndarray, "h w"]
    classes: UInt8[np.ndarray, "h w"]
    road_users: UInt16[np.ndarray, "h w"]
    ground: Ground

    @property
    def sky(self) -> Bool[np.ndarray, "h w"]:
        """Sky mask (H, W)."""
        return self.classes == StreetClass.SKY


def street_of(rgb: UInt8[np.ndarray, "h w 3"], camera: Camera, look: Look, height_m: float) -> PhotoStreet:
    """Depth of a photo from a look at it, on a level road ``height_m`` below the camera.

    The look's tilt tells the road: on drawn streets its plane is better than the look's depth within 20 m.
    All other depth follows the road's, road users by their feet.
    """
    ground = Ground(look.camera.up_in(camera), height_m)
    plane = ground.depth_m(camera)
    seen, classes, road_users = look.depth[0] * np.float64(height_m), look.classes[0], look.instances[0]
    flat = np.isin(classes, FLAT)
    depth = seen * _factor(plane, seen, flat & (plane < _LEVEL_M))
    for user in range(1, int(road_users.max()) + 1):
        _stand(depth, plane, road_users == user)
    poles_stand(depth, classes, plane)
    stands = ~flat & ~np.isin(classes, (StreetClass.SKY, StreetClass.OWN_CAR))
    depth = _sharp(depth, rgb)
    depth = upright(depth, road_users.astype(np.int64) + 1000 * (classes == StreetClass.POLE), stands)
    share = np.clip((plane - _LEVEL_M) / (_HILLY_M - _LEVEL_M), 0, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        on_road = np.exp((1 - share) * np.log(plane) + share * np.log(np.maximum(depth, 1e-3)))
    depth = np.where(flat & (plane < _HILLY_M), on_road, depth)
    # Nothing lies under the road.
    depth = np.where(plane < _LEVEL_M, np.minimum(depth, plane), depth)
    depth = np.clip(depth, 0, FAR_M)
    depth[(classes == StreetClass.SKY) | (classes == StreetClass.OWN_CAR)] = 0
    return PhotoStreet(
        rgb, camera, depth.astype(np.float32), classes, _with_shadows(road_users, classes, rgb), ground
    )


def _with_shadows(
    road_users: UInt16[np.ndarray, "h w"], classes: UInt8[np.ndarray, "h w"], rgb: UInt8[np.ndarray, "h w 3"]
) -> UInt16[np.ndarray, "h w"]:
    """Road users with the dark ground under them, which goes where they go."""
    light, flat, out = rgb.mean(2), np.isin(classes, FLAT), road_users.copy()
    for user in range(1, int(road_users.max(initial=0)) + 1):
        mask = road_users == user
        rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
        if not len(rows):
            continue
        down, aside = max(2, int(_SHADOW * len(rows))), max(1, int(_SHADOW * len(columns) / 2))
        around = np.ones((2 * down + 1, 2 * aside + 1), np.uint8)
        around[down + 1 :] = 0  # what is above a pixel reaches down to it
        under = (cv2.dilate(mask.astype(np.uint8), around) > 0) & flat & (road_users == 0)
        under[: rows[-1] - 2 * down] = False
        road = flat[rows[-1] :, columns[0] : columns[-1] + 1]
        if under.any() and road.any():
            usual = np.median(light[rows[-1] :, columns[0] : columns[-1] + 1][road])
            out[under & (light < _DARK * usual)] = user
    return out


def _factor(plane: np.ndarray, seen: np.ndarray, road: np.ndarray) -> float:
    """What makes the depth that is seen that of the road, where it is seen near."""
    known = road & (seen > 0)
    return float(np.median(plane[known] / seen[known])) if known.sum() > 100 else 1.0


def _stand(depth: np.ndarray, plane: np.ndarray, user: Bool[np.ndarray, "h w"]) -> None:
    """Move a road user to where its foot meets the road, unless the picture's border cuts the foot off."""
    rows = np.flatnonzero(user.any(1))
    if not len(rows) or rows[-1] >= len(user) - 2:
        return
    foot = user.copy()
    foot[: rows[-1] - max(2, int(_FOOT * len(rows)))] = False
    here = float(np.median(depth[foot]))
    factor = float(plane[rows[-1], user[rows[-1]]].mean()) / max(here, 1e-3)
    if 1 / _LIKE < factor < _LIKE:
        depth[user] *= _NEARER * factor


def _sharp(depth: Float[np.ndarray, "h w"], rgb: UInt8[np.ndarray, "h w 3"]) -> Float[np.ndarray, "h w"]:
    """Depth between two surfaces is that of the one whose colour the pixel has."""
    near, far = cv2.erode(depth, np.ones((5, 5))), cv2.dilate(depth, np.ones((5, 5)))
    between = (depth > (1 + _EDGE) * near) & (depth < far / (1 + _EDGE)) & (near > 0)
    if not between.any():
        return depth
    colours, middle = cv2.GaussianBlur(rgb, (3, 3), 0).astype(np.float64), np.sqrt(near * far)
    sums = []
    for side in (~between & (depth < middle), ~between & (depth >= middle)):
        weight = cv2.blur(side.astype(np.float64), (9, 9))
        sums.append(cv2.blur(colours * side[..., None], (9, 9)) / np.maximum(weight, 1e-6)[..., None])
    off = [np.linalg.norm(colours - each, axis=2) for each in sums]
    return np.where(between, np.where(off[0] < off[1], near, far), depth)
