"""Recordings of several cameras on one car."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.data.rig import RIG, is_rig, read_rig, read_rig_clip
from dreamdrive.errors import InputError
from streetworld.files import write_world
from tests.data.textures import approach
from tests.rigs import drives, rig_clip, true_poses


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rig") / "world"
    write_world(drives(), path)
    return path


def test_a_surround_world_is_read_in_the_order_of_time(world: Path) -> None:
    assert is_rig(world)
    clip, expected = read_rig_clip(world, fps=10.0, size=(96, 64), hold_out=4), rig_clip()
    for name in ("frames", "camera", "held_out", "source_index", "valid"):
        np.testing.assert_array_equal(getattr(clip, name), getattr(expected, name))
    np.testing.assert_allclose(clip.times_s, expected.times_s)
    for camera, wanted in zip(clip.rig, expected.rig, strict=True):
        np.testing.assert_allclose(camera.world_from_camera, wanted.world_from_camera, atol=1e-12)
        np.testing.assert_allclose(camera.matrix, wanted.matrix)
    assert clip.known.intrinsics


def test_poses_of_the_first_place_all(world: Path) -> None:
    clip = read_rig_clip(world, fps=10.0, size=(96, 64), poses=world / "front" / "poses.json")
    assert clip.known.world_from_camera is not None
    np.testing.assert_allclose(
        clip.known.world_from_camera[clip.of_camera(1)], true_poses("front_left"), atol=1e-6
    )


def test_cuts_are_those_of_each_camera(tmp_path: Path) -> None:
    first, second = approach(0), approach(1)
    for name, frames in {"a": first, "b": np.concatenate([first[:3], second[:3]])}.items():
        (tmp_path / name).mkdir()
        for index, frame in enumerate(frames):
            assert cv2.imwrite(str(tmp_path / name / f"{index}.png"), frame)
    pose = np.eye(4).tolist()
    listed = [{"frames": name, "intrinsics": None, "car_from_camera": pose} for name in ("a", "b")]
    (tmp_path / RIG).write_text(json.dumps({"cameras": listed}))
    clip = read_rig_clip(tmp_path)
    assert clip.cuts == (7,)
    assert (clip.camera[7], clip.step[7]) == (1, 3)
    assert (clip.only(0).cuts, clip.only(1).cuts) == ((), (3,))
    assert (
        "The picture cuts to another scene at frame 3 of the source; --frames 0:3:1 or 3:6:1 keeps to one."
        in clip.provenance["notes"]
    )


def test_cameras_that_disagree_are_refused(world: Path, tmp_path: Path) -> None:
    rig = json.loads((world / RIG).read_text())
    short = tmp_path / "short"
    short.mkdir()
    for name in ("0000.png", "0001.png"):
        (short / name).write_bytes((world / "front" / "frames" / name).read_bytes())
    cameras = [{**each, "frames": str(world / each["frames"]), "intrinsics": None} for each in rig["cameras"]]
    cameras[1]["frames"] = "short"
    (tmp_path / RIG).write_text(json.dumps({"cameras": cameras}))
    with pytest.raises(InputError, match=r"short gives 2 frames of 96x64, .*front/frames gives 6 frames"):
        read_rig_clip(tmp_path, fps=10.0)


GOOD: dict[str, Any] = {"frames": "a", "intrinsics": "a.json", "car_from_camera": np.eye(4).tolist()}


@pytest.mark.parametrize(
    ("cameras", "message"),
    [
        ([], r"length >= 1 - at `\$.cameras`; expected {"),
        (3, r"`array`, got `int` - at `\$.cameras`; expected {"),
        ([GOOD, 4], "`object`, got `int`"),
        ([{**GOOD, "frames": 3}], r"got `int` - at `\$.cameras\[0\].frames`; expected {"),
        ([GOOD, {**GOOD, "frames": ""}], "camera 1 names '', which is no file name; expected {"),
        ([{**GOOD, "intrinsics": "a" * 300}], "camera 0 names 'aaaa.*', which is no file name"),
        ([{**GOOD, "car_from_camera": [[1, 0], [0, 1]]}], r"`\$.cameras\[0\].car_from_camera`"),
        ([{**GOOD, "car_from_camera": (2 * np.eye(4)).tolist()}], "camera 0 has no rigid pose: car_from"),
        ([{"frames": "a"}], "missing required field `car_from_camera`"),
    ],
)
def test_a_malformed_rig_is_refused_by_what_is_wrong(tmp_path: Path, cameras: Any, message: str) -> None:
    (tmp_path / RIG).write_text(json.dumps({"cameras": cameras}))
    with pytest.raises(InputError, match=message):
        read_rig(tmp_path)


json_values = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=12,
)


@given(json_values, st.sampled_from(["cameras", "frames", "intrinsics", "car_from_camera"]))
def test_rubbish_is_refused(tmp_path_factory: pytest.TempPathFactory, value: Any, place: str) -> None:
    path = tmp_path_factory.mktemp("rubbish")
    document = {"cameras": value} if place == "cameras" else {"cameras": [{**GOOD, place: value}]}
    (path / RIG).write_text(json.dumps(document))
    try:
        cameras = read_rig(path)
    except InputError:
        return
    assert all(camera.car_from_camera.shape == (4, 4) for camera in cameras)
