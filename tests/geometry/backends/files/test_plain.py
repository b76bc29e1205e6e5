"""Geometry given as files: what is read, and what is said about bad ones."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dreamdrive.errors import InputError
from dreamdrive.geometry import GeometryOptions, reconstruct
from dreamdrive.geometry.backends.files import attach
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip


def make_clip(count: int = 3, width: int = 40, height: int = 24) -> Clip:
    rng = np.random.default_rng(0)
    return Clip(
        frames=rng.integers(0, 255, (count, height, width, 3)).astype(np.uint8),
        times_s=0.1 * np.arange(count),
        camera=np.zeros(count, int),
        rig=(Camera(30.0, 30.0, width / 2, height / 2, width, height),),
        valid=np.ones((count, height, width), bool),
        held_out=np.zeros(count, bool),
        source_index=10 + 2 * np.arange(count),
    )


def record(count: int = 20) -> dict:
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, 2, 3] = np.arange(count)
    return {
        "width": 80,
        "height": 48,
        "intrinsics": {"fx": 60.0, "fy": 62.0, "cx": 39.5, "cy": 23.5},
        "world_from_camera": poses.tolist(),
    }


def write(folder: Path, content: object) -> Path:
    (folder / "cameras.json").write_text(json.dumps(content))
    return folder


def test_cameras_are_selected_scaled_and_moved_to_the_first_frame(tmp_path):
    clip = attach(make_clip(), write(tmp_path, record()))
    assert clip.known.intrinsics
    assert clip.known.depth_m is None
    camera = clip.rig[0]
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (30.0, 31.0, 20.0, 12.0)
    poses = clip.known.world_from_camera
    assert poses is not None
    np.testing.assert_allclose(poses[:, 2, 3], [0, 2, 4])


def test_a_guessed_focal_length_is_said_to_be_replaced(tmp_path):
    write(tmp_path, record())
    (said,) = attach(make_clip(), tmp_path).provenance["notes"]
    assert said == "The focal length is that of cameras.json, not the one that was taken before."
    clip = make_clip()
    known = replace(clip, known=replace(clip.known, intrinsics=True))
    assert attach(known, tmp_path).provenance["notes"] == []


def test_frames_may_be_named(tmp_path):
    content = record(3)
    content["frames"] = [14, 12, 10]
    poses = attach(make_clip(), write(tmp_path, content)).known.world_from_camera
    assert poses is not None
    np.testing.assert_allclose(poses[:, 2, 3], [0, -1, -2])


def test_depth_comes_from_both_formats_and_may_be_missing(tmp_path):
    write(tmp_path, record())
    folder = tmp_path / "depth"
    folder.mkdir()
    depth = np.linspace(2, 50, 48 * 80, dtype=np.float32).reshape(48, 80)
    np.savez(folder / "0010.npz", depth_m=depth)
    cv2.imwrite(str(folder / "0012.png"), np.round(depth * 1000).astype(np.uint16))
    found = attach(make_clip(), tmp_path).known.depth_m
    assert found is not None
    np.testing.assert_allclose(found[0], found[1], atol=1e-3)
    assert np.isin(found[0], depth).all()
    assert not found[2].any()


def broken(**changes: object) -> dict:
    content = {**record(), **changes}
    return {key: value for key, value in content.items() if value is not None}


SCALED = (2 * np.tile(np.eye(4), (20, 1, 1))).tolist()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (broken(width=None), "expected an object"),
        (broken(width=480, height=270), "another aspect"),
        (broken(intrinsics={"fx": 1}), "fx, fy, cx, cy"),
        (broken(intrinsics={"fx": -1, "fy": 1, "cx": 0, "cy": 0}), "positive"),
        (broken(intrinsics={"fx": 1, "fy": 1, "cx": float("nan"), "cy": 0}), "NaN"),
        (broken(world_from_camera=SCALED), "rotation"),
        (
            broken(world_from_camera=record(12)["world_from_camera"]),
            "no pose for the selected frames [12, 14]",
        ),
        (broken(world_from_camera=np.eye(4).tolist()), "world_from_camera"),
        (broken(world_from_camera=[[1, 2], [3]]), "world_from_camera|cameras.json"),
        (broken(frames=[1, 2]), "2 frames for"),
        (broken(frames="all"), "cameras.json"),
        (broken(frames=[float("inf")] * 20), "cameras.json"),
        (broken(width=float("inf")), "cameras.json"),
        ([1, 2], "expected a JSON object"),
    ],
)
def test_bad_cameras_are_refused_with_a_reason(tmp_path, content, words):
    with pytest.raises(InputError) as caught:
        attach(make_clip(), write(tmp_path, content))
    assert any(word in str(caught.value) for word in words.split("|"))
    assert "cameras.json" in str(caught.value)


@settings(max_examples=60)
@given(
    key=st.sampled_from(["width", "height", "intrinsics", "world_from_camera", "frames"]),
    value=st.recursive(
        st.none() | st.booleans() | st.integers(-3, 3) | st.floats() | st.text(max_size=3),
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=2), inner, max_size=2),
        max_leaves=6,
    ),
)
def test_any_damage_is_an_input_error_or_no_damage(tmp_path_factory, key, value):
    folder = write(tmp_path_factory.mktemp("files"), {**record(), key: value})
    try:
        clip = attach(make_clip(), folder)
    except InputError:
        return
    assert clip.known.world_from_camera is not None
    assert np.isfinite(clip.known.world_from_camera).all()


def test_missing_or_unreadable_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        attach(make_clip(), tmp_path)
    (tmp_path / "cameras.json").write_bytes(b"\xff\xfe{")
    with pytest.raises(InputError, match="not JSON"):
        attach(make_clip(), tmp_path)


@pytest.mark.parametrize("kind", ["text", "object", "nan", "aspect", "eight bits", "missing array"])
def test_bad_depth_is_refused(tmp_path, kind):
    write(tmp_path, record())
    folder = tmp_path / "depth"
    folder.mkdir()
    depth = np.ones((48, 80), np.float32)
    if kind == "text":
        (folder / "0010.npz").write_text("no archive")
    elif kind == "object":
        np.savez(folder / "0010.npz", depth_m=np.array([{}], dtype=object))
    elif kind == "nan":
        np.savez(folder / "0010.npz", depth_m=depth * np.nan)
    elif kind == "aspect":
        np.savez(folder / "0010.npz", depth_m=depth[:, :40])
    elif kind == "eight bits":
        cv2.imwrite(str(folder / "0010.png"), np.ones((48, 80), np.uint8))
    else:
        np.savez(folder / "0010.npz", other=depth)
    with pytest.raises(InputError, match="0010"):
        attach(make_clip(), tmp_path)


def test_an_unknown_method_is_named_with_the_known_ones():
    with pytest.raises(InputError, match="classical"):
        reconstruct(make_clip(), GeometryOptions(method="magic"))
