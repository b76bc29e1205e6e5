import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dreamdrive.geometry.cameras.turning import shaken, turned
from dreamdrive.scene.camera import Camera

WIDTH, HEIGHT = 320, 180
CAMERA = Camera(280.0, 280.0, 160.0, 90.0, WIDTH, HEIGHT)


def texture() -> np.ndarray:
    noise = np.random.default_rng(0).uniform(0, 255, (HEIGHT, WIDTH)).astype(np.float32)
    blurred = cv2.GaussianBlur(noise, (0, 0), 2.0)
    return np.clip((blurred - blurred.mean()) * 4 + 128, 0, 255).astype(np.uint8)


def seen(picture: np.ndarray, turn: Rotation) -> np.ndarray:
    """The picture of the first camera as one sees it whose rays ``turn`` takes to the first's."""
    warp = CAMERA.matrix @ turn.as_matrix().T @ np.linalg.inv(CAMERA.matrix)
    # OpenCV has the middle of a pixel at its index, the pinhole half a pixel further.
    half = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
    return cv2.warpPerspective(
        picture, np.linalg.inv(half) @ warp @ half, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REFLECT
    )


def test_a_camera_that_settles_is_followed_to_a_twentieth_of_a_pixel() -> None:
    turns = [Rotation.from_rotvec(np.radians([0.2 * k, -0.1 * k, 0.15 * k])) for k in range(4)]
    frames = np.stack([seen(texture(), turn) for turn in turns])
    poses = turned(frames, np.ones(frames.shape, bool), CAMERA)
    assert not poses[:, :3, 3].any()
    for pose, turn in zip(poses, turns, strict=True):
        off = (Rotation.from_matrix(pose[:3, :3]).inv() * turn).magnitude()
        assert off * CAMERA.fx_px < 0.05


def test_what_drives_through_the_picture_is_outvoted() -> None:
    turn = Rotation.from_rotvec(np.radians([0.3, 0.0, 0.0]))
    first, second = texture(), seen(texture(), turn)
    passing = texture()[::-1]
    first[60:150, 30:150], second[60:150, 36:156] = passing[60:150, 30:150], passing[60:150, 30:150]
    frames = np.stack([first, second])
    pose = turned(frames, np.ones(frames.shape, bool), CAMERA)[1]
    off = (Rotation.from_matrix(pose[:3, :3]).inv() * turn).magnitude()
    assert off * CAMERA.fx_px < 0.1


@pytest.mark.parametrize("usable", [True, False])
def test_a_frame_that_shows_nothing_keeps_the_pose_before(usable: bool) -> None:
    turn = Rotation.from_rotvec(np.radians([0.3, 0.0, 0.0]))
    blank = np.full((HEIGHT, WIDTH), 128, np.uint8)
    frames = np.stack([texture(), seen(texture(), turn), blank])
    street = np.full(frames.shape, usable)
    poses = turned(frames, street, CAMERA)
    np.testing.assert_array_equal(poses[2], poses[1])
    assert bool(np.array_equal(poses[1], np.eye(4))) is not usable


def test_turns_to_and_fro_are_seen_beside_a_steady_one() -> None:
    rng, count = np.random.default_rng(1), 12
    shakes = [Rotation.from_rotvec(np.radians(rng.normal(0, 0.15, 3))) for _ in range(count)]
    steady = [Rotation.from_rotvec(np.radians([0.0, 0.3 * k, 0.0])) for k in range(count)]
    frames = np.stack([seen(texture(), there * shake) for there, shake in zip(steady, shakes, strict=True)])
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = np.stack([each.as_matrix() for each in steady])
    found = shaken(poses, frames, np.ones(frames.shape, bool), CAMERA)
    true = np.stack([shake.as_rotvec() for shake in shakes])
    off = Rotation.from_matrix(poses[:, :3, :3]).inv() * Rotation.from_matrix(found[:, :3, :3])
    left = off.as_rotvec() - true
    between = slice(1, -1)
    curved = (left[between] - (left[:-2] + left[2:]) / 2) * CAMERA.fx_px
    assert np.abs(true * CAMERA.fx_px).max() > 1
    assert np.sqrt(np.square(curved).mean()) < 0.1


def test_too_few_frames_or_corners_show_no_shaking() -> None:
    poses = np.tile(np.eye(4), (4, 1, 1))
    blank = np.full((4, HEIGHT, WIDTH), 128, np.uint8)
    for count in (1, 2, 4):
        found = shaken(poses[:count], blank[:count], np.ones((count, HEIGHT, WIDTH), bool), CAMERA)
        np.testing.assert_array_equal(found, poses[:count])
