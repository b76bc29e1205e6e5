import numpy as np
import pytest

from dreamdrive.geometry.cameras.posing import pose_clip
from tests.geometry.toy_drive import FOCAL_PX, make_clip, path_error, straight, turning


def test_a_turning_clip_shows_its_focal_length() -> None:
    path = turning(10)
    posed = pose_clip(make_clip(path, calibrated=False, prior_px=1.3 * FOCAL_PX))
    assert posed.fallback is None
    assert posed.focal.observed
    assert posed.focal.px == pytest.approx(FOCAL_PX, rel=0.02)
    poses = [camera.world_from_camera for camera in posed.cameras]
    assert path_error(np.stack(poses), path) < 0.005


def test_a_straight_clip_keeps_the_prior() -> None:
    posed = pose_clip(make_clip(straight([0.5] * 6), calibrated=False, prior_px=1.15 * FOCAL_PX))
    assert posed.fallback is None
    assert not posed.focal.observed
    assert posed.focal.px == pytest.approx(1.15 * FOCAL_PX)
    assert posed.scale.spread > 0.3


def test_a_calibrated_focal_length_is_used_as_given() -> None:
    posed = pose_clip(make_clip(turning(10)))
    assert posed.focal.observed
    assert posed.focal.px == FOCAL_PX
