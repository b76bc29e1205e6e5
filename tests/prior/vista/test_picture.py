"""Photos become first frames."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from dreamdrive.data.pictures.video_writer import write_video
from dreamdrive.errors import InputError
from dreamdrive.prior.vista.picture import check_size, frame, read_leading, to_frames, to_images
from dreamdrive.scene.camera import Camera
from tests.prior.vista.photos import picture, save_photo


def test_nuscenes_is_scaled_and_not_cut() -> None:
    framing = frame((1600, 900), (1024, 576), "photo")
    assert (framing.corner, framing.part) == ((0, 0), (1600, 900))
    camera = framing.camera(Camera(1266, 1266, 816, 491, 1600, 900))
    assert camera.fx_px == pytest.approx(1266 * 0.64)
    assert (camera.cx_px, camera.cy_px) == (pytest.approx(816 * 0.64), pytest.approx(491 * 0.64))
    assert (camera.width_px, camera.height_px) == (1024, 576)


@pytest.mark.parametrize(
    ("source", "corner", "part"), [((200, 90), (20, 0), (160, 90)), ((160, 121), (0, 15), (160, 90))]
)
def test_the_middle_is_kept_and_the_axis_with_it(
    source: tuple[int, int], corner: tuple[int, int], part: tuple[int, int]
) -> None:
    framing = frame(source, (128, 72), "photo")
    assert (framing.corner, framing.part) == (corner, part)
    own = Camera(100, 100, source[0] / 2, source[1] / 2, *source)
    camera = framing.camera(own)
    assert camera.cx_px == pytest.approx(64)
    assert camera.cy_px == pytest.approx(36, abs=0.5)
    shown = framing.apply(np.asarray(picture(*source)))
    middle = np.asarray(picture(*source))[source[1] // 2, source[0] // 2]
    np.testing.assert_allclose(shown[36, 64], middle, atol=4)


def test_scaling_is_lanczos(tmp_path: Path) -> None:
    draw = np.random.default_rng(0).integers(0, 256, (144, 256, 3), dtype=np.uint8)
    Image.fromarray(draw).save(tmp_path / "photo.png")
    leading = read_leading(tmp_path / "photo.png", 1, 10, (128, 64))
    part = Image.fromarray(draw).crop((0, 8, 256, 136))
    np.testing.assert_array_equal(leading.frames[0], part.resize((128, 64), Image.Resampling.LANCZOS))
    assert any("middle 256x128" in note for note in leading.notes)


def test_exif_grey_and_cmyk(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6  # to be turned clockwise
    turned = tmp_path / "turned.jpg"
    picture(128, 64).rotate(90, expand=True).save(turned, exif=exif, quality=98)
    expected = read_leading(save_photo(tmp_path / "plain.png", 128, 64), 1, 10, (128, 64)).frames[0]
    np.testing.assert_allclose(read_leading(turned, 1, 10, (128, 64)).frames[0], expected, atol=12)
    grey = read_leading(save_photo(tmp_path / "grey.png", 128, 64, "L"), 1, 10, (128, 64))
    assert (grey.frames[..., 0] == grey.frames[..., 2]).all()
    assert any("grey" in note for note in grey.notes)
    cmyk = read_leading(save_photo(tmp_path / "cmyk.jpg", 128, 64, "CMYK", quality=98), 1, 10, (128, 64))
    np.testing.assert_allclose(cmyk.frames[0].astype(int), expected.astype(int), atol=12)


def test_intrinsics_follow(tmp_path: Path) -> None:
    calibration = tmp_path / "camera.json"
    pinhole = {"fx": 100.0, "fy": 110.0, "cx": 79.5, "cy": 44.5}
    calibration.write_text(json.dumps({"width": 160, "height": 90, "intrinsics": pinhole}))
    photo = save_photo(tmp_path / "photo.png")
    camera = read_leading(photo, 1, 10, (64, 64), calibration).calibration
    assert camera.known
    assert camera.camera.fx_px == pytest.approx(100 * 64 / 90)
    assert camera.camera.cx_px == pytest.approx(32)
    wide = read_leading(photo, 1, 10, (64, 64), None, 90.0).calibration
    assert not wide.known
    assert wide.camera.fx_px == pytest.approx(80 * 64 / 90)
    with pytest.raises(InputError, match="give one of them"):
        read_leading(photo, 1, 10, (64, 64), calibration, 90.0)
    lens = {
        "width": 160,
        "height": 90,
        "intrinsics": pinhole,
        "distortion": {"model": "opencv", "coefficients": [-0.2, 0, 0, 0]},
    }
    calibration.write_text(json.dumps(lens))
    straight = read_leading(photo, 1, 10, (64, 64), calibration)
    assert any("lens was taken out" in note for note in straight.notes)
    assert (straight.frames != read_leading(photo, 1, 10, (64, 64)).frames).any()


def test_leading_frames_of_folders_and_videos(tmp_path: Path) -> None:
    folder = tmp_path / "frames"
    folder.mkdir()
    for i in range(5):
        Image.new("RGB", (64, 64), (40 * i, 0, 0)).save(folder / f"{i}.png")
    leading = read_leading(folder, 3, 10, (64, 64))
    assert [int(each.mean()) for each in leading.frames[..., 0]] == [0, 40, 80]
    shown = np.repeat(np.arange(12, dtype=np.uint8)[:, None, None, None] * 20, 64, axis=1)
    frames = np.broadcast_to(shown.reshape(12, 64, 1, 1)[:, :, :, :], (12, 64, 64, 3)).copy()
    write_video(tmp_path / "drive.mp4", list(frames), 20.0)
    video = read_leading(tmp_path / "drive.mp4", 3, 10, (64, 64))
    np.testing.assert_allclose(video.frames.mean(axis=(1, 2, 3)), [0, 40, 80], atol=3)


def test_what_cannot_be_used_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="give 1024x576, or leave it out"):
        check_size((1000, 570))
    photo = save_photo(tmp_path / "small.png", 200, 110)
    with pytest.raises(InputError, match=r"too small for 1024x576.*--size 384x192"):
        read_leading(photo, 1, 10, (1024, 576))
    with pytest.raises(InputError, match="does not exist"):
        read_leading(tmp_path / "none.jpg", 1, 10, (64, 64))
    (tmp_path / "text.jpg").write_text("no picture")
    with pytest.raises(InputError, match="cannot be read as an image"):
        read_leading(tmp_path / "text.jpg", 1, 10, (64, 64))


def test_bytes_there_and_back() -> None:
    frames = np.arange(256, dtype=np.uint8).reshape(1, 16, 16, 1).repeat(3, axis=3)
    np.testing.assert_array_equal(to_frames(to_images(frames)), frames)
    assert to_frames(3 * to_images(frames)).max() == 255
