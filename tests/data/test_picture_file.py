"""Pictures that do not fit, or are none, are refused before anything is decoded."""

import os

import cv2
import numpy as np
import pytest
from tests.data.headers import bmp, jpeg, png, tiff, webp

from dreamdrive.data import picture_file
from dreamdrive.data.picture_file import read_picture
from dreamdrive.errors import InputError


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
    other = "PICTURE cannot be read as an image; expected PNG, JPEG, BMP, TIFF or WebP"
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
