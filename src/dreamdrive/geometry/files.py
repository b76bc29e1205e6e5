"""Geometry that the user brings as files: poses, intrinsics and depth.

A folder holds

- ``cameras.json``: ``{"width", "height", "intrinsics": {"fx", "fy", "cx", "cy"},
  "world_from_camera": [4x4, ...], "frames": [index, ...]}``. Pixels are counted by integer index (the first
  pixel's centre is 0), axes are x right, y down, z forward, lengths are metres. ``frames`` names the source
  frame of each pose and may be left out when there is one for each source frame, in order.
- ``depth/NNNN.npz`` (array ``depth_m``, metres) or ``depth/NNNN.png`` (16 bit, millimetres), NNNN the source
  frame; depth along z, 0 where unknown. Frames without a file have no depth; the folder may be missing.

All of it is for a picture with the clip's field of view, at any size.
"""

import json
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera, check_rigid
from dreamdrive.scene.clip import Clip

_ASPECT_TOLERANCE = 0.01


def attach(clip: Clip, directory: Path) -> Clip:
    """The clip with what ``directory`` says in its rig and ``known``.

    Raises:
        InputError: A file is missing or damaged, or does not fit the clip.
    """
    path = directory / "cameras.json"
    record = _read_json(path)
    camera = _camera(record, clip.size, path)
    poses = _poses(record, clip, path)
    depth = _depths(clip, directory / "depth")
    known = replace(clip.known, world_from_camera=poses, intrinsics=True, depth_m=depth)
    return replace(clip, rig=(camera,), camera=np.zeros(len(clip), np.intp), known=known)


def _read_json(path: Path) -> dict[str, Any]:
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); geometry files need it") from error
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is not JSON ({error})") from error
    needed = ("width", "height", "intrinsics", "world_from_camera")
    if not isinstance(record, dict) or any(key not in record for key in needed):
        raise InputError(f"{path}: expected an object with {', '.join(needed)}")
    return record


def _camera(record: dict[str, Any], size: tuple[int, int], path: Path) -> Camera:
    try:
        width, height = int(record["width"]), int(record["height"])
        fx, fy, cx, cy = (float(record["intrinsics"][key]) for key in ("fx", "fy", "cx", "cy"))
        camera = Camera(fx, fy, cx + 0.5, cy + 0.5, width, height)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{path}: width, height and intrinsics fx, fy, cx, cy expected ({error})") from error
    if not np.isfinite([fx, fy, cx, cy]).all():
        raise InputError(f"{path}: the intrinsics hold NaN or infinite numbers")
    if abs(width / height * size[1] / size[0] - 1) > _ASPECT_TOLERANCE:
        raise InputError(
            f"{path}: made for {width}x{height}, but the clip is {size[0]}x{size[1]}, another aspect; "
            "give the geometry for the clip's picture, or choose --size to match"
        )
    return camera.resized(*size)


def _poses(record: dict[str, Any], clip: Clip, path: Path) -> Float[np.ndarray, "f 4 4"]:
    try:
        matrices = np.asarray(record["world_from_camera"], np.float64)
        frames = [int(i) for i in record.get("frames", range(len(matrices)))]
        check_rigid(matrices.reshape(-1, *matrices.shape[-2:]), "world_from_camera")
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{path}: {error}") from error
    if matrices.ndim != 3 or len(frames) != len(matrices):
        raise InputError(f"{path}: {len(frames)} frames for world_from_camera of shape {matrices.shape}")
    row = {frame: k for k, frame in enumerate(frames)}
    missing = [int(i) for i in clip.source_index if int(i) not in row]
    if missing:
        raise InputError(f"{path}: has no pose for the selected frames {missing[:5]}")
    selected = matrices[[row[int(i)] for i in clip.source_index]]
    return np.linalg.inv(selected[0]) @ selected


def _depths(clip: Clip, folder: Path) -> Float[np.ndarray, "f h w"] | None:
    found = [_depth_file(folder, int(index)) for index in clip.source_index]
    if not any(found):
        return None
    width, height = clip.size
    depth = np.zeros((len(clip), height, width), np.float32)
    for frame, path in enumerate(found):
        if path is not None:
            depth[frame] = _read_depth(path, clip.size)
    return depth


def _depth_file(folder: Path, index: int) -> Path | None:
    candidates = (folder / f"{index:04d}{ending}" for ending in (".npz", ".png"))
    return next((path for path in candidates if path.is_file()), None)


def _read_depth(path: Path, size: tuple[int, int]) -> Float[np.ndarray, "h w"]:
    depth = _read_npz(path) if path.suffix == ".npz" else _read_png(path)
    height, width = depth.shape
    if abs(width / height * size[1] / size[0] - 1) > _ASPECT_TOLERANCE:
        raise InputError(f"{path}: is {width}x{height}, but the clip is {size[0]}x{size[1]}, another aspect")
    if not np.isfinite(depth).all() or (depth < 0).any():
        raise InputError(f"{path}: holds negative, NaN or infinite depth; write 0 where there is none")
    # Nearest: an average across a depth edge is a depth at which there is nothing.
    return cv2.resize(depth, size, interpolation=cv2.INTER_NEAREST)


def _read_npz(path: Path) -> Float[np.ndarray, "h w"]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            depth = np.asarray(archive["depth_m"], np.float32)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: cannot be read as an npz with an array depth_m ({error})") from error
    if depth.ndim != 2 or depth.size == 0:
        raise InputError(f"{path}: depth_m has shape {depth.shape}, expected (height, width)")
    return depth


def _read_png(path: Path) -> Float[np.ndarray, "h w"]:
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None or image.dtype != np.uint16 or image.ndim != 2:
        raise InputError(f"{path}: expected a grey PNG of 16 bits with depth in millimetres")
    return image.astype(np.float32) / 1000
