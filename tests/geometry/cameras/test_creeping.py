"""A camera that waits before a wall and rolls a little nearer to it, frame by frame."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dreamdrive.geometry.cameras import with_creep
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from tests.decompose.test_per_frame import DEPTH_M, FOCAL_PX, HEIGHT, WIDTH, wall


def creeping(step_m: float, turn_rad: float = 0.0) -> tuple[Clip, Geometry]:
    """A wall that comes nearer by a step each frame, while the camera turns right; nothing of it is known."""
    clip, geometry = wall(step_m=0.0, held_out=0)
    noise = np.random.default_rng(1).uniform(0, 255, (HEIGHT, WIDTH, 3))
    texture = cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 1.5), np.empty(0), 0, 255, cv2.NORM_MINMAX)
    # The first pixel's middle is at 0.5; OpenCV counts from there.
    lens = np.array([[FOCAL_PX, 0, WIDTH / 2 - 0.5], [0, FOCAL_PX, HEIGHT / 2 - 0.5], [0, 0, 1]])
    frames = []
    for k in range(len(clip)):
        nearer = np.diag([1, 1, (DEPTH_M - step_m * k) / DEPTH_M])
        back = Rotation.from_rotvec([0, -turn_rad * k, 0]).as_matrix()
        way = lens @ back @ nearer @ np.linalg.inv(lens)
        frames.append(cv2.warpPerspective(texture, way, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REFLECT))
    return replace(clip, frames=np.stack(frames).round().astype(np.uint8)), geometry


@pytest.mark.parametrize("turn_rad", [0.0, 0.002])
def test_a_creep_and_a_turn_are_found_and_told_apart(turn_rad: float) -> None:
    clip, geometry = creeping(0.02, turn_rad)
    found = with_creep(clip, geometry)
    poses = np.stack([camera.world_from_camera for camera in found.cameras])
    assert poses[:, 2, 3] == pytest.approx(0.02 * np.arange(len(clip)), abs=0.01)
    turns = Rotation.from_matrix(poses[:, :3, :3]).as_rotvec()
    assert turns[:, 1] == pytest.approx(turn_rad * np.arange(len(clip)), abs=5e-4)
    assert found.at_one_place
    assert np.abs(poses[:, :2, 3]).max() < 0.005


def test_a_camera_that_keeps_its_place_is_left_there() -> None:
    clip, geometry = creeping(0.0)
    poses = np.stack([camera.world_from_camera for camera in with_creep(clip, geometry).cameras])
    assert np.abs(poses - np.eye(4)).max() < 1e-3


def test_what_moves_tells_nothing_and_no_drive_is_made_of_a_creep() -> None:
    clip, geometry = creeping(0.02)
    moves = replace(geometry, moving=np.ones_like(geometry.moving))
    assert all((camera.world_from_camera == np.eye(4)).all() for camera in with_creep(clip, moves).cameras)
    far = replace(geometry, depth_m=geometry.depth_m * 1000)
    assert all(camera.world_from_camera[2, 3] == 0 for camera in with_creep(clip, far).cameras)
