"""Photos to start from."""

import json

import cv2
import numpy as np
import pytest

from dreamdrive.data.photo import leading_frames, read_photo
from dreamdrive.data.pictures.video_writer import write_video
from dreamdrive.errors import InputError
from tests.data.textures import texture


def test_a_photo_is_cut_to_the_size_and_its_camera_with_it(tmp_path):
    path = tmp_path / "photo.png"
    cv2.imwrite(str(path), texture(60, 128, 0))
    photo = read_photo(path, (64, 32), hfov_deg=90.0)
    assert photo.rgb.shape == (32, 64, 3)
    assert photo.camera.fx_px == pytest.approx(34)
    assert photo.camera.cx_px == pytest.approx(32, abs=0.5)
    assert not photo.calibrated
    assert any("6 % of the photo was cut away" in note for note in photo.notes)


def test_a_recording_gives_its_first_frame(tmp_path):
    for index in range(2):
        cv2.imwrite(str(tmp_path / f"{index}.png"), texture(32, 64, index))
    photo = read_photo(tmp_path, (64, 32))
    np.testing.assert_array_equal(photo.rgb[..., ::-1], texture(32, 64, 0))
    assert any("first frame of" in note for note in photo.notes)


@pytest.mark.parametrize(
    ("rate_hz", "shown", "off"),
    [(20.0, [0, 40, 80], None), (15.0, [0, 20, 60], "33%"), (24.0, [0, 40, 100], "17%"), (5.0, [0], None)],
)
def test_leading_frames_are_those_nearest_to_the_models_times(tmp_path, rate_hz, shown, off):
    """At 15 Hz the frame for 0.1 s is at 0.067 s, and at 5 Hz there is none for it."""
    frames = np.broadcast_to(20 * np.arange(12, dtype=np.uint8)[:, None, None, None], (12, 64, 64, 3)).copy()
    write_video(tmp_path / "drive.mp4", list(frames), rate_hz)
    found, notes = leading_frames(tmp_path / "drive.mp4", 3, 10.0)
    np.testing.assert_allclose([frame.rgb.mean() for frame in found], shown, atol=3)
    assert ("Only 1 of 3 leading frames at 10 Hz" in " ".join(notes)) == (len(shown) == 1)
    assert (f"{off} of a step off the model's 10 Hz" in " ".join(notes)) == (off is not None)


def test_one_source_of_the_focal_length_is_enough(tmp_path):
    cv2.imwrite(str(tmp_path / "photo.png"), texture(32, 64, 0))
    with pytest.raises(InputError, match="--intrinsics and --hfov both tell the focal length"):
        read_photo(tmp_path / "photo.png", (64, 32), tmp_path / "k.json", 60.0)


def test_a_known_lens_is_taken_out(tmp_path):
    path = tmp_path / "photo.png"
    cv2.imwrite(str(path), texture(32, 64, 0))
    values = {"width": 64, "height": 32, "intrinsics": {"fx": 40, "fy": 40, "cx": 31.5, "cy": 15.5}}
    (tmp_path / "plain.json").write_text(json.dumps(values))
    bent = values | {"distortion": {"model": "opencv", "coefficients": [-0.2, 0, 0, 0]}}
    (tmp_path / "bent.json").write_text(json.dumps(bent))
    plain = read_photo(path, (64, 32), tmp_path / "plain.json")
    assert plain.calibrated
    assert plain.camera.cx_px == 32
    assert (read_photo(path, (64, 32), tmp_path / "bent.json").rgb != plain.rgb).any()


def test_a_small_photo_is_said_to_be_enlarged(tmp_path):
    cv2.imwrite(str(tmp_path / "photo.png"), texture(16, 32, 0))
    assert any("enlarged 2.00 times" in n for n in read_photo(tmp_path / "photo.png", (64, 32)).notes)
