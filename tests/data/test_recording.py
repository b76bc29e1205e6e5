"""Clips written for replay."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.data.recording import write_recording
from dreamdrive.errors import InputError
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.replay import REPLAY
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.control import Control
from tests.data.textures import texture
from tests.prior.paths import circle
from tests.rigs import rig_clip


@pytest.fixture(scope="module")
def clip() -> Clip:
    frames = np.stack([texture(48, 64, index)[..., ::-1] for index in range(3)])
    valid = np.ones(frames.shape[:3], bool)
    return Clip(
        frames=frames,
        times_s=np.arange(3) / 5,
        camera=np.zeros(3, np.int64),
        rig=(Camera(50.0, 51.0, 31.0, 25.5, 64, 48),),
        valid=valid,
        held_out=np.zeros(3, bool),
        source_index=np.arange(3),
        features={"appearance": appearance(frames, valid), "other": np.ones((3, 2, 2, 1), np.float32)},
        known=Known(circle(7.0, seconds=0.4, rate_hz=5).world_from_camera, intrinsics=True),
        requested=circle(8.0, 0.01, seconds=0.4, rate_hz=5),
        provenance={"notes": ["made up"]},
    )


def test_replay_takes_up_what_was_written(clip: Clip, tmp_path: Path) -> None:
    write_recording(clip, tmp_path / "made", {"prior": "street-world"})
    made = tmp_path / "made"
    names = {path.name for path in made.glob("[!.]*")}
    assert names == {
        *("frames", "video.mp4", "intrinsics.json", "poses.json", "requested.json"),
        *("features.safetensors", "provenance.json"),
    }
    again = REPLAY(
        Control(
            made,
            fps=1 / clip.interval_s,
            intrinsics=made / "intrinsics.json",
            poses=made / "poses.json",
            trajectory=made / "requested.json",
            features=made / "features.safetensors",
        )
    )
    np.testing.assert_array_equal(again.frames, clip.frames)
    assert again.features.keys() == clip.features.keys()
    for name, array in clip.features.items():
        np.testing.assert_array_equal(again.features[name], array)
    np.testing.assert_allclose(again.times_s, clip.times_s)
    np.testing.assert_allclose(again.rig[0].matrix, clip.rig[0].matrix)
    assert again.known.intrinsics
    np.testing.assert_allclose(again.known.world_from_camera, clip.known.world_from_camera, atol=1e-9)
    assert again.requested is not None
    assert clip.requested is not None
    np.testing.assert_allclose(again.requested.world_from_camera, clip.requested.world_from_camera, atol=1e-9)
    about = json.loads((made / "provenance.json").read_text())
    assert again.provenance["features"] == about
    assert about["provenance"] == clip.provenance
    assert (about["fps"], about["frames"], about["size"]) == (5.0, 3, [64, 48])


def test_what_holds_no_picture_stays_so(clip: Clip, tmp_path: Path) -> None:
    valid = clip.valid.copy()
    valid[1, :10, :20] = False
    frames = clip.frames.copy()
    frames[~valid] = 0
    write_recording(replace(clip, frames=frames, valid=valid), tmp_path / "made", {})
    again = REPLAY(Control(tmp_path / "made", fps=5.0))
    np.testing.assert_array_equal(again.valid, valid)
    np.testing.assert_array_equal(again.frames, frames)


def test_only_what_is_known_is_written(clip: Clip, tmp_path: Path) -> None:
    known = replace(clip.known, intrinsics=False, metric=False)
    write_recording(replace(clip, known=known, requested=None, features={}), tmp_path / "made", {})
    names = {path.name for path in (tmp_path / "made").glob("[!.]*")}
    assert names == {"frames", "video.mp4", "provenance.json"}


def test_other_folders_are_left_alone(clip: Clip, tmp_path: Path) -> None:
    write_recording(clip, tmp_path / "made", {})
    with pytest.raises(InputError, match="exists already"):
        write_recording(clip, tmp_path / "made", {})
    write_recording(clip, tmp_path / "made", {"again": True}, replace=True)
    assert json.loads((tmp_path / "made/provenance.json").read_text())["again"]
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/work.txt").touch()
    with pytest.raises(InputError, match="holds other files"):
        write_recording(clip, tmp_path / "mine", {}, replace=True)


def test_several_cameras_are_taken_up_as_a_rig(tmp_path: Path) -> None:
    clip, made = rig_clip(poses=True), tmp_path / "made"
    write_recording(clip, made, {})
    assert {path.name for path in made.glob("[!.]*")} == {
        *("camera0", "camera1", "rig.json", "poses.json", "video.mp4", "provenance.json"),
    }
    size = clip.size
    again = REPLAY(Control(made, fps=1 / clip.interval_s, size=size, poses=made / "poses.json"))
    np.testing.assert_array_equal(again.frames, clip.frames)
    np.testing.assert_array_equal(again.camera, clip.camera)
    assert again.known.world_from_camera is not None
    assert clip.known.world_from_camera is not None
    np.testing.assert_allclose(again.known.world_from_camera, clip.known.world_from_camera, atol=1e-6)
    with pytest.raises(InputError, match=r"several cameras with rig.json.* takes no --features"):
        REPLAY(Control(made, features=tmp_path))
