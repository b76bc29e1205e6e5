"""A photo becomes a clip, or a sentence."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from dreamdrive.data.photo import read_photo
from dreamdrive.errors import InputError
from dreamdrive.prior import Seeing
from dreamdrive.prior.photo import PHOTO
from dreamdrive.scene.control import Command, Control
from dreamdrive.scene.geometry import Scale
from streetworld import make_street

HIGH = Seeing(camera_height_m=1.5)


@pytest.fixture(scope="module")
def photo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("photo") / "street.png"
    frame = make_street(3, 1, 10.0, (480, 270)).frames[0]
    cv2.imwrite(str(path), frame[..., ::-1])
    return path


def test_a_photo_is_driven_into(photo: Path) -> None:
    clip = PHOTO(Control(path=photo, frames="0:9:4", size=(160, 90)), seeing=HIGH)
    assert clip.frames.shape == (3, 90, 160, 3)
    assert clip.source_index.tolist() == [0, 4, 8]
    np.testing.assert_allclose(clip.times_s, [0, 0.4, 0.8])
    known = clip.known
    assert known.generated
    assert known.intrinsics
    assert known.world_from_camera is not None
    assert known.depth_m is not None
    assert known.sky is not None
    np.testing.assert_allclose(known.world_from_camera[0], np.eye(4), atol=1e-12)
    assert known.world_from_camera[-1, 2, 3] > 0.1
    read = read_photo(photo, (160, 90)).rgb
    assert np.abs(clip.frames[0].astype(int) - read).mean() < 6
    assert (known.depth_m > 0).mean() > 0.5
    assert any("made up" in note for note in clip.provenance["notes"])


@pytest.mark.parametrize(
    ("control", "message"),
    [
        (Control(), "needs an input"),
        (Control(frames="-3:"), "count from the photo"),
        (Control(frames="0:1"), "two or more"),
        (Control(size=(63, 48)), "even width"),
        (Control(frames="5000:5002"), "two or more"),
    ],
)
def test_what_cannot_be_done_is_said(photo: Path, control: Control, message: str) -> None:
    given = control if message == "needs an input" else replace(control, path=photo)
    with pytest.raises(InputError, match=message):
        PHOTO(given)


def test_it_cannot_do_without_the_street_network(photo: Path) -> None:
    with pytest.raises(InputError, match="street network"):
        PHOTO(Control(path=photo), seeing=Seeing(knowledge="none"))


def test_a_picture_of_nothing_is_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "sky.png"
    cv2.imwrite(str(path), np.full((270, 480, 3), (235, 180, 120), np.uint8))
    with pytest.raises(InputError, match="of one colour"):
        PHOTO(Control(path=path, frames="0:2"))
    clear = np.linspace(150, 235, 270)[:, None, None] * np.array([1.0, 0.8, 0.55])
    cv2.imwrite(str(path), np.broadcast_to(clear, (270, 480, 3)).astype(np.uint8))
    with pytest.raises(InputError, match="nothing solid"):
        PHOTO(Control(path=path, frames="0:2"))


def test_what_is_set_in_motion_is_told_and_what_stands_is_not(photo: Path) -> None:
    control = Control(path=photo, frames="0:7:3", size=(160, 90))
    clip = PHOTO(control, seeing=HIGH)
    assert clip.set_in_motion is not None
    assert clip.set_in_motion[0].any()
    assert any("set in motion" in note for note in clip.provenance["notes"])
    still = PHOTO(replace(control, traffic="still"), seeing=HIGH)
    assert still.set_in_motion is not None
    assert not still.set_in_motion.any()
    assert not any("set in motion" in note for note in still.provenance["notes"])
    assert (clip.provenance["set_in_motion"] > 0, still.provenance["set_in_motion"]) == (True, 0)


def test_metres_are_told_to_be_as_sure_as_the_photo_shows_them(photo: Path) -> None:
    control = Control(path=photo, frames="0:2", size=(160, 90))
    seen = PHOTO(control).known
    assert seen.scale is not None
    assert seen.scale.basis in ("seen sizes", "usual height")
    assert seen.scale.spread > 0.15
    assert seen.focal_guessed
    told = PHOTO(replace(control, hfov_deg=60), seeing=HIGH).known
    assert told.scale == Scale("camera height 1.50 m (given)", 0.0, basis="height")
    assert not told.focal_guessed


def test_two_drives_begin_at_the_photo_and_are_drawn_in_one_world(photo: Path) -> None:
    control = Control(path=photo, frames="0:9:4", size=(160, 90))
    clip = PHOTO(replace(control, actions=(Command("forward"), Command("left"))), seeing=HIGH)
    assert clip.camera.tolist() == [0, 1] * 3
    np.testing.assert_array_equal(clip.frames[0], clip.frames[1])
    poses = clip.known.world_from_camera
    assert poses is not None
    np.testing.assert_allclose(poses[:2], np.tile(np.eye(4), (2, 1, 1)), atol=1e-12)
    alone = PHOTO(replace(control, action=Command("left")), seeing=HIGH)
    np.testing.assert_array_equal(clip.frames[1::2], alone.frames)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"traffic_speed_m_s": 0.0}, "--traffic-speed 0: expected metres a second"),
        ({"traffic_speed_m_s": 99.0}, "--traffic-speed 99"),
        ({"traffic": "still", "traffic_speed_m_s": 5.0}, "exclude each other"),
    ],
)
def test_a_speed_that_cannot_be_is_a_sentence(photo: Path, given: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        PHOTO(Control(path=photo, **given))


def test_the_network_fills_where_it_is_asked_to_and_gives_its_features(photo: Path, tmp_path: Path) -> None:
    control = Control(path=photo, frames="0:9:4", size=(160, 90))
    clip, plain = PHOTO(replace(control, fill="network"), seeing=HIGH), PHOTO(control, seeing=HIGH)
    assert clip.features["photo:last"].shape == (3, 45, 80, 16)
    assert "photo:last" not in plain.features
    off = np.abs(clip.frames.astype(int) - plain.frames).max(-1)
    assert (off[0] > 0).mean() < 0.01  # where the own car was
    assert 0.003 < (off[-1] > 0).mean() < 0.6
    with pytest.raises(InputError, match=r"--fill none\.safetensors: there is no such file"):
        PHOTO(replace(control, fill="none.safetensors"))
    wrong = tmp_path / "wrong.safetensors"
    wrong.write_bytes(b"nothing")
    with pytest.raises(InputError, match=r"wrong\.safetensors"):
        PHOTO(replace(control, fill=str(wrong)))
