"""A first estimate of the far background from the sky pixels of all frames."""

import math

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.sky import Sky

# The panorama reaches this far beyond what the frames saw, so that turned and raised views stay inside it.
MARGIN_RAD = math.radians(40.0)
MAX_TEXELS = (512, 1024)


def estimate_sky(clip: Clip, geometry: Geometry) -> Sky:
    """Average what the frames show of the sky, by direction alone, and continue it smoothly elsewhere.

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
    colour, weight = np.zeros((rows, columns, 3)), np.zeros((rows, columns))
    for i, (azimuth, elevation) in zip(frames, angles, strict=True):
        usable = _clear_sky(geometry.sky[i]) & clip.valid[i] & (geometry.fixed_regions == 0)
        row = _texel(elevation_rad[1] - elevation, elevation_rad, rows)[usable]
        column = _texel(azimuth - azimuth_rad[0], azimuth_rad, columns)[usable]
        np.add.at(colour, (row, column), clip.frames[i][usable] / 255.0)
        np.add.at(weight, (row, column), 1.0)
    texture = torch.tensor(_filled(colour, weight), dtype=torch.float32)
    return Sky(texture, azimuth_rad, elevation_rad)


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
    return cv2.erode(sky.astype(np.uint8), np.ones((5, 5), np.uint8), borderValue=1) > 0


def _filled(
    colour: Float[np.ndarray, "r c 3"], weight: Float[np.ndarray, "r c"]
) -> Float[np.ndarray, "r c 3"]:
    """Colours where seen; elsewhere normalised blurs of growing width, so that every texel has a value."""
    if not weight.any():
        return np.full_like(colour, 0.5)
    filled = colour / np.maximum(weight, 1)[..., None]
    missing = weight == 0
    sigma = 2.0
    sums, weights = colour, weight
    while missing.any():
        blurred = cv2.GaussianBlur(sums, (0, 0), sigma, borderType=cv2.BORDER_CONSTANT)
        share = cv2.GaussianBlur(weights, (0, 0), sigma, borderType=cv2.BORDER_CONSTANT)
        reached = missing & (share > 1e-3 * weight.max())
        filled[reached] = blurred[reached] / share[reached][:, None]
        missing &= ~reached
        sigma *= 2
        if sigma > 4 * max(weight.shape):
            filled[missing] = colour.sum((0, 1)) / weight.sum()
            break
    return filled
