"""Frames become pictures of the network's size as Pillow makes them, and pixels find their way back."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.network.images import any_resize_crop, as_input, resize_crop
from dreamdrive.geometry.resize import ResizeCrop, prepare
from dreamdrive.scene.camera import Camera
from tests.golden.reading import arrays, cases, values


def test_golden_sizes() -> None:
    sizes = values("dust3r/preprocess_sizes.json")
    assert sizes
    for name, expected in sizes.items():
        shape, size, square = name.split("|")
        width, height = map(int, shape.split("x"))
        got = any_resize_crop(width, height, int(size), square_ok=square == "square_ok").size
        assert list(got) == expected, name


def fittings(frame: np.ndarray, picture: np.ndarray) -> list[ResizeCrop]:
    """How a frame can have become a picture: no file tells the long side before whole patches were cut."""
    height, width = picture.shape[:2]
    long_sides = range(max(width, height), max(width, height) + 16)
    found = [
        any_resize_crop(frame.shape[1], frame.shape[0], size, square_ok=square_ok)
        for size in long_sides
        for square_ok in (False, True)
    ]
    return [how for how in found if how.size == (width, height)]


@pytest.mark.parametrize("name", cases("dust3r/preprocess.safetensors", r"(.+)\.input"))
def test_golden_pictures(name: str) -> None:
    given = arrays("dust3r/preprocess.safetensors")
    frame, expected = given[f"{name}.input"], given[f"{name}.output_u8"].transpose(1, 2, 0)
    apart = [np.abs(prepare(frame, how).astype(int) - expected) for how in fittings(frame, expected)]
    best = min(apart, key=np.sum)
    # Pillow rounds between its two passes, and where a value is half way.
    assert best.max() <= 1
    assert (best == 0).mean() > 0.98


def test_input_of_the_network() -> None:
    picture = np.array([0, 51, 255] * 4, np.uint8).reshape(2, 2, 3)
    got = as_input([picture, picture])
    assert got.shape == (2, 3, 2, 2)
    np.testing.assert_allclose(got[0, :, 1, 0], [-1, -0.6, 1], atol=1e-6)


def test_a_frame_of_the_networks_size_stays_as_it_is() -> None:
    frame = np.random.default_rng(0).integers(0, 256, (288, 512, 3), dtype=np.uint8)
    np.testing.assert_array_equal(prepare(frame, resize_crop(512, 288)), frame)


@pytest.mark.parametrize(
    ("width", "height", "size"), [(0, 5, 512), (2000, 20, 512), (90, 90, 80), (640, 480, 8)]
)
def test_frames_that_do_not_fit_are_refused(width: int, height: int, size: int) -> None:
    with pytest.raises(InputError, match=f"frames of {width}x{height} px"):
        resize_crop(width, height, size)


def test_another_size_than_announced_is_refused() -> None:
    with pytest.raises(ValueError, match="64x48"):
        prepare(np.zeros((48, 64, 3), np.uint8), resize_crop(64, 32))
    with pytest.raises(ValueError, match="64x48"):
        resize_crop(64, 32).picture_camera(Camera(50, 50, 32, 24, 64, 48))


frames = st.tuples(st.integers(40, 900), st.integers(40, 900)).filter(lambda s: max(s) < 4 * min(s))


@settings(max_examples=40)
@given(frames, st.sampled_from([512, 224, 128]))
def test_pixels_and_cameras_there_and_back(shape: tuple[int, int], size: int) -> None:
    how = resize_crop(*shape, size)
    pixels = np.random.default_rng(0).uniform(0, 300, (5, 2))
    np.testing.assert_allclose(how.to_frame(how.to_picture(pixels)), pixels, rtol=1e-12)
    camera = Camera(300.0, 310.0, 200.5, 99.25, *how.frame_size)
    back = how.frame_camera(how.picture_camera(camera))
    np.testing.assert_allclose(back.matrix, camera.matrix, rtol=1e-12)
    assert (back.width_px, back.height_px) == how.frame_size
    # A point is seen where its pixel goes.
    point = np.array([[0.3, -0.2, 2.0]])
    seen = how.picture_camera(camera).project(point)[:, :2]
    np.testing.assert_allclose(seen, how.to_picture(camera.project(point)[:, :2]), rtol=1e-9)


@pytest.mark.parametrize("shape", [(640, 400), (150, 250)])
def test_a_bright_spot_is_found_where_its_pixel_goes(shape: tuple[int, int]) -> None:
    how: ResizeCrop = resize_crop(*shape, 256)
    rows, columns = np.mgrid[: shape[1], : shape[0]] + 0.5
    centre = np.array([0.4 * shape[0], 0.6 * shape[1]])
    spot = 250 * np.exp(-((columns - centre[0]) ** 2 + (rows - centre[1]) ** 2) / 300)
    picture = prepare(np.repeat(spot[..., None].astype(np.uint8), 3, axis=2), how)[..., 0].astype(float)
    rows, columns = np.mgrid[: picture.shape[0], : picture.shape[1]] + 0.5
    found = [(columns * picture).sum() / picture.sum(), (rows * picture).sum() / picture.sum()]
    np.testing.assert_allclose(found, how.to_picture(centre), atol=0.05)
