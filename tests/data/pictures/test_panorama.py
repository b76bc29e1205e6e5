"""Views out of panoramas: where a direction lies, and what is refused."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.data.photo import read_photo
from dreamdrive.data.pictures.panorama import is_panorama, view_of
from dreamdrive.errors import InputError


def directions(width: int = 720) -> np.ndarray:
    """A panorama whose red is the azimuth and whose green the elevation."""
    azimuth = np.linspace(0, 255, width)[None, :]
    elevation = np.linspace(255, 0, width // 2)[:, None]
    blue = np.zeros((width // 2, width))
    return np.stack(np.broadcast_arrays(azimuth, elevation, blue), axis=2).astype(np.uint8)


@given(st.floats(-90, 90), st.floats(-40, 40))
def test_the_middle_of_a_view_is_its_heading_and_pitch(heading: float, pitch: float) -> None:
    rgb, camera = view_of(directions(), heading, pitch, 60.0, (64, 48), "x")
    assert camera.fx_px == pytest.approx(32 / np.tan(np.deg2rad(30)))
    red, green = rgb[23:25, 31:33, :2].astype(float).mean((0, 1))
    assert red == pytest.approx((heading / 360 + 0.5) * 255, abs=1.5)
    assert green == pytest.approx((pitch / 180 + 0.5) * 255, abs=1.5)


def test_what_is_to_the_right_is_to_the_right_and_what_is_below_below() -> None:
    rgb, _ = view_of(directions(), 0.0, 0.0, 60.0, (64, 48), "x")
    assert rgb[24, -1, 0] > rgb[24, 0, 0]
    assert rgb[0, 32, 1] > rgb[-1, 32, 1]


def test_the_seam_is_not_seen() -> None:
    flat = np.full((180, 360, 3), 77, np.uint8)
    rgb, _ = view_of(flat, 180.0, 0.0, 90.0, (64, 48), "x")
    assert (rgb == 77).all()


@pytest.mark.parametrize(
    ("shape", "view", "hfov", "message"),
    [
        ((200, 300), (0.0, 0.0), 70.0, "twice as wide"),
        ((180, 360), (0.0, 80.0), 70.0, "pitch"),
        ((180, 360), (400.0, 0.0), 70.0, "heading"),
        ((180, 360), (0.0, 0.0), 150.0, "field of view"),
    ],
)
def test_what_is_no_panorama_or_no_view_is_a_sentence(
    shape: tuple[int, int], view: tuple[float, float], hfov: float, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        view_of(np.zeros((*shape, 3), np.uint8), *view, hfov, (64, 48), "x")


def test_a_photo_is_taken_out_of_a_panorama(tmp_path: Path) -> None:
    path = tmp_path / "all.png"
    cv2.imwrite(str(path), directions()[..., ::-1])
    assert is_panorama((720, 360))
    photo = read_photo(path, (64, 48), view=(30.0, 0.0))
    assert photo.calibrated
    assert any("heading 30" in note for note in photo.notes)
    assert any("--view HEADING,PITCH" in note for note in read_photo(path, (64, 48)).notes)
    with pytest.raises(InputError, match="leave --intrinsics out"):
        read_photo(path, (64, 48), tmp_path / "k.json", view=(0.0, 0.0))
