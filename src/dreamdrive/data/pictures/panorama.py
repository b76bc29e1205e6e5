"""Views out of panoramas, which are as wide as all directions (equirectangular)."""

import cv2
import numpy as np
from jaxtyping import UInt8

from dreamdrive.data.cameras.intrinsics import guess_camera
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera

USUAL_HFOV_DEG = 70.0
_ASPECT, _TOLERANCE = 2.0, 0.02


def is_panorama(size: tuple[int, int]) -> bool:
    """Whether a picture of this width and height may be one: twice as wide as high."""
    return abs(size[0] / size[1] / _ASPECT - 1) <= _TOLERANCE


def view_of(
    panorama: UInt8[np.ndarray, "y x 3"],
    heading_deg: float,
    pitch_deg: float,
    hfov_deg: float,
    size: tuple[int, int],
    where: str,
) -> tuple[UInt8[np.ndarray, "h w 3"], Camera]:
    """What a pinhole sees, and that pinhole.

    Args:
        panorama: All directions: azimuth along the columns, its middle being heading 0; elevation along the
            rows from 90 degrees down to -90.
        heading_deg: Of the view, to the right.
        pitch_deg: Of the view, upwards.
        hfov_deg: Horizontal field of view.
        size: Width and height of the view.
        where: How messages call the panorama.

    Raises:
        InputError: The picture is no panorama, or an angle is outside its range.
    """
    height, width = panorama.shape[:2]
    if not is_panorama((width, height)):
        raise InputError(f"{where} is {width}x{height}; expected a panorama, which is twice as wide as high")
    if not (abs(heading_deg) <= 360 and abs(pitch_deg) <= 60 and 10 <= hfov_deg <= 120):
        raise InputError(
            f"--view {heading_deg:g},{pitch_deg:g} --hfov {hfov_deg:g}: expected a heading within 360 and a "
            "pitch within 60 degrees, and a field of view of 10 to 120"
        )
    camera = guess_camera(size, hfov_deg).camera
    right, down, ahead = np.moveaxis(camera.rays(), -1, 0)
    pitch = np.deg2rad(pitch_deg)
    level, up = np.cos(pitch) * ahead + np.sin(pitch) * down, np.sin(pitch) * ahead - np.cos(pitch) * down
    azimuth = np.arctan2(right, level) + np.deg2rad(heading_deg)
    elevation = np.arctan2(up, np.hypot(right, level))
    # A view shrinks the panorama by this, which would alias.
    shrink = max(1.0, width / (2 * np.pi) / camera.fx_px)
    soft = cv2.GaussianBlur(panorama, (0, 0), 0.4 * shrink) if shrink > 1.2 else panorama
    u = np.mod(azimuth / (2 * np.pi) + 0.5, 1.0) * width - 0.5
    v = (0.5 - elevation / np.pi) * height - 0.5
    u, v = u.astype(np.float32), v.astype(np.float32)
    return cv2.remap(soft, u, v, cv2.INTER_CUBIC, borderMode=cv2.BORDER_WRAP), camera
