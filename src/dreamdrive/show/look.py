"""One picture of all that the street network says of a frame."""

from dataclasses import replace
from math import degrees, exp

import cv2
import numpy as np
from jaxtyping import Shaped, UInt8

from dreamdrive.scene.street.look import CameraEstimate, Look, RoadUser
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.show.panels import Image, depth_colours, grid

COLOURS: dict[StreetClass, tuple[int, int, int]] = {
    StreetClass.SKY: (135, 190, 235),
    StreetClass.ROAD: (110, 80, 130),
    StreetClass.MARKING: (255, 255, 255),
    StreetClass.GROUND: (230, 150, 200),
    StreetClass.STRUCTURE: (150, 150, 150),
    StreetClass.VEGETATION: (70, 150, 50),
    StreetClass.POLE: (240, 220, 60),
    StreetClass.VEHICLE: (40, 70, 230),
    StreetClass.TWO_WHEELER: (230, 120, 30),
    StreetClass.PERSON: (220, 30, 50),
    StreetClass.OWN_CAR: (100, 65, 40),
}
"""Red, green and blue of each class."""
_LEAST_PX = 480
"""Height of two rows of panels at least, so that letters can be read: smaller frames are enlarged."""
_NEAR, _FAR = 1.5, 60.0
"""Camera heights at the ends of the colours of depth."""
_TICKS_M, _TICKS = (3, 5, 10, 20, 50), (2, 4, 8, 16, 40)
_OUTLINE_RGB, _HORIZON_RGB = (255, 60, 60), (255, 220, 0)
_WHITE, _DARK = (255, 255, 255), 24
_A_LINE = 6
"""Classes in a line of the legend."""


def draw_look(frame: UInt8[np.ndarray, "h w 3"], look: Look, index: int) -> UInt8[np.ndarray, "h2 w2 3"]:
    """Four panels: the frame with road users and horizon, depth, classes, confidence; below them the words.

    Args:
        frame: RGB, that the network saw.
        look: What it said.
        index: Which of its frames this is.
    """
    times = max(1, -(-_LEAST_PX // (2 * frame.shape[0])))
    outlined = _road_users(_larger(frame, times), look, index, times)
    classes = look.classes[index]
    colours = np.array([COLOURS[each] for each in StreetClass], np.uint8)[classes]
    tinted = _larger(cv2.addWeighted(frame, 0.45, colours, 0.55, 0), times)
    sure = np.rint(255 * look.confidence[index].astype(np.float32)).astype(np.uint8)
    confidence = cv2.cvtColor(cv2.applyColorMap(sure, cv2.COLORMAP_VIRIDIS), cv2.COLOR_BGR2RGB)
    metric = look.camera_height_m is not None
    picture = grid(
        {
            f"road users: {len(look.road_users[index])}": _horizon(outlined, look.cameras[index], times),
            "depth in metres" if metric else "depth in camera heights": _scaled(look, index, times),
            "classes": tinted,
            "confidence of the class": _ramp(
                _larger(confidence, times), cv2.COLORMAP_VIRIDIS, {"0": 0, "0.5": 0.5, "1": 1}
            ),
        }
    )
    return np.concatenate([picture, _words(look.cameras[index], picture.shape[1])])


def _larger(picture: Shaped[np.ndarray, "h w c"], times: int) -> Shaped[np.ndarray, "h2 w2 c"]:
    return np.ascontiguousarray(picture.repeat(times, axis=0).repeat(times, axis=1))


def _road_users(picture: Image, look: Look, index: int, times: int) -> Image:
    """The picture with outlines, and what each is beside it."""
    instances = _larger(look.instances[index][..., None], times)[..., 0]
    for number, user in enumerate(look.road_users[index], start=1):
        mask = (instances == number).astype(np.uint8)
        outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(picture, outlines, -1, _OUTLINE_RGB, 1)
        left, top = (times * at for at in user.box_px[:2])
        _write(picture, _name(user), left, top - 3, _letters(picture.shape[1]))
    return picture


def _name(user: RoadUser) -> str:
    return f"{user.kind.name.lower().replace('_', '-')} {user.score:.2f}"


def _horizon(picture: Image, camera: CameraEstimate, times: int) -> Image:
    """The picture with the line at which level rays cross it, and those a standard deviation off it."""
    ends = np.array([0.0, camera.width_px])
    rows = camera.horizon_rows(ends)
    for off, width in ((0.0, 2), (-camera.horizon_spread_px, 1), (camera.horizon_spread_px, 1)):
        left, right = (np.clip(times * (rows + off), -9999, 9999).round().astype(int)).tolist()
        cv2.line(picture, (0, left), (picture.shape[1], right), _HORIZON_RGB, width, cv2.LINE_AA)
    return picture


def _scaled(look: Look, index: int, times: int) -> Image:
    """Depth in colours, with a bar that tells which is how far."""
    height = look.camera_height_m or 1.0
    near, far = _NEAR * height, _FAR * height
    picture = _larger(depth_colours(look.depth[index] * np.float32(height), near, far), times)
    ticks = np.array(_TICKS if look.camera_height_m is None else _TICKS_M, dtype=np.float64)
    span = 1 / near - 1 / far
    places = np.sqrt(((1 / ticks - 1 / far) / span).clip(0, 1))
    return _ramp(picture, cv2.COLORMAP_TURBO, {f"{t:g}": p for t, p in zip(ticks, places, strict=True)})


def _ramp(picture: Image, colours: int, ticks: dict[str, float]) -> Image:
    """The picture with a bar of colours at its right edge, and words at shares of it from below."""
    height, width = picture.shape[:2]
    bar = max(8, width // 50)
    levels = np.linspace(255, 0, height).round().astype(np.uint8)[:, None]
    shown = cv2.cvtColor(cv2.applyColorMap(levels, colours), cv2.COLOR_BGR2RGB)
    picture[:, width - bar :] = shown
    size = _letters(width)
    for word, share in ticks.items():
        row = round((1 - share) * (height - 1))
        cv2.line(picture, (width - bar, row), (width - 1, row), _WHITE, 1)
        (across, up), _ = cv2.getTextSize(word, cv2.FONT_HERSHEY_SIMPLEX, size, 1)
        _write(picture, word, width - bar - across - 6, row + up // 2, size)
    return picture


def _words(camera: CameraEstimate, width: int) -> Image:
    """A legend of the classes and what the frame says of the camera."""
    size = _letters(width // 2)
    line = round(53 * size)
    strip = np.full((line * (2 + -(-len(StreetClass) // _A_LINE)), width, 3), _DARK, np.uint8)
    _write(strip, _camera_words(camera), line // 3, line, size)
    for place, each in enumerate(StreetClass):
        left, top = width // _A_LINE * (place % _A_LINE), line * (2 + place // _A_LINE)
        cv2.rectangle(strip, (left + 8, top - line // 2), (left + line, top), COLOURS[each], -1)
        _write(strip, each.name.lower().replace("_", " "), left + line + 6, top, size)
    return strip


def _camera_words(camera: CameraEstimate) -> str:
    fov = degrees(camera.hfov_rad)
    wider = degrees(replace(camera, focal_px=camera.focal_px * exp(-camera.focal_spread)).hfov_rad)
    pitch, roll = degrees(camera.pitch_rad), degrees(camera.roll_rad)
    pitch_spread = degrees(camera.horizon_spread_px / camera.focal_px)
    return (
        f"field of view {fov:.0f} +- {wider - fov:.0f} deg, pitch {pitch:+.1f} +- {pitch_spread:.1f}, roll "
        f"{roll:+.1f} +- {degrees(camera.roll_spread_rad):.1f}; distorted: {100 * camera.distorted:.0f} %"
    )


def _letters(width: int) -> float:
    """Size of letters in a panel of a width: a scale of OpenCV's."""
    return max(0.38, width / 1400)


def _write(picture: Image, text: str, x: int, y: int, size: float) -> None:
    """White letters on a dark box, inside the picture."""
    (across, up), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, size, 1)
    x = min(max(x, 2), max(2, picture.shape[1] - across - 2))
    y = min(max(y, up + 2), picture.shape[0] - below)
    cv2.rectangle(picture, (x - 2, y - up - 2), (x + across + 1, y + below - 1), (_DARK,) * 3, -1)
    cv2.putText(picture, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, size, _WHITE, 1, cv2.LINE_AA)
