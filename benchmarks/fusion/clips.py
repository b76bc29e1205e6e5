"""Depth of recorded clips against lidar."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from common.places import DATA
from dreamdrive.geometry import reconstruct
from dreamdrive.geometry.options import GeometryOptions
from dreamdrive.knowledge import look_at, with_looks
from dreamdrive.prior import choose_prior
from dreamdrive.progress import Work
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.geometry import Geometry
from knowledge.shots import VEHICLES, labels

Values = Float[np.ndarray, " n"]
NEAR_M, FAR_M, OFF = 2.0, 80.0, 0.1


@dataclass(frozen=True)
class Recording:
    """A clip with lidar; points are in pixels of pictures of ``lidar_width_px``."""

    control: Control
    camera_height_m: float
    lidar: Path
    lidar_name: str
    lidar_width_px: int


def _recordings() -> dict[str, Recording]:
    pandaset, kitti = DATA / "clips/pandaset_002", DATA / "clips/kitti_odom04_follow_van"
    front = Control(path=pandaset / "front_camera", frames="20:68:2", fps=10, size=(480, 270), hold_out=8)
    follow = Control(
        path=kitti / "frames",
        frames="0:48:2",
        fps=10,
        size=(480, 144),
        hold_out=8,
        intrinsics=kitti / "meta.json",
    )
    return {
        "pandaset": Recording(front, 2.2, pandaset / "lidar_depth_front", "{:02d}.npz", 1920),
        "kitti04": Recording(follow, 1.65, kitti / "lidar_depth", "{:04d}.npz", 1226),
    }


CLIPS = _recordings()


def judge_clip(name: str, knowledge: str) -> dict[str, Any]:
    """The figures of one clip; ``knowledge`` as of ``--knowledge``."""
    recording = CLIPS[name]
    clip = choose_prior("replay")(recording.control, Work())
    began = time.monotonic()
    clip = with_looks(clip, look_at(clip, knowledge))
    look_s = time.monotonic() - began
    geometry = reconstruct(clip, GeometryOptions(camera_height_m=recording.camera_height_m))
    return {
        **point_shares(recording, clip, geometry),
        "focal_px": geometry.focal.px,
        "fallback": geometry.fallback,
        "look_s": look_s,
        "geometry_s": time.monotonic() - began - look_s,
    }


def point_shares(recording: Recording, clip: Clip, geometry: Geometry) -> dict[str, Any]:
    """Shares of points whose depth is off, of all and of vehicles, and of the intervals that hold them."""
    found = [_points(recording, clip, geometry, frame) for frame in np.flatnonzero(~clip.held_out).tolist()]
    true, depth, spread, kind = map(np.concatenate, zip(*(each for each in found if each), strict=True))
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
    recording: Recording, clip: Clip, geometry: Geometry, frame: int
) -> (
    tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], Float[np.ndarray, " n"], Int[np.ndarray, " n"]]
    | None
):
    """True depth, depth, spread and class of a frame's points; None without lidar."""
    path = recording.lidar / recording.lidar_name.format(int(clip.source_index[frame]))
    if not path.exists():
        return None
    with np.load(path) as stored:
        true, kind = stored["depth"], stored["sem"] if "sem" in stored.files else None
        place = np.stack([stored["u"], stored["v"]]) + 0.5
    near = (true >= NEAR_M) & (true <= FAR_M)
    column, row = (place[:, near] * clip.size[0] / recording.lidar_width_px).astype(int)
    at = row.clip(0, clip.size[1] - 1), column.clip(0, clip.size[0] - 1)
    spread = np.zeros(near.sum()) if geometry.spread is None else geometry.spread[frame][at]
    kinds = np.full(near.sum(), -1) if kind is None else kind[near].astype(int)
    return true[near], geometry.depth_m[frame][at], spread, kinds
