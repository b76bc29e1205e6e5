"""A first estimate of the far background from the sky pixels of all frames."""

import math
from dataclasses import replace

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.sky import Sky
from dreamdrive.vision.windows import window_px

# The panorama reaches this far beyond what the frames saw, so that turned and raised views stay inside it.
MARGIN_RAD = math.radians(40.0)
MAX_TEXELS = (512, 1024)


def estimate_sky(clip: Clip, geometry: Geometry) -> Sky:
    """Average what the frames show of the sky, by direction alone, and continue it smoothly elsewhere.

    Below the horizon it is a blurred backdrop of what static things look like in each direction.

    Args:
        clip: Frames; held-out frames are not read.
        geometry: Sky masks and rotations.

    Returns:
        A panorama with about one texel a pixel.
    """
    frames = np.flatnonzero(~clip.held_out).tolist()
    angles = [_angles(geometry, i) for i in frames]
    azimuth_rad = _padded(min(a[0].min() for a in angles), max(a[0].max() for a in angles))
    elevation_rad = _padded(min(a[1].min() for a in angles), max(a[1].max() for a in angles), math.pi / 2)
    texel_rad = 1.0 / geometry.cameras[0].fx_px
    rows = min(MAX_TEXELS[0], math.ceil((elevation_rad[1] - elevation_rad[0]) / texel_rad))
    columns = min(MAX_TEXELS[1], math.ceil((azimuth_rad[1] - azimuth_rad[0]) / texel_rad))
    empty = Sky(torch.zeros(rows, columns, 3), azimuth_rad, elevation_rad)
    colour, weight = _gathered(clip, geometry, empty, _sky_only(clip, geometry))
    sky = replace(empty, texture=torch.tensor(_filled(colour, weight), dtype=torch.float32))
    return _with_backdrop(sky, clip, geometry)


def _with_backdrop(sky: Sky, clip: Clip, geometry: Geometry) -> Sky:
    """The panorama with what static things look like, blurred, where no sky was seen.

    A view that looks past a car ahead meets directions in which no frame has seen the street. A hole there in
    the colour of the sky is the first thing one sees.
    """
    _, seen = _gathered(clip, geometry, sky, _sky_only(clip, geometry))
    free = clip.valid & (geometry.fixed_regions[clip.camera] == 0)
    still = [free[i] & ~_near_moving(geometry, i) for i in range(len(clip))]
    blurred = _filled(*_gathered(clip, geometry, sky, still))
    reach = cv2.dilate((seen > 0).astype(np.uint8), np.ones((5, 5), np.uint8))[..., None] > 0
    # Above the horizon the sky itself goes on.
    rows = np.linspace(sky.elevation_rad[1], sky.elevation_rad[0], len(blurred))[:, None, None]
    texture = np.where(reach | (rows > 0), sky.texture.numpy(), blurred)
    return replace(sky, texture=torch.tensor(texture, dtype=torch.float32))


def _sky_only(clip: Clip, geometry: Geometry) -> list[Bool[np.ndarray, "h w"]]:
    free = clip.valid & (geometry.fixed_regions[clip.camera] == 0)
    return [_clear_sky(geometry.sky[i]) & free[i] for i in range(len(clip))]


def _near_moving(geometry: Geometry, frame: int) -> Bool[np.ndarray, "h w"]:
    moving = (geometry.moving[frame] >= 0.5).astype(np.uint8)
    side = window_px(9, moving.shape[1])
    return cv2.dilate(moving, np.ones((side, side), np.uint8)) > 0


def _gathered(
    clip: Clip, geometry: Geometry, sky: Sky, masks: list[Bool[np.ndarray, "h w"]]
) -> tuple[Float[np.ndarray, "r c 3"], Float[np.ndarray, "r c"]]:
    """Sums of the colours seen in each texel's direction, and how many there were."""
    rows, columns = sky.texture.shape[:2]
    sums = np.zeros((rows * columns, 4))
    for i in np.flatnonzero(~clip.held_out).tolist():
        azimuth, elevation = _angles(geometry, i)
        row = _texel(sky.elevation_rad[1] - elevation, sky.elevation_rad, rows)[masks[i]]
        column = _texel(azimuth - sky.azimuth_rad[0], sky.azimuth_rad, columns)[masks[i]]
        values = np.column_stack([clip.frames[i][masks[i]] / 255.0, np.ones(len(row))])
        for k in range(4):
            sums[:, k] += np.bincount(row * columns + column, values[:, k], minlength=rows * columns)
    sums = sums.reshape(rows, columns, 4)
    return sums[..., :3], sums[..., 3]


def _angles(geometry: Geometry, frame: int) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w"]]:
    camera = geometry.cameras[frame]
    x, y, z = np.moveaxis(camera.rays() @ camera.world_from_camera[:3, :3].T, -1, 0)
    return np.arctan2(x, z), np.arctan2(-y, np.hypot(x, z))


def _padded(low: float, high: float, limit: float = math.pi) -> tuple[float, float]:
    return max(-limit, float(low) - MARGIN_RAD), min(limit, float(high) + MARGIN_RAD)


def _texel(offset: Float[np.ndarray, "h w"], span: tuple[float, float], count: int) -> np.ndarray:
    return np.clip((offset / (span[1] - span[0]) * count).astype(int), 0, count - 1)


def _clear_sky(sky: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """Sky without its border, where branches and roofs mix in."""
    side = window_px(5, sky.shape[1])
    return cv2.erode(sky.astype(np.uint8), np.ones((side, side), np.uint8), borderValue=1) > 0


def _filled(
    colour: Float[np.ndarray, "r c 3"], weight: Float[np.ndarray, "r c"]
) -> Float[np.ndarray, "r c 3"]:
    """Mean colours where seen; elsewhere those of ever coarser neighbourhoods: every texel has one."""
    if not weight.any():
        return np.full_like(colour, 0.5)
    mean = colour / np.maximum(weight, 1e-9)[..., None]
    if weight.all():
        return mean
    # Sums at half the size: an average over the texels that were seen, whatever their number.
    half = max(1, (weight.shape[1] + 1) // 2), max(1, (weight.shape[0] + 1) // 2)
    coarse = _filled(
        cv2.resize(colour, half, interpolation=cv2.INTER_AREA).reshape(half[1], half[0], 3),
        cv2.resize(weight, half, interpolation=cv2.INTER_AREA).reshape(half[1], half[0]),
    )
    around = cv2.resize(coarse, weight.shape[::-1], interpolation=cv2.INTER_LINEAR).reshape(colour.shape)
    return np.where(weight[..., None] > 0, mean, around)
