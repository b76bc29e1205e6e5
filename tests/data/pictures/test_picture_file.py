"""Pictures that do not fit, or are none, are refused before anything is decoded."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from dreamdrive.data.pictures import picture_file
from dreamdrive.data.pictures.picture_file import read_pages, read_picture
from dreamdrive.errors import InputError
from tests.data.headers import bmp, jpeg, png, tiff, webp
from tests.data.textures import texture


def refusal(path) -> str:
    with pytest.raises(InputError) as caught:
        read_picture(path)
    return str(caught.value).replace(str(path), "PICTURE")


@pytest.mark.parametrize(
    ("make", "width", "height"),
    [
        (png, 100000, 100000),
        (jpeg, 32000, 32000),
        (bmp, 32000, 32000),
        (tiff, 100000, 1000),
        (webp, 32000, 32000),
    ],
)
def test_a_huge_picture_is_refused_without_decoding(tmp_path, monkeypatch, make, width, height):
    monkeypatch.delattr(cv2, "imdecode")
    (tmp_path / "0.png").write_bytes(make(width, height))
    assert refusal(tmp_path / "0.png") == (
        f"PICTURE is an image of {width}x{height} pixels; expected at most 64 megapixels: scale it down"
    )


def test_a_jpeg_of_many_scans_is_refused(tmp_path):
    (tmp_path / "0.jpg").write_bytes(jpeg(8000, 8000, scans=51))
    assert refusal(tmp_path / "0.jpg") == (
        "PICTURE is a JPEG of 51 scans; expected at most 50: save it again with another program"
    )


def test_what_is_no_picture_is_refused(tmp_path):
    other = "PICTURE cannot be read as an image; expected PNG, JPEG, BMP, TIFF, WebP or AVIF"
    path = tmp_path / "0.png"
    for content, expected in (
        (b"", "PICTURE is empty; expected an image"),
        (b"hello", other),
        (cv2.imencode(".pgm", np.zeros((20, 20), np.uint8))[1].tobytes(), other),
        (png(0, 20), other),
        (
            png(20, 20)[:-20],
            "PICTURE is cut short: the end of the image is missing; copy it again or leave it out",
        ),
    ):
        path.write_bytes(content)
        assert refusal(path) == expected


def test_what_is_no_plain_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "0.png")
    assert refusal(tmp_path / "0.png") == "PICTURE cannot be read: it is not a regular file"
    (tmp_path / "1.png").symlink_to("/dev/zero")
    assert refusal(tmp_path / "1.png") == "PICTURE cannot be read: it is not a regular file"


def test_a_large_file_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(picture_file, "PICTURE_BYTES", 2_000_000)
    with (tmp_path / "0.bmp").open("wb") as file:
        file.truncate(3_000_000)
    assert refusal(tmp_path / "0.bmp") == "PICTURE holds 3.0 MB; expected at most 2 MB"


def test_a_link_to_a_picture_is_followed(tmp_path):
    cv2.imwrite(str(tmp_path / "a.png"), np.full((20, 30), 7, np.uint8))
    (tmp_path / "b.png").symlink_to(tmp_path / "a.png")
    assert (read_picture(tmp_path / "b.png") == 7).all()


def test_a_photo_of_a_phone_is_read_upright(tmp_path: Path) -> None:
    picture = texture(40, 60)
    image = Image.fromarray(picture)
    exif = image.getexif()
    exif[274] = 6
    image.save(tmp_path / "a.avif", quality=95, exif=exif)
    read, pages = read_pages(tmp_path / "a.avif")
    assert pages == 1
    assert read.shape == (60, 40, 3)
    assert np.abs(np.rot90(read[..., ::-1]).astype(int) - picture).mean() < 12


def test_transparency_of_an_avif_is_kept(tmp_path: Path) -> None:
    picture = np.dstack([texture(40, 60), np.full((40, 60), 255, np.uint8)])
    picture[:20, :, 3] = 0
    Image.fromarray(picture).save(tmp_path / "a.avif", quality=95)
    read = read_picture(tmp_path / "a.avif")
    assert read.shape == (40, 60, 4)
    assert (read[..., 3] > 127).tolist() == (picture[..., 3] > 127).tolist()


def test_a_huge_avif_is_refused_by_its_header(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Image.fromarray(texture(40, 60)).save(tmp_path / "a.avif")
    monkeypatch.setattr(picture_file, "MAX_PIXELS", 1000)
    with pytest.raises(InputError, match="60x40"):
        read_picture(tmp_path / "a.avif")


@pytest.mark.parametrize("kind", ["tiff", "png", "webp", "avif"])
def test_of_several_pages_the_first_is_read_and_counted(tmp_path: Path, kind: str) -> None:
    first, second = (Image.fromarray(texture(48, 48, seed)) for seed in range(2))
    first.save(tmp_path / f"a.{kind}", save_all=True, append_images=[second])
    read, pages = read_pages(tmp_path / f"a.{kind}")
    assert pages == 2
    assert np.abs(read[..., 2::-1].astype(int) - np.asarray(first)).mean() < 12
    first.save(tmp_path / f"b.{kind}")
    assert read_pages(tmp_path / f"b.{kind}")[1] == 1


def test_a_damaged_avif_is_refused(tmp_path: Path) -> None:
    Image.fromarray(texture(24, 32)).save(tmp_path / "a.avif", quality=60)
    data = (tmp_path / "a.avif").read_bytes()
    for changed in (data[:358] + data[422:], data.replace(b"pitm", b"xxxx"), data.replace(b"av01", b"xxxx")):
        (tmp_path / "b.avif").write_bytes(changed)
        with pytest.raises(InputError, match=r"b\.avif"):
            read_picture(tmp_path / "b.avif")
