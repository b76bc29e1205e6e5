"""Features of frames on disk: what a model that ran elsewhere thought of each pixel (docs/replay.md).

A ``.safetensors`` file holds one array (F, h, w, C) a name, half or single precision, each covering the whole
of the input's pictures, and in its metadata under ``provenance`` a JSON object that says where they are from;
``frame_index`` in it, where it is given, lists which frames of the input the rows are of.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard, cast

import numpy as np
from jaxtyping import Float, Int
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from dreamdrive.data.cameras.lens import SourceLens
from dreamdrive.data.frames.size import Sizing
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import parse_json
from dreamdrive.files.output import new_file
from dreamdrive.files.tensor_file import DAMAGE, briefly, header_problem

MAX_CHANNELS = 128
"""More a name are refused: each pixel of the frames carries all of them. The first components do as well."""
FEATURE_BYTES = 600_000_000
"""Largest file: 1000 frames at an eighth of 480x270 in half precision, with as many channels as may be."""
INDEX = "frame_index"
"""Where the provenance may list the frames of the input that the rows are of."""
_KEY = "provenance"
_TYPES = {"F16": "float16", "F32": "float32"}
_EXPECTED = "a .safetensors file with arrays (frames, rows, columns, channels), see docs/replay.md"


@dataclass(frozen=True)
class FeatureFile:
    """Named features (F, h, w, C), all of F frames, and as JSON values where they come from."""

    arrays: dict[str, Float[np.ndarray, "f _ _ _"]]
    provenance: dict[str, Any]

    def of_frames(self, index: Int[np.ndarray, " f"], count: Callable[[], int], path: Path) -> "FeatureFile":
        """Those of the selected frames, by their index in the source.

        There has to be one row a frame of the source, one a selected frame, or the file says which frames it
        is of. ``count`` gives the number of frames of the source; it is called only where it decides.
        """
        rows = len(next(iter(self.arrays.values())))
        if INDEX in self.provenance:
            return self._rows(self._by_index(index, rows, path))
        if rows == len(index):
            return self
        if rows != count():
            raise InputError(
                f"--features {path} has {rows} frames, but the input has {count()}, {len(index)} of them "
                "selected; expected features of each frame of the input or of each selected frame"
            )
        return self._rows(index)

    def _rows(self, rows: Int[np.ndarray, " f"]) -> "FeatureFile":
        return FeatureFile({name: array[rows] for name, array in self.arrays.items()}, self.provenance)

    def _by_index(self, index: Int[np.ndarray, " f"], rows: int, path: Path) -> Int[np.ndarray, " f"]:
        """The row of each selected frame, as the file itself says which frames it is of."""
        own: Any = self.provenance[INDEX]
        if not _is_index(own) or len(own) != rows:
            raise InputError(f"--features {path}: {INDEX} is no list of {rows} frames, one for each row")
        row_of = {frame: row for row, frame in enumerate(own)}
        if missing := [frame for frame in index.tolist() if frame not in row_of]:
            raise InputError(
                f"--features {path} is of {rows} frames of its clip, from {min(row_of)} to {max(row_of)}; "
                f"frame {missing[0]} is selected and not among them: choose the --frames that the features "
                "were computed with, or compute them again"
            )
        return np.array([row_of[frame] for frame in index.tolist()])

    def cropped(
        self, sizing: Sizing, lens: SourceLens | None, path: Path | None
    ) -> dict[str, Float[np.ndarray, "f _ _ _"]]:
        """The features of what is left of the pictures in the clip; bilinear where something was cut away."""
        if lens is not None:
            raise InputError(
                f"--features {path} is of the distorted pictures, but --intrinsics takes the distortion out "
                "of the frames; undistort the input first, and compute the features of that"
            )
        if sizing.scaled == sizing.target:
            return self.arrays
        made: dict[str, np.ndarray] = {}
        for name, array in self.arrays.items():
            for axis, side in ((1, 1), (2, 0)):
                array = _resampled(array, axis, sizing.offset[side], sizing.target[side], sizing.scaled[side])
            made[name] = array
        return made


def read_features(path: Path) -> FeatureFile:
    """Read a file of features; an error names what is malformed."""
    where = f"--features {path}"
    try:
        if problem := header_problem(path):
            raise SafetensorError(problem)
        if (size := path.stat().st_size) > FEATURE_BYTES:
            raise SafetensorError(f"it holds {size / 1e6:.0f} MB, more than {FEATURE_BYTES // 10**6}")
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            for name in file.keys():  # noqa: SIM118
                stated = file.get_slice(name)
                kind = _TYPES.get(str(stated.get_dtype()), str(stated.get_dtype()))
                if problem := _misfit(tuple(stated.get_shape()), kind):
                    raise InputError(f"{where}: {briefly(repr(name))} {problem}")
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except InputError:
        raise
    except DAMAGE as error:
        raise InputError(f"{where} cannot be read ({briefly(error)}); expected {_EXPECTED}") from None
    if not arrays:
        raise InputError(f"{where} holds no array; expected {_EXPECTED}")
    for name, array in arrays.items():
        if problem := _problem(array):
            raise InputError(f"{where}: {briefly(repr(name))} {problem}")
    if len({len(array) for array in arrays.values()}) > 1:
        counts = ", ".join(f"{name!r} {len(array)}" for name, array in arrays.items())
        raise InputError(f"{where}: its arrays have different numbers of frames: {counts}")
    return FeatureFile(arrays, _provenance(metadata, where))


def write_features(path: Path, features: FeatureFile) -> None:
    """Write a file that ``read_features`` reads, whole or not at all; ``ValueError`` where it is none."""
    for name, array in features.arrays.items():
        if problem := _problem(array):
            raise ValueError(f"features {briefly(repr(name))} {problem}")
    arrays = {name: np.ascontiguousarray(array) for name, array in features.arrays.items()}
    blob = save(arrays, metadata={_KEY: json.dumps(features.provenance)})
    with new_file(path) as partial:
        partial.write_bytes(blob)


def _is_index(values: Any) -> TypeGuard[list[int]]:
    return isinstance(values, list) and all(type(each) is int for each in cast("list[Any]", values))


def _problem(array: np.ndarray) -> str | None:
    wrong = _misfit(array.shape, array.dtype.name)
    return wrong or (None if np.isfinite(array).all() else "holds NaN or infinite numbers")


def _misfit(shape: tuple[int, ...], kind: str) -> str | None:
    """What is wrong with an array by what its header says."""
    if kind not in _TYPES.values():
        return f"holds {kind}; expected float16 or float32"
    if len(shape) != 4 or 0 in shape:
        return f"has the shape {shape}; expected (frames, rows, columns, channels)"
    if shape[3] > MAX_CHANNELS:
        return (
            f"has {shape[3]} channels; expected at most {MAX_CHANNELS}: keep the first principal "
            "components, 16 to 32 of them"
        )
    return None


def _provenance(metadata: dict[str, str], where: str) -> dict[str, Any]:
    if _KEY not in metadata:
        raise InputError(
            f"{where} does not say where it comes from: expected a JSON object in its metadata under {_KEY!r}"
        )
    values = parse_json(metadata[_KEY], f"{where}: its metadata under {_KEY!r}")
    if not isinstance(values, dict):
        raise InputError(f"{where}: its metadata under {_KEY!r} is no JSON object")
    return cast("dict[str, Any]", values)


def _resampled(array: np.ndarray, axis: int, offset: int, target: int, scaled: int) -> np.ndarray:
    """The part of an axis from ``offset`` on, ``target`` of ``scaled`` pixels long, on as many cells."""
    cells = array.shape[axis]
    at = (offset + (np.arange(cells) + 0.5) / cells * target) / scaled * cells - 0.5
    at = np.clip(at, 0, cells - 1)
    low = np.minimum(np.floor(at).astype(int), max(cells - 2, 0))
    share = (at - low).reshape([-1 if k == axis else 1 for k in range(array.ndim)]).astype(np.float32)
    first, second = (np.take(array, np.minimum(low + k, cells - 1), axis) for k in (0, 1))
    return (first * (1 - share) + second * share).astype(array.dtype)
