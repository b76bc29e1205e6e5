"""Cameras of another world, another scale, another attitude are brought back exactly."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.similarity import fit_similarity

PINHOLE = Camera(50.0, 50.0, 20.0, 15.0, 40, 30)


def cameras(places: np.ndarray, seed: int = 0) -> list[Camera]:
    rng = np.random.default_rng(seed)
    poses = np.tile(np.eye(4), (len(places), 1, 1))
    poses[:, :3, :3] = Rotation.from_rotvec(rng.normal(0, 0.02, (len(places), 3))).as_matrix()
    poses[:, :3, 3] = places
    return [PINHOLE.at(pose) for pose in poses]


def moved(given: list[Camera], scale: float, turn: np.ndarray, shift: np.ndarray) -> list[Camera]:
    out: list[Camera] = []
    for camera in given:
        pose = camera.world_from_camera.copy()
        pose[:3, :3] = turn @ pose[:3, :3]
        pose[:3, 3] = scale * turn @ pose[:3, 3] + shift
        out.append(camera.at(pose))
    return out


@pytest.mark.parametrize("way", ["bend", "straight"])
def test_a_similarity_is_found_again(way: str) -> None:
    along = np.linspace(0, 8, 9)
    side = 0.05 * along**2 if way == "bend" else 0 * along
    here = cameras(np.column_stack([side, 0 * along, along]))
    turn = Rotation.from_euler("xyz", [0.3, -1.2, 2.0]).as_matrix()
    found = fit_similarity(here, moved(here, 1.7, turn, np.array([3.0, -2, 5])))
    assert found.scale == pytest.approx(1.7)
    np.testing.assert_allclose(found.rotation, turn, atol=1e-9)
    points = np.random.default_rng(1).normal(size=(5, 3))
    np.testing.assert_allclose(found(points), 1.7 * points @ turn.T + [3, -2, 5], atol=1e-8)


def test_a_standing_camera_keeps_the_scale() -> None:
    here = cameras(np.zeros((4, 3)))
    turn = Rotation.from_euler("y", 0.4).as_matrix()
    found = fit_similarity(here, moved(here, 3.0, turn, np.array([1.0, 2, 3])))
    assert found.scale == 1.0
    np.testing.assert_allclose(found.rotation, turn, atol=1e-9)
    np.testing.assert_allclose(found.translation, [1, 2, 3], atol=1e-9)


def test_frames_have_to_match() -> None:
    with pytest.raises(ValueError, match="2 cameras against 1"):
        fit_similarity(cameras(np.zeros((2, 3))), cameras(np.zeros((1, 3))))
