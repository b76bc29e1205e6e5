"""A scene on disk: ``scene.json`` and tensors in safetensors; no pickle is ever read."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
import safetensors.torch
import torch
from msgspec import Meta
from torch import Tensor

from dreamdrive.data.formats.rigid import JsonPose
from dreamdrive.errors import InputError
from dreamdrive.files.checked import build, check_finite
from dreamdrive.files.json_file import of_type, parse_json
from dreamdrive.files.output import new_folder
from dreamdrive.files.paths import TEXT_BYTES, inside, read_bytes
from dreamdrive.files.tensor_file import DAMAGE, briefly, read_own
from dreamdrive.motion import rebuilt
from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.camera import FARTHEST_M, Camera
from dreamdrive.scene.exposure import Exposure
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Provenance, Scene, SceneMotion
from dreamdrive.scene.sky import Sky
from dreamdrive.stored.believable import check_scene

FORMAT = "dreamdrive scene"
VERSION = 4
CONVENTIONS = (
    "World: the camera of the first frame, x right, y down, z forward, metres. Times in seconds. "
    "Cameras: pinholes, the centre of the top-left pixel at (0.5, 0.5). Quaternions wxyz, scales as natural "
    "logarithms, opacities as logits, colour = SH + 0.5."
)
_INDEX = "scene.json"
_BLOCK = "main"
_FIRST_MOTION = "network"
"""The only kind of motion in format version 1, which does not name it."""

_Metres = Annotated[float, Meta(ge=-FARTHEST_M, le=FARTHEST_M)]
_Digest = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
_Point = tuple[_Metres, _Metres, _Metres]
_Length = Annotated[float, Meta(ge=0, le=FARTHEST_M)]
_Angle = Annotated[float, Meta(ge=-1e4, le=1e4)]


class _StoredCamera(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A view, as ``Camera``."""

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    width_px: int
    height_px: int
    world_from_camera: JsonPose

    def camera(self) -> Camera:
        """The noun; ``ValueError`` where its pose, size or focal length is none of a camera."""
        pose = np.array(self.world_from_camera, dtype=np.float64)
        return Camera(self.fx_px, self.fy_px, self.cx_px, self.cy_px, self.width_px, self.height_px, pose)


class _StoredActor(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What moves, as ``Actor``; ``size_m`` and ``ahead`` are its box."""

    id: Annotated[int, Meta(ge=0, le=10**6)]
    name: Annotated[str, Meta(max_length=200)]
    kind: Annotated[str, Meta(max_length=200)]
    count: Annotated[int, Meta(ge=0, le=10**9)]
    times_s: list[float]
    positions_m: list[_Point]
    yaw_rad: list[_Angle] | None = None
    size_m: tuple[_Length, _Length, _Length] | None = None
    ahead: _Point | None = None
    spread_m: list[_Length] | None = None
    completed: bool = False

    def actor(self) -> Actor:
        """The noun; ``ValueError`` where times and places do not belong together."""
        yaw_rad = [0.0] * len(self.times_s) if self.yaw_rad is None else self.yaw_rad
        positions_m = np.array(self.positions_m, dtype=np.float64).reshape(-1, 3)
        track = Track(
            np.array(self.times_s, dtype=np.float64), positions_m, np.array(yaw_rad, dtype=np.float64)
        )
        spread_m = None if self.spread_m is None else np.array(self.spread_m, dtype=np.float64)
        box = None
        if self.size_m is not None and self.ahead is not None:
            box = ActorBox(np.array(self.size_m), np.array(self.ahead))
        return Actor(self.id, self.name, self.kind, self.count, track, box, spread_m, self.completed)

    @classmethod
    def of(cls, actor: Actor) -> "_StoredActor":
        """What is stored of one."""
        track = actor.track
        path = track.times_s.tolist(), track.positions_m.tolist(), track.yaw_rad.tolist()
        box = (None, None) if actor.box is None else (actor.box.size_m.tolist(), actor.box.ahead.tolist())
        spread_m = None if actor.spread_m is None else actor.spread_m.tolist()
        return cls(actor.id, actor.name, actor.kind, actor.count, *path, *box, spread_m, actor.completed)


class _StoredSky(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The range of the panorama, as ``Sky``."""

    azimuth_rad: tuple[float, float]
    elevation_rad: tuple[float, float]


class _StoredIndex(msgspec.Struct, frozen=True):
    """All of ``scene.json`` that a scene is made of."""

    parts: dict[str, _Digest]
    actors: list[_StoredActor]
    cameras: Annotated[list[_StoredCamera], Meta(min_length=1)]
    times_s: list[float]
    held_out: list[bool]
    provenance: Provenance
    camera: list[Annotated[int, Meta(ge=0, le=10**4)]] | None = None
    deformation: dict[str, int | float | str] | None = None
    sky: _StoredSky | None = None


def save_scene(scene: Scene, path: Path | str, *, replace: bool = False) -> None:
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
        "provenance": asdict(scene.provenance),
        "blocks": [{"name": _BLOCK, "parts": sorted(parts)}],
        "parts": {name: hashlib.sha256(data).hexdigest() for name, data in parts.items()},
        **_values(scene),
    }
    # Through text once, so that the checksum is that of what a reader will see.
    index = json.loads(json.dumps(index, allow_nan=False))
    index["sha256"] = _checksum(index)
    text = json.dumps(index, indent=1, sort_keys=True, allow_nan=False)
    with new_folder(Path(path), replace=replace, kind="scene") as folder:
        for name, data in parts.items():
            (folder / name).write_bytes(data)
        (folder / _INDEX).write_text(text + "\n", encoding="utf-8")


def load_scene(path: Path | str) -> Scene:
    """Read a scene folder; nothing in it is believed before it is checked.

    Raises:
        InputError: No scene, a newer format, a file that is missing or differs from what was written, values
            that no scene has, or more than the memory that is free.
    """
    path = Path(path)
    index = _read_index(path)
    stored = of_type(index, _StoredIndex, str(path / _INDEX))
    parts = {name: _read_part(path, name, digest) for name, digest in stored.parts.items()}

    def part(name: str) -> dict[str, Tensor] | None:
        return parts.get(f"{_BLOCK}-{name}.safetensors")

    try:
        scene = _rebuild(stored, part)
        check_scene(scene)
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        raise InputError(f"{path} is not a complete scene ({error}); generate it again") from error
    return scene


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
    if scene.residual is not None:
        tensors["residual"] = {"rms": torch.from_numpy(scene.residual)}
    if scene.frames is not None:
        kept = {str(view): frame for view, frame in enumerate(scene.frames) if frame}
        tensors["frames"] = {k: torch.frombuffer(bytearray(v), dtype=torch.uint8) for k, v in kept.items()}
    return tensors


def _values(scene: Scene) -> dict[str, Any]:
    """What goes into the index itself; floats survive JSON exactly."""
    return {
        "actors": [msgspec.structs.asdict(_StoredActor.of(actor)) for actor in scene.actors],
        "cameras": [{**asdict(c), "world_from_camera": c.world_from_camera.tolist()} for c in scene.cameras],
        "times_s": scene.times_s.tolist(),
        "held_out": scene.held_out.tolist(),
        **({} if scene.camera is None else {"camera": scene.camera.tolist()}),
        "deformation": None if scene.deformation is None else _described(scene.deformation),
        "sky": None
        if scene.sky is None
        else {n: getattr(scene.sky, n) for n in ("azimuth_rad", "elevation_rad")},
    }


def _version(scene: Scene) -> int:
    """The first format version that can hold a scene.

    1 knows deformation fields alone, and does not name them; 2 other motions; 3 a per-frame street; 4 what
    was filled in, and rigid actors of other scenes.
    """
    config = None if scene.deformation is None else scene.deformation.config
    if scene.static.filled is not None or getattr(config, "rigid", 0):
        return VERSION
    if scene.moves_per_frame:
        return 3
    return 1 if scene.deformation is None or scene.deformation.kind == _FIRST_MOTION else 2


def _described(motion: SceneMotion) -> dict[str, Any]:
    kind = {} if motion.kind == _FIRST_MOTION else {"kind": motion.kind}
    # What none has is not named, so that older programs read what they can move.
    return {
        **kind,
        **{name: value for name, value in asdict(motion.config).items() if name != "rigid" or value},
    }


def _rebuilt(values: dict[str, Any], state: dict[str, Tensor]) -> SceneMotion:
    # Here, since what moves is built on the nouns of this package.
    return rebuilt(values.get("kind", _FIRST_MOTION), {k: v for k, v in values.items() if k != "kind"}, state)


def _checksum(index: dict[str, Any]) -> str:
    """SHA-256 of the index without its own checksum."""
    rest = {name: value for name, value in index.items() if name != "sha256"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True, allow_nan=False).encode()).hexdigest()


def _read_index(path: Path) -> dict[str, Any]:
    try:
        data = read_bytes(path / _INDEX, _INDEX, at_most=TEXT_BYTES, follow=False)
    except InputError as error:
        raise InputError(f"{path} is not a scene folder: {error}") from error
    try:
        index = parse_json(data, _INDEX)
    except InputError as error:
        raise InputError(f"{path} is damaged or no scene: {error}; generate the scene again") from error
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
        data = read_own(inside(path, name), name)
    except InputError as error:
        raise InputError(f"{path} is incomplete: {error}") from error
    if hashlib.sha256(data).hexdigest() != digest:
        raise InputError(
            f"{path / name} is damaged: its SHA-256 differs from {_INDEX}; generate the scene again"
        )
    try:
        tensors = safetensors.torch.load(data)
        for key, tensor in tensors.items():
            check_finite(key, tensor)
    except DAMAGE as error:
        raise InputError(f"{path / name} holds no tensors of a scene ({briefly(error)})") from error
    return tensors


def _rebuild(stored: _StoredIndex, part: Callable[[str], dict[str, Tensor] | None]) -> Scene:
    static, dynamic = part("static"), part("dynamic")
    if static is None or dynamic is None:
        raise KeyError("no static or no dynamic Gaussians")
    ranges = {} if stored.sky is None else msgspec.structs.asdict(stored.sky)
    sky, exposure, motion = part("sky"), part("exposure"), part("deformation")
    residual, frames = part("residual"), part("frames")
    return Scene(
        static=build(Gaussians, static),
        dynamic=build(Gaussians, dynamic),
        deformation=None if motion is None else _rebuilt(stored.deformation or {}, motion),
        actors=tuple(actor.actor() for actor in stored.actors),
        sky=None if sky is None else build(Sky, {**sky, **ranges}),
        exposure=None if exposure is None else _exposure(exposure),
        cameras=tuple(camera.camera() for camera in stored.cameras),
        times_s=np.array(stored.times_s, dtype=np.float64),
        held_out=np.array(stored.held_out, dtype=bool),
        camera=None if stored.camera is None else np.array(stored.camera, dtype=np.int64),
        provenance=stored.provenance,
        residual=None if residual is None else residual["rms"].numpy(),
        frames=None if frames is None else _frames(frames, len(stored.cameras)),
    )


def _frames(part: dict[str, Tensor], count: int) -> tuple[bytes, ...]:
    if strange := set(part) - {str(view) for view in range(count)}:
        raise ValueError(f"frames are of no view: {', '.join(sorted(strange))[:80]}")
    return tuple(part[k].numpy().tobytes() if (k := str(view)) in part else b"" for view in range(count))


def _exposure(part: dict[str, Tensor]) -> Exposure:
    arrays = {name: tensor.numpy() for name, tensor in part.items() if name != "transforms"}
    return build(Exposure, {**arrays, "transforms": part["transforms"]})
