"""The report picture: what the geometry stage saw, for a few frames, and the path from above."""

import textwrap

import cv2
import numpy as np
from jaxtyping import UInt8

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.show.ids import with_ids

_ROWS = 4
_NEAR_INVERSE = 0.2  # 1/m, the warm end of the depth colours
_MOVING = 0.5
_SKY_RGB = (90, 140, 255)
_REGION_RGB = (255, 0, 255)
_MOVING_RGB = (255, 40, 40)
_PATH_PX = 240
_LETTER_PX = 7


def draw_geometry(clip: Clip, geometry: Geometry, scene: Scene | None = None) -> UInt8[np.ndarray, "h w 3"]:
    """Rows of frame, depth and confidence for up to four frames, and below them the path from above, RGB.

    On the frames: sky tinted blue, regions fixed to the camera tinted and named, moving evidence outlined;
    where there is a scene, the ids of what moves in it.
    """
    candidates = np.flatnonzero(~clip.held_out)
    chosen = candidates[np.unique(np.linspace(0, len(candidates) - 1, _ROWS).round().astype(int))]
    rows = [np.hstack(_panels(clip, geometry, int(frame), scene)) for frame in chosen]
    return np.vstack([*rows, _path(clip, geometry, rows[0].shape[1])])


def _panels(clip: Clip, geometry: Geometry, frame: int, scene: Scene | None) -> list[np.ndarray]:
    depth = geometry.depth_m[frame]
    inverse = np.where(depth > 0, 1 / np.maximum(depth, 1e-3), 0) / _NEAR_INVERSE
    depth_picture = _coloured(inverse, cv2.COLORMAP_TURBO)
    depth_picture[depth <= 0] = 0
    confidence = _coloured(geometry.confidence[frame], cv2.COLORMAP_VIRIDIS)
    index, marked = int(clip.source_index[frame]), _marked(clip, geometry, frame)
    if scene is not None:
        marked = with_ids(marked, scene, geometry.cameras[frame], float(clip.times_s[frame]))
    return [
        _titled(marked, f"frame {index}"),
        _titled(depth_picture, f"depth, red {1 / _NEAR_INVERSE:.0f} m"),
        _titled(confidence, "confidence"),
    ]


def _marked(clip: Clip, geometry: Geometry, frame: int) -> np.ndarray:
    picture = clip.frames[frame].copy()
    _tint(picture, geometry.sky[frame], _SKY_RGB)
    for index, name in enumerate(geometry.region_names):
        region = geometry.fixed_regions[clip.camera[frame]] == index + 1
        if region.any():
            _tint(picture, region, _REGION_RGB)
            rows, columns = np.nonzero(region)
            _write(picture, name, int(columns.min()) + 3, int(np.median(rows)) + 4)
    moving = (geometry.moving[frame] >= _MOVING).astype(np.uint8)
    outlines, _ = cv2.findContours(moving, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(picture, outlines, -1, _MOVING_RGB, 1)
    return picture


def _tint(picture: np.ndarray, mask: np.ndarray, rgb: tuple[int, int, int]) -> None:
    picture[mask] = (0.6 * picture[mask] + 0.4 * np.array(rgb)).astype(np.uint8)


def _coloured(values: np.ndarray, colours: int) -> np.ndarray:
    levels = (np.clip(values, 0, 1) * 255).astype(np.uint8)
    return np.ascontiguousarray(cv2.applyColorMap(levels, colours)[..., ::-1])


def _titled(picture: np.ndarray, title: str) -> np.ndarray:
    _write(picture, title, 4, 12)
    return picture


def _write(picture: np.ndarray, text: str, x: int, y: int) -> None:
    """White on a dark box, readable on any picture; letters that do not fit are cut off."""
    y = min(max(y, 10), picture.shape[0] - 4)
    (width, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.38, 1)
    cv2.rectangle(picture, (x - 2, y - 10), (x + width + 2, y + 3), (0, 0, 0), -1)
    cv2.putText(picture, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, 0.38, (255, 255, 255), 1, cv2.LINE_AA)


def _path(clip: Clip, geometry: Geometry, width: int) -> np.ndarray:
    """Camera centres from above, forward to the right, with both axes to the same scale."""
    picture = np.full((_PATH_PX, width, 3), 255, np.uint8)
    positions = np.array([camera.world_from_camera[:3, 3] for camera in geometry.cameras])
    forward, right = positions[:, 2], positions[:, 0]
    extent = max(float(np.ptp(forward)) / (width - 40), float(np.ptp(right)) / (_PATH_PX - 60), 1e-3)
    x = 20 + (forward - forward.min()) / extent
    y = _PATH_PX / 2 + 10 + (right - (right.max() + right.min()) / 2) / extent
    points = np.stack([x, y], axis=-1).round().astype(np.int32)
    cv2.polylines(picture, [points[:, None]], False, (60, 60, 60), 1, cv2.LINE_AA)
    for point in points:
        cv2.circle(picture, (int(point[0]), int(point[1])), 3, (20, 90, 220), -1, cv2.LINE_AA)
    length = float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum())
    known = "poses as given" if clip.known.world_from_camera is not None else "full reconstruction"
    state = f"fallback: {geometry.fallback}" if geometry.fallback else known
    said = f"path from above, {length:.1f} m; scale: {geometry.scale.source}; {state}"
    for line, text in enumerate(textwrap.wrap(said, width // _LETTER_PX)):
        _write(picture, text, 4, 14 * (1 + line))
    return picture
