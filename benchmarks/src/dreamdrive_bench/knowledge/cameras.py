"""Fields of view and horizons of recorded clips against what is known of their cameras."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import atan, degrees
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.data import read_clip
from dreamdrive.data.formats.pandaset import pandaset_camera
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.look import CameraEstimate, Look
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.knowledge.shots import pinhole_of

WIDTH_PX = 480
_MOST = 8
"""Frames of a clip that are looked at, evenly spaced."""
_LENSES = {
    "kitti_odom04_follow_van": "frames",
    "kitti_odom06_avenue": "frames",
    "kitti_odom07_left_turn": "frames",
    "udacity_highway_two_cars": "video.mp4",
    "udacity_highway_open": "video.mp4",
}
"""Clips whose calibration is known, but not where up is."""

Frames = UInt8[np.ndarray, "f h w 3"]
See = Callable[[Frames], Look]


@dataclass(frozen=True)
class Known:
    """Frames of one camera as recorded, not undistorted, and their cameras; ``up`` is None where unknown."""

    name: str
    frames: UInt8[np.ndarray, "f h w 3"]
    cameras: tuple[Camera, ...]
    up: Float[np.ndarray, "3"] | None


def known_cameras() -> Iterator[Known]:
    """All development clips with intrinsics, the cameras of PandaSet and of nuScenes one by one."""
    for name, source in _LENSES.items():
        folder = DATA / "clips" / name
        meta = json.loads((folder / "meta.json").read_text())
        step = max(1, meta["n_frames"] // _MOST)
        clip = read_clip(folder / source, frames=f"0:{meta['n_frames']}:{step}")
        camera = pinhole_of(meta["intrinsics"], meta["width"], meta["height"]).resized(*clip.size)
        yield Known(name, clip.frames, (camera,) * len(clip), None)
    yield from _pandaset()
    yield from _nuscenes()


def judge_camera(known: Known, see: See) -> dict[str, Any]:
    """Errors of the field of view of a clip, and medians over its frames of those of horizon and roll."""
    look, true = see(known.frames), known.cameras[0]
    hfov = degrees(2 * atan(true.width_px / 2 / true.fx_px))
    record = {
        "name": known.name,
        "frames": len(look),
        "true_hfov_deg": hfov,
        "hfov_deg": degrees(look.camera.hfov_rad),
        "hfov_error_deg": degrees(look.camera.hfov_rad) - hfov,
        "focal_error": look.camera.focal_px / true.fx_px - 1,
        "focal_spread": look.camera.focal_spread,
        "distorted": look.camera.distorted,
    }
    if known.up is None:
        return record
    pairs = list(zip(look.cameras, known.cameras, strict=True))
    horizon, roll = np.median([errors_deg(said, camera, known.up) for said, camera in pairs], axis=0)
    return {**record, "horizon_error_deg": horizon, "roll_error_deg": roll}


def errors_deg(said: CameraEstimate, true: Camera, up: Float[np.ndarray, "3"]) -> tuple[float, float]:
    """By how many degrees horizon and roll are off, in a world where ``up`` is upwards."""
    x, y, z = true.world_from_camera[:3, :3].T @ up
    aside = (true.width_px / 2 - true.cx_px) / true.fx_px
    row = true.cy_px - true.fy_px * (x * aside + z) / y
    off_px = said.horizon_px - (row - true.height_px / 2)
    return abs(degrees(atan(off_px / true.fx_px))), abs(degrees(said.roll_rad - atan(x / y)))


def _pandaset() -> Iterator[Known]:
    clip = DATA / "clips/pandaset_002"
    known = json.loads((clip / "cameras.json").read_text())
    for name in known["cameras"]:
        files = sorted((clip / name).glob("*.jpg"))
        files = files[:: max(1, len(files) // _MOST)]
        frames = np.stack([_picture(file) for file in files])
        camera = pandaset_camera(known, name, name)
        pinhole = camera.pinhole().resized(frames.shape[2], frames.shape[1])
        poses = dict(zip(camera.sweeps, camera.rows.world_from_camera, strict=True))
        cameras = tuple(pinhole.at(poses[int(file.stem)]) for file in files)
        yield Known(f"pandaset_002 {name}", frames, cameras, np.array([0.0, 0, 1]))


def _nuscenes() -> Iterator[Known]:
    folder = DATA / "nuscenes_format/nuscenes_scene0061_first_sample"
    images = json.loads((folder / "info.json").read_text())["data_list"][0]["images"]
    for name, each in images.items():
        path = next(folder.rglob(Path(each["img_path"]).name), None)
        if path is None:
            continue
        high, wide = cv2.imread(str(path)).shape[:2]
        k = np.array(each["cam2img"])
        full = Camera(k[0, 0], k[1, 1], k[0, 2] + 0.5, k[1, 2] + 0.5, wide, high)
        frame = _picture(path)
        camera = full.resized(frame.shape[1], frame.shape[0]).at(np.array(each["cam2ego"]))
        yield Known(f"nuscenes {name}", frame[None], (camera,), np.array([0.0, 0, 1]))


def _picture(path: Path) -> UInt8[np.ndarray, "h w 3"]:
    picture = cv2.imread(str(path))
    size = WIDTH_PX, round(picture.shape[0] * WIDTH_PX / picture.shape[1])
    return np.ascontiguousarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA)[..., ::-1])
