"""Calibration files, and the guess where there is none."""

from dataclasses import dataclass
from math import radians, tan
from pathlib import Path
from typing import Literal

import msgspec

from dreamdrive.data.cameras.distortion import Distortion, check_bend
from dreamdrive.data.formats.cameras import Intrinsics, LensCamera, different
from dreamdrive.data.formats.colmap import colmap_camera, find_colmap, read_colmap
from dreamdrive.data.formats.nerfstudio import frame_camera, transforms_frames
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type, read_json
from dreamdrive.scene.camera import Camera

DEFAULT_FOCAL = 0.85
"""Focal length over the longer side of the image where nothing is known: 61 degrees, a usual dashcam."""
GUESSED = f"No calibration: the focal length is taken as {DEFAULT_FOCAL} times the longer side."
_ASPECT_TOLERANCE = 0.005
_OPENCV_ORDER = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tx", "ty"]


@dataclass(frozen=True)
class Calibration:
    """The camera that took the source, with sentences for the report.

    The pinhole is at the source's size; there is no distortion or it is unknown where it is None. ``known``
    tells a calibration file from a guess, ``hfov`` a guess from a field of view that was told.
    """

    camera: Camera
    distortion: Distortion | None
    known: bool
    notes: tuple[str, ...]
    hfov: bool = False


def calibration(size: tuple[int, int], intrinsics: Path | None, hfov_deg: float | None) -> Calibration:
    """The camera of an input, as far as it is told."""
    if intrinsics is not None and hfov_deg is not None:
        raise InputError("--intrinsics and --hfov both tell the focal length; give one of them")
    return guess_camera(size, hfov_deg) if intrinsics is None else read_intrinsics(intrinsics, size)


def guess_camera(size: tuple[int, int], hfov_deg: float | None = None) -> Calibration:
    """A pinhole for a source without calibration: principal point in the centre, square pixels."""
    width, height = size
    if hfov_deg is None:
        focal = DEFAULT_FOCAL * max(size)
        said = GUESSED
    elif not 1 <= hfov_deg <= 179:
        raise InputError(f"--hfov {hfov_deg:g}: expected degrees between 1 and 179, such as 60")
    else:
        focal = 0.5 * width / tan(radians(hfov_deg) / 2)
        said = f"No calibration: the focal length follows from --hfov, {hfov_deg:g} degrees."
    camera = Camera(focal, focal, width / 2, height / 2, width, height)
    notes = said, "The lens distortion is unknown and taken as zero."
    return Calibration(camera, None, False, notes, hfov_deg is not None)


def read_intrinsics(path: Path, size: tuple[int, int]) -> Calibration:
    """Read a calibration file: JSON with ``width``, ``height``, ``intrinsics`` and optional ``distortion``.

    The file counts pixels by integer index (the centre of the first pixel is 0), so 0.5 is added to cx, cy. A
    COLMAP model or a ``transforms.json`` of one camera counts as a calibration, too, see ``model_cameras``.
    One for another size of the source's aspect is scaled.
    """
    cameras = model_cameras(path, "--intrinsics")
    if cameras is not None and len(cameras) != 1:
        raise InputError(
            f"--intrinsics {path} holds {len(cameras)} different cameras; expected one for all frames: let "
            "COLMAP share it (--ImageReader.single_camera 1), or undistort the pictures and give their model"
        )
    try:
        found, notes = _of_json(path) if cameras is None else (cameras[0], [])
        (width, height), (wide, high) = found.size, size
        if abs(width / height * high / wide - 1) > _ASPECT_TOLERANCE:
            raise InputError(
                f"--intrinsics {path} is for {width:g}x{height:g} images, but the input is "
                f"{wide}x{high}, another shape; give the calibration of this input"
            )
        if found.size != size:
            notes = [f"The calibration is scaled from {width:g}x{height:g} to {wide}x{high}.", *notes]
        return Calibration(found.camera.resized(*size), found.distortion, True, tuple(notes))
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"--intrinsics {path}: {error}") from None


class _Bend(msgspec.Struct):
    model: str
    coefficients: list[float]


class _Told(msgspec.Struct):
    """What a calibration file holds; some programs write whole sizes as 1280.0."""

    width: float
    height: float
    intrinsics: Intrinsics
    distortion: _Bend | str | None = None


def _of_json(path: Path) -> tuple[LensCamera, list[str]]:
    """The camera at the size that the file is for, and what to say about its lens."""
    values = read_json(path, "--intrinsics")
    if not isinstance(values.get("intrinsics"), dict):
        raise InputError(
            f"--intrinsics {path} holds no calibration; expected JSON with width, height and "
            'intrinsics {"fx", "fy", "cx", "cy"} in pixels, a COLMAP model or a transforms.json'
        )
    told = of_type(values, _Told, f"--intrinsics {path}")
    k, width, height = told.intrinsics, told.width, told.height
    whole = width % 1 == height % 1 == 0
    if not whole or min(width, height, k.fx, k.fy) <= 0 or not (0 <= k.cx < width and 0 <= k.cy < height):
        raise InputError(
            f"--intrinsics {path}: expected whole positive sizes, positive focal lengths and a principal "
            f"point inside the image, got width {width:g}, height {height:g}, fx {k.fx:g}, fy {k.fy:g}, "
            f"cx {k.cx:g}, cy {k.cy:g}"
        )
    camera = Camera(k.fx, k.fy, k.cx + 0.5, k.cy + 0.5, int(width), int(height))
    distortion, notes = _distortion(path, told.distortion)
    return LensCamera(camera, distortion), notes


def model_cameras(path: Path, option: str) -> list[LensCamera] | None:
    """The different cameras of a COLMAP model or a ``transforms.json``; ``None`` if the path is neither."""
    transforms = path / "transforms.json" if path.is_dir() else path
    if transforms.suffix.lower() == ".json" and transforms.is_file():
        values = read_json(transforms, option)
        if not isinstance(values.get("frames"), list) or {"intrinsics", "world_from_camera"} & values.keys():
            return None
        where = f"{option} {transforms}"
        return different([frame_camera(frame, where) for frame in transforms_frames(values, where)])[0]
    folder = find_colmap(path) if path.is_dir() else None
    if folder is None:
        return None
    model = read_colmap(folder)
    return different([colmap_camera(camera, str(folder)) for camera in model.cameras.values()])[0]


def _distortion(path: Path, value: _Bend | str | None) -> tuple[Distortion | None, list[str]]:
    if not isinstance(value, _Bend):
        said = f' (the calibration says "{value}")' if value else ""
        return None, [f"No distortion coefficients are given: the lens distortion is taken as zero{said}."]
    name, coefficients = value.model, tuple(value.coefficients)
    check_bend(coefficients, f"--intrinsics {path}")
    model, order = _model(path, name)
    allowed = (4,) if model == "fisheye" else (4, 5, 8, 12, 14)
    if len(coefficients) not in allowed or (order and len(order) != len(coefficients)):
        raise InputError(
            f"--intrinsics {path}: distortion {name!r} with {len(coefficients)} coefficients; expected "
            f"{' or '.join(map(str, allowed))} in OpenCV's order"
        )
    return (Distortion(model, coefficients) if any(coefficients) or model == "fisheye" else None), []


def _model(path: Path, name: str) -> tuple[Literal["opencv", "fisheye"], list[str]]:
    """The model and the order of coefficients that a name such as ``opencv k1 k2 p1 p2 k3`` spells out."""
    words = name.lower().replace("_", " ").replace(",", " ").split()
    fisheye = "fisheye" in words
    order = [w for w in words if w not in ("opencv", "fisheye")]
    expected = ["k1", "k2", "k3", "k4"] if fisheye else _OPENCV_ORDER[: len(order)]
    if len(order) == len(words) or (order and order != expected):
        raise InputError(
            f"--intrinsics {path}: unknown distortion model {name!r}; expected opencv (k1 k2 p1 p2 k3 ...) "
            "or fisheye"
        )
    return ("fisheye" if fisheye else "opencv"), order
