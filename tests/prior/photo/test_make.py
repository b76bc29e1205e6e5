"""A photo becomes a clip, or a sentence."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.data.photo import read_photo
from dreamdrive.errors import InputError
from dreamdrive.prior import prior_of
from dreamdrive.prior.photo import PHOTO
from dreamdrive.scene.control import Control
from dreamdrive.world import make_street


@pytest.fixture(scope="module")
def photo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("photo") / "street.png"
    frame = make_street(3, 1, 10.0, (480, 270)).frames[0]
    cv2.imwrite(str(path), frame[..., ::-1])
    return path


def test_a_photo_is_driven_into(photo: Path) -> None:
    clip = PHOTO(Control(path=photo, frames="0:9:4", size=(160, 90), camera_height_m=1.5))
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


def test_a_photo_needs_no_name_of_a_prior(photo: Path) -> None:
    assert prior_of(photo) == "photo"
    with pytest.raises(InputError, match="--prior NAME"):
        prior_of(photo, with_weights=True)


@pytest.mark.parametrize(
    ("control", "message"),
    [
        (Control(), "needs an input"),
        (Control(frames="-3:"), "count from the photo"),
        (Control(frames="0:1"), "two or more"),
        (Control(size=(63, 48)), "even numbers"),
        (Control(knowledge="none"), "street network"),
        (Control(frames="5000:5002"), "two or more"),
    ],
)
def test_what_cannot_be_done_is_said(photo: Path, control: Control, message: str) -> None:
    given = control if message == "needs an input" else replace(control, path=photo)
    with pytest.raises(InputError, match=message):
        PHOTO(given)


def test_a_picture_of_nothing_is_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "sky.png"
    cv2.imwrite(str(path), np.full((270, 480, 3), (235, 180, 120), np.uint8))
    with pytest.raises(InputError, match="of one colour"):
        PHOTO(Control(path=path, frames="0:2"))
    clear = np.linspace(150, 235, 270)[:, None, None] * np.array([1.0, 0.8, 0.55])
    cv2.imwrite(str(path), np.broadcast_to(clear, (270, 480, 3)).astype(np.uint8))
    with pytest.raises(InputError, match="nothing solid"):
        PHOTO(Control(path=path, frames="0:2"))
