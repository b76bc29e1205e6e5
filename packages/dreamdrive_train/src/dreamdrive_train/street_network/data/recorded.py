"""Recorded pictures as records: with lidar and its classes, or with depth that stereo is sure of."""

import json
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from dreamdrive.data.pictures.picture_file import read_picture, write_picture
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive_train.street_network.data.records import UNKNOWN, Record, depth_steps

_LONG_SIDE_PX = 512
_SURE = 0.7  # confidence from which classical depth teaches
_STILL = 0.2  # evidence of motion from which it does not
_LABELS = {
    StreetClass.VEGETATION: ("Vegetation",),
    StreetClass.ROAD: ("Road",),
    StreetClass.MARKING: ("Lane Line Marking", "Stop Line Marking", "Other Road Marking"),
    StreetClass.GROUND: ("Ground", "Sidewalk", "Driveway"),
    StreetClass.VEHICLE: (
        "Car",
        "Pickup Truck",
        "Medium-sized Truck",
        "Semi-truck",
        "Towed Object",
        "Other Vehicle - Construction Vehicle",
        "Other Vehicle - Uncommon",
        "Emergency Vehicle",
        "Bus",
        "Train",
        "Trolley",
        "Tram / Subway",
    ),
    StreetClass.TWO_WHEELER: ("Motorcycle", "Personal Mobility Device", "Motorized Scooter", "Bicycle"),
    StreetClass.PERSON: ("Pedestrian", "Pedestrian with Object"),
    StreetClass.POLE: ("Signs", "Construction Signs"),
    StreetClass.STRUCTURE: ("Road Barriers", "Building", "Temporary Construction Barriers"),
}
"""Classes of PandaSet's points; those of the others are not used."""


def pandaset_records(recording: Path, front: Path, out: Path, camera_height_m: float) -> list[Record]:
    """Every picture of PandaSet that has lidar: depth and classes of its points.

    Args:
        recording: Five cameras with ``cameras.json``, ``lidar_labels`` and ``semseg_classes.json``.
        front: The front camera's frames and ``lidar_depth_front``.
        out: Where pictures go.
        camera_height_m: Height of the front camera above the road.
    """
    cameras = json.loads((recording / "cameras.json").read_text())["cameras"]
    names = json.loads((recording / "semseg_classes.json").read_text())
    number = {name: int(key) for key, name in names.items()}
    label = np.full(256, UNKNOWN, np.uint8)
    for kind, points in _LABELS.items():
        label[[number[name] for name in points]] = kind
    level_m = np.array(cameras["front_camera"]["camera_to_world"])[:, 2, 3]
    records: list[Record] = []
    out.mkdir(parents=True, exist_ok=True)
    for name, k in cameras.items():
        ahead = name == "front_camera"
        lidar = front / "lidar_depth_front" if ahead else recording / "lidar_labels" / name
        folder = front / name if ahead else recording / name
        # The file counts pixels by integer index.
        pinhole = Camera(k["fx"], k["fy"], k["cx"] + 0.5, k["cy"] + 0.5, k["width"], k["height"])
        pinhole = pinhole.resized(_LONG_SIDE_PX, round(pinhole.height_px * _LONG_SIDE_PX / pinhole.width_px))
        for path in sorted(lidar.glob("*.npz")):
            index = int(path.stem)
            camera = pinhole.at(np.array(k["camera_to_world"][index]))
            stem, size = f"{name}-{path.stem}", (camera.width_px, camera.height_px)
            _write_lidar(read_picture(folder / f"{path.stem}.jpg"), path, label, size, out / stem)
            horizon_px, roll_rad = level_line(camera)
            records.append(
                Record(
                    image=f"{stem}.jpg",
                    source="pandaset",
                    group=recording.name,
                    labels=f"{stem}-labels.png",
                    depth=f"{stem}-depth.png",
                    focal_px=camera.fx_px,
                    horizon_px=horizon_px,
                    roll_rad=roll_rad,
                    camera_height_m=camera_height_m + float(camera.world_from_camera[2, 3] - level_m[index]),
                    distorted=False,
                )
            )
    return records


def _write_lidar(
    picture: UInt8[np.ndarray, "_ _ 3"],
    lidar: Path,
    label: UInt8[np.ndarray, " 256"],
    size: tuple[int, int],
    out: Path,
) -> None:
    """Write a picture at a width and height, and the nearest of the points that lie in each pixel."""
    scale = size[0] / picture.shape[1]
    labels = np.zeros((*size[::-1], 3), np.uint8)
    labels[..., 2], labels[..., 1] = UNKNOWN, UNKNOWN  # OpenCV writes blue first
    depth = np.zeros(size[::-1], np.uint16)
    with np.load(lidar) as points:
        order = np.argsort(-points["depth"])  # the nearest last
        column, row = (
            np.floor((points[k][order] + 0.5) * scale).astype(int).clip(0, side - 1)
            for k, side in zip("uv", size, strict=True)
        )
        depth[row, column] = depth_steps(points["depth"][order])
        kind = label[points["sem"][order]]
        labels[row, column, 2] = kind
        labels[row, column, 1] = np.where(kind <= StreetClass.POLE, 0, UNKNOWN)
    write_picture(Path(f"{out}.jpg"), cv2.resize(picture, size, interpolation=cv2.INTER_AREA))
    write_picture(Path(f"{out}-labels.png"), labels)
    write_picture(Path(f"{out}-depth.png"), depth)


def level_line(camera: Camera) -> tuple[float, float]:
    """``horizon_px`` and ``roll_rad`` of ``Record``; the world's z is up."""
    up = camera.world_from_camera[2, :3]  # in the camera
    aside = (camera.width_px / 2 - camera.cx_px) / camera.fx_px
    row = camera.cy_px - camera.fy_px * (aside * up[0] + up[2]) / up[1]
    return float(row - camera.height_px / 2), float(np.arctan2(-up[0], -up[1]))


def clip_records(clip: Clip, geometry: Geometry, source: str, group: str, out: Path) -> list[Record]:
    """Frames of a clip of one camera, with the depth that its geometry is sure of.

    What moves, and what stereo is not sure of, stays unknown; nothing is said of classes.

    Raises:
        InputError: The geometry is a fallback.
    """
    if geometry.fallback is not None:
        raise InputError(f"{group}: {geometry.fallback}; expected a clip whose depth was measured")
    out.mkdir(parents=True, exist_ok=True)
    records: list[Record] = []
    for index in np.flatnonzero(~clip.held_out).tolist():
        camera, name = geometry.cameras[index], f"{group}-{clip.source_index[index]:05d}"
        sure = (geometry.confidence[index] >= _SURE) & (geometry.moving[index] < _STILL)
        depth = np.where(sure, geometry.depth_m[index], 0)
        write_picture(out / f"{name}.jpg", clip.frames[index][..., ::-1])
        write_picture(out / f"{name}-depth.png", depth_steps(depth))
        height_m = None if geometry.ground is None else _height_m(geometry, index)
        records.append(
            Record(
                image=f"{name}.jpg",
                source=source,
                group=group,
                depth=f"{name}-depth.png",
                focal_px=camera.fx_px if geometry.focal.observed else None,
                camera_height_m=height_m,
            )
        )
    return records


def _height_m(geometry: Geometry, index: int) -> float:
    assert geometry.ground is not None
    return float(geometry.ground.height_m(geometry.cameras[index].world_from_camera[:3, 3]))
