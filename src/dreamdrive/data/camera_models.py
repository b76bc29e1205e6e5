"""Cameras as COLMAP and nerfstudio write them.

Both count pixels as we do: the centre of the first pixel is at (0.5, 0.5), so principal points are taken as
they stand.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, tan
from pathlib import Path
from typing import Annotated, Any, cast

import msgspec

from dreamdrive.data.colmap_binary import check_binary
from dreamdrive.data.distortion import Distortion, check_bend
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json
from dreamdrive.scene.camera import Camera

_COLMAP = {
    "SIMPLE_PINHOLE": "f cx cy",
    "PINHOLE": "fx fy cx cy",
    "SIMPLE_RADIAL": "f cx cy k1",
    "RADIAL": "f cx cy k1 k2",
    "OPENCV": "fx fy cx cy k1 k2 p1 p2",
    "FULL_OPENCV": "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6",
    "OPENCV_FISHEYE": "fx fy cx cy k1 k2 k3 k4",
    "SIMPLE_RADIAL_FISHEYE": "f cx cy k1",
    "RADIAL_FISHEYE": "f cx cy k1 k2",
}
"""What COLMAP's numbers mean, by its model."""
_NERFSTUDIO = ("SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "OPENCV_FISHEYE")
_FILES = ("cameras", "images", "points3D")
_ENDINGS = (".bin", ".txt")


@dataclass(frozen=True)
class LensCamera:
    """A camera of a model of several pictures.

    Attributes:
        camera: Its pinhole, at the size of its pictures.
        distortion: Its lens, or ``None`` for a pinhole.
    """

    camera: Camera
    distortion: Distortion | None


class Intrinsics(msgspec.Struct):
    """Focal lengths and principal point in pixels, the centre of the first pixel at 0."""

    fx: float
    fy: float
    cx: float
    cy: float


class IndexedPinhole(msgspec.Struct):
    """A calibration that counts pixels by integer index."""

    width: int
    height: int
    intrinsics: Intrinsics

    def camera(self) -> Camera:
        """The pinhole as we count: the centre of the first pixel at 0.5.

        Raises:
            ValueError: Its numbers are those of no camera.
        """
        k = self.intrinsics
        return Camera(k.fx, k.fy, k.cx + 0.5, k.cy + 0.5, self.width, self.height)


class MatrixPinhole(msgspec.Struct):
    """A calibration as PandaSet's cameras have it, which counts pixels by integer index, too."""

    width: int
    height: int
    K: Annotated[list[tuple[float, float, float]], msgspec.Meta(min_length=3, max_length=3)]

    def camera(self) -> Camera:
        """The pinhole as we count: the centre of the first pixel at 0.5.

        Raises:
            ValueError: Its numbers are those of no camera.
        """
        (fx, _, cx), (_, fy, cy), _ = self.K
        return Camera(fx, fy, cx + 0.5, cy + 0.5, self.width, self.height)


class NamedFrames(msgspec.Struct):
    """Which pictures poses are of, where a file says that."""

    frames: list[int] | None = None


def find_colmap(folder: Path) -> Path | None:
    """The folder of a COLMAP model: this one, or where COLMAP and nerfstudio put it inside a project."""
    for inner in (".", "sparse/0", "sparse", "colmap/sparse/0"):
        place = folder / inner
        if any((place / f"{name}{ending}").is_file() for name in _FILES for ending in _ENDINGS):
            return place
    return None


def read_colmap(folder: Path) -> Any:
    """Read a COLMAP model, binary or text, as ``pycolmap.Reconstruction``; of both the binary one.

    Raises:
        InputError: A file of it is missing or damaged.
    """
    import pycolmap  # here: reading a clip without such a model should not wait for it

    missing = {
        ending: [f"{name}{ending}" for name in _FILES if not (folder / f"{name}{ending}").is_file()]
        for ending in _ENDINGS
    }
    ending = min(missing, key=lambda each: len(missing[each]))
    if missing[ending]:
        raise InputError(
            f"{folder}: {', '.join(missing[ending])} is missing; a COLMAP model is cameras, images and "
            "points3D, all .bin or all .txt"
        )
    if ending == ".bin":
        check_binary(folder)
    model = pycolmap.Reconstruction()
    try:
        (model.read_binary if ending == ".bin" else model.read_text)(str(folder))
        for image in model.images.values():
            str(image.name)  # which it decodes here
    except (ValueError, IndexError, KeyError, RuntimeError, MemoryError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{folder}: the COLMAP model is damaged ({reason}); export it again") from error
    return model


def from_colmap(camera: Any, where: str) -> LensCamera:
    """A ``pycolmap.Camera`` of a COLMAP model.

    Raises:
        InputError: Its lens is of a kind that is not known here, or its numbers are none.
    """
    name = camera.model.name
    if name not in _COLMAP:
        raise InputError(
            f"{where}: camera model {name} is not known; expected {', '.join(_COLMAP)}: undistort the "
            "pictures with `colmap image_undistorter` and give these and their model"
        )
    values = dict(zip(_COLMAP[name].split(), map(float, camera.params), strict=True))
    focal = {"fx": values.get("f"), "fy": values.get("f")}
    return _lens_camera({**focal, **values}, (camera.width, camera.height), "FISHEYE" in name, where)


def from_nerfstudio(values: Mapping[str, Any], where: str) -> LensCamera:
    """The camera that a ``transforms.json``, or one frame of it, describes.

    Without ``fl_y`` the pixels are square, without ``cx``, ``cy`` the principal point is in the middle, and
    ``camera_angle_x`` stands in for ``fl_x``, as in the files of instant-ngp.

    Raises:
        InputError: A number is missing or none, or the lens is of a kind that is not known here.
    """
    name = str(values.get("camera_model", "OPENCV"))
    if name not in _NERFSTUDIO:
        raise InputError(
            f"{where}: camera_model {name!r} is not known; expected {', '.join(_NERFSTUDIO)}: undistort the "
            "pictures and give a transforms.json of them"
        )
    width, height = (_number(values, key, where) for key in ("w", "h"))
    if not (width >= 1 and height >= 1 and width == int(width) and height == int(height)):
        raise InputError(f"{where}: expected w and h as whole pixels, got {width:g}x{height:g}")
    if "fl_x" not in values and "camera_angle_x" in values:
        angle = _number(values, "camera_angle_x", where)
        if not 0 < angle < 3.1:
            raise InputError(f"{where}: camera_angle_x {angle:g}: expected radians between 0 and 3.1")
        fx = width / 2 / tan(angle / 2)
    else:
        fx = _number(values, "fl_x", where)
    found = {
        "fx": fx,
        "fy": _number(values, "fl_y", where, fx),
        "cx": _number(values, "cx", where, width / 2),
        "cy": _number(values, "cy", where, height / 2),
        **{key: _number(values, key, where, 0.0) for key in ("k1", "k2", "k3", "k4", "p1", "p2")},
    }
    fisheye = name == "OPENCV_FISHEYE"
    if found["k4"] and not fisheye:
        raise InputError(f"{where}: k4 {found['k4']:g} belongs to OPENCV_FISHEYE; {name} has k1 k2 p1 p2 k3")
    if fisheye:
        del found["p1"], found["p2"]
    return _lens_camera(found, (int(width), int(height)), fisheye, where)


def _lens_camera(
    values: Mapping[str, float | None], size: tuple[int, int], fisheye: bool, where: str
) -> LensCamera:
    numbers = {key: float(value) for key, value in values.items() if value is not None}
    if not all(map(isfinite, numbers.values())):
        raise InputError(f"{where}: the intrinsics hold NaN or infinite numbers")
    check_bend([numbers[key] for key in numbers if key[0] in "kp"], where)
    try:
        fx, fy, cx, cy = (numbers[key] for key in ("fx", "fy", "cx", "cy"))
        camera = Camera(fx, fy, cx, cy, *size)
    except ValueError as error:
        raise InputError(f"{where}: {error}") from error
    if fisheye:  # equidistant: bent even with all coefficients 0
        bend = [numbers.get(f"k{i}", 0.0) for i in (1, 2, 3, 4)]
        return LensCamera(camera, Distortion("fisheye", tuple(bend)))
    order = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
    bend = [numbers.get(key, 0.0) for key in order]
    if not any(bend):
        return LensCamera(camera, None)
    length = 8 if any(bend[5:]) else 5 if bend[4] else 4
    return LensCamera(camera, Distortion("opencv", tuple(bend[:length])))


def _number(values: Mapping[str, Any], key: str, where: str, default: float | None = None) -> float:
    value = values.get(key, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e12:
        raise InputError(f"{where}: expected a number for {key}, got {value!r}")
    return float(value)


def transforms_frames(values: Mapping[str, Any], where: str) -> list[dict[str, Any]]:
    """The frames of a ``transforms.json``, each with what is shared by all of them.

    Raises:
        InputError: There are none, or one is no object.
    """
    frames = values.get("frames")
    listed = cast("list[Any]", frames) if isinstance(frames, list) else []
    if not listed or not all(isinstance(frame, dict) for frame in listed):
        raise InputError(f"{where}: expected frames, a list of objects with file_path and transform_matrix")
    shared = {key: value for key, value in values.items() if key != "frames"}
    return [{**shared, **frame} for frame in listed]


def model_cameras(path: Path, option: str) -> list[LensCamera] | None:
    """The different cameras of a COLMAP model or a ``transforms.json``; ``None`` if the path is neither.

    Args:
        path: A file or a folder.
        option: How messages call it, such as ``--intrinsics``.

    Raises:
        InputError: It is one of them and cannot be used.
    """
    transforms = path / "transforms.json" if path.is_dir() else path
    if transforms.suffix.lower() == ".json" and transforms.is_file():
        values = read_json(transforms, option)
        if (
            not isinstance(values.get("frames"), list)
            or "intrinsics" in values
            or "world_from_camera" in values
        ):
            return None
        where = f"{option} {transforms}"
        cameras = [from_nerfstudio(frame, where) for frame in transforms_frames(values, where)]
    else:
        folder = find_colmap(path) if path.is_dir() else None
        if folder is None:
            return None
        model = read_colmap(folder)
        cameras = [from_colmap(camera, str(folder)) for camera in model.cameras.values()]
    return list({lens_key(each): each for each in cameras}.values())


def lens_key(each: LensCamera) -> tuple[object, ...]:
    """What makes two cameras the same."""
    c = each.camera
    return (c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.width_px, c.height_px, each.distortion)
