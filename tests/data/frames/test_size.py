import re

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.data.frames.size import MAX_CROP, choose_size, cover
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera

sizes = st.tuples(st.integers(16, 4000), st.integers(16, 4000))


@given(sizes)
def test_the_default_size_is_even_and_at_most_480_wide(source):
    if round(min(480, source[0]) * source[1] / source[0]) < 16:
        with pytest.raises(InputError, match="too flat"):
            choose_size(source, None)
        return
    sizing = choose_size(source, None)
    width, height = sizing.target
    assert width == min(480, source[0] - source[0] % 2)
    assert height % 2 == 0
    assert abs(height - width * source[1] / source[0]) <= 1


@given(sizes, st.tuples(st.integers(16, 2000), st.integers(16, 2000)))
def test_an_asked_size_is_met_exactly_or_refused_with_sizes_that_work(source, wanted):
    try:
        sizing = choose_size(source, wanted)
    except InputError as error:
        for width, height in re.findall(r"(\d+)x(\d+)", str(error).partition("nearest sizes are")[2]):
            if min(int(width), int(height)) >= 100:  # rounding to even numbers costs less than 2 % there
                assert choose_size(source, (int(width), int(height))).target == (int(width), int(height))
        return
    assert sizing.target == wanted
    for axis in (0, 1):
        lost = sizing.scaled[axis] - wanted[axis]
        assert 0 <= lost <= MAX_CROP * sizing.scaled[axis] + 1
        assert sizing.offset[axis] == lost // 2


@given(sizes, st.floats(0.3, 3), st.floats(0.2, 0.8), st.floats(0.2, 0.8))
def test_intrinsics_follow_the_pixels(source, focal, x, y):
    try:
        sizing = choose_size(source, None)
    except InputError:
        return
    camera = Camera(focal * source[0], focal * source[0], x * source[0], y * source[1], *source)
    small = sizing.camera(camera)
    assert (small.width_px, small.height_px) == sizing.target
    ray = np.array([0.1, -0.2])
    big_px = ray * (camera.fx_px, camera.fy_px) + (camera.cx_px, camera.cy_px)
    small_px = ray * (small.fx_px, small.fy_px) + (small.cx_px, small.cy_px)
    scale = np.array(sizing.scaled) / source
    np.testing.assert_allclose(small_px, big_px * scale - sizing.offset, atol=1e-6)


def test_a_scaled_picture_and_its_camera_agree():
    """A blob at a known ray is found where the camera of the clip says."""
    source = Camera(900.0, 900.0, 611.0, 180.5, 1226, 370)
    sizing = choose_size((1226, 370), (480, 144))
    u, v = 800.0, 121.0
    x, y = np.meshgrid(np.arange(1226) + 0.5, np.arange(370) + 0.5)
    blob = np.exp(-((x - u) ** 2 + (y - v) ** 2) / 128) * 255
    small = sizing.apply(blob.astype(np.uint8)).astype(float)
    grid = np.meshgrid(np.arange(480) + 0.5, np.arange(144) + 0.5)
    found = [(small * g).sum() / small.sum() for g in grid]
    clip = sizing.camera(source)
    expected = (
        (u - source.cx_px) / source.fx_px * clip.fx_px + clip.cx_px,
        (v - source.cy_px) / source.fy_px * clip.fy_px + clip.cy_px,
    )
    np.testing.assert_allclose(found, expected, atol=0.02)


def test_shrinking_is_area_averaging():
    image = np.random.default_rng(0).integers(0, 256, (1080, 1920, 3), dtype=np.uint8)
    got = choose_size((1920, 1080), (480, 270)).apply(image)
    np.testing.assert_array_equal(got, cv2.resize(image, (480, 270), interpolation=cv2.INTER_AREA))
    means = image.reshape(270, 4, 480, 4, 3).mean(axis=(1, 3))
    assert np.abs(got - means).max() <= 0.5


def test_another_shape_is_refused_with_the_nearest_sizes():
    with pytest.raises(InputError, match=r"--size 640x480 would cut away 25 % .* 640x360 and 854x480"):
        choose_size((1920, 1080), (640, 480))


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ((481, 270), "give 482x270"),
        ((8, 6), "at least 16"),
        ((0, 270), "at least 16"),
        ((32000, 18000), "too large for H.264"),
    ],
)
def test_sizes_no_video_can_have_are_refused(wanted, words):
    with pytest.raises(InputError, match=words):
        choose_size((1920, 1080), wanted)


def test_tiny_sources_are_refused():
    with pytest.raises(InputError, match="8x6 pixels"):
        choose_size((8, 6), None)


@pytest.mark.parametrize("source", [(2, 4000), (4000, 2), (30, 1000)])
def test_a_strip_is_refused_before_it_fills_memory(source: tuple[int, int]) -> None:
    with pytest.raises(InputError, match="not a strip"):
        cover(source, (1024, 576))


def test_a_tall_photo_covers_a_wide_model() -> None:
    assert cover((1080, 2400), (1024, 576)).scaled == (1024, 2276)
