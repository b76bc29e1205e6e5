"""A pack: a clip and its geometry, found on the cores, small enough to be carried to a bare machine.

Frames are JPEG at the largest size and averaged for smaller ones. Depth is kept to half a percent,
confidence, motion and spread in 16 to 256 steps. Both devices get the same, and no library that finds
cameras or reads videos is needed.
"""

import lzma
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from safetensors.numpy import load, save

from dreamdrive.build import build_scene
from dreamdrive.options import QUALITIES
from dreamdrive.prior.appearance import appearance
from dreamdrive.progress import Work
from dreamdrive.run import codec
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry

QUALITY = 90
"""Of the JPEG pictures."""
STEPS = 64
"""Of depth in each doubling."""
_NEAREST = 2.0**-8
_LEVELS = {"confidence": 15.0, "moving": 255.0, "spread": 32.0}
"""Steps that the largest, 1, is divided into; of spread each 1."""
_WHOLE = ("sky", "road_users")


def name_of(size: tuple[int, int]) -> str:
    """E.g. 480x270."""
    return f"{size[0]}x{size[1]}"


class _FoundError(Exception):
    """The geometry is there, and nothing after it is wanted."""


def found(clip: Clip) -> Geometry:
    """The geometry of a clip, as a run finds it."""
    made: list[Any] = []

    def run(name: str, options: object, compute: Any, *, check: Any = None, given: Any = None) -> Any:
        if name == "initialise":
            raise _FoundError
        made.append(compute(Work()))
        return made[-1]

    try:
        build_scene(clip, QUALITIES["draft"], run=run)
    except _FoundError:
        return made[-1]
    raise AssertionError("a scene without seeds")


def save_pack(folder: Path, clips: list[tuple[Clip, Geometry]]) -> None:
    """Write clips of the same frames at different sizes."""
    largest = max((clip for clip, _ in clips), key=lambda clip: clip.size)
    folder.mkdir(parents=True, exist_ok=True)
    for index, frame in enumerate(largest.frames):
        file = str(folder / f"{index:03d}.jpg")
        cv2.imwrite(file, cv2.cvtColor(frame, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    for clip, geometry in clips:
        arrays = {"depth_m": _depth_coded(geometry.depth_m), "valid": np.packbits(clip.valid)}
        arrays["fixed_regions"] = geometry.fixed_regions.astype(np.uint8)
        for name, steps in _LEVELS.items():
            if (values := getattr(geometry, name)) is not None:
                arrays[name] = np.minimum(np.round(steps * values), 255).astype(np.uint8)
        for name in _WHOLE:
            if (values := getattr(geometry, name)) is not None:
                arrays[name] = values.astype(np.uint16)
        packed = lzma.compress(save({name: np.ascontiguousarray(v) for name, v in arrays.items()}), preset=9)
        own = folder / name_of(clip.size)
        codec.write(own, (_without(clip), _bare(geometry)), {})
        (own / "arrays.xz").write_bytes(packed)


def load_pack(folder: Path, size: tuple[int, int]) -> tuple[Clip, Geometry]:
    """The clip and its geometry at one of the sizes."""
    own = folder / name_of(size)
    bare_clip, bare = codec.read(own, tuple)
    arrays = load(lzma.decompress((own / "arrays.xz").read_bytes()))
    files = sorted(folder.glob("*.jpg"))
    frames = np.stack([_at(cv2.cvtColor(cv2.imread(str(f)), cv2.COLOR_BGR2RGB), size) for f in files])
    shape = frames.shape[:3]
    valid = np.unpackbits(arrays["valid"], count=int(np.prod(shape))).reshape(shape).astype(bool)
    features = {"appearance": appearance(frames, valid)}
    clip = replace(bare_clip, frames=frames, valid=valid, features=features)
    values: dict[str, Any] = {"depth_m": _depth_decoded(arrays["depth_m"], shape)}
    values["fixed_regions"] = arrays["fixed_regions"].astype(bare.fixed_regions.dtype)
    for name, steps in _LEVELS.items():
        if name in arrays:
            values[name] = (arrays[name] / steps).astype(np.float32)
    for name in _WHOLE:
        if name in arrays:
            values[name] = arrays[name].astype(getattr(bare, name).dtype)
    return clip, replace(bare, **values)


def _at(frame: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    same = (frame.shape[1], frame.shape[0]) == size
    return frame if same else cv2.resize(frame, size, interpolation=cv2.INTER_AREA)


def _without(clip: Clip) -> Clip:
    """All but the pictures."""
    return replace(clip, frames=clip.frames[:, :1, :1], valid=clip.valid[:, :1, :1], features={})


def _bare(geometry: Geometry) -> Geometry:
    """All but the arrays of whole frames."""
    names = ("depth_m", "fixed_regions", *_LEVELS, *_WHOLE)
    values = {name: getattr(geometry, name) for name in names}
    cut = {name: None if v is None else v[:, :1, :1].copy() for name, v in values.items()}
    return replace(geometry, **cut, stereo_ratio=None, stereo_confidence=None)


def _depth_coded(depth_m: np.ndarray) -> np.ndarray:
    """Logarithms in whole steps, 0 for none, less those at the left; low bytes, then high ones."""
    steps = np.round(STEPS * np.log2(np.maximum(depth_m, _NEAREST) / _NEAREST)) + 1
    whole = np.where(depth_m > 0, steps, 0).astype(np.int16)
    less = np.diff(whole, axis=2, prepend=np.int16(0)).view(np.uint16)
    return np.stack([less & 255, less >> 8]).astype(np.uint8)


def _depth_decoded(coded: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    low, high = coded.astype(np.uint16)
    whole = np.cumsum((low | (high << 8)).view(np.int16), axis=2, dtype=np.int64).reshape(shape)
    return np.where(whole > 0, _NEAREST * 2.0 ** ((whole - 1) / STEPS), 0).astype(np.float32)
