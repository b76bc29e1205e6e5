"""Change of colour along the flow, on frames whose motion is known."""

import cv2
import numpy as np
import pytest

from dreamdrive.evaluate.warp_error import warp_error
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip


def clip(frames: np.ndarray, valid: np.ndarray | None = None) -> Clip:
    count, height, width = frames.shape[:3]
    return Clip(
        frames=frames,
        times_s=np.arange(count) / 10,
        camera=np.zeros(count, np.int64),
        rig=(Camera(100.0, 100.0, width / 2, height / 2, width, height),),
        valid=np.ones(frames.shape[:3], bool) if valid is None else valid,
        held_out=np.zeros(count, bool),
        source_index=np.arange(count),
    )


@pytest.fixture(scope="module")
def picture() -> np.ndarray:
    noise = np.random.default_rng(0).uniform(0, 255, (96, 160, 3)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 2.5)
    return np.clip(128 + 6 * (smooth - smooth.mean()), 20, 220).astype(np.uint8)


def test_a_frame_repeated_has_no_error(picture: np.ndarray) -> None:
    still = clip(np.stack([picture] * 9))
    for gap in (1, 4, 8):
        error = warp_error(still, gap)
        assert error.grey_levels == 0
        assert error.share == 1


def test_motion_is_no_error_but_what_leaves_the_frame_is_not_followed(picture: np.ndarray) -> None:
    frames = np.stack([np.roll(picture, -3 * i, axis=1)[:, :120] for i in range(5)])
    error = warp_error(clip(frames), 4)
    assert error.grey_levels is not None
    assert error.grey_levels < 1
    assert 0.7 < error.share < 0.93  # 12 of 120 columns have left


def test_a_change_of_brightness_is_measured_in_grey_levels(picture: np.ndarray) -> None:
    frames = np.stack([np.roll(picture, -2 * i, axis=1)[:, :120] + np.uint8(10 * i) for i in range(3)])
    for gap in (1, 2):
        assert warp_error(clip(frames), gap).grey_levels == pytest.approx(10 * gap, abs=1)


def test_what_holds_no_picture_is_not_measured(picture: np.ndarray) -> None:
    frames, valid = np.stack([picture] * 3), np.ones((3, 96, 160), bool)
    valid[:, :, :40] = False
    frames[1:, :, :40] = 255
    error = warp_error(clip(frames, valid), 1)
    assert error.grey_levels == pytest.approx(0, abs=0.2)
    assert error.share > 0.9
    assert warp_error(clip(frames, np.zeros_like(valid)), 1).grey_levels is None


def test_frames_farther_apart_than_there_are_is_a_mistake(picture: np.ndarray) -> None:
    with pytest.raises(ValueError, match="none 3 apart"):
        warp_error(clip(np.stack([picture] * 3)), 3)
