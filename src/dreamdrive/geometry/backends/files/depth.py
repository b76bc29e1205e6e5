"""Depth files: npz, npy, EXR and 16-bit PNG.

All hold depth along z (not along the ray), 0 where it is unknown, the first row at the top.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Shaped

from dreamdrive.data.array_file import read_npy, read_npz
from dreamdrive.data.pictures.picture_file import read_picture
from dreamdrive.errors import InputError, installing
from dreamdrive.files.paths import check_file, is_path
from dreamdrive.files.tensor_file import briefly
from dreamdrive.geometry.backends.files.given import NAME, Declared, DepthFiles

ENDINGS = (".npz", ".npy", ".exr", ".png")
_EXR_CHANNELS = ("Z", "Depth.V", "depth.V", "V", "Y", "R")
_EXR_NUMBERS = 32_000_000
"""Numbers that an EXR may have over all its channels; its library holds them twice."""
_MILLIMETRE, _KITTI_M = 0.001, 1 / 256


def find_depth(folder: Path, labels: Sequence[str], declared: Declared) -> DepthFiles:
    """The depth files in ``folder``, called like ``labels``, one label for each selected frame."""
    of: dict[int, Path] = {}
    for row, label in enumerate(labels):
        # Pictures of a model may have any name, also one that no file has.
        named = [folder / f"{label}{end}" for end in ENDINGS if is_path(f"{label}{end}")]
        found = next((path for path in named if path.is_file()), None)
        if found is not None:
            of[row] = found
    return DepthFiles(of, declared.depth_unit, not declared.depth_in_poses_unit)


def read_depth(
    path: Path, unit: float | None, *, kitti: bool = False
) -> tuple[Float[np.ndarray, "h w"], str | None]:
    """Depth in metres, or in the unit of the poses, and the unit that was taken without being declared.

    Where no unit is, the stored number 1 means a millimetre, or KITTI's 1/256 m, for a PNG, a metre for
    floats; whole numbers without a unit are refused.
    """
    stored, sure = _READERS[path.suffix.lower()](path)
    if stored.ndim != 2 or stored.size == 0 or stored.dtype.kind not in "fiu":
        raise InputError(f"{path}: holds {stored.dtype} of shape {stored.shape}, expected (height, width)")
    said = None
    if sure:
        unit = 1.0
    elif unit is None:
        unit, said = _usual_unit(path, stored, kitti)
    with np.errstate(over="ignore", invalid="ignore"):
        depth = stored.astype(np.float32, copy=not stored.flags.writeable)
        depth *= np.float32(unit)
    if not np.isfinite(depth).all() or (depth < 0).any():
        raise InputError(f"{path}: holds negative, NaN or infinite depth; write 0 where there is none")
    return depth, said


def _usual_unit(path: Path, stored: Shaped[np.ndarray, "h w"], kitti: bool) -> tuple[float, str]:
    if path.suffix.lower() == ".png":
        return (_KITTI_M, "1/256 m, as KITTI has it") if kitti else (_MILLIMETRE, "millimetres")
    if np.issubdtype(stored.dtype, np.floating):
        return 1.0, "metres"
    raise InputError(
        f"{path}: holds whole numbers ({stored.dtype}), whose unit cannot be known; write "
        f'{{"depth_unit": "mm"}} (or "m", "1/256 m") into {NAME} beside the poses'
    )


def _read_npz(path: Path) -> tuple[Shaped[np.ndarray, "*d"], bool]:
    """The array ``depth_m`` (in metres for sure) or ``depth``."""
    stored = read_npz(path, ("depth_m", "depth"))
    for name, array in stored.items():
        return array, name == "depth_m"
    raise InputError(f"{path}: holds neither an array depth_m nor depth")


def _read_npy(path: Path) -> tuple[Shaped[np.ndarray, "*d"], bool]:
    stored = read_npy(path)
    return (stored[..., 0] if stored.ndim == 3 and stored.shape[2] == 1 else stored), False


def _read_png(path: Path) -> tuple[Shaped[np.ndarray, "*d"], bool]:
    image = read_picture(path)
    if image.dtype != np.uint16 or image.ndim != 2:
        raise InputError(f"{path}: expected a grey PNG of 16 bits with depth, 0 where unknown")
    return image, False


def _read_exr(path: Path) -> tuple[Shaped[np.ndarray, "*d"], bool]:
    # OpenCV's wheels come without OpenEXR since 5.0, and before only read it when told by the environment.
    try:
        import OpenEXR  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError(
            f"{path}: EXR files are read by the package OpenEXR, which is not installed; "
            f"{installing('exr')}, or give the depth as .npz"
        ) from None
    check_file(path)
    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            _check_exr(path, file)
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels: dict[str, Any] = {name: each.pixels for name, each in file.channels().items()}
    except InputError:
        raise
    except (OSError, RuntimeError, ValueError, TypeError, KeyError, MemoryError) as error:
        raise InputError(f"{path}: cannot be read as EXR ({briefly(error)})") from error
    name = next((name for name in _EXR_CHANNELS if name in channels), None)
    if name is None and len(channels) == 1:
        name = next(iter(channels))
    if name is None:
        named = briefly(", ".join(channels))
        raise InputError(f"{path}: has the channels {named}; expected Z, V, Y or a single one")
    return np.asarray(channels[name]), False


def _check_exr(path: Path, file: Any) -> None:
    """Whether the header of an EXR says that it fits into memory."""
    numbers = 0
    for part in file.parts:
        low, high = part.header["dataWindow"]
        width, height = (int(b) - int(a) + 1 for a, b in zip(low, high, strict=True))
        numbers += max(width, 0) * max(height, 0) * len(part.header["channels"])
    if numbers > _EXR_NUMBERS:
        raise InputError(
            f"{path}: states {numbers / 1e6:.0f} million numbers; expected at most "
            f"{_EXR_NUMBERS // 10**6} million"
        )


_READERS = {".npz": _read_npz, ".npy": _read_npy, ".exr": _read_exr, ".png": _read_png}
