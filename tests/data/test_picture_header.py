"""Sizes and orientations are read from headers alone."""

import struct

import cv2
import numpy as np
import pytest

from dreamdrive.data.pictures.picture_file import Header, parse_header
from tests.data.headers import bmp, exif, jpeg, png, tiff, webp


@pytest.mark.parametrize(
    ("suffix", "kind"),
    [(".png", "PNG"), (".jpg", "JPEG"), (".bmp", "BMP"), (".tif", "TIFF"), (".webp", "WebP")],
)
def test_sizes_are_those_that_opencv_wrote(suffix, kind):
    data = cv2.imencode(suffix, np.zeros((48, 70, 3), np.uint8))[1].tobytes()
    assert parse_header(data) == Header(kind, 70, 48)


@pytest.mark.parametrize("flags", [[cv2.IMWRITE_WEBP_QUALITY, 101], [cv2.IMWRITE_WEBP_QUALITY, 50]])
@pytest.mark.parametrize("channels", [3, 4])
def test_each_way_of_webp_has_its_size(flags, channels):
    data = cv2.imencode(".webp", np.full((48, 70, channels), 99, np.uint8), flags)[1].tobytes()
    assert parse_header(data) == Header("WebP", 70, 48)


@pytest.mark.parametrize("make", [png, jpeg, bmp, tiff])
def test_huge_sizes_are_read_as_they_are_stated(make):
    header = parse_header(make(60000, 50000))
    assert header is not None
    assert (header.width_px, header.height_px) == (60000, 50000)


def test_bigtiff_has_the_same_tags():
    header = parse_header(tiff(100000, 7, big=True))
    assert header == Header("TIFF", 100000, 7)


def test_of_a_tag_given_twice_the_largest_counts():
    """Decoders do not agree which one they take."""
    assert parse_header(tiff(100000, 10, 20)) == Header("TIFF", 100000, 10)


@pytest.mark.parametrize("make", [png, jpeg, webp])
@pytest.mark.parametrize("order", ["<", ">"])
def test_orientation_is_found(make, order):
    header = parse_header(make(70, 48, exif(6, order)))
    assert header is not None
    assert (header.width_px, header.height_px, header.orientation) == (70, 48, 6)


@pytest.mark.parametrize("bad", [b"", b"II*\0", b"II*\0" + struct.pack("<I", 2**32 - 1), exif(9), exif(0)])
def test_exif_without_use_turns_nothing(bad):
    assert parse_header(png(70, 48, bad)) == Header("PNG", 70, 48)


@pytest.mark.parametrize("make", [png, jpeg, bmp, tiff, webp])
def test_a_header_cut_short_is_none(make):
    data = make(70, 48)
    for end in range(len(data)):
        header = parse_header(data[:end])
        assert header is None or (header.width_px, header.height_px) in ((70, 48), (0, 0), (70, 0))
    assert parse_header(data[:10]) is None or make is jpeg


def test_a_part_of_a_png_that_claims_more_than_the_file_is_none():
    """OpenCV takes memory for as much as it claims."""
    data = bytearray(png(70, 48))
    at = data.index(b"IDAT") - 4
    data[at : at + 4] = struct.pack(">I", 2**31 - 1)
    assert parse_header(bytes(data)) is None


def test_other_kinds_are_none():
    for data in (b"", b"GIF89a" + bytes(40), b"P6 10 10 255 " + bytes(300), b"\x89PNG\r\n\x1a\n" + bytes(30)):
        assert parse_header(data) is None
