"""Stage results on disk: frozen dataclasses, arrays and tensors as one JSON and one safetensors file."""

import hashlib
import json
import math
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
import torch
from jaxtyping import Shaped
from safetensors.numpy import load, save

from dreamdrive.decompose import Grouping
from dreamdrive.errors import InputError
from dreamdrive.files.checked import build, check_finite
from dreamdrive.files.json_file import read_json
from dreamdrive.files.output import new_file
from dreamdrive.files.tensor_file import DAMAGE, read_own
from dreamdrive.fit import StaticFit
from dreamdrive.geometry import Measured, Posed
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known, Recorded
from dreamdrive.scene.exposure import Exposure
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Focal, Geometry, Ground, Scale
from dreamdrive.scene.sky import Sky
from dreamdrive.scene.street.log import OfLog
from dreamdrive.scene.street.look import CameraEstimate, Look, RoadUser
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.scene.trajectory import Trajectory

NOUNS: dict[str, type] = {
    noun.__name__: noun
    for noun in (
        Camera,
        CameraEstimate,
        Clip,
        Exposure,
        Focal,
        Gaussians,
        Geometry,
        Ground,
        Grouping,
        Known,
        Look,
        Measured,
        OfLog,
        Posed,
        Recorded,
        RoadUser,
        Scale,
        Sky,
        StaticFit,
        Trajectory,
    )
}
"""What may be stored; a file names these and nothing else."""

JSON_NAME, _ARRAYS = "result.json", "result.safetensors"
# Keys of the JSON objects that stand for something else.
_NOUN, _ARRAY, _TENSOR, _TUPLE, _DICT, _ODD = "noun", "array", "tensor", "tuple", "dict", "number"
_CLASS = "street class"


T = TypeVar("T")


class DamagedError(InputError):
    """Stored files are missing, cut short or do not belong together."""


def write(folder: Path, value: object, header: dict[str, Any]) -> None:
    """Store ``value`` and a header of JSON values in ``folder``.

    The arrays are written first and the JSON, which holds their digest, last, each under a temporary name:
    after a kill at any moment the folder holds a whole result or one that ``read`` refuses.
    """
    arrays: dict[str, np.ndarray] = {}
    document = {"header": header, "value": _encode(value, "value", arrays)}
    blob = save(arrays)
    document["sha256"] = hashlib.sha256(blob).hexdigest()
    with new_file(folder / _ARRAYS) as path:
        path.write_bytes(blob)
    with new_file(folder / JSON_NAME) as path:
        path.write_text(json.dumps(document, allow_nan=False))


def read_header(folder: Path) -> object:
    """The header of what ``folder`` holds; ``InputError`` where there is nothing readable."""
    return read_json(folder / JSON_NAME, follow=False).get("header")


def read(folder: Path, kind: type[T] = object) -> T:
    """What ``write`` stored; every noun of the types and shapes that it has, and the whole of ``kind``.

    ``DamagedError`` says what is wrong, or that it is too large for the memory that is free.
    """
    try:
        document = read_json(folder / JSON_NAME, follow=False)
        blob = read_own(folder / _ARRAYS)
        if hashlib.sha256(blob).hexdigest() != document["sha256"]:
            raise DamagedError(f"{folder / _ARRAYS} is not the file that {JSON_NAME} was written with")
        value = _decode(document["value"], load(blob))
    except DAMAGE as error:
        raise DamagedError(f"{folder}: {error}") from error
    if not isinstance(value, kind):
        raise DamagedError(f"{folder} holds a {type(value).__name__}; expected a {kind.__name__}")
    return value


def _encode(value: object, name: str, arrays: dict[str, np.ndarray]) -> object:
    """JSON values for ``value``; arrays go to ``arrays`` under their path."""
    if isinstance(value, float) and not math.isfinite(value):
        return {_ODD: str(value)}
    if isinstance(value, StreetClass):
        return {_CLASS: value.name}
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, np.generic):
        return _encode(value.item(), name, arrays)
    if isinstance(value, np.ndarray | torch.Tensor):
        kind = _ARRAY if isinstance(value, np.ndarray) else _TENSOR
        plain = value if isinstance(value, np.ndarray) else value.detach().numpy()
        arrays[name] = np.ascontiguousarray(plain).reshape(plain.shape)
        return {kind: name}
    if isinstance(value, tuple | list):
        items = [_encode(item, f"{name}.{i}", arrays) for i, item in enumerate(cast(list[object], value))]
        return {_TUPLE: items} if isinstance(value, tuple) else items
    if isinstance(value, dict):
        named = cast(dict[str, object], value)
        if not all(isinstance(key, str) for key in cast(dict[object, object], value)):
            raise ValueError(f"{name}: cannot store a dictionary whose keys are not text")
        return {_DICT: {key: _encode(item, f"{name}.{key}", arrays) for key, item in named.items()}}
    if is_dataclass(value) and NOUNS.get(type(value).__name__) is type(value):
        parts = {f.name: _encode(getattr(value, f.name), f"{name}.{f.name}", arrays) for f in fields(value)}
        return {_NOUN: type(value).__name__, "fields": parts}
    raise ValueError(f"{name}: cannot store a {type(value).__name__}")


def _decode(value: Any, arrays: dict[str, Shaped[np.ndarray, "..."]]) -> Any:
    if isinstance(value, list):
        return [_decode(item, arrays) for item in cast(list[Any], value)]
    if not isinstance(value, dict):
        return value
    if not value:
        raise DamagedError("an entry is empty")
    kind = next(iter(cast(dict[str, Any], value)))
    content = value[kind]
    if kind in (_ARRAY, _TENSOR):
        check_finite(str(content), arrays[content])
        return arrays[content] if kind == _ARRAY else torch.from_numpy(arrays[content])
    if kind == _TUPLE:
        return tuple(_decode(item, arrays) for item in content)
    if kind == _DICT:
        return {key: _decode(item, arrays) for key, item in content.items()}
    if kind == _ODD:
        return float(content)
    if kind == _CLASS:
        return StreetClass[content]
    if kind == _NOUN:
        parts = {name: _decode(item, arrays) for name, item in value["fields"].items()}
        made = build(NOUNS[content], parts)
        if isinstance(made, Gaussians) and (problem := made.problem()):
            raise DamagedError(problem)
        return made
    raise DamagedError(f"unknown entry {kind!r}")
