"""What dreamdrive itself wrote: scene folders, results of stages, worlds."""

import hashlib
import json
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from dreamdrive.data.feature_file import FeatureFile, read_features, write_features
from dreamdrive.data.truth_folder import read_world
from dreamdrive.errors import InputError
from dreamdrive.run import codec
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.stored import folder as scene_folder, load_scene, save_scene
from streetworld.files import write_world
from tests.mutation.reader import Reader
from tests.scene.scenes import make_baseline, make_scene, per_frame_scene
from tests.streets import small_street, street_clip, true_geometry


@lru_cache
def _street():
    return small_street(frames=3, size=(24, 16), parked=1)


def _clip() -> Clip:
    poses = np.stack([camera.world_from_camera for camera in _street().cameras])
    clip = street_clip(_street(), hold_out=3)
    known = Known(poses, intrinsics=True, points=np.ones((2, 3)), ground=_street().ground)
    return replace(
        clip, known=known, requested=Trajectory(poses, clip.times_s), provenance={"notes": ["Drawn."]}
    )


def _mend_result(folder: Path) -> None:
    """Make the digest that of the arrays."""
    path = folder / codec.JSON_NAME
    document = json.loads(path.read_bytes())
    document["sha256"] = hashlib.sha256((folder / "result.safetensors").read_bytes()).hexdigest()
    path.write_text(json.dumps(document))


def _mend_scene(folder: Path) -> None:
    """Make all digests of a scene those of what is there."""
    path = folder / "scene" / "scene.json"
    index = json.loads(path.read_bytes())
    for name in index["parts"]:
        index["parts"][name] = hashlib.sha256((path.parent / name).read_bytes()).hexdigest()
    index["sha256"] = scene_folder._checksum(index)
    path.write_text(json.dumps(index))


def _read_clip(folder: Path) -> None:
    codec.read_header(folder)
    codec.read(folder, Clip)


def _features(folder: Path) -> None:
    array = np.random.default_rng(0).normal(size=(3, 2, 4, 2)).astype(np.float32)
    about = {"model": "none", "frame_index": [0, 1, 2]}
    write_features(folder / "f.safetensors", FeatureFile({"a": array, "b": array.astype(np.float16)}, about))


def _read_features(folder: Path) -> None:
    path = folder / "f.safetensors"
    chosen = read_features(path).of_frames(np.array([0, 2]), lambda: 3, path)
    assert all(np.isfinite(array).all() and len(array) == 2 for array in chosen.arrays.values())


def _use(scene: Scene) -> None:
    """What is read can be drawn, or is refused where it is."""
    for part in (scene.static, scene.dynamic):
        assert part.problem() is None
    with suppress(InputError):
        scene.at(float(scene.times_s[0]))


_RESULT = (InputError, codec.DamagedError)

STORED: tuple[Reader, ...] = (
    Reader(
        "scene",
        lambda folder: save_scene(make_scene(), folder / "scene"),
        lambda folder: _use(load_scene(folder / "scene")),
        mend=_mend_scene,
    ),
    Reader(
        "scene-hexplane",
        lambda folder: save_scene(make_baseline("hexplane"), folder / "scene"),
        lambda folder: _use(load_scene(folder / "scene")),
        mend=_mend_scene,
    ),
    Reader(
        "scene-vibration",
        lambda folder: save_scene(make_baseline("vibration"), folder / "scene"),
        lambda folder: _use(load_scene(folder / "scene")),
        mend=_mend_scene,
    ),
    Reader(
        "scene-per-frame",
        lambda folder: save_scene(per_frame_scene(), folder / "scene"),
        lambda folder: _use(load_scene(folder / "scene")),
        mend=_mend_scene,
    ),
    Reader(
        "result-clip",
        lambda folder: codec.write(folder, _clip(), {"stage": "prior"}),
        _read_clip,
        _RESULT,
        _mend_result,
    ),
    Reader(
        "result-geometry",
        lambda folder: codec.write(folder, true_geometry(_street()), {"stage": "geometry"}),
        lambda folder: codec.read(folder, Geometry),
        _RESULT,
        _mend_result,
    ),
    Reader(
        "world",
        lambda folder: write_world({"front": _street()}, folder / "world"),
        lambda folder: read_world(folder / "world"),
    ),
    Reader("features", _features, _read_features),
)
