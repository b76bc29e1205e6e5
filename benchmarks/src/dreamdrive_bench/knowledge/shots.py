"""Recorded pictures with lidar: those of PandaSet's six cameras, and of KITTI."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, Int, UInt8

from dreamdrive.scene.camera import Camera
from dreamdrive_bench.common.places import DATA

WIDTH_PX = 640
"""Width of the pictures at most, as those of five cameras are."""
_KITTI_HEIGHT_M = 1.65
_PANDASET_HEIGHT_M = 2.2


@dataclass(frozen=True)
class Shot:
    """A picture, the camera that took it, and lidar points in it.

    Attributes:
        camera: Name of the camera.
        picture: RGB file of any size of the pinhole's shape.
        pinhole: Of at most ``WIDTH_PX`` pixels of width.
        height_m: Of the camera above the road.
        place_px: Columns and rows of the points.
        depth_m: Along z.
        label: Number of the point's class; None where there are no labels.
    """

    camera: str
    picture: Path
    pinhole: Camera
    height_m: float
    place_px: Float[np.ndarray, "n 2"]
    depth_m: Float[np.ndarray, " n"]
    label: Int[np.ndarray, " n"] | None

    def frame(self) -> UInt8[np.ndarray, "h w 3"]:
        """The picture at the pinhole's size."""
        size = self.pinhole.width_px, self.pinhole.height_px
        picture = cv2.imread(str(self.picture))
        return np.ascontiguousarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA)[..., ::-1])

    def pixels(self) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        """Rows and columns of the pixels that the points lie in."""
        column, row = np.floor(self.place_px).astype(int).T
        return row.clip(0, self.pinhole.height_px - 1), column.clip(0, self.pinhole.width_px - 1)


def pandaset() -> Iterator[Shot]:
    """Every picture with lidar: the front camera's are those of the clip, the others of the training data."""
    training, clip = DATA / "training/pandaset_002", DATA / "clips/pandaset_002"
    cameras = json.loads((training / "cameras.json").read_text())["cameras"]
    rise_m = {name: np.array(each["camera_to_world"])[:, 2, 3] for name, each in cameras.items()}
    for name, each in cameras.items():
        front = name == "front_camera"
        pinhole = pinhole_of(each, each["width"], each["height"])
        lidar = clip / "lidar_depth_front" if front else training / "lidar_labels" / name
        folder = clip / name if front else training / name
        for path in sorted(lidar.glob("*.npz")):
            index = int(path.stem)
            height_m = _PANDASET_HEIGHT_M + rise_m[name][index] - rise_m["front_camera"][index]
            taken = 3.0 if front else 1.0
            yield _shot(name, folder / f"{path.stem}.jpg", pinhole, float(height_m), path, taken)


def kitti() -> Iterator[Shot]:
    """Every picture with lidar of a clip from KITTI."""
    clip = DATA / "clips/kitti_odom04_follow_van"
    meta = json.loads((clip / "meta.json").read_text())
    full = pinhole_of(meta["intrinsics"], meta["width"], meta["height"])
    pinhole = full.resized(WIDTH_PX, round(full.height_px * WIDTH_PX / full.width_px))
    for path in sorted((clip / "lidar_depth").glob("*.npz")):
        picture = clip / "frames" / f"{path.stem}.jpg"
        yield _shot("kitti04", picture, pinhole, _KITTI_HEIGHT_M, path, full.width_px / WIDTH_PX)


def pinhole_of(k: dict[str, float], width_px: int, height_px: int) -> Camera:
    """A pinhole from a file, which counts pixels by integer index."""
    return Camera(k["fx"], k["fy"], k["cx"] + 0.5, k["cy"] + 0.5, width_px, height_px)


def _shot(name: str, picture: Path, pinhole: Camera, height_m: float, lidar: Path, taken: float) -> Shot:
    """A shot whose lidar file is for a picture so many times as wide as the pinhole's."""
    with np.load(lidar) as stored:
        place_px = (np.column_stack([stored["u"], stored["v"]]).astype(float) + 0.5) / taken
        label = stored["sem"].astype(int) if "sem" in stored else None
        return Shot(name, picture, pinhole, height_m, place_px, stored["depth"].astype(float), label)
