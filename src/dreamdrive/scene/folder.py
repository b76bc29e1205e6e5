"""A scene on disk: ``scene.json`` and tensors in safetensors; no pickle is ever read."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import safetensors
import safetensors.torch
import torch
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.atomic import new_folder
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.deformation import DeformationField
from dreamdrive.scene.exposure import Exposure
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.sky import Sky
from dreamdrive.scene.stored_motion import described, rebuilt

FORMAT = "dreamdrive scene"
VERSION = 2
CONVENTIONS = (
    "World: the camera of the first frame, x right, y down, z forward, metres. Times in seconds. "
    "Cameras: pinholes, the centre of the top-left pixel at (0.5, 0.5). Quaternions wxyz, scales as natural "
    "logarithms, opacities as logits, colour = SH + 0.5."
)
_INDEX = "scene.json"
_BLOCK = "main"


def save_scene(scene: Scene, path: Path, *, replace: bool = False) -> None:
    """Write a scene folder; it appears whole or not at all, and equal scenes give equal bytes.

    Args:
        scene: What to write.
        path: The folder.
        replace: Whether an existing scene folder may be replaced.

    Raises:
        InputError: Something else is at ``path``, or it cannot be written; what was there stays.
    """
    parts = {f"{_BLOCK}-{name}.safetensors": _encode(tensors) for name, tensors in _tensors(scene).items()}
    index = {
        "format": FORMAT,
        "version": _version(scene),
        "conventions": CONVENTIONS,
        "provenance": scene.provenance,
        "blocks": [{"name": _BLOCK, "parts": sorted(parts)}],
        "parts": {name: hashlib.sha256(data).hexdigest() for name, data in parts.items()},
        **_values(scene),
    }
    # Through text once, so that the checksum is that of what a reader will see.
    index = json.loads(json.dumps(index, allow_nan=False))
    index["sha256"] = _checksum(index)
    text = json.dumps(index, indent=1, sort_keys=True, allow_nan=False)
    with new_folder(path, replace=replace, mark=_INDEX) as folder:
        for name, data in parts.items():
            (folder / name).write_bytes(data)
        (folder / _INDEX).write_text(text + "\n", encoding="utf-8")


def load_scene(path: Path) -> Scene:
    """Read a scene folder.

    Raises:
        InputError: No scene, a newer format, or a file that is missing or differs from what was written.
    """
    index = _read_index(path)
    parts = {name: _read_part(path, name, digest) for name, digest in index["parts"].items()}

    def part(name: str) -> dict[str, Tensor] | None:
        return parts.get(f"{_BLOCK}-{name}.safetensors")

    try:
        return _rebuild(index, part)
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        raise InputError(f"{path} is not a complete scene ({error}); generate it again") from error


def _version(scene: Scene) -> int:
    """The oldest format that holds the scene: version 1 knows deformation fields alone."""
    return 1 if isinstance(scene.deformation, DeformationField | None) else VERSION


def _encode(tensors: dict[str, Tensor]) -> bytes:
    return safetensors.torch.save({name: t.detach().cpu().contiguous() for name, t in tensors.items()})


def _tensors(scene: Scene) -> dict[str, dict[str, Tensor]]:
    """What goes into each safetensors file."""
    tensors = {"static": scene.static.tensors(), "dynamic": scene.dynamic.tensors()}
    if scene.deformation is not None:
        tensors["deformation"] = scene.deformation.state_dict()
    if scene.sky is not None:
        tensors["sky"] = {"texture": scene.sky.texture}
    if scene.exposure is not None:
        tensors["exposure"] = {
            "transforms": scene.exposure.transforms,
            "times_s": torch.from_numpy(np.asarray(scene.exposure.times_s, dtype=np.float64)),
        }
        if scene.exposure.camera is not None:
            tensors["exposure"]["camera"] = torch.from_numpy(scene.exposure.camera)
    return tensors


def _values(scene: Scene) -> dict[str, Any]:
    """What goes into the index itself; floats survive JSON exactly."""
    return {
        "actors": [
            {**asdict(a), "times_s": a.times_s.tolist(), "positions_m": a.positions_m.tolist()}
            for a in scene.actors
        ],
        "cameras": [{**asdict(c), "world_from_camera": c.world_from_camera.tolist()} for c in scene.cameras],
        "times_s": scene.times_s.tolist(),
        "held_out": scene.held_out.tolist(),
        **({} if scene.camera is None else {"camera": scene.camera.tolist()}),
        "deformation": None if scene.deformation is None else described(scene.deformation),
        "sky": None
        if scene.sky is None
        else {n: getattr(scene.sky, n) for n in ("azimuth_rad", "elevation_rad")},
    }


def _checksum(index: dict[str, Any]) -> str:
    """SHA-256 of the index without its own checksum."""
    rest = {name: value for name, value in index.items() if name != "sha256"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True, allow_nan=False).encode()).hexdigest()


def _read_index(path: Path) -> dict[str, Any]:
    try:
        index = json.loads((path / _INDEX).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(
            f"{path} is not a scene folder: {_INDEX} cannot be read ({error.strerror})"
        ) from error
    except ValueError as error:
        raise InputError(
            f"{path / _INDEX} is damaged or no scene ({error}); generate the scene again"
        ) from error
    if not isinstance(index, dict) or index.get("format") != FORMAT:
        raise InputError(f"{path / _INDEX} does not describe a scene; expected format {FORMAT!r}")
    if index.get("version") not in range(1, VERSION + 1):
        raise InputError(
            f"{path} has scene format version {index.get('version')}; this program reads 1 to {VERSION}, "
            "use the program that wrote it or generate the scene again"
        )
    if index.get("sha256") != _checksum(index):
        raise InputError(f"{path / _INDEX} was changed after it was written; generate the scene again")
    return index


def _read_part(path: Path, name: str, digest: str) -> dict[str, Tensor]:
    try:
        data = (path / name).read_bytes()
    except OSError as error:
        raise InputError(f"{path} is incomplete: {name} cannot be read ({error.strerror})") from error
    if hashlib.sha256(data).hexdigest() != digest:
        raise InputError(
            f"{path / name} is damaged: its SHA-256 differs from {_INDEX}; generate the scene again"
        )
    try:
        return safetensors.torch.load(data)
    except safetensors.SafetensorError as error:
        raise InputError(f"{path / name} is not a safetensors file ({error})") from error


def _rebuild(index: dict[str, Any], part: Callable[[str], dict[str, Tensor] | None]) -> Scene:
    static, dynamic = part("static"), part("dynamic")
    if static is None or dynamic is None:
        raise KeyError("no static or no dynamic Gaussians")
    sky, exposure, motion = part("sky"), part("exposure"), part("deformation")
    return Scene(
        static=Gaussians(**static),
        dynamic=Gaussians(**dynamic),
        deformation=None if motion is None else rebuilt(index["deformation"], motion),
        actors=tuple(Actor(**_arrays(a, "times_s", "positions_m")) for a in index["actors"]),
        sky=None if sky is None else Sky(sky["texture"], **{n: tuple(r) for n, r in index["sky"].items()}),
        exposure=None if exposure is None else _exposure(exposure),
        cameras=tuple(Camera(**_arrays(c, "world_from_camera")) for c in index["cameras"]),
        times_s=np.array(index["times_s"], dtype=np.float64),
        held_out=np.array(index["held_out"], dtype=bool),
        camera=np.array(index["camera"], dtype=np.int64) if "camera" in index else None,
        provenance=index["provenance"],
    )


def _exposure(part: dict[str, Tensor]) -> Exposure:
    camera = part["camera"].numpy() if "camera" in part else None
    return Exposure(part["transforms"], part["times_s"].numpy(), camera)


def _arrays(values: dict[str, Any], *names: str) -> dict[str, Any]:
    return {**values, **{name: np.array(values[name], dtype=np.float64) for name in names}}
