"""Pinholes of a network, and a known one in their place."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.geometry.backends.feedforward.network import FeedforwardResult
from dreamdrive.geometry.backends.feedforward.reconstruct import seen_through
from dreamdrive.scene.camera import Camera

KNOWN = Camera(100.0, 100.0, 86.0, 45.0, 160, 96)


def points(seen: FeedforwardResult, camera: Camera) -> np.ndarray:
    """World points (H, W, 3) of the only frame."""
    pose, local = seen.world_from_camera[0], camera.rays() * seen.depth[0][..., None]
    return local @ pose[:3, :3].T + pose[:3, 3]


@pytest.fixture
def seen() -> FeedforwardResult:
    """A wall and a road in front of a camera with the principal point in the middle, somewhere."""
    middle = replace(KNOWN, cx_px=80.0, cy_px=48.0)
    rays = middle.rays()
    depth = np.minimum(20.0, 1.5 / np.maximum(rays[..., 1], 1e-3)).astype(np.float32)
    pose = np.eye(4)
    pose[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    pose[:3, 3] = [3, -1, 2]
    return FeedforwardResult(pose[None], middle.matrix[None], depth[None], np.ones_like(depth)[None])


def test_points_stay_where_the_network_saw_them(seen: FeedforwardResult) -> None:
    """What is left is of second order: a picture beside the middle is no quite turned one."""
    wanted = points(seen, replace(KNOWN, cx_px=80.0, cy_px=48.0))
    found = seen_through(seen, KNOWN)
    np.testing.assert_allclose(found.world_from_camera[0, :3, 3], [3, -1, 2])
    apart, before = (
        np.linalg.norm(points(each, KNOWN) - wanted, axis=-1) / seen.depth[0] for each in (found, seen)
    )
    assert apart.mean() < 0.2 * before.mean()
    assert apart.max() < 0.7 * before.min()


def test_the_same_pinhole_changes_nothing(seen: FeedforwardResult) -> None:
    camera = replace(KNOWN, cx_px=80.0, cy_px=48.0)
    for known in (camera, replace(camera, fx_px=150.0, fy_px=150.0)):
        found = seen_through(seen, known)
        np.testing.assert_allclose(found.world_from_camera, seen.world_from_camera, atol=1e-12)
        np.testing.assert_allclose(found.depth, seen.depth, rtol=1e-6)
