"""Ray casting of textured boxes: colour, depth and labels of the procedural street."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Int

from dreamdrive.data.street_textures import Texture
from dreamdrive.scene.camera import Camera

_NEAR_M = 0.2
_TAPS = np.array([-0.375, -0.125, 0.125, 0.375], dtype=np.float32)
# Axes of a face that its texture's columns and rows run along, by the axis of its normal.
_FACE_AXES = ((2, 1), (0, 2), (0, 1))
# Daylight on the faces -x, +x, -y (up), +y, -z, +z.
_LIGHT = (0.80, 0.98, 1.0, 0.4, 0.88, 0.72)


@dataclass(frozen=True)
class Solid:
    """A box at one instant: axes x right, y down, z forward, origin at its centre.

    Attributes:
        half_m: Half of its size (3,).
        street_from_box: Rigid pose (4, 4).
        textures: Texture of the faces -x, +x, -y (up), +y, -z, +z.
        instance: Label of its pixels, 0 for the backdrop.
        shadow: Whether it darkens the ground around it.
    """

    half_m: Float[np.ndarray, "3"]
    street_from_box: Float[np.ndarray, "4 4"]
    textures: tuple[Texture, ...]
    instance: int = 0
    shadow: bool = False


@dataclass(frozen=True)
class Hits:
    """Nearest surfaces (H, W): depth along z (infinite for none), index of the solid (-1 for none)."""

    depth_m: Float[np.ndarray, "h w"]
    solid: Int[np.ndarray, "h w"]


def cast(camera: Camera, solids: list[Solid], dtype: type = np.float64) -> Hits:
    """The nearest solid along the ray of each pixel centre; the camera's world is the street."""
    shape = camera.height_px, camera.width_px
    depth = np.full(shape, np.inf, dtype=dtype)
    index = np.full(shape, -1, dtype=np.int32)
    for number, window in _windows(camera, solids):
        solid = solids[number]
        origin, rays = _local_rays(camera, solid, window, dtype)
        enter = np.full(rays[0].shape, -np.inf, dtype=dtype)
        leave = np.full(rays[0].shape, np.inf, dtype=dtype)
        for axis in range(3):
            # A ray parallel to a face meets it almost at infinity.
            inverse = 1 / np.where(np.abs(rays[axis]) < 1e-12, dtype(1e-12), rays[axis])
            near, far = ((side * solid.half_m[axis] - origin[axis]) * inverse for side in (-1, 1))
            np.maximum(enter, np.minimum(near, far), out=enter)
            np.minimum(leave, np.maximum(near, far), out=leave)
        region = depth[window]
        hit = (enter <= leave) & (enter > _NEAR_M) & (enter < region)
        region[hit] = enter[hit]
        index[window][hit] = number
    return Hits(depth, index)


def shade(camera: Camera, solids: list[Solid], hits: Hits, sky: np.ndarray) -> Float[np.ndarray, "h w 3"]:
    """Colours (H, W, 3) in 0..255 of what :func:`cast` found, ``sky`` (180, 720, 3) behind it."""
    colour = np.empty((*hits.solid.shape, 3), dtype=np.float32)
    above = hits.solid < 0
    colour[above] = _sky(camera, sky, above)
    for number, window in _windows(camera, solids):
        solid = solids[number]
        inside = np.nonzero(hits.solid[window] == number)
        if len(inside[0]) == 0:
            continue
        origin, rays = _local_rays(camera, solid, window, np.float32)
        depth = hits.depth_m[window][inside].astype(np.float32)
        rays = np.stack([np.broadcast_to(r, hits.solid[window].shape)[inside] for r in rays])
        colour[window][inside] = _surface(solid, origin, rays, depth, 1 / camera.fx_px)
    ground = hits.solid == 0
    colour[ground] *= _shadows(camera, solids, hits.depth_m, ground)[:, None]
    return colour


def _windows(camera: Camera, solids: list[Solid]) -> list[tuple[int, tuple[slice, slice]]]:
    """Index of each solid in view with the rows and columns that it can reach."""
    unit = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
    poses = camera.camera_from_world @ np.stack([solid.street_from_box for solid in solids])
    half = np.stack([solid.half_m for solid in solids])
    corners = (unit * half[:, None]) @ poses[:, :3, :3].transpose(0, 2, 1) + poses[:, None, :3, 3]
    found: list[tuple[int, tuple[slice, slice]]] = []
    for number in np.flatnonzero((corners[..., 2] > _NEAR_M).any(axis=1)):
        window = _window(camera, corners[number])
        if window is not None:
            found.append((int(number), window))
    return found


def _window(camera: Camera, points: np.ndarray) -> tuple[slice, slice] | None:
    """Rows and columns that the hull of the points (8, 3) can reach; None when it is out of view."""
    ahead, behind = points[points[:, 2] > _NEAR_M], points[points[:, 2] <= _NEAR_M]
    if len(behind):
        # Edges that cross the near plane are cut there: the hull of these points is the visible part.
        share = (_NEAR_M - behind[:, None, 2]) / (ahead[None, :, 2] - behind[:, None, 2])
        cut = behind[:, None] + share[..., None] * (ahead[None] - behind[:, None])
        ahead = np.concatenate([ahead, cut.reshape(-1, 3)])
    x = ahead[:, 0] / ahead[:, 2] * camera.fx_px + camera.cx_px
    y = ahead[:, 1] / ahead[:, 2] * camera.fy_px + camera.cy_px
    left, right = max(0, int(x.min()) - 1), min(camera.width_px, int(x.max()) + 2)
    top, bottom = max(0, int(y.min()) - 1), min(camera.height_px, int(y.max()) + 2)
    return (slice(top, bottom), slice(left, right)) if left < right and top < bottom else None


def _local_rays(
    camera: Camera, solid: Solid, window: tuple[slice, slice], dtype: type
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Camera centre (3,) and the rays' three components (h, w), scaled to z = 1, in the solid's frame."""
    x = ((np.arange(window[1].start, window[1].stop) + 0.5 - camera.cx_px) / camera.fx_px)[None, :]
    y = ((np.arange(window[0].start, window[0].stop) + 0.5 - camera.cy_px) / camera.fy_px)[:, None]
    rotation = solid.street_from_box[:3, :3].T
    turn = rotation @ camera.world_from_camera[:3, :3]
    origin = rotation @ (camera.world_from_camera[:3, 3] - solid.street_from_box[:3, 3])
    rays = [(turn[i, 0] * x).astype(dtype) + (turn[i, 1] * y + turn[i, 2]).astype(dtype) for i in range(3)]
    return origin.astype(dtype), rays


def _surface(
    solid: Solid, origin: np.ndarray, rays: np.ndarray, depth: np.ndarray, pixel: float
) -> Float[np.ndarray, "n 3"]:
    """Colours (N, 3) on a box; ``rays`` (3, N) in its frame, ``pixel`` the width of a pixel at z = 1."""
    points = origin[:, None] + depth * rays
    axis = np.argmax(np.abs(points) / solid.half_m[:, None].astype(np.float32), axis=0)
    positive = np.take_along_axis(points, axis[None], axis=0)[0] > 0
    length = np.sqrt((rays**2).sum(axis=0))
    colour = np.empty((len(depth), 3), dtype=np.float32)
    for face in range(6):
        chosen = np.flatnonzero((axis == face // 2) & (positive == bool(face % 2)))
        if len(chosen) == 0:
            continue
        u, v = _FACE_AXES[face // 2]
        # A pixel covers an ellipse: the short axis across the line of sight, the long one along it.
        short_m = depth[chosen] * pixel * length[chosen]
        slope = np.maximum(np.abs(rays[face // 2, chosen]) / length[chosen], 0.02)
        along = np.stack([rays[u, chosen], rays[v, chosen]])
        along *= short_m / slope / np.maximum(np.sqrt((along**2).sum(axis=0)), 1e-6)
        half = np.array([[solid.half_m[u]], [solid.half_m[v]]], dtype=np.float32)
        place = (points[[u, v]][:, chosen] + half) / (2 * half)
        along /= 2 * half
        if face in (0, 5):
            place[0], along[0] = 1 - place[0], -along[0]
        footprint_m = np.maximum(short_m, short_m / slope / len(_TAPS))
        colour[chosen] = (
            _lookup(solid.textures[face], place, along, footprint_m / (2 * half[0, 0])) * _LIGHT[face]
        )
    return colour


def _lookup(texture: Texture, place: np.ndarray, along: np.ndarray, footprint: np.ndarray) -> np.ndarray:
    """Texture at ``place`` (2, N) in [0, 1]: four taps along the footprint's long axis, two mip levels."""
    levels = texture.levels
    exact = np.clip(np.log2(np.maximum(footprint * texture.image.shape[1], 1e-9)), 0, len(levels) - 1)
    lower = np.minimum(exact.astype(np.int32), max(len(levels) - 2, 0))
    taps = place[:, None, :] + _TAPS[None, :, None] * along[:, None, :]
    total = np.zeros((place.shape[1], 3), dtype=np.float32)
    for level in range(len(levels)):
        weight = np.clip(1 - np.abs(exact - level), 0, 1)
        chosen = np.flatnonzero((weight > 0) & ((lower == level) | (lower == level - 1)))
        if len(chosen):
            total[chosen] += weight[chosen, None] * _bilinear(levels[level], taps[:, :, chosen]).mean(axis=0)
    return total


def _bilinear(image: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Texels at ``place`` (2, K, N) in [0, 1], the edge continued: (K, N, 3)."""
    height, width = image.shape[:2]
    flat = place.reshape(2, -1)
    # OpenCV limits a row of its sampling maps to 32767 entries.
    rows = -(-flat.shape[1] // 4096)
    maps = np.zeros((2, rows * 4096), dtype=np.float32)
    maps[:, : flat.shape[1]] = flat
    maps = maps.reshape(2, rows, 4096)
    picked = cv2.remap(
        image,
        maps[0] * width - 0.5,
        maps[1] * height - 0.5,
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return picked.reshape(-1, 3)[: flat.shape[1]].reshape(*place.shape[1:], 3)


def _sky(camera: Camera, panorama: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """The panorama behind the pixels of a mask (N, 3), by direction alone."""
    rays = _pixel_rays(camera, mask).T @ camera.world_from_camera[:3, :3].T
    azimuth = np.arctan2(rays[:, 0], rays[:, 2])
    elevation = np.arctan2(-rays[:, 1], np.hypot(rays[:, 0], rays[:, 2]))
    place = np.stack([azimuth / (2 * np.pi) + 0.5, 1 - elevation / (np.pi / 2)]).astype(np.float32)
    return _bilinear(panorama, place[:, None])[0]


def _pixel_rays(camera: Camera, mask: np.ndarray) -> np.ndarray:
    """Rays (3, N) of the pixels of a mask in the camera frame, scaled to z = 1."""
    rows, columns = np.nonzero(mask)
    x = (columns + 0.5 - camera.cx_px) / camera.fx_px
    return np.stack([x, (rows + 0.5 - camera.cy_px) / camera.fy_px, np.ones(len(rows))])


def _shadows(camera: Camera, solids: list[Solid], depth: np.ndarray, ground: np.ndarray) -> np.ndarray:
    """Brightness (N,) of the ground pixels: darker below and close to solids that throw a shadow."""
    rays = _pixel_rays(camera, ground)
    points = camera.world_from_camera[:3, :3] @ (rays * depth[ground]) + camera.world_from_camera[:3, 3:]
    brightness = np.ones(rays.shape[1], dtype=np.float32)
    for solid in solids:
        if not solid.shadow:
            continue
        pose = solid.street_from_box
        offset = points - pose[:3, 3:]
        near = np.flatnonzero(np.abs(offset[[0, 2]]).max(axis=0) < solid.half_m.max() + 0.6)
        local = np.abs(pose[:3, :3].T @ offset[:, near])
        outside_m = np.hypot(*(np.maximum(local[i] - solid.half_m[i] + 0.1, 0) for i in (0, 2)))
        brightness[near] *= (1 - 0.6 * np.exp(-((outside_m / 0.25) ** 2))).astype(np.float32)
    return brightness
