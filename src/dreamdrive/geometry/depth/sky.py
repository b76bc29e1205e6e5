"""Segmentation of the sky."""

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground
from dreamdrive.vision.windows import window_px

_GRADIENT = 6.0  # grey levels; the sky is smooth
_BLUE_B = 124  # Lab b below this is bluish
_BLUE_GREY = 60  # a blue pixel darker than this is not the day's sky
_BRIGHT_GREY = 150  # clouds and over-exposed sky
_CLOSING_PX = 5


def above_horizon(camera: Camera, ground: Ground | None) -> Bool[np.ndarray, "h w"]:
    """Pixels (H, W) whose ray does not go down; without a ground the first camera's -y is up."""
    normal = ground.normal_world if ground is not None else np.array([0.0, -1.0, 0.0])
    up_camera = camera.world_from_camera[:3, :3].T @ normal
    return camera.rays() @ up_camera >= 0


def sky_mask(
    frame: UInt8[np.ndarray, "h w 3"],
    above: Bool[np.ndarray, "h w"],
    usable: Bool[np.ndarray, "h w"],
) -> Bool[np.ndarray, "h w"]:
    """The sky of one RGB frame: smooth, blue or bright regions above the horizon that reach the top edge.

    White facades and over-exposed walls that touch the top edge are taken for sky. Not usable is what shows
    no street (invalid or fixed to the camera).
    """
    grey = cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY)
    lab_b = cv2.cvtColor(frame, cv2.COLOR_RGB2LAB)[..., 2]
    blurred = cv2.GaussianBlur(grey, (0, 0), 0.7).astype(np.float32)
    # Central differences with Sobel's weights, in grey levels a pixel.
    dx, dy = (cv2.Sobel(blurred, cv2.CV_32F, *way, ksize=3, scale=0.125) for way in ((1, 0), (0, 1)))
    smooth = cv2.magnitude(dx, dy) < _GRADIENT
    coloured = ((lab_b < _BLUE_B) & (grey > _BLUE_GREY)) | (grey > _BRIGHT_GREY)
    candidate = (above & usable & smooth & coloured).astype(np.uint8)
    _, labels = cv2.connectedComponents(candidate, connectivity=4)
    # The top edge of what the frame shows, which an undistorted image or a bar may push below row 0.
    top = usable & (np.cumsum(usable, axis=0) <= max(2, len(frame) // 50))
    reaching = np.unique(labels[top & (candidate > 0)])
    mask = np.isin(labels, reaching[reaching > 0]).astype(np.uint8)
    side = window_px(_CLOSING_PX, frame.shape[1])
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, kernel)
    return (closed > 0) & above & usable
