"""A photo as Gaussians in layers: what it shows, what that hides, and what goes on beyond its borders."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8, UInt16

from dreamdrive.prior.photo.beyond import RIM_PX, THIN, widened
from dreamdrive.prior.photo.fill import continued, grown, inpainted, smoothed
from dreamdrive.prior.photo.pavement import AROUND, along_road
from dreamdrive.prior.photo.street import FAR_M, PhotoStreet
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.sky import Sky
from dreamdrive.scene.street.street_class import FLAT, ROAD_USERS, StreetClass
from dreamdrive.scene.surfels import surfels, tangents

_ROOM_M = 25.0
"""How far what is behind a vehicle that drives on is at least behind it."""
_LEVEL = 0.3
"""What is hidden and at most by this share nearer than the road is the road."""


@dataclass(frozen=True)
class LayerOptions:
    """How far a photo goes on.

    Attributes:
        reach_px: How far behind the edge of what is near the street goes on, at a picture 480 wide.
        beyond: How far it goes on beyond the left, right and lower border, as a share of its width.
        edge: Relative step in depth from which something hides what is behind it.
        opacity: Of every Gaussian.
        footprint: Standard deviation over the distance between pixels.
        stretch: How long a disc may be along a surface that is seen at a grazing angle, as the road is.
    """

    reach_px: int = 20
    beyond: float = 0.25
    edge: float = 0.12
    opacity: float = 0.95
    footprint: float = 0.5
    stretch: float = 20.0


@dataclass(frozen=True)
class Layers:
    """A photo in space.

    Attributes:
        gaussians: Of all layers; ``source_frame`` is 0 for what the photo shows, 1 for what is made up,
            ``actor`` the index of a road user, -1 for none.
        sky: Behind them.
        rgb: The picture of the front layer, wider than the photo (H, W, 3), and its camera.
        behind: Which Gaussians are not of that layer (N,).
        carried_m: How far each has been carried from its place in the photo (N, 3).
        moving: Which are of road users that move (N,).
    """

    gaussians: Gaussians
    sky: Sky
    rgb: UInt8[np.ndarray, "h w 3"]
    camera: Camera
    behind: Bool[torch.Tensor, " n"]
    carried_m: Float[torch.Tensor, "n 3"]
    moving: Bool[torch.Tensor, " n"]

    def at(self, t_s: float, velocities_m_s: Float[np.ndarray, "u 3"]) -> "Layers":
        """With the road users of the photo where they are so long after it."""
        actor = self.gaussians.actor
        if actor is None or not velocities_m_s.any():
            return self
        velocity = torch.cat([_tensor(velocities_m_s), torch.zeros(1, 3)])[actor]  # the last: of all else
        carried = replace(self.gaussians, means=self.gaussians.means + t_s * velocity)
        return replace(self, gaussians=carried, carried_m=t_s * velocity, moving=(velocity != 0).any(1))


@dataclass(frozen=True)
class _Sheet:
    """Pixels with depth; 0 where there is nothing."""

    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float[np.ndarray, "h w"]


def layers_of(
    street: PhotoStreet, leaving: Sequence[int] = (), options: LayerOptions = LayerOptions()
) -> Layers:
    """All that a drive into the photo may uncover; road users ``leaving``, numbered from 1, drive on."""
    margin = round(options.beyond * street.camera.width_px)
    wide = widened(street, margin)
    inside = np.zeros(wide.classes.shape, bool)
    photo = slice(0, street.camera.height_px), slice(margin, margin + street.camera.width_px)
    inside[photo] = street.classes != StreetClass.OWN_CAR
    behind = _behind(wide, leaving, options)
    none = np.zeros_like(wide.road_users)
    front = _gaussians(_Sheet(wide.rgb, wide.depth_m), wide.camera, inside, _whole(wide), options)
    back = _gaussians(_Sheet(behind.rgb, behind.depth_m), wide.camera, np.zeros_like(inside), none, options)
    gaussians = Gaussians.concatenate(front, back)
    is_behind = torch.arange(len(gaussians)) >= len(front)
    nowhere = torch.zeros_like(gaussians.means)
    none_moves = torch.zeros_like(is_behind)
    return Layers(gaussians, sky_of(street), wide.rgb, wide.camera, is_behind, nowhere, none_moves)


def _whole(street: PhotoStreet) -> UInt16[np.ndarray, "h w"]:
    """Road users with the rim that is as deep as they are, which would stay behind when they move."""
    around = cv2.dilate(street.road_users, np.ones((5, 5)))
    deep = cv2.dilate(np.where(street.road_users > 0, street.depth_m, 0).astype(np.float32), np.ones((5, 5)))
    rim = (street.road_users == 0) & (around > 0) & (street.depth_m < 1.05 * deep)
    rim &= ~np.isin(street.classes, FLAT)
    return np.where(rim, around, street.road_users)


def _behind(street: PhotoStreet, leaving: Sequence[int], options: LayerOptions) -> _Sheet:
    """What is hidden: the street without road users and poles, and what goes on behind edges."""
    solid, plane = street.depth_m > 0, street.ground.depth_m(street.camera)
    shadow = np.isin(street.classes, FLAT) & (street.road_users > 0)
    thin = np.isin(street.classes, THIN) | shadow
    reach = 2 * round(options.reach_px * street.camera.width_px / 480) + 1
    inverse = np.where(solid, 1 / np.maximum(street.depth_m, 1e-3), 1 / FAR_M).astype(np.float32)
    farther = cv2.erode(inverse, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach)))
    smooth = cv2.blur(farther, (reach // 2, reach // 2))
    # A road user's whole shape hides something: there depth runs from side to side.
    around = ~grown(thin, RIM_PX) & (street.classes != StreetClass.OWN_CAR)
    across = _across(inverse, around)
    road = np.isin(street.road_users, leaving)
    across = np.where(road, np.minimum(across, 1 / (street.depth_m + _ROOM_M)), across)
    inverse_behind = np.maximum(np.where(thin, across, smooth), 1 / FAR_M)
    level = plane * inverse_behind < 1 + _LEVEL
    depth = np.where(level, plane, 1 / inverse_behind)
    hidden = solid & (thin | (depth > (1 + options.edge) * street.depth_m)) & (depth > 1.02 * street.depth_m)
    depth, hidden = np.where(shadow, 1.02 * street.depth_m, depth), hidden | shadow
    source = _without(street, hidden, level)
    sky = _across((street.classes == StreetClass.SKY).astype(np.float32), around) > 0.5
    open_ = (sky | ~thin) & (1 / inverse_behind >= 0.8 * FAR_M) & (plane > FAR_M)
    return _Sheet(source, np.where(hidden & ~open_, depth, 0).astype(np.float32))


def _without(
    street: PhotoStreet, hidden: Bool[np.ndarray, "h w"], level: Bool[np.ndarray, "h w"]
) -> UInt8[np.ndarray, "h w 3"]:
    """The picture without what hides something: ground goes on as ground, what stands as what stands."""
    flat, sky = np.isin(street.classes, FLAT), street.classes == StreetClass.SKY
    road_users = grown((street.road_users > 0) | np.isin(street.classes, ROAD_USERS), RIM_PX)
    hiding = grown(hidden, 3)
    edges = inpainted(street.rgb, hiding)
    stands = smoothed(street.rgb, road_users | flat | sky)
    bare = flat & ~hiding & ~road_users
    wanted = level & ~bare & (street.ground.depth_m(street.camera) < FAR_M)
    found, left = along_road(street.rgb, street.camera, street.ground, wanted, bare, AROUND)
    ground = smoothed(found, ~bare & (left | ~wanted))
    return np.where(level[..., None], ground, np.where(road_users[..., None], stands, edges))


def _across(values: Float[np.ndarray, "h w"], known: Bool[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
    """Values where they are known, and straight between these along each row; 0 in rows without any.

    Inverse depth runs straight over a plane, such as the front of a row of houses.
    """
    found, columns = np.zeros_like(values), np.arange(values.shape[1])
    for row in np.flatnonzero(known.any(1)):
        found[row] = np.interp(columns, columns[known[row]], values[row, known[row]])
    return found


def _gaussians(
    sheet: _Sheet,
    camera: Camera,
    shown: Bool[np.ndarray, "h w"],
    road_users: UInt16[np.ndarray, "h w"],
    options: LayerOptions,
) -> Gaussians:
    """A disc for each pixel that has depth."""
    chosen, depth = sheet.depth_m > 0, sheet.depth_m.astype(np.float64)
    spacing = depth[chosen] / camera.fx_px
    rotations, extents = surfels(tangents(camera, depth)[chosen], spacing, options.stretch)
    colour = sheet.rgb[chosen].astype(np.float64) / 255
    count = len(spacing)
    return Gaussians(
        means=_tensor((camera.rays() * depth[..., None])[chosen]),
        quaternions=_tensor(rotations),
        log_scales=_tensor(np.log(extents * options.footprint)),
        logit_opacities=torch.full((count,), float(np.log(options.opacity / (1 - options.opacity)))),
        sh=_tensor((colour - 0.5) / SH_C0)[:, None],
        source_frame=torch.from_numpy(np.where(shown[chosen], 0, 1)),
        actor=torch.from_numpy(road_users[chosen].astype(np.int64) - 1),
    )


def _tensor(values: np.ndarray) -> Float[torch.Tensor, "..."]:
    return torch.tensor(values, dtype=torch.float32)


def sky_of(street: PhotoStreet) -> Sky:
    """The photo's sky, continued in all directions ahead; below it a blur of what stands there."""
    reach = np.pi / 2
    texel_rad = 2 / street.camera.fx_px
    rows, columns = round(2 * reach / texel_rad), round(2 * reach / texel_rad)
    azimuth = np.linspace(-reach, reach, columns, dtype=np.float32)[None, :]
    elevation = np.linspace(reach, -reach, rows, dtype=np.float32)[:, None]
    ahead = np.cos(elevation) * np.cos(azimuth)
    x, y = np.cos(elevation) * np.sin(azimuth), -np.sin(elevation) * np.ones_like(azimuth)
    camera, safe = street.camera, np.maximum(ahead, 1e-3)
    u = (camera.fx_px * x / safe + camera.cx_px - 0.5).astype(np.float32)
    v = (camera.fy_px * y / safe + camera.cy_px - 0.5).astype(np.float32)
    own = grown(street.classes == StreetClass.OWN_CAR, 3)
    clear = cv2.erode(street.sky.astype(np.uint8), np.ones((5, 5))).astype(np.float32)
    colours = street.rgb.astype(np.float32) / 255
    backdrop = continued(colours, (~own).astype(np.float32))
    sky = continued(colours, clear) if clear.any() else backdrop
    low = cv2.GaussianBlur(backdrop, (0, 0), street.camera.width_px / 40)
    is_sky = grown(street.sky, 9)[..., None]
    level = (street.ground.depth_m(camera) > FAR_M)[..., None]
    shown = np.where(is_sky | level, sky, low).astype(np.float32)
    texture = cv2.remap(shown, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return Sky(_tensor(texture), (-reach, reach), (-reach, reach))
