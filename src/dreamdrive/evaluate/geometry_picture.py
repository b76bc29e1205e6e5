"""Pictures of the errors of depth, and of a path beside the true one."""

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.evaluate.estimate import Estimate
from dreamdrive.evaluate.truth.geometry import GeometryTruth
from dreamdrive.scene.similarity import fit_similarity
from dreamdrive.show import Image, depth_colours, labelled

_FRAMES = 3
_PATH_PX = 260
_MARGIN_PX = 40
_LIMIT = 0.5
"""Natural logarithm of the ratio of depths that has the full colour."""
_SPARSE = 0.2
"""Below this share of known pixels their marks are drawn larger than they are."""
_TRUE_RGB, _FOUND_RGB, _NONE_RGB = (60, 60, 60), (20, 90, 220), (40, 40, 40)


def draw_geometry_errors(
    estimate: Estimate, truth: GeometryTruth, scale: float = 1.0
) -> UInt8[np.ndarray, "h w 3"]:
    """RGB picture: for up to three frames the depth beside its errors, and below them both paths from above.

    Of frames that have both depths the first, the middle and the last are taken. A wrong scale would paint
    all of a frame in one colour: the depth found is multiplied by the median scale, see
    ``depth_errors.median_scale``.
    """
    rows = [] if estimate.depth_m is None else _rows(estimate, scale * estimate.depth_m, truth.depth_m)
    width = rows[0].shape[1] if rows else max(2 * estimate.size[0], 480)
    return np.vstack([*rows, _paths(estimate, truth, width)])


def _rows(
    estimate: Estimate, found_m: Float[np.ndarray, "f h w"], true_m: Float[np.ndarray, "f h w"]
) -> list[np.ndarray]:
    """Depth and errors of a few of the frames that have both depths."""
    both = (true_m > 0) & (found_m > 0)
    frames = np.flatnonzero(both.any(axis=(1, 2)))
    if not len(frames):
        return []
    rows: list[np.ndarray] = []
    for frame in frames[np.unique(np.linspace(0, len(frames) - 1, _FRAMES).round().astype(int))].tolist():
        depth = labelled(depth_colours(found_m[frame]), f"frame {estimate.index[frame]}: depth")
        errors = error_colours(found_m[frame], true_m[frame])
        error = labelled(errors, "error: red too far, blue too near, white right")
        rows.append(np.hstack([depth, error]))
    return rows


def error_colours(found: Float[np.ndarray, "h w"], true: Float[np.ndarray, "h w"]) -> Image:
    """Errors of depth in metres: white is right, red too far, blue too near; dark where either is unknown."""
    both = (found > 0) & (true > 0)
    log = np.log(np.where(both, found, 1.0)) - np.log(np.where(both, true, 1.0))
    strength = np.clip(np.abs(log) / _LIMIT, 0, 1)[..., None]
    full = np.where(log[..., None] > 0, (200, 0, 20), (10, 60, 220))
    colours = np.rint((1 - strength) * 255 + strength * full).astype(np.uint8)
    colours[~both] = _NONE_RGB
    return _enlarged(colours, both) if 0 < both.mean() < _SPARSE else colours


def _enlarged(colours: Image, known: Bool[np.ndarray, "h w"]) -> Image:
    """Every known pixel as a square of 3, without hiding other known ones."""
    height, width = known.shape
    grown, filled = colours.copy(), known.copy()
    wide, wide_known = np.pad(colours, ((1, 1), (1, 1), (0, 0))), np.pad(known, 1)
    for row in range(3):
        for column in range(3):
            there = slice(row, row + height), slice(column, column + width)
            new = wide_known[there] & ~filled
            grown[new] = wide[there][new]
            filled |= new
    return grown


def _paths(estimate: Estimate, truth: GeometryTruth, width: int) -> Image:
    """Both paths from above after the best similarity, forward to the right, both axes at one scale."""
    picture = np.full((_PATH_PX, width, 3), 255, np.uint8)
    similarity = fit_similarity(estimate.cameras, truth.cameras)
    found, true = (np.stack([c.world_from_camera[:3, 3] for c in x.cameras]) for x in (estimate, truth))
    first = truth.cameras[0].camera_from_world
    both = [x @ first[:3, :3].T + first[:3, 3] for x in (true, similarity(found))]
    places = np.concatenate(both)[:, [2, 0]]
    low, high = places.min(axis=0), places.max(axis=0)
    room = np.array([width, _PATH_PX]) - 2 * _MARGIN_PX
    m_per_px = float(max(((high - low) / room).max(), 1e-3))
    for path, rgb, radius in zip(both, (_TRUE_RGB, _FOUND_RGB), (4, 2), strict=True):
        centred = (path[:, [2, 0]] - (low + high) / 2) / m_per_px + np.array([width, _PATH_PX]) / 2
        points = np.round(centred).astype(np.int32)
        cv2.polylines(picture, [points[:, None]], False, rgb, 1, cv2.LINE_AA)
        for x, y in points.tolist():
            cv2.circle(picture, (x, y), radius, rgb, -1, cv2.LINE_AA)
    length_px = max(1, round((high[0] - low[0]) / m_per_px))
    text = f"paths from above, {high[0] - low[0]:.1f} m ahead in {length_px} px: grey true, blue of the scene"
    return labelled(picture, text)
