"""Depth of recorded clips against lidar."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dreamdrive.geometry import GeometryOptions, reconstruct
from dreamdrive.prior import choose_prior
from dreamdrive.progress import Work
from dreamdrive.scene.control import Control
from dreamdrive.street_network import look_at, with_looks
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.recorded.lidar import point_shares


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
    shares = point_shares(
        geometry,
        clip,
        lambda frame: recording.lidar / recording.lidar_name.format(frame),
        recording.lidar_width_px,
    )
    assert shares is not None, f"{recording.lidar} has no points"
    return {
        **shares,
        "focal_px": geometry.focal.px,
        "fallback": geometry.fallback,
        "look_s": look_s,
        "geometry_s": time.monotonic() - began - look_s,
    }
