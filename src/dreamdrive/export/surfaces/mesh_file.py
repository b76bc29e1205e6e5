"""Coloured meshes as PLY and GLB."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from dreamdrive.export.surfaces.fusion import SurfaceMesh
from dreamdrive.files.output import check_new_file, new_file

_FLOAT, _BYTE, _UINT = 5126, 5121, 5125
_POINTS, _CORNERS = 34962, 34963
"""What a part of a buffer is for, in glTF's numbers."""
_OPEN_GL = np.array([1.0, -1.0, -1.0])
"""From x right, y down, z forward to x right, y up, z backward."""


def write_mesh(mesh: SurfaceMesh, file: Path, *, replace: bool = False) -> None:
    """Write a mesh as binary PLY or GLB, as the name ends; for their axes see ``scene_to_mesh``."""
    check_new_file(file, replace)
    data = _glb(mesh) if file.suffix.lower() == ".glb" else _ply(mesh)
    with new_file(file) as partial:
        partial.write_bytes(data)


def _ply(mesh: SurfaceMesh) -> bytes:
    fields = [(axis, "<f4") for axis in "xyz"] + [(name, "u1") for name in ("red", "green", "blue")]
    corners = np.zeros(len(mesh.places_m), fields)
    for axis, values in zip("xyz", mesh.places_m.T, strict=True):
        corners[axis] = values
    for name, values in zip(("red", "green", "blue"), mesh.colours.T, strict=True):
        corners[name] = np.rint(values * 255)
    faces = np.zeros(len(mesh.triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.triangles
    kinds = {"<f4": "float", "u1": "uchar"}
    head = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(corners)}",
        *(f"property {kinds[kind]} {name}" for name, kind in fields),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    return ("\n".join(head) + "\n").encode("ascii") + corners.tobytes() + faces.tobytes()


def _glb(mesh: SurfaceMesh) -> bytes:
    """One node of one mesh; colours, linear in glTF, are those of its corners, and light changes nothing."""
    places = (mesh.places_m * _OPEN_GL).astype("<f4")
    srgb = mesh.colours
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    colours = np.full((len(places), 4), 255, np.uint8)
    colours[:, :3] = np.rint(linear * 255)
    corners = mesh.triangles.astype("<u4")
    parts = [places.tobytes(), colours.tobytes(), corners.tobytes()]
    starts = np.concatenate([[0], np.cumsum([len(part) for part in parts])]).tolist()
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": len(part), "target": target}
        for start, part, target in zip(starts, parts, (_POINTS, _POINTS, _CORNERS), strict=False)
    ]
    accessors: list[dict[str, Any]] = [
        {"bufferView": 0, "componentType": _FLOAT, "count": len(places), "type": "VEC3"}
        | {"min": places.min(axis=0).tolist(), "max": places.max(axis=0).tolist()},
        {"bufferView": 1, "componentType": _BYTE, "normalized": True, "count": len(places), "type": "VEC4"},
        {"bufferView": 2, "componentType": _UINT, "count": corners.size, "type": "SCALAR"},
    ]
    material = {"extensions": {"KHR_materials_unlit": {}}, "doubleSided": True}
    primitive = {"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "material": 0}
    scene = {
        "asset": {"version": "2.0", "generator": "dreamdrive"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "street"}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [material],
        "buffers": [{"byteLength": starts[-1]}],
        "bufferViews": views,
        "accessors": accessors,
    }
    text = json.dumps(scene, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + starts[-1]
    head = struct.pack("<III", 0x46546C67, 2, total)
    return (
        head
        + struct.pack("<II", len(text), 0x4E4F534A)
        + text
        + struct.pack("<II", starts[-1], 0x004E4942)
        + b"".join(parts)
    )
