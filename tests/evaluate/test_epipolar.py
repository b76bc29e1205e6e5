"""Shares of matches near their epipolar lines, on points that are known."""

import numpy as np
import pytest

from dreamdrive.evaluate.epipolar import epipolar_share, match
from dreamdrive.geometry.evidence.features import Features
from dreamdrive.scene.camera import Camera

CAMERA = Camera(300.0, 310.0, 200.0, 120.0, 400, 240)
POINTS = 60


def seen(off_px: float = 0.0, bad: int = 0) -> tuple[list[Features], np.ndarray]:
    """Three views on a drive ahead and right; ``bad`` points sit ``off_px`` too low in all but the first."""
    rng = np.random.default_rng(0)
    world = rng.uniform([-6, -1.0, 14], [6, 1.0, 30], (POINTS, 3))
    descriptors = rng.integers(0, 120, (POINTS, 128), np.uint8)
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, 0, 3] = [0, 1.5, 3.0]
    poses[:, 2, 3] = [0, 0.5, 1.0]
    views: list[Features] = []
    for pose in poses:
        pixels = CAMERA.at(pose).project(world)[:, :2].astype(np.float32)
        if views:
            pixels[:bad, 1] += off_px
        order = rng.permutation(POINTS)
        views.append(Features(pixels[order], descriptors[order]))
    return views, poses


def test_a_rigid_world_agrees() -> None:
    views, poses = seen()
    for gap, matches in ((1, 2 * POINTS), (2, POINTS)):
        found = epipolar_share(views, CAMERA, poses, gap, 400)
        assert found.matches == matches
        assert found.share == 1


def test_what_leaves_its_line_is_counted() -> None:
    views, poses = seen(off_px=6.0, bad=15)
    assert epipolar_share(views, CAMERA, poses, 2, 400).share == pytest.approx(0.75)


def test_the_limit_is_in_pixels_of_the_frames() -> None:
    views, poses = seen(off_px=6.0, bad=15)
    assert epipolar_share(views, CAMERA, poses, 2, 100).share == 1


def test_other_poses_than_those_driven_show() -> None:
    views, poses = seen()
    poses[:, 1, 3] = [0, -1.0, -2.0]
    share = epipolar_share(views, CAMERA, poses, 2, 400).share
    assert share is not None
    assert share < 0.5


def test_the_unit_of_the_poses_does_not_count() -> None:
    views, poses = seen(off_px=6.0, bad=15)
    larger = poses.copy()
    larger[:, :3, 3] *= 1000
    assert epipolar_share(views, CAMERA, larger, 1, 400) == epipolar_share(views, CAMERA, poses, 1, 400)


def test_pairs_that_stand_are_left_out() -> None:
    views, poses = seen()
    poses[1] = poses[0]
    assert epipolar_share(views, CAMERA, poses, 1, 400).matches == POINTS
    found = epipolar_share(views, CAMERA, np.tile(np.eye(4), (3, 1, 1)), 1, 400)
    assert found.matches == 0
    assert found.share is None


def test_only_clear_and_mutual_matches_count() -> None:
    views, _ = seen()
    first = views[0]
    twice = Features(np.repeat(first.keypoints_px, 2, axis=0), np.repeat(first.descriptors, 2, axis=0))
    assert len(match(first, twice)[0]) == 0
    nothing = Features(np.zeros((0, 2), np.float32), np.zeros((0, 128), np.uint8))
    assert len(match(first, nothing)[0]) == 0
    here, there = match(first, Features(first.keypoints_px[::-1], first.descriptors[::-1]))
    np.testing.assert_array_equal(here, there)
    assert len(here) == POINTS
