import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from dreamdrive.data.cameras.distortion import Distortion
from dreamdrive.data.cameras.intrinsics import guess_camera, read_intrinsics
from dreamdrive.errors import InputError

GOOD = {"width": 1280, "height": 720, "intrinsics": {"fx": 1000.0, "fy": 990.0, "cx": 639.5, "cy": 359.5}}


@pytest.fixture
def write(tmp_path):
    def write(values: object) -> Path:
        path = tmp_path / "calibration.json"
        path.write_text(values if isinstance(values, str) else json.dumps(values))
        return path

    return write


def test_half_a_pixel_is_added_to_the_principal_point(write):
    found = read_intrinsics(write(GOOD), (1280, 720))
    assert (found.camera.cx_px, found.camera.cy_px) == (640.0, 360.0)
    assert (found.camera.fx_px, found.camera.fy_px) == (1000.0, 990.0)
    assert found.known
    assert found.distortion is None


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.floats(0.2, 4))
def test_the_calibration_of_another_size_is_scaled(write, scale):
    size = (round(1280 * scale), round(720 * scale))
    found = read_intrinsics(write(GOOD), size)
    assert found.camera.fx_px == pytest.approx(1000 * size[0] / 1280)
    assert found.camera.cx_px == pytest.approx(size[0] / 2)
    assert found.camera.cy_px == pytest.approx(size[1] / 2)
    assert found.notes
    assert ("scaled" in found.notes[0]) == (size != (1280, 720))


def test_another_shape_is_refused(write):
    with pytest.raises(InputError, match=r"for 1280x720 images, but the input is 1226x370"):
        read_intrinsics(write(GOOD), (1226, 370))


@pytest.mark.parametrize(
    ("distortion", "model", "numbers"),
    [
        ({"model": "opencv k1 k2 p1 p2 k3", "coefficients": [-0.2, 0.1, 0, 0, 0.01]}, "opencv", 5),
        ({"model": "opencv", "coefficients": [-0.2, 0.1, 0, 0]}, "opencv", 4),
        ({"model": "OpenCV", "coefficients": [-0.2, 0.1, 0, 0, 0, 0, 0.1, 0]}, "opencv", 8),
        ({"model": "fisheye", "coefficients": [0.1, 0, 0, 0]}, "fisheye", 4),
        ({"model": "opencv_fisheye", "coefficients": [0, 0, 0, 0]}, "fisheye", 4),
        ({"model": "fisheye k1 k2 k3 k4", "coefficients": [0.1, 0, 0, 0]}, "fisheye", 4),
    ],
)
def test_distortion_models(write, distortion, model, numbers):
    found = read_intrinsics(write({**GOOD, "distortion": distortion}), (1280, 720)).distortion
    assert isinstance(found, Distortion)
    assert (found.model, len(found.coefficients)) == (model, numbers)


@pytest.mark.parametrize(
    "value", [None, "none (rectified)", {"model": "opencv", "coefficients": [0, 0, 0, 0]}]
)
def test_no_distortion(write, value):
    found = read_intrinsics(write({**GOOD, "distortion": value}), (1280, 720))
    assert found.distortion is None
    assert any("rectified" in note for note in found.notes) == (value == "none (rectified)")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"intrinsics": None}, "holds no calibration"),
        ({"intrinsics": {"fx": 1.0}}, r"missing required field `fy` - at `\$.intrinsics`"),
        ({"width": 1280.5}, "expected whole positive sizes"),
        ({"width": "wide"}, r"Expected `float`, got `str` - at `\$.width`"),
        (
            {"intrinsics": {**GOOD["intrinsics"], "fx": float("nan")}},
            "it holds NaN or Infinity, which JSON has not",
        ),
        ({"intrinsics": {**GOOD["intrinsics"], "fx": -4}}, "positive"),
        ({"intrinsics": {**GOOD["intrinsics"], "cx": 4000}}, "principal point inside"),
        ({"distortion": {"model": "mei", "coefficients": [0, 0, 0, 0]}}, "unknown distortion model 'mei'"),
        ({"distortion": {"model": "opencv k2 k1", "coefficients": [0, 0]}}, "unknown distortion model"),
        (
            {"distortion": {"model": "opencv", "coefficients": [0.1, 0]}},
            "with 2 coefficients; expected 4 or 5",
        ),
        ({"distortion": {"model": "fisheye", "coefficients": [0] * 5}}, "with 5 coefficients; expected 4"),
        (
            {"distortion": {"model": "opencv", "coefficients": [0.1, None, 0, 0]}},
            r"got `null` - at `\$.distortion.coefficients\[1\]`",
        ),
        ({"distortion": [0.1, 0, 0, 0]}, r"got `array` - at `\$.distortion`"),
        ({"width": True}, r"Expected `float`, got `bool` - at `\$.width`"),
    ],
)
def test_malformed_calibrations_are_refused(write, change, words):
    with pytest.raises(InputError, match=words):
        read_intrinsics(write({**GOOD, **change}), (1280, 720))


@pytest.mark.parametrize(("text", "words"), [("not json", "is not JSON"), ("[1]", "expected a JSON object")])
def test_other_files_are_refused(write, text, words):
    with pytest.raises(InputError, match=words):
        read_intrinsics(write(text), (1280, 720))


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_intrinsics(tmp_path / "none.json", (1280, 720))


def test_the_guess_is_a_usual_dashcam():
    guess = guess_camera((1920, 1080))
    assert (guess.camera.fx_px, guess.camera.cx_px, guess.camera.cy_px) == (0.85 * 1920, 960, 540)
    assert not guess.known
    assert "The lens distortion is unknown and taken as zero." in guess.notes
    assert guess_camera((1080, 1920)).camera.fx_px == guess.camera.fx_px


def test_a_field_of_view_gives_the_focal_length():
    assert guess_camera((1000, 500), 90.0).camera.fx_px == pytest.approx(500)
    with pytest.raises(InputError, match="--hfov 190"):
        guess_camera((1000, 500), 190.0)


def test_golden_the_calibration_of_a_real_clip(data_dir):
    found = read_intrinsics(data_dir / "clips/udacity_highway_two_cars/meta.json", (1280, 720))
    meta = json.loads((data_dir / "clips/udacity_highway_two_cars/meta.json").read_text())
    assert found.camera.fx_px == meta["intrinsics"]["fx"]
    assert found.camera.cx_px == meta["intrinsics"]["cx"] + 0.5
    assert found.distortion == Distortion("opencv", tuple(meta["distortion"]["coefficients"]))


def test_golden_every_clip_with_calibration_is_accepted(data_dir):
    for path in sorted((data_dir / "clips").glob("*/meta.json")):
        meta = json.loads(path.read_text())
        if meta["intrinsics"]:
            assert read_intrinsics(path, (meta["width"], meta["height"])).known
        else:
            with pytest.raises(InputError, match="holds no calibration"):
                read_intrinsics(path, (meta["width"], meta["height"]))


def test_a_transforms_json_is_a_calibration(tmp_path):
    shared = {
        "w": 1280,
        "h": 720,
        "fl_x": 1000.0,
        "fl_y": 990.0,
        "cx": 640.0,
        "cy": 360.0,
        "k1": -0.1,
        "k3": 0.01,
    }
    path = tmp_path / "transforms.json"
    path.write_text(json.dumps({**shared, "frames": [{"file_path": "a"}, {"file_path": "b"}]}))
    for given_as in (path, tmp_path):
        found = read_intrinsics(given_as, (640, 360))
        assert (found.camera.fx_px, found.camera.cx_px, found.camera.cy_px) == (500.0, 320.0, 180.0)
        assert found.distortion == Distortion("opencv", (-0.1, 0.0, 0.0, 0.0, 0.01))
        assert found.known
    path.write_text(json.dumps({**shared, "frames": [{"fl_x": 900.0}, {}]}))
    with pytest.raises(InputError, match="2 different cameras"):
        read_intrinsics(path, (640, 360))
    path.write_text(json.dumps({**shared, "frames": [{}]}))
    with pytest.raises(InputError, match=r"for 1280x720 images, but the input is 640x300"):
        read_intrinsics(path, (640, 300))


def test_a_colmap_model_is_a_calibration(tmp_path):
    (tmp_path / "cameras.txt").write_text("1 FULL_OPENCV 1280 720 1000 990 640 360 1 2 3 4 5 6 7 8\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.jpg\n\n")
    (tmp_path / "points3D.txt").write_text("")
    found = read_intrinsics(tmp_path, (1280, 720))
    assert (found.camera.fy_px, found.camera.cx_px) == (990.0, 640.0)
    assert found.distortion == Distortion("opencv", (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0))
    (tmp_path / "images.txt").write_text("")
    (tmp_path / "cameras.txt").write_text("")
    with pytest.raises(InputError, match="holds 0 different cameras; expected one"):
        read_intrinsics(tmp_path, (1280, 720))
    (tmp_path / "points3D.txt").unlink()
    with pytest.raises(InputError, match=r"points3D\.txt is missing"):
        read_intrinsics(tmp_path, (1280, 720))
