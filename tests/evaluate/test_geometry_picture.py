"""The picture shows errors where they are, in their colours."""

from dataclasses import replace

import numpy as np

from dreamdrive.evaluate.estimate import Estimate
from dreamdrive.evaluate.geometry_picture import draw_geometry_errors, error_colours
from dreamdrive.evaluate.truth.geometry import GeometryTruth
from dreamdrive.scene.camera import Camera


def test_right_is_white_too_far_red_too_near_blue_unknown_dark() -> None:
    true = np.full((4, 6), 10.0)
    found = np.tile([10.0, 20, 5, 0, 10, 10], (4, 1))
    true[:, 4] = 0
    colours = error_colours(found, true)[0]
    assert colours[0].tolist() == [255, 255, 255]
    assert colours[1, 0] > 150 > colours[1, 2]
    assert colours[2, 2] > 150 > colours[2, 0]
    assert (colours[3] == colours[4]).all()
    assert colours[3].max() < 60


def test_a_sparse_point_is_enlarged_and_hides_no_other() -> None:
    true, found = np.zeros((9, 12)), np.full((9, 12), 10.0)
    true[4, 5], true[4, 6], true[0, 11] = 10, 1, 10
    colours = error_colours(found, true)
    white = (colours == 255).all(axis=2)
    assert white[3:6, 4].all(), "to the left of the right one"
    assert white[4, 5]
    assert colours[4, 6, 0] > 150 > colours[4, 6, 1]
    assert white[:2, 10:].all(), "at the edge"
    assert not white[:, 0].any()


def test_the_picture_has_up_to_three_frames_and_the_paths() -> None:
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[:, 2, 3] = np.arange(4)
    cameras = tuple(Camera(80.0, 80.0, 48.0, 32.0, 96, 64, pose) for pose in poses)
    depth_m = np.full((4, 64, 96), 10.0)
    nothing = np.zeros(4, dtype=bool)
    estimate = Estimate(cameras, nothing, np.arange(4), 0.1 * np.arange(4), depth_m, depth_m / 10)
    truth = GeometryTruth(cameras, depth_m, None)
    three = draw_geometry_errors(estimate, truth)
    bare = draw_geometry_errors(replace(estimate, depth_m=None), truth)
    assert three.shape[0] - bare.shape[0] == 3 * 64
    assert three.shape[1] == 2 * 96
    assert (bare == (20, 90, 220)).all(axis=2).any(), "the path of the scene"
    np.testing.assert_array_equal(draw_geometry_errors(estimate, truth), three)
