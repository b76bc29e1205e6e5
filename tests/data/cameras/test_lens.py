import cv2
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dreamdrive.data.cameras.distortion import Distortion
from dreamdrive.data.cameras.lens import SourceLens, Undistorter
from dreamdrive.data.frames.size import choose_size
from dreamdrive.scene.camera import Camera
from tests.data.textures import texture

UDACITY = Distortion("opencv", (-0.24879, -0.01577, -0.00061, 0.00017, 0.0))
FISHEYE = Distortion("fisheye", (0.04, -0.01, 0.003, -0.0008))
PINCUSHION = Distortion("opencv", (0.15, 0.02, 0.001, -0.001))
RATIONAL = Distortion("opencv", (0.2, -0.05, 0.0003, -0.0002, 0.01, 0.4, -0.02, 0.01))
PRISM = Distortion("opencv", (*RATIONAL.coefficients, 0.01, -0.002, 0.003, 0.001))
TILTED = Distortion("opencv", (*PRISM.coefficients, 0.05, -0.03))
LENSES = [UDACITY, FISHEYE, PINCUSHION, RATIONAL]
SOURCE = Camera(1155.74, 1150.36, 673.0, 389.06, 1280, 720)

small = st.floats(-0.05, 0.05)


def psnr(a: np.ndarray, b: np.ndarray) -> float:
    return float(-10 * np.log10(np.mean((a.astype(float) - b) ** 2)))


def lens_of(distortion: Distortion, size=(480, 270)) -> tuple[SourceLens, Undistorter]:
    sizing = choose_size((1280, 720), size)
    lens = SourceLens(distortion, sizing.camera(SOURCE))
    return lens, Undistorter.create(lens, SOURCE, sizing)


@given(st.floats(-0.3, 0.3), small, small, small, st.tuples(st.floats(-0.6, 0.6), st.floats(-0.4, 0.4)))
def test_undistort_inverts_distort(k1, k2, p1, p2, point):
    for distortion in (
        Distortion("opencv", (k1, k2, p1 / 10, p2 / 10)),
        Distortion("fisheye", (k1 / 3, k2, p1, p2)),
    ):
        ideal = np.array([point])
        if distortion.unfolded(ideal).all():
            np.testing.assert_allclose(distortion.undistort(distortion.distort(ideal)), ideal, atol=1e-6)


@given(st.lists(st.tuples(st.floats(-0.7, 0.7), st.floats(-0.7, 0.7)), min_size=1, max_size=5))
def test_points_agree_with_opencv(points):
    ideal = np.array(points)
    k = np.array(FISHEYE.coefficients)
    expected = cv2.fisheye.distortPoints(ideal[:, None], np.eye(3), k)[:, 0]
    np.testing.assert_allclose(FISHEYE.distort(ideal), expected, atol=1e-9)
    rays = np.concatenate([ideal, np.ones((len(ideal), 1))], axis=1)
    for distortion in (UDACITY, PINCUSHION, RATIONAL, PRISM, TILTED):
        k = np.array(distortion.coefficients)
        expected = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), np.eye(3), k)[0][:, 0]
        np.testing.assert_allclose(distortion.distort(ideal), expected, atol=1e-9)


def test_points_behind_the_fold_have_no_ideal():
    barrel = Distortion("opencv", (-0.3, 0.0, 0.0, 0.0))
    fold = np.tan(barrel.fold_rad)
    assert fold == pytest.approx(np.sqrt(1 / 0.9), rel=2e-3)
    assert np.isnan(barrel.undistort(np.array([[0.9, 0.0]]))).all()
    assert not barrel.unfolded(np.array([[1.2, 0.0]])).any()
    assert np.isnan(FISHEYE.undistort(np.array([[3.0, 0.0]]))).all()


def test_a_lens_without_distortion_is_area_averaging():
    """With coefficients of zero the dense lookups fall on the pixels that area averaging means."""
    image = texture(720, 1280)
    sizing = choose_size((1280, 720), (640, 360))
    lens = SourceLens(Distortion("opencv", (0.0, 0.0, 0.0, 0.0)), sizing.camera(SOURCE))
    got = Undistorter.create(lens, SOURCE, sizing).apply(image)
    assert np.abs(got.astype(int) - sizing.apply(image)).max() <= 2


@pytest.mark.parametrize("distortion", LENSES)
def test_a_straight_edge_stays_straight(distortion):
    """The source image of an ideal half-plane, undistorted, is the half-plane again."""
    lens, undistorter = lens_of(distortion, (240, 136))
    rays = SOURCE.rays()[..., :2]
    ideal = distortion.undistort(rays.reshape(-1, 2)).reshape(rays.shape)
    a, b, c = 0.8, 0.6, 0.05
    with np.errstate(invalid="ignore"):
        bright = np.clip((ideal @ (a, b) - c) * 100 + 0.5, 0, 1)
    source = np.repeat((np.nan_to_num(bright) * 255).astype(np.uint8)[..., None], 3, axis=2)
    got = undistorter.apply(source)[..., 0] / 255
    expected = np.clip((lens.camera.rays()[..., :2] @ (a, b) - c) * 100 + 0.5, 0, 1)
    assert np.abs(got - expected)[undistorter.valid].max() < 0.06


@pytest.mark.parametrize("distortion", LENSES)
def test_undistorting_and_distorting_gives_the_source_back(distortion):
    source = texture(720, 1280)
    lens, undistorter = lens_of(distortion)
    clip = undistorter.apply(source) / 255
    again = lens.apply(clip.astype(np.float32))
    usable = lens.apply(np.repeat(undistorter.valid[..., None], 3, axis=2).astype(np.float32))[..., 0] > 0.999
    assert usable.mean() > 0.7
    expected = choose_size((1280, 720), (480, 270)).apply(source) / 255
    assert psnr(again[usable], expected[usable]) > 38


@pytest.mark.parametrize("distortion", LENSES)
def test_the_covering_pinhole_reaches_every_pixel(distortion):
    lens, _ = lens_of(distortion)
    wide = lens.covering()
    assert lens.covered(wide).all()
    assert (wide.fx_px, wide.fy_px) == (lens.camera.fx_px, lens.camera.fy_px)
    assert wide.cx_px - lens.camera.cx_px == int(wide.cx_px - lens.camera.cx_px)
    rays = np.clip(wide.rays() * 0.5 + 0.5, 0, 1)
    x = lens.apply(rays, wide)[..., 0] * 2 - 1
    ideal = distortion.undistort(lens.camera.rays()[..., :2].reshape(-1, 2))[:, 0].reshape(x.shape)
    pixel = 1 / lens.camera.fx_px
    assert np.abs(x - ideal).max() < 0.08 * pixel  # OpenCV's lookups are to 1/32 of a pixel


def test_a_very_wide_fisheye_is_covered_up_to_a_limit():
    camera = Camera(150.0, 150.0, 240.0, 135.0, 480, 270)
    lens = SourceLens(Distortion("fisheye", (0.0, 0.0, 0.0, 0.0)), camera)
    wide = lens.covering()
    assert (wide.width_px, wide.height_px) == (960, 540)
    assert 0.5 < lens.covered(wide).mean() < 1
    image = lens.apply(np.ones((540, 960, 3)), wide)
    assert (image[lens.covered(wide)] == 1).all()
    assert (image[~lens.covered(wide)] == 0).all()


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_the_rim_of_a_render_is_not_darkened(kind):
    lens, _ = lens_of(UDACITY)
    image = lens.apply(np.full((270, 480, 3), 0.4, dtype=kind))
    assert image.dtype == kind
    np.testing.assert_allclose(image[lens.covered()], 0.4, atol=1e-6)
    assert 0.8 < lens.covered().mean() < 0.95


def test_a_pincushion_lens_leaves_invalid_corners():
    _, undistorter = lens_of(Distortion("opencv", (0.3, 0.0, 0.0, 0.0)))
    image = undistorter.apply(np.full((720, 1280, 3), 200, dtype=np.uint8))
    assert not undistorter.valid[0, 0]
    assert undistorter.valid[135, 240]
    assert (image[~undistorter.valid] == 0).all()
    assert (image[undistorter.valid] == 200).all()


def test_a_large_source_is_shrunk_first():
    big = Camera(8000.0, 8000.0, 4000.0, 2250.0, 8000, 4500)
    sizing = choose_size((8000, 4500), (480, 270))
    lens = SourceLens(UDACITY, sizing.camera(big))
    undistorter = Undistorter.create(lens, big, sizing)
    assert undistorter.maps[0].size < 5e6
    coarse = texture(270, 480)
    image = cv2.resize(coarse, (8000, 4500), interpolation=cv2.INTER_CUBIC)
    again = lens.apply(undistorter.apply(image) / 255.0)
    assert psnr(again[60:-60, 100:-100], coarse[60:-60, 100:-100] / 255) > 33


@settings(max_examples=20)
@given(small, small)
def test_the_lens_survives_json(k1, k2):
    lens = SourceLens(Distortion("opencv", (k1, k2, 0.0, 0.0)), Camera(400.0, 410.0, 240.5, 134.0, 480, 270))
    again = SourceLens.from_json(lens.to_json())
    assert again.to_json() == lens.to_json()
    assert again.distortion == lens.distortion


def test_a_wrong_render_size_is_an_error():
    lens, _ = lens_of(UDACITY)
    with pytest.raises(ValueError, match="its camera"):
        lens.apply(np.zeros((10, 10, 3)))
