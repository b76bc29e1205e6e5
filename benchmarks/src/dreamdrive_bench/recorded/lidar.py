"""Depth of a clip against lidar points, and the classes that PandaSet gives them."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive_bench.common.places import DATA

NEAR_M, FAR_M, OFF = 2.0, 80.0, 0.1
"""Points at these distances count; a depth is off that misses by more than this share."""
VEHICLES = (
    "Car",
    "Pickup Truck",
    "Medium-sized Truck",
    "Semi-truck",
    "Towed Object",
    "Other Vehicle - Construction Vehicle",
    "Other Vehicle - Uncommon",
    "Other Vehicle - Pedicab",
    "Emergency Vehicle",
    "Bus",
    "Train",
    "Trolley",
    "Tram / Subway",
)
PEOPLE = (
    "Motorcycle",
    "Personal Mobility Device",
    "Motorized Scooter",
    "Bicycle",
    "Pedestrian",
    "Pedestrian with Object",
)
"""People and two-wheelers."""


def labels(names: tuple[str, ...]) -> set[int]:
    """Numbers of PandaSet's classes."""
    known = json.loads((DATA / "clips/pandaset_002/semseg_classes.json").read_text())
    number = {name: int(key) for key, name in known.items()}
    return {number[name] for name in names}


def point_shares(
    geometry: Geometry, clip: Clip, file_of: Callable[[int], Path], width_px: int
) -> dict[str, Any] | None:
    """Shares of points whose depth is off, of all and of vehicles, and of the intervals that hold them.

    After one scale for the clip, in the frames that were seen; None without lidar.

    Args:
        geometry: The depth.
        clip: Its frames.
        file_of: The points of a frame of the source, whose file may be missing.
        width_px: Of the pictures in whose pixels they are.
    """
    frames = np.flatnonzero(~clip.held_out).tolist()
    files = {frame: file_of(int(clip.source_index[frame])) for frame in frames}
    found = [_points(geometry, clip, k, file, width_px) for k, file in files.items() if file.exists()]
    if not found:
        return None
    true, depth, spread, kind = map(np.concatenate, zip(*found, strict=True))
    known = depth > 0
    ratio = np.median(true[known] / depth[known])
    off = np.where(known, np.abs(depth * ratio - true) / true, np.inf)
    vehicle = np.isin(kind, list(labels(VEHICLES)))
    return {
        "points": len(true),
        "off": float((off > OFF).mean()),
        "vehicles_off": float((off[vehicle] > OFF).mean()) if vehicle.any() else None,
        "abs_rel": float(off[known].mean()),
        "held_by_68": None if geometry.spread is None else float((off < spread)[known].mean()),
        "scale": float(ratio),
    }


def _points(
    geometry: Geometry, clip: Clip, frame: int, path: Path, width_px: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """True depth, depth, spread and class of a frame's points (N,)."""
    with np.load(path) as stored:
        true, kind = stored["depth"], stored["sem"] if "sem" in stored.files else None
        place = np.stack([stored["u"], stored["v"]]) + 0.5
    near = (true >= NEAR_M) & (true <= FAR_M)
    column, row = (place[:, near] * clip.size[0] / width_px).astype(int)
    at = row.clip(0, clip.size[1] - 1), column.clip(0, clip.size[0] - 1)
    spread = np.zeros(near.sum()) if geometry.spread is None else geometry.spread[frame][at]
    kinds = np.full(near.sum(), -1) if kind is None else kind[near].astype(int)
    return true[near], geometry.depth_m[frame][at], spread, kinds
