"""Gaussians as binary glTF with KHR_gaussian_splatting: points with attributes, axes x right, y up, z back.

Rotations are xyzw, scales linear deviations, opacities 0 to 1, colours coefficients as 3DGS has them.
Source: the extension of Khronos.
"""

import json
import struct
from typing import Any, cast

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.data.splats.splats import UP_AND_BACK, Splats, arrays_of, check_count
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import parse_json
from dreamdrive.scene.gaussians import SH_C0, Gaussians

_NAME = "KHR_gaussian_splatting"
_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
_JSON_BYTES = 16_000_000
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
_TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5126: "<f4"}
_FULL = {5120: 127, 5121: 255, 5122: 32767, 5123: 65535}
"""What normalised whole numbers are divided by."""
_BANDS = (1, 3, 5, 7)
_LEAST_OPACITY = 1e-7
_POINTS, _FLOAT = 0, 5126


def pack_glb(gaussians: Gaussians) -> bytes:
    """A GLB file with one primitive; programs that do not know the extension show coloured points."""
    numbers = arrays_of(gaussians, UP_AND_BACK)
    opacities = 1 / (1 + np.exp(-numbers.logit_opacities[:, None].astype(np.float64)))
    points = np.concatenate([numbers.sh[:, 0] * SH_C0 + 0.5, opacities], axis=1)
    arrays: dict[str, np.ndarray] = {
        "POSITION": numbers.means,
        "COLOR_0": np.clip(np.rint(points * 255), 0, 255).astype(np.uint8),
        f"{_NAME}:ROTATION": np.roll(numbers.quaternions, -1, axis=1),
        f"{_NAME}:SCALE": np.exp(np.minimum(numbers.log_scales, 40.0)),
        f"{_NAME}:OPACITY": opacities,
    }
    for name, k in _coefficients(numbers.sh.shape[1]):
        arrays[name] = numbers.sh[:, k]
    views: list[dict[str, int]] = []
    accessors: list[dict[str, Any]] = []
    parts: list[bytes] = []
    for name, values in arrays.items():
        data = (values if values.dtype == np.uint8 else values.astype("<f4")).tobytes()
        views.append({"buffer": 0, "byteOffset": sum(map(len, parts)), "byteLength": len(data)})
        parts.append(data + bytes(-len(data) % 4))
        accessors.append(_accessor(name, values, len(views) - 1))
    document = {
        "asset": {"version": "2.0", "generator": "dreamdrive"},
        "extensionsUsed": [_NAME],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [_primitive(list(arrays))]}],
        "buffers": [{"byteLength": sum(map(len, parts))}],
        "bufferViews": views,
        "accessors": accessors,
    }
    return _container(json.dumps(document).encode("ascii"), b"".join(parts))


def _coefficients(count: int) -> list[tuple[str, int]]:
    """Name of the attribute of each coefficient of colour, and which it is."""
    named = [
        f"{_NAME}:SH_DEGREE_{degree}_COEF_{k}" for degree, band in enumerate(_BANDS) for k in range(band)
    ]
    return [(name, k) for k, name in enumerate(named[:count])]


def _accessor(name: str, values: np.ndarray, view: int) -> dict[str, Any]:
    widths = {width: kind for kind, width in _WIDTHS.items()}
    whole = values.dtype == np.uint8
    about: dict[str, Any] = {
        "bufferView": view,
        "componentType": 5121 if whole else _FLOAT,
        "count": len(values),
        "type": widths[values.shape[1]],
    }
    if whole:
        about["normalized"] = True
    if name == "POSITION" and len(values):
        about |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
    return about


def _primitive(names: list[str]) -> dict[str, Any]:
    about = {
        "kernel": "ellipse",
        "colorSpace": "srgb_rec709_display",
        "projection": "perspective",
        "sortingMethod": "cameraDistance",
    }
    attributes = {name: i for i, name in enumerate(names)}
    return {"mode": _POINTS, "attributes": attributes, "extensions": {_NAME: about}}


def _container(document: bytes, numbers: bytes) -> bytes:
    document += b" " * (-len(document) % 4)
    size = _HEADER.size + 2 * _CHUNK.size + len(document) + len(numbers)
    return b"".join(
        [
            _HEADER.pack(b"glTF", 2, size),
            _CHUNK.pack(len(document), b"JSON"),
            document,
            _CHUNK.pack(len(numbers), b"BIN\0"),
            numbers,
        ]
    )


def unpack_glb(data: bytes, where: str) -> Splats:
    """The Gaussians of all splat primitives of a GLB file, in its own axes, with the colours that all have.

    Of nodes, positions may move; turned or scaled ones are refused.
    """
    document, numbers = _chunks(data, where)
    required = set(_list(document, "extensionsRequired")) - {_NAME}
    if required:
        raise InputError(f"{where} needs {', '.join(map(str, required))}, which is not read; unpack it first")
    try:
        parts = [
            _splats(document, numbers, primitive, where, shift)
            for mesh, shift in _placed(document, where)
            for primitive in document["meshes"][mesh]["primitives"]
            if _NAME in primitive.get("extensions", {})
        ]
    except (
        KeyError,
        IndexError,
        TypeError,
        AttributeError,
        ValueError,
        OverflowError,
        RecursionError,
    ) as error:
        raise InputError(f"{where} is damaged: {type(error).__name__} {error} in its description") from None
    if not parts:
        raise InputError(f"{where} holds no Gaussians; expected a primitive with {_NAME}")
    check_count(sum(len(part.means) for part in parts), len(data), where)
    least = min(part.sh.shape[1] for part in parts)
    names = "means", "quaternions", "log_scales", "logit_opacities"
    joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return Splats(**joined, sh=np.concatenate([part.sh[:, :least] for part in parts]))


def _chunks(data: bytes, where: str) -> tuple[dict[str, Any], bytes]:
    """The description and the numbers."""
    if len(data) < _HEADER.size + _CHUNK.size or not data.startswith(b"glTF"):
        raise InputError(f"{where} is not binary glTF: it begins with {data[:4]!r}")
    _, version, size = _HEADER.unpack_from(data)
    if version != 2 or size > len(data):
        raise InputError(f"{where} is cut short, or not of version 2: it has {len(data)} of {size} bytes")
    found: dict[bytes, bytes] = {}
    place = _HEADER.size
    while place + _CHUNK.size <= size:
        length, kind = _CHUNK.unpack_from(data, place)
        place += _CHUNK.size
        if length > size - place or (kind == b"JSON" and length > _JSON_BYTES):
            raise InputError(f"{where} is damaged: a part of {length} bytes does not fit in")
        found.setdefault(kind, data[place : place + length])
        place += length
    document = parse_json(found.get(b"JSON", b"").decode("utf-8", "replace"), where)
    if not isinstance(document, dict):
        raise InputError(f"{where} has no description; expected binary glTF with {_NAME}")
    return cast("dict[str, Any]", document), found.get(b"BIN\0", b"")


def _list(document: dict[str, Any], name: str) -> list[Any]:
    found = document.get(name, [])
    return cast("list[Any]", found) if isinstance(found, list) else []


def _placed(document: dict[str, Any], where: str) -> list[tuple[int, Float[np.ndarray, "4 4"]]]:
    """Each mesh that the scene shows, and where."""
    nodes, scenes = _list(document, "nodes"), _list(document, "scenes")
    found: list[tuple[int, np.ndarray]] = []
    seen: set[int] = set()

    def walk(index: int, world: np.ndarray) -> None:
        if index in seen or index < 0:
            raise InputError(f"{where} is damaged: its nodes are no tree")
        seen.add(index)
        here = world @ _pose(nodes[index])
        if "mesh" in nodes[index]:
            found.append((nodes[index]["mesh"], here))
        for child in nodes[index].get("children", []):
            walk(child, here)

    roots = scenes[document.get("scene", 0)]["nodes"] if scenes else range(len(nodes))
    for root in roots:
        walk(root, np.eye(4))
    return found


def _pose(node: dict[str, Any]) -> Float[np.ndarray, "4 4"]:
    pose = np.eye(4)
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    turn = Rotation.from_quat(node.get("rotation", [0, 0, 0, 1])).as_matrix()
    pose[:3, :3] = turn * np.array(node.get("scale", [1, 1, 1]), np.float64)
    pose[:3, 3] = node.get("translation", [0, 0, 0])
    return pose


def _splats(
    document: dict[str, Any],
    numbers: bytes,
    primitive: dict[str, Any],
    where: str,
    world: Float[np.ndarray, "4 4"],
) -> Splats:
    if not np.allclose(world[:3, :3], np.eye(3), atol=1e-6):
        raise InputError(
            f"{where} turns or scales its Gaussians as a whole; apply that in the program it is of"
        )
    attributes = primitive["attributes"]

    def values(name: str) -> Float[np.ndarray, "n c"]:
        return _values(document, numbers, attributes[name], name, where)

    means = values("POSITION")
    coefficients = [name for name, _ in _coefficients(16)]
    there = sum(name in attributes for name in coefficients)
    degree = int(there**0.5) - 1
    whole = (degree + 1) ** 2
    opacities = np.clip(values(f"{_NAME}:OPACITY")[:, 0], _LEAST_OPACITY, 1 - _LEAST_OPACITY)
    with np.errstate(divide="ignore", invalid="ignore"):
        scales = np.log(values(f"{_NAME}:SCALE"))
    found = Splats(
        means=means + world[:3, 3].astype(np.float32),
        quaternions=np.roll(values(f"{_NAME}:ROTATION"), 1, axis=1),
        log_scales=scales,
        logit_opacities=np.log(opacities / (1 - opacities)),
        sh=np.stack([values(name) for name in coefficients[: max(whole, 1)]], axis=1),
    )
    rows = {len(getattr(found, name)) for name in found.__dataclass_fields__}
    if len(rows) > 1 or (means.shape[1], found.quaternions.shape[1], scales.shape[1]) != (3, 4, 3):
        raise InputError(f"{where} is damaged: its attributes are not of one number of Gaussians")
    return found


def _values(
    document: dict[str, Any], numbers: bytes, index: int, name: str, where: str
) -> Float[np.ndarray, "n c"]:
    """An attribute as float32."""
    about = document["accessors"][index]
    view = document["bufferViews"][about["bufferView"]]
    kind, count, width = about["componentType"], about["count"], _WIDTHS[about["type"]]
    if "sparse" in about or view.get("buffer", 0) != 0 or "uri" in document["buffers"][0]:
        raise InputError(f"{where}: {name} lies outside the file, or in parts; save it as one GLB")
    row = np.dtype((_TYPES[kind], (width,)))
    stride = view.get("byteStride", row.itemsize)
    start = view.get("byteOffset", 0) + about.get("byteOffset", 0)
    check_count(count, len(numbers), where)
    end = start + (count - 1) * stride + row.itemsize
    if start < 0 or stride < row.itemsize or end > len(numbers):
        raise InputError(f"{where} is cut short: {name} ends at byte {end} of {len(numbers)}")
    found = np.ndarray((count, width), _TYPES[kind], numbers, start, (stride, row.itemsize // width))
    if about.get("normalized"):
        return np.maximum(found.astype(np.float32) / _FULL[kind], -1)
    return found.astype(np.float32)
