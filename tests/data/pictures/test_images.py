import zlib

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.data.pictures.images import ImageFolder, natural_key, read_image
from dreamdrive.data.source import open_source
from dreamdrive.errors import InputError
from tests.data.textures import texture

EXIF = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0%c\0\0\0\0\0\0"


@given(st.lists(st.integers(0, 3000), unique=True))
def test_numbers_in_names_count_as_numbers(numbers):
    names = sorted((f"frame{n}.png" for n in numbers), key=natural_key)
    assert names == [f"frame{n}.png" for n in sorted(numbers)]


@given(st.lists(st.text(max_size=8)))
def test_any_names_can_be_ordered(names):
    assert sorted(sorted(names, key=natural_key), key=natural_key) == sorted(names, key=natural_key)


def test_a_folder_lists_its_images_only(make_folder):
    folder = make_folder(12)
    (folder / "notes.txt").write_text("x")
    (folder / "._0.png").write_text("x")
    (folder / "0.png.d").mkdir()
    assert [f.name for f in ImageFolder.open(folder).files] == [f"{i}.png" for i in range(12)]


def test_a_folder_without_images_tells_where_they_are(make_folder, tmp_path):
    with pytest.raises(InputError, match=r"holds no images .*\.jpg"):
        ImageFolder.open(make_folder([]))
    make_folder(2, name="front_camera")
    with pytest.raises(InputError, match="did you mean one of these in it: front_camera"):
        ImageFolder.open(tmp_path)


def test_a_folder_of_a_recording_gives_its_frames(make_folder, tmp_path):
    cv2.imwrite(str(tmp_path / "layout.png"), texture(10, 10))
    frames = make_folder(3, name="frames")
    source = open_source(tmp_path)
    assert source.path == frames
    assert source.count() == 3


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".jpeg", ".bmp", ".tif", ".webp"])
def test_kinds_of_files(make_folder, suffix):
    image = texture(48, 64)
    read = read_image(make_folder([image], suffix=suffix) / f"0{suffix}")
    assert read.rgb.dtype == np.uint8
    assert np.abs(read.rgb.astype(int) - image).mean() < (0.5 if suffix in (".png", ".bmp", ".tif") else 8)
    assert read.notes == ()


def test_16_bit_images_are_scaled(make_folder):
    image = texture(48, 64)
    read = read_image(make_folder([image.astype(np.uint16) * 257]) / "0.png")
    np.testing.assert_array_equal(read.rgb, image)
    assert "16-bit" in read.notes[0]


@pytest.mark.parametrize("depth", [1, 257])
def test_grey_images_become_rgb(make_folder, depth):
    image = texture(48, 64)[..., 0]
    read = read_image(make_folder([image.astype(np.uint8 if depth == 1 else np.uint16) * depth]) / "0.png")
    np.testing.assert_array_equal(read.rgb, np.repeat(image[..., None], 3, axis=2))
    assert "grey" in read.notes[-1]


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_transparent_pixels_are_marked(make_folder, suffix):
    alpha = np.full((48, 64), 255, dtype=np.uint8)
    alpha[:10, :20] = 0
    read = read_image(make_folder([np.dstack([texture(48, 64), alpha])], suffix=suffix) / f"0{suffix}")
    np.testing.assert_array_equal(read.opaque, alpha > 0)
    np.testing.assert_array_equal(read.rgb, texture(48, 64))
    assert "Transparent" in read.notes[0]


def test_opaque_alpha_is_nothing_special(make_folder):
    image = np.dstack([texture(48, 64), np.full((48, 64), 255, dtype=np.uint8)])
    read = read_image(make_folder([image]) / "0.png")
    assert read.opaque is None
    assert read.notes == ()


def turned(image: np.ndarray, orientation: int) -> np.ndarray:
    """How an image with that EXIF orientation is to be shown."""
    return {
        1: image,
        2: image[:, ::-1],
        3: image[::-1, ::-1],
        4: image[::-1],
        5: np.transpose(image, (1, 0, 2)) if image.ndim == 3 else image.T,
        6: np.rot90(image, -1),
        7: np.rot90(image[:, ::-1], -1),
        8: np.rot90(image, 1),
    }[orientation]


@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_orientation_is_honoured(tmp_path, orientation):
    data = cv2.imencode(".jpg", texture(48, 64)[..., ::-1])[1].tobytes()
    tag = EXIF % orientation
    path = tmp_path / "0.jpg"
    path.write_bytes(data[:2] + b"\xff\xe1" + (len(tag) + 2).to_bytes(2, "big") + tag + data[2:])
    plain = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    np.testing.assert_array_equal(read_image(path).rgb, turned(plain, orientation))


@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
def test_alpha_turns_with_the_colours(tmp_path, orientation):
    alpha = np.full((48, 64), 255, dtype=np.uint8)
    alpha[:10, :20] = 0
    data = cv2.imencode(".png", np.dstack([texture(48, 64)[..., ::-1], alpha]))[1].tobytes()
    body = (EXIF % orientation)[6:]
    chunk = b"eXIf" + body
    part = len(body).to_bytes(4, "big") + chunk + zlib.crc32(chunk).to_bytes(4, "big")
    path = tmp_path / "0.png"
    path.write_bytes(data[:33] + part + data[33:])
    read = read_image(path)
    np.testing.assert_array_equal(read.rgb, turned(texture(48, 64), orientation))
    np.testing.assert_array_equal(read.opaque, turned(alpha, orientation) > 0)


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".webp", ".bmp", ".tif"])
@pytest.mark.parametrize("keep", [0.0, 0.3, 0.7, 0.99])
def test_files_cut_short_are_refused(make_folder, suffix, keep):
    path = make_folder([texture(240, 320)], suffix=suffix) / f"0{suffix}"
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * keep)])
    with pytest.raises(InputError, match=r"empty|cut short|cannot be read"):
        read_image(path)


def test_other_content_is_refused(tmp_path):
    (tmp_path / "0.png").write_text("hello " * 99)
    with pytest.raises(InputError, match="cannot be read as an image"):
        read_image(tmp_path / "0.png")
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_image(tmp_path / "1.png")
    cv2.imwrite(str(tmp_path / "f.tif"), texture(48, 64).astype(np.float32))
    with pytest.raises(InputError, match="float32 numbers; expected 8 or 16 bits"):
        read_image(tmp_path / "f.tif")


def test_a_jpeg_with_data_behind_its_end_is_whole(make_folder):
    path = make_folder([texture(48, 64)], suffix=".jpg") / "0.jpg"
    path.write_bytes(path.read_bytes() + b"trailer")
    assert read_image(path).size == (64, 48)
