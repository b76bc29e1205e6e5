"""A camera is moved along its own axes, wherever it looks."""

import numpy as np
from scipy.spatial.transform import Rotation

from dreamdrive.scene.camera import Camera


def test_a_camera_moves_along_its_own_axes() -> None:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.3, -1.2, 0.4]).as_matrix()
    pose[:3, 3] = 5.0, -2.0, 1.0
    camera = Camera(50.0, 50.0, 20.0, 15.0, 40, 30, pose)
    point = camera.lift(np.array([[20.0, 15.0, 10.0]]))
    (seen,) = camera.moved(right_m=1.0, down_m=-0.5, ahead_m=2.0).project(point)
    np.testing.assert_allclose(seen, [20.0 - 50.0 / 8, 15.0 + 25.0 / 8, 8.0])
    np.testing.assert_array_equal(camera.moved().world_from_camera, pose)
