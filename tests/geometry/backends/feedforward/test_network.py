"""Pictures are whole patches, and pixels find their way back."""

import numpy as np
import pytest

from dreamdrive.geometry.backends.feedforward.network import fit_patches, show, standardise
from dreamdrive.geometry.resize import in_frames
from dreamdrive.scene.camera import Camera


@pytest.mark.parametrize(
    ("frame", "picture"),
    [
        ((1600, 900), (504, 280)),
        ((1242, 375), (504, 154)),
        ((160, 96), (504, 308)),
        ((900, 1600), (280, 504)),
        ((500, 500), (504, 504)),
        ((2000, 20), (504, 14)),
    ],
)
def test_sides_are_multiples_of_14(frame: tuple[int, int], picture: tuple[int, int]) -> None:
    assert fit_patches(*frame, 504).size == picture


def test_cameras_and_values_come_back() -> None:
    how = fit_patches(160, 96, 518)
    camera = Camera(100.0, 110.0, 70.0, 50.0, 160, 96)
    back = how.frame_camera(how.picture_camera(camera))
    assert back.matrix == pytest.approx(camera.matrix)
    frame = np.random.default_rng(0).random((96, 160)).astype(np.float32)
    width, height = how.size
    rows, columns = (((np.arange(n) + 0.5) * m / n).astype(int) for n, m in ((height, 96), (width, 160)))
    assert np.array_equal(in_frames((frame[rows[:, None], columns],), how)[0], frame)


def test_pictures_are_between_0_and_1_and_standardised_as_imagenet() -> None:
    frames = np.zeros((2, 20, 30, 3), np.uint8)
    frames[1] = 255
    pictures = show(frames, fit_patches(30, 20, 28))
    assert pictures.shape == (2, 3, 14, 28)
    assert (pictures[0].max(), pictures[1].min()) == (0, 1)
    black, white = standardise(pictures)[:, 0, 0, 0].tolist()
    assert (black, white) == pytest.approx((-0.485 / 0.229, 0.515 / 0.229))
